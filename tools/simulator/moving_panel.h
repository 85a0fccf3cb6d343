// A panel that moves, nearer than all else that is to be seen: somebody who passes, a board that somebody holds.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <opencv2/core.hpp>

#include "ear/calibration.h"
#include "tools/simulator/image_sensor.h"
#include "tools/simulator/scene.h"
#include "tools/simulator/texture.h"
#include "tools/simulator/trajectory.h"

namespace ear::simulator {

/// Where it is at a time of the motion [s].
using PanelMotion = std::function<Panel(double)>;

/// Puts it into a picture exposed around t [s], in grey levels (float), blurred as it and the camera move.
/// `brightness` is vignetting().
void draw_moving_panel(const PanelMotion& panel_at, const Texture& texture, const CameraCalibration& camera,
                       const Trajectory& trajectory, double t, const Exposure& exposure, const cv::Mat& brightness,
                       cv::Mat& grey);

}  // namespace ear::simulator
