// Settings of the filter. One default set serves all recordings; docs/filter.md gives the reasons and the measurements.
#pragma once

#include <cstdint>

#include "ear/kernels.h"

namespace ear {

/// How the filter recognises that the vehicle stands, and how firmly it then holds the pose.
struct StandstillConfig {
  double duration = 0.5;          ///< [s] stillness before the vehicle counts as standing
  double max_gyro = 0.02;         ///< [rad/s] mean rate less the bias, once that is known
  double max_gyro_spread = 0.15;  ///< [rad/s] standard deviation of the samples over `duration`, vibration included
  double max_accel_spread = 3.0;  ///< [m/s^2] the same for the specific force
  double max_flow_px = 0.5;       ///< [px] common motion of the features until the vehicle counts as standing
  double leave_flow_px = 1.0;     ///< [px] common motion since it stopped that ends it: legs give under rotors
  double position_sigma = 1e-3;   ///< [m] how far a standing vehicle may shift
  double rotation_sigma = 5e-4;   ///< [rad]
  double velocity_sigma = 5e-3;   ///< [m/s]
};

/// Standard deviations at the start, before anything was measured.
struct PriorConfig {
  double gyro_bias = 0.1;             ///< [rad/s]
  double gyro_scale = 3e-3;           ///< relative, of each axis, and how much it measures of turns about another
  double accel_scale = 3e-3;          ///< relative, of each axis, and how much it measures of forces along another
  double gyro_unseen = 3e-2;          ///< relative, of each axis, where there is no camera
  double gyro_axes_unseen = 1e-2;     ///< how much an axis measures of turns about another, where there is no camera
  double accel_bias = 0.08;           ///< [m/s^2]
  double camera_rotation = 2.5e-3;    ///< [rad] camera 0 in the body, where it is estimated
  double camera_position = 1e-3;      ///< [m]
  double stereo_rotation = 2e-3;      ///< [rad] camera 1 in camera 0: rigs bend
  double stereo_position = 5e-5;      ///< [m]
  double focal_length = 1e-3;         ///< of each camera, relative
  double principal_point = 0.5;       ///< [px] of each camera, each axis
  double time_offset = 2e-3;          ///< [s] camera against IMU
  double wheel_radius = 4e-3;         ///< of each wheel, relative; of their mean, over sqrt(2)
  double wheel_apart = 1e-3;          ///< of each wheel by itself, relative
  double wheel_scale = 5e-2;          ///< of both wheels alike, relative, where neither camera nor lasers exist
  double track_width = 5e-3;          ///< relative
  double odometer_rotation = 5e-3;    ///< [rad] odometer in the body
  double odometer_unseen = 4e-2;      ///< [rad] the same without lasers, where it is what was guessed
  double axle = 3e-3;                 ///< [m] middle of the axle in the body
  double axle_unseen = 0.1;           ///< [m] the same without lasers
  double encoder_time_offset = 2e-3;  ///< [s] encoders against IMU
  double beam_offset = 2e-3;          ///< [m] range of each laser beam
};

/// What is calibrated while running. A frozen quantity keeps its value, and its uncertainty is not accounted for.
struct OnlineCalibrationConfig {
  bool camera_extrinsics = true;    ///< pose of camera 0 in the body, and of camera 1 in camera 0
  bool intrinsics = true;           ///< focal length and principal point of each camera
  bool time_offset = true;          ///< camera against IMU
  bool wheels = true;               ///< wheel radii, and their track width where the yaw rate is used
  bool odometer_rotation = true;    ///< the odometer's mounting in the body
  bool axle = true;                 ///< the middle of the axle in the body
  bool encoder_time_offset = true;  ///< encoders against IMU
  bool beam_offset = true;          ///< what each laser beam reads too much
};

/// What is made of the wheels; the paper's Table II compares them.
enum class OdometerModel : std::uint8_t {
  none,          ///< stereo and inertial only
  differential,  ///< speed and yaw rate from the wheels, along the body
  gyro,          ///< speed from the wheels, along the body; rotation from the gyroscope
  terrain        ///< the paper's: pitch rate taken into account, direction along the ground that the lasers see
};

/// Wheels and lasers. What slips or bumps grows with the square root of the distance: [m] per sqrt(m).
struct OdometerConfig {
  OdometerModel model = OdometerModel::terrain;
  double slip = 1e-3;            ///< along the track [m/sqrt(m)]
  double side_slip = 2e-3;       ///< across it [m/sqrt(m)]
  double side_slip_turn = 5e-3;  ///< across it, while turning [m/s per rad/s]
  double roughness = 4e-3;       ///< through the ground [m/sqrt(m)]
  bool scores = true;            ///< wheels, beams, inertial sensors that do not fit weigh less; off in ablations
  double body_pitch = 3e-2;      ///< without lasers: the body against its path, up and down [rad sqrt(s)]
  double body_yaw = 2.5e-3;      ///< the same to the sides [rad sqrt(s)]
  double speed_sigma = 1e-3;     ///< [m/s] every row, also of standing wheels
  double yaw_rate_sigma = 0.02;  ///< [rad/s]
  double normal_walk = 0.1;      ///< change of the ground's normal [rad/sqrt(m)]
  double normal_prior = 0.3;     ///< [rad] before the lasers saw it
  double unevenness = 0.012;     ///< [m] of the ground under a beam against the plane through the wheels
};

/// When the vehicle is on the ground, and when it flies.
struct ContactConfig {
  double takeoff_height = 0.005;    ///< [m] wheels above the ground, after standing, that are a take-off
  double unevenness = 0.025;        ///< [m] on top of it while they roll
  double takeoff_duration = 0.04;   ///< [s] for which the beams must show it
  double touchdown_height = 0.025;  ///< [m] wheels below it, neither rising nor falling, stand on the ground
  double touchdown_duration = 0.2;  ///< [s] for which the beams must show it
  double touchdown_climb = 0.06;    ///< [m/s] neither rising nor falling
  double confirmed_height = 0.05;   ///< [m] below it a strike is a touchdown at once
  double strike = 10.0;             ///< [m/s^2] change of the specific force's magnitude
};

/// Which inertial samples are less certain than the sensor's noise alone: strikes, spikes, clipped values.
struct ImpactConfig {
  double accel_deviation = 10.0;  ///< [m/s^2] from the recent mean that is ordinary in any case
  double gyro_deviation = 4.0;    ///< [rad/s]
  double accel_range = 0.0;       ///< [m/s^2] largest value of an axis; 0: not known, flat tops show it
  double gyro_range = 0.0;        ///< [rad/s]
};

/// What is measured of the sensors' disagreement about how far the vehicle went.
enum class AnomalyScore : std::uint8_t {
  distance,    ///< the paper's: lengths, whatever the interval between frames
  mahalanobis  ///< lengths over the standard deviations that the two displacements should have
};

/// How the weight of the sensor at fault follows from the distances between the displacements.
enum class AnomalyWeight : std::uint8_t {
  symmetric,  ///< the others' distance over each of its own, the same for every sensor
  printed     ///< (15) as the paper prints it
};

/// Sensors compared over every interval between frames: the paper's III-D; docs/anomaly.md.
struct AnomalyConfig {
  bool enabled = true;  ///< weigh down the one at fault; it is named in any case
  AnomalyScore score = AnomalyScore::mahalanobis;
  AnomalyWeight weight = AnomalyWeight::symmetric;
  double distance = 0.005;    ///< [m] with `distance`: root of the variance (13) that is too much
  double false_alarm = 1e-4;  ///< with `mahalanobis`: probability of an alarm about sensors that are right
  double min_weight = 0.02;   ///< of the sensor at fault
};

struct FilterConfig {
  int window = 12;                    ///< clones kept
  int max_track_updates = 40;         ///< features used per frame, those with most observations first
  double feature_sigma_px = 0.6;      ///< one observation of one feature, one axis [px]
  double huber_px = 1.5;              ///< observations further off than this weigh less [px]
  double gate_probability = 0.98;     ///< chi-square gate of every feature; wheels and beams weigh less instead
  double keyframe_parallax_px = 6.0;  ///< a clone with less median parallax to its elder makes room first [px]
  PriorConfig prior;
  StandstillConfig standstill;
  OnlineCalibrationConfig online_calibration;
  OdometerConfig odometer;
  ContactConfig contact;
  ImpactConfig impact;
  AnomalyConfig anomaly;
  Kernels kernels = Kernels::best;  ///< another choice is for tests and comparisons, or the next best; not in files
};

}  // namespace ear
