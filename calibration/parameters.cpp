#include "calibration/parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "filter/ekf/so3.h"
#include "filter/ekf/state.h"

#include "calibration/degree.h"

namespace ear::calibration {
namespace {

Eigen::Vector3d vector(const double* values) { return Eigen::Map<const Eigen::Vector3d>(values); }

void move_pose(Eigen::Isometry3d& T, const std::array<double, 6>& error) {
  T.linear() = exp_so3(vector(error.data())) * T.linear();
  T.translation() += vector(error.data() + 3);
}

void move_lens(CameraCalibration& camera, const std::array<double, 5>& error) {
  camera.fu *= 1.0 + error[0];
  camera.fv *= 1.0 + error[0];
  camera.cu += error[1];
  camera.cv += error[2];
  camera.distortion[0] += error[3];
  camera.distortion[1] += error[4];
}

Eigen::Isometry3d stereo_pose(const Calibration& calibration) {
  return calibration.cameras[0].T_BC.inverse(Eigen::Isometry) * calibration.cameras[1].T_BC;
}

std::array<double, 6> pose_error(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  const Eigen::Vector3d phi = log_so3(to.linear() * from.linear().transpose());
  const Eigen::Vector3d p = to.translation() - from.translation();
  return {phi.x(), phi.y(), phi.z(), p.x(), p.y(), p.z()};
}

/// Collects entries of one block.
class BlockMaker {
 public:
  BlockMaker(double* data, std::string sensor) : sensor_(std::move(sensor)) { block_.data = data; }
  BlockMaker& add(const std::string& name, const std::string& unit, double scale, double prior, double given = 0.0) {
    Entry entry{sensor_ + ": " + name, unit, scale, given, prior, block_.data + block_.entries.size()};
    block_.entries.push_back(entry);
    return *this;
  }
  BlockMaker& axes(const std::string& name, const std::string& unit, double scale, double prior) {
    for (const char* axis : {" x", " y", " z"}) add(name + axis, unit, scale, prior);
    return *this;
  }
  [[nodiscard]] const CalibrationBlock& block() const { return block_; }

 private:
  std::string sensor_;
  CalibrationBlock block_;
};

constexpr double kToDegrees = 1.0 / kDegree;
constexpr double kToMillimetres = 1e3;
constexpr double kToMilliseconds = 1e3;
constexpr double kToPercent = 1e2;

void add_cameras(Parameters& parameters, const Calibration& given, const Priors& priors,
                 std::vector<CalibrationBlock>& blocks) {
  if (given.cameras.empty()) return;
  blocks.push_back(BlockMaker(parameters.camera.data(), "cam0")
                       .axes("rotation in the body about", "deg", kToDegrees, priors.camera_rotation)
                       .axes("position in the body", "mm", kToMillimetres, priors.camera_position)
                       .block());
  if (given.cameras.size() > 1) {
    blocks.push_back(BlockMaker(parameters.stereo.data(), "cam1")
                         .axes("rotation in cam0 about", "deg", kToDegrees, priors.stereo_rotation)
                         .axes("position in cam0", "mm", kToMillimetres, priors.stereo_position)
                         .block());
  }
  for (std::size_t i = 0; i < given.cameras.size(); ++i) {
    const CameraCalibration& camera = given.cameras[i];
    blocks.push_back(BlockMaker(parameters.lens[i].data(), "cam" + std::to_string(i))
                         .add("focal length", "px", camera.fu, priors.focal_length[i], camera.fu)
                         .add("principal point u", "px", 1.0, priors.principal_point[i], camera.cu)
                         .add("principal point v", "px", 1.0, priors.principal_point[i], camera.cv)
                         .add("distortion k1", "", 1.0, priors.distortion, camera.distortion[0])
                         .add("distortion k2", "", 1.0, priors.distortion, camera.distortion[1])
                         .block());
  }
  blocks.push_back(BlockMaker(parameters.camera_time.data(), "cam0")
                       .add("time offset", "ms", kToMilliseconds, priors.camera_time, 1e3 * given.camera_time_offset)
                       .block());
}

void add_gyroscope(Parameters& parameters, const Priors& priors, std::vector<CalibrationBlock>& blocks) {
  constexpr std::array kAxes{"x", "y", "z"};
  BlockMaker maker(parameters.gyro.data(), "imu0");
  for (const std::string measured : kAxes) {
    for (const std::string about : kAxes) {
      const std::string name = about == measured ? "scale " + about : about + " by what " + measured + " measures";
      maker.add("gyroscope, " + name, "%", kToPercent, priors.gyro);
    }
  }
  blocks.push_back(maker.block());
}

void add_wheels(Parameters& parameters, const Calibration& given, const Priors& priors,
                std::vector<CalibrationBlock>& blocks) {
  if (!given.encoder) return;
  const EncoderCalibration& encoder = *given.encoder;
  const double radius = 500.0 * (encoder.wheel_radius[0] + encoder.wheel_radius[1]);  // [mm]
  const double track = 1e3 * encoder.track_width;
  const double apart = 1e3 * (encoder.wheel_radius[0] - encoder.wheel_radius[1]);
  blocks.push_back(BlockMaker(parameters.wheels.data(), "encoder0")
                       .add("wheel radius, mean", "mm", radius, priors.wheel_radius, radius)
                       .add("wheel radius, left less right", "mm", radius, priors.radius_difference, apart)
                       .add("wheel separation", "mm", track, priors.track_width, track)
                       .block());
  blocks.push_back(BlockMaker(parameters.axle.data(), "encoder0")
                       .axes("position of the axle", "mm", kToMillimetres, priors.axle_position)
                       .add("axle turned about x", "deg", kToDegrees, priors.axle_rotation)
                       .add("axle turned about z", "deg", kToDegrees, priors.axle_rotation)
                       .block());
  blocks.push_back(BlockMaker(parameters.encoder_time.data(), "encoder0")
                       .add("time offset", "ms", kToMilliseconds, priors.encoder_time, 1e3 * encoder.time_offset)
                       .block());
}

void add_beams(Parameters& parameters, const Calibration& given, const Priors& priors,
               std::vector<CalibrationBlock>& blocks) {
  if (!given.lasers) return;
  for (std::size_t i = 0; i < parameters.beams.size(); ++i) {
    blocks.push_back(BlockMaker(parameters.beams[i].data(), "laser0 " + given.lasers->beams[i].name)
                         .axes("origin", "mm", kToMillimetres, priors.beam_origin)
                         .add("direction, 1st tilt", "deg", kToDegrees, priors.beam_direction)
                         .add("direction, 2nd tilt", "deg", kToDegrees, priors.beam_direction)
                         .block());
  }
  blocks.push_back(BlockMaker(parameters.laser_time.data(), "laser0")
                       .add("time offset", "ms", kToMilliseconds, priors.laser_time, 1e3 * given.lasers->time_offset)
                       .block());
}

PoseSigma pose_or(const std::optional<PoseSigma>& stated, double rotation, double position) {
  return stated.value_or(PoseSigma{rotation, position});
}

}  // namespace

Priors priors_of(const Calibration& given) {
  Priors priors{};
  const PoseSigma camera = pose_or(given.cameras.empty() ? std::nullopt : given.cameras[0].pose_sigma, kDegree, 0.01);
  const PoseSigma stereo =
      pose_or(given.cameras.size() < 2 ? std::nullopt : given.cameras[1].pose_sigma, 0.1 * kDegree, 2.5e-4);
  priors.camera_rotation = camera.rotation;
  priors.camera_position = camera.position;
  priors.stereo_rotation = stereo.rotation;
  priors.stereo_position = stereo.position;
  priors.focal_length.fill(5e-3);
  priors.principal_point.fill(2.5);
  for (std::size_t i = 0; i < std::min<std::size_t>(given.cameras.size(), 2); ++i) {
    const CameraCalibration& lens = given.cameras[i];
    if (!lens.intrinsics_sigma) continue;
    priors.focal_length[i] = lens.intrinsics_sigma->focal_length / lens.fu;
    priors.principal_point[i] = lens.intrinsics_sigma->principal_point;
  }
  priors.distortion = 2e-3;
  priors.gyro = given.imu.gyro_scale_sigma.value_or(5e-3);
  priors.camera_time = given.camera_time_offset_sigma.value_or(0.01);
  priors.laser_time = given.lasers.value_or(LaserCalibration{}).time_offset_sigma.value_or(2e-3);
  priors.beam_origin = 0.02;
  priors.beam_direction = 10.0 * kDegree;
  const EncoderCalibration encoder = given.encoder.value_or(EncoderCalibration{});
  const double radius = 0.5 * (encoder.wheel_radius[0] + encoder.wheel_radius[1]);
  const PoseSigma axle = pose_or(encoder.T_BO_sigma, 5.0 * kDegree, 0.02);
  priors.axle_rotation = axle.rotation;
  priors.axle_position = axle.position;
  priors.wheel_radius = encoder.wheel_radius_sigma.value_or(0.05 * radius) / radius;
  priors.radius_difference = encoder.wheel_radius_difference_sigma.value_or(0.02 * radius) / radius;
  priors.track_width = encoder.track_width_sigma.value_or(0.05 * encoder.track_width) / encoder.track_width;
  priors.encoder_time = encoder.time_offset_sigma.value_or(2e-3);
  return priors;
}

std::vector<CalibrationBlock> blocks_of(Parameters& parameters, const Calibration& given, const Priors& priors) {
  std::vector<CalibrationBlock> blocks;
  add_gyroscope(parameters, priors, blocks);
  add_cameras(parameters, given, priors, blocks);
  add_wheels(parameters, given, priors, blocks);
  add_beams(parameters, given, priors, blocks);
  return blocks;
}

Parameters zero_parameters(const Calibration& given) {
  Parameters parameters;
  if (given.lasers) parameters.beams.resize(given.lasers->beams.size());
  return parameters;
}

Calibration applied(const Calibration& given, const Parameters& parameters) {
  Calibration result = given;
  result.imu.gyro_matrix = gyro_matrix(parameters.gyro) * given.imu.gyro_matrix;
  if (!given.cameras.empty()) move_pose(result.cameras[0].T_BC, parameters.camera);
  if (given.cameras.size() > 1) {
    Eigen::Isometry3d T_C0C1 = stereo_pose(given);
    move_pose(T_C0C1, parameters.stereo);
    result.cameras[1].T_BC = result.cameras[0].T_BC * T_C0C1;
  }
  for (std::size_t i = 0; i < given.cameras.size(); ++i) move_lens(result.cameras[i], parameters.lens[i]);
  result.camera_time_offset += parameters.camera_time[0];
  if (result.encoder) {
    EncoderCalibration& encoder = *result.encoder;
    const std::array<double, 3>& wheels = parameters.wheels;
    encoder.wheel_radius[0] *= 1.0 + wheels[0] + 0.5 * wheels[1];
    encoder.wheel_radius[1] *= 1.0 + wheels[0] - 0.5 * wheels[1];
    encoder.track_width *= 1.0 + wheels[2];
    encoder.time_offset += parameters.encoder_time[0];
    encoder.T_BO.translation() += vector(parameters.axle.data());
    const Eigen::Vector3d y_O(-parameters.axle[4], 1.0, parameters.axle[3]);
    encoder.T_BO.linear() *= Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitY(), y_O).toRotationMatrix();
  }
  if (result.lasers) {
    result.lasers->time_offset += parameters.laser_time[0];
    for (std::size_t i = 0; i < parameters.beams.size(); ++i) {
      LaserBeam& beam = result.lasers->beams[i];
      const std::array<double, 5>& error = parameters.beams[i];
      beam.p_BL += vector(error.data());
      const Eigen::Vector3d tilted = tangent_basis(-beam.d_B) * Eigen::Vector2d(error[3], error[4]);
      beam.d_B = (beam.d_B + tilted.cross(beam.d_B)).normalized();
    }
  }
  return result;
}

Parameters errors_of(const Calibration& given, const Calibration& truth) {
  Parameters errors = zero_parameters(given);
  Eigen::Map<Eigen::Matrix3d>(errors.gyro.data()) =
      truth.imu.gyro_matrix * given.imu.gyro_matrix.inverse() - Eigen::Matrix3d::Identity();
  if (!given.cameras.empty()) errors.camera = pose_error(given.cameras[0].T_BC, truth.cameras[0].T_BC);
  if (given.cameras.size() > 1) errors.stereo = pose_error(stereo_pose(given), stereo_pose(truth));
  for (std::size_t i = 0; i < given.cameras.size(); ++i) {
    const CameraCalibration& from = given.cameras[i];
    const CameraCalibration& to = truth.cameras[i];
    errors.lens[i] = {to.fu / from.fu - 1.0, to.cu - from.cu, to.cv - from.cv, to.distortion[0] - from.distortion[0],
                      to.distortion[1] - from.distortion[1]};
  }
  errors.camera_time[0] = truth.camera_time_offset - given.camera_time_offset;
  if (given.encoder) {
    const EncoderCalibration& from = *given.encoder;
    const EncoderCalibration& to = *truth.encoder;
    const double left = to.wheel_radius[0] / from.wheel_radius[0] - 1.0;
    const double right = to.wheel_radius[1] / from.wheel_radius[1] - 1.0;
    errors.wheels = {0.5 * (left + right), left - right, to.track_width / from.track_width - 1.0};
    errors.encoder_time[0] = to.time_offset - from.time_offset;
    const Eigen::Vector3d p = to.T_BO.translation() - from.T_BO.translation();
    const Eigen::Vector3d y_O = from.T_BO.linear().transpose() * to.T_BO.linear().col(1);
    errors.axle = {p.x(), p.y(), p.z(), y_O.z() / y_O.y(), -y_O.x() / y_O.y()};
  }
  if (given.lasers) errors.laser_time[0] = truth.lasers->time_offset - given.lasers->time_offset;
  for (std::size_t i = 0; i < errors.beams.size(); ++i) {
    const LaserBeam& from = given.lasers->beams[i];
    const LaserBeam& to = truth.lasers->beams[i];
    const Eigen::Vector3d p = to.p_BL - from.p_BL;
    const Eigen::Vector3d aside = to.d_B / to.d_B.dot(from.d_B) - from.d_B;
    const Eigen::Vector2d tilt = tangent_basis(-from.d_B).transpose() * from.d_B.cross(aside);
    errors.beams[i] = {p.x(), p.y(), p.z(), tilt.x(), tilt.y()};
  }
  return errors;
}

Calibration with_priors(const Calibration& given, const Priors& priors) {
  Calibration result = given;
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    CameraCalibration& camera = result.cameras[i];
    camera.intrinsics_sigma = IntrinsicsSigma{priors.focal_length[i] * camera.fu, priors.principal_point[i]};
  }
  if (!result.cameras.empty()) {
    result.cameras[0].pose_sigma = PoseSigma{priors.camera_rotation, priors.camera_position};
    result.camera_time_offset_sigma = priors.camera_time;
    result.imu.gyro_scale_sigma = priors.gyro;
  }
  if (result.cameras.size() > 1) {
    result.cameras[1].pose_sigma = PoseSigma{priors.stereo_rotation, priors.stereo_position};
  }
  if (result.encoder) {
    EncoderCalibration& encoder = *result.encoder;
    const double radius = 0.5 * (encoder.wheel_radius[0] + encoder.wheel_radius[1]);
    encoder.T_BO_sigma = PoseSigma{priors.axle_rotation, priors.axle_position};
    encoder.wheel_radius_sigma = priors.wheel_radius * radius;
    encoder.wheel_radius_difference_sigma = std::min(priors.radius_difference, 1.9 * priors.wheel_radius) * radius;
    encoder.track_width_sigma = priors.track_width * encoder.track_width;
    encoder.time_offset_sigma = priors.encoder_time;
  }
  if (result.lasers) {
    result.lasers->time_offset_sigma = priors.laser_time;
    result.lasers->offset_sigma = priors.beam_origin;
  }
  return result;
}

}  // namespace ear::calibration
