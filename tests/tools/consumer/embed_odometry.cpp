#include <ear/odometry.h>

#include <iostream>

int main() {
  ear::Calibration calibration;  // from your files: cameras, IMU, wheels
  ear::CameraCalibration camera;
  camera.width = 640;
  camera.height = 480;
  camera.fu = camera.fv = 385.0;
  camera.cu = 319.5;
  camera.cv = 239.5;
  calibration.cameras = {camera, camera};
  calibration.cameras[1].T_BC.translation().x() = 0.05;  // the right camera

  ear::Odometry odometry(ear::Config{}, calibration);

  ear::ImuSample sample;  // samples as they arrive, in the order of their time
  sample.accel_B = {0.0, 0.0, 9.81};
  odometry.add_imu(sample);

  ear::StereoFrame frame;  // views of your images; here there are none yet
  if (const auto estimate = odometry.add_stereo(frame)) {
    std::cout << estimate->state.p_WB.transpose() << '\n';
  } else {
    std::cout << "not started yet\n";
  }
}
