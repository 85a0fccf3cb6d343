// What tests of live estimation begin with: Cyclone DDS kept on this machine, and a small camera.
#pragma once

#include <cstdlib>

#include "ear/calibration.h"

namespace ear::test {

/// Everything stays on this machine, whatever its network is.
inline void use_loopback() {
  ::setenv("CYCLONEDDS_URI",
           "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>"
           "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
           "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>",
           1);
}

/// 64 x 48 pixels, at the body's origin.
inline CameraCalibration small_camera() {
  CameraCalibration camera;
  camera.width = 64;
  camera.height = 48;
  camera.fu = camera.fv = 50.0;
  camera.cu = 31.5;
  camera.cv = 23.5;
  return camera;
}

}  // namespace ear::test
