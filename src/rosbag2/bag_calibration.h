// Where the calibration of a bag's sensors comes from.
#pragma once

#include "ear/calibration.h"
#include "src/recording/sample_source.h"
#include "src/ros2/topics.h"
#include "src/rosbag2/bag.h"

namespace ear::rosbag2 {

/// Of the sensors that have topics. In this order: Kalibr's files (cameras, noise of the IMU); the folder that the
/// topic map names, else the one beside the bag that has its name and ends in .calibration, else the attachments
/// calibration/<sensor>/sensor.yaml of an MCAP file; else, for cameras and lasers, CameraInfo, tf_static and the
/// ranges' own limits. Wheels without encoder0/sensor.yaml, and lasers without any, are left out with a warning. Throws
/// InputError: cameras without calibration, or one that cannot be read.
[[nodiscard]] Calibration bag_calibration(const Bag& bag, const ros2::SensorTopics& topics,
                                          const RecordingOptions& options, Warnings& warnings);

/// The folder beside a bag.
[[nodiscard]] std::filesystem::path calibration_beside(const std::filesystem::path& bag);

}  // namespace ear::rosbag2
