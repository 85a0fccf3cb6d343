#include "smoother/unknowns.h"

#include <algorithm>
#include <utility>

#include "smoother/wheel_factor.h"

namespace ear::smoother {

using MotionVector = Eigen::Matrix<double, kMotionStep, 1>;

Unknowns::Unknowns(const State& x) : given_(x.odometer) {
  calibration_.camera = to_block(x.camera.T_BC0);
  calibration_.stereo = to_block(x.camera.T_C0C1);
  calibration_.imaging = imaging_block(x.camera);
  auto first = std::make_unique<Frame>();
  first->number = next_number_++;
  first->t_ns = x.imu.t_ns;
  first->pose = to_block(Pose{x.imu.R_WB, x.imu.p_WB});
  Eigen::Map<MotionVector>(first->motion.data()) << x.imu.v_W, x.imu.b_g, x.imu.b_a;
  frames_.push_back(std::move(first));
}

std::uint64_t Unknowns::append(const NewFrame& given, bool image) {
  const ImuState x = newest();
  const double T = given.since.imu.duration();
  auto frame = std::make_unique<Frame>();
  frame->number = next_number_++;
  frame->t_ns = given.t_ns;
  const Eigen::Matrix3d R_WB = x.R_WB * given.since.imu.R_BiBj();
  const Eigen::Vector3d v_W = x.v_W + kGravity_W * T + x.R_WB * given.since.imu.dv_Bi();
  const Eigen::Vector3d p_WB = x.p_WB + x.v_W * T + 0.5 * kGravity_W * T * T + x.R_WB * given.since.imu.dp_Bi();
  frame->pose = to_block(Pose{R_WB, p_WB});
  Eigen::Map<MotionVector>(frame->motion.data()) << v_W, x.b_g, x.b_a;
  frame->since = given.since;
  frame->rate_B = given.rate_B;
  frame->v_B = R_WB.transpose() * v_W;
  frame->time_offset = calibration_.imaging[imaging_entry::time_offset];
  frame->feature_noise = given.feature_noise;
  frame->image = image;
  frames_.push_back(std::move(frame));
  return frames_.back()->number;
}

void Unknowns::erase(std::size_t frame) { frames_.erase(frames_.begin() + static_cast<std::ptrdiff_t>(frame)); }

std::size_t Unknowns::index_of(std::uint64_t number) const {
  const auto frame = std::lower_bound(frames_.begin(), frames_.end(), number,
                                      [](const std::unique_ptr<Frame>& f, std::uint64_t n) { return f->number < n; });
  return static_cast<std::size_t>(frame - frames_.begin());
}

ImuState Unknowns::newest() const {
  const Frame& frame = *frames_.back();
  const Pose T_WB = to_pose(frame.pose.data());
  const Eigen::Map<const MotionVector> m(frame.motion.data());
  return {frame.t_ns, T_WB.R, m.head<3>(), T_WB.p, m.segment<3>(motion_entry::b_g), m.segment<3>(motion_entry::b_a)};
}

CameraState Unknowns::cameras() const {
  CameraState cameras;
  cameras.T_BC0 = to_pose(calibration_.camera.data());
  cameras.T_C0C1 = to_pose(calibration_.stereo.data());
  set_imaging(calibration_.imaging.data(), cameras);
  return cameras;
}

OdometerState Unknowns::odometer() const { return with_errors(given_, calibration_.wheels.data()); }

std::vector<PriorBlock> Unknowns::blocks() const {
  std::vector<PriorBlock> result;
  const auto add = [&](BlockKind kind, const double* block, int size, double* body_pose = nullptr) {
    result.push_back(
        {kind, const_cast<double*>(block), size, body_pose, Eigen::Map<const Eigen::VectorXd>(block, size)});
  };
  for (const std::unique_ptr<Frame>& frame : frames_) {
    add(BlockKind::body_pose, frame->pose.data(), 7);
    add(BlockKind::motion, frame->motion.data(), 9, frame->pose.data());
  }
  add(BlockKind::sensor_pose, calibration_.camera.data(), 7);
  add(BlockKind::sensor_pose, calibration_.stereo.data(), 7);
  add(BlockKind::additive, calibration_.imaging.data(), static_cast<int>(calibration_.imaging.size()));
  add(BlockKind::additive, calibration_.wheels.data(), 6);
  return result;
}

std::vector<int> filter_entries() {
  std::vector<int> entries;
  const auto take = [&](int begin, int count) {
    for (int i = 0; i < count; ++i) entries.push_back(begin + i);
  };
  take(err::theta, 3);
  take(err::rho, 3);
  take(err::nu, 3);
  take(err::b_g, 6);
  take(err::camera, 6);
  take(err::stereo, 6);
  take(err::lenses, 2 * err::lens_size);
  take(err::time_offset, 1);
  take(err::wheel_radius, 2);
  take(err::track_width, 1);
  take(err::odometer, 3);
  return entries;
}

}  // namespace ear::smoother
