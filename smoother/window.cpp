// Window: how it begins, how a frame is appended, and what it holds.
#include "smoother/window.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "filter/sources/cameras/parallax.h"
#include "smoother/wheel_factor.h"

namespace ear::smoother {
namespace {

// Standard deviations that nothing is known better than at the start: position [m], rotation [rad], calibration.
constexpr double kLeastPosition = 1e-4;
constexpr double kLeastRotation = 1e-5;
constexpr double kLeastCalibration = 1e-7;

/// Of the filter's covariance what the window has unknowns for, in the order of Window::blocks().
Eigen::MatrixXd start_covariance(const Eigen::MatrixXd& P) {
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
  take(err::time_offset, 1);
  take(err::wheel_radius, 2);
  take(err::track_width, 1);
  take(err::odometer, 3);
  Eigen::MatrixXd P_start = P(entries, entries);
  P_start.diagonal().head<3>().array() += kLeastRotation * kLeastRotation;
  P_start.diagonal().segment<3>(3).array() += kLeastPosition * kLeastPosition;
  P_start.diagonal().tail(19).array() += kLeastCalibration * kLeastCalibration;
  return P_start;
}

}  // namespace

Window::Window(const FilterConfig& config, double focal_px, const State& x, const Eigen::Ref<const Eigen::MatrixXd>& P)
    : config_(config),
      focal_px_(focal_px),
      sigma_(config.feature_sigma_px / focal_px),
      gate_(config.gate_probability, 4 * (config.window + 1)),
      huber_(config.huber_px / config.feature_sigma_px),
      given_(x.odometer) {
  camera_ = smoother::to_block(x.camera.T_BC0);
  stereo_ = smoother::to_block(x.camera.T_C0C1);
  offset_ = {x.camera.time_offset};
  auto first = std::make_unique<Frame>();
  first->number = next_number_++;
  first->t_ns = x.imu.t_ns;
  first->pose = smoother::to_block(Pose{x.imu.R_WB, x.imu.p_WB});
  Eigen::Map<Eigen::Matrix<double, kMotionStep, 1>>(first->motion.data(), kMotionStep) << x.imu.v_W, x.imu.b_g,
      x.imu.b_a;
  frames_.push_back(std::move(first));
  const Eigen::MatrixXd P_start = start_covariance(P);
  const Eigen::MatrixXd whitening =
      P_start.llt().matrixL().solve(Eigen::MatrixXd::Identity(P_start.rows(), P_start.cols()));
  set_prior(std::make_unique<PriorFactor>(blocks(), whitening, Eigen::VectorXd::Zero(P_start.rows())));
}

void Window::add(const NewFrame& given, const std::vector<FeatureObservation>& features) {
  const ImuState x = newest();
  const double T = given.since.imu.duration();
  auto frame = std::make_unique<Frame>();
  frame->number = next_number_++;
  frame->t_ns = given.t_ns;
  const Eigen::Matrix3d R_WB = x.R_WB * given.since.imu.R_BiBj();
  const Eigen::Vector3d v_W = x.v_W + kGravity_W * T + x.R_WB * given.since.imu.dv_Bi();
  const Eigen::Vector3d p_WB = x.p_WB + x.v_W * T + 0.5 * kGravity_W * T * T + x.R_WB * given.since.imu.dp_Bi();
  frame->pose = smoother::to_block(Pose{R_WB, p_WB});
  Eigen::Map<Eigen::Matrix<double, kMotionStep, 1>>(frame->motion.data(), kMotionStep) << v_W, x.b_g, x.b_a;
  frame->since = given.since;
  frame->rate_B = given.rate_B;
  frame->v_B = R_WB.transpose() * v_W;
  frame->time_offset = offset_[0];
  frame->feature_noise = given.feature_noise;
  frame->image = !features.empty();
  tracks_.add(frame->number, features);
  frames_.push_back(std::move(frame));
}

void Window::forget_wheels(double duration) {
  double passed = 0.0;
  for (std::size_t i = frames_.size(); i-- > 1 && passed < duration;) {
    passed += frames_[i]->since.imu.duration();
    frames_[i]->since.wheels.reset();
  }
}

ImuState Window::newest() const {
  const Frame& frame = *frames_.back();
  const Pose T_WB = to_pose(frame.pose.data());
  const Eigen::Map<const Eigen::Matrix<double, 9, 1>> m(frame.motion.data());
  return {frame.t_ns, T_WB.R, m.head<3>(), T_WB.p, m.segment<3>(motion_entry::b_g), m.segment<3>(motion_entry::b_a)};
}

CameraState Window::cameras() const { return {to_pose(camera_.data()), to_pose(stereo_.data()), offset_[0]}; }

OdometerState Window::odometer() const { return with_errors(given_, wheels_.data()); }

std::vector<PriorBlock> Window::blocks() const {
  std::vector<PriorBlock> result;
  const auto add = [&](BlockKind kind, const double* block, int size, double* body_pose = nullptr) {
    result.push_back(
        {kind, const_cast<double*>(block), size, body_pose, Eigen::Map<const Eigen::VectorXd>(block, size)});
  };
  for (const std::unique_ptr<Frame>& frame : frames_) {
    add(BlockKind::body_pose, frame->pose.data(), 7);
    add(BlockKind::motion, frame->motion.data(), 9, frame->pose.data());
  }
  add(BlockKind::sensor_pose, camera_.data(), 7);
  add(BlockKind::sensor_pose, stereo_.data(), 7);
  add(BlockKind::additive, offset_.data(), 1);
  add(BlockKind::additive, wheels_.data(), 6);
  return result;
}

double Window::parallax_px(std::size_t from, std::size_t to) const {
  const Eigen::Matrix3d R_BC0 = to_pose(camera_.data()).R;
  const FrameRotation a{frames_[from]->number, pose(from).R * R_BC0};
  const FrameRotation b{frames_[to]->number, pose(to).R * R_BC0};
  return focal_px_ * median_parallax(tracks_, a, b, parallax_);
}

std::size_t Window::index_of(std::uint64_t number) const {
  const auto frame = std::lower_bound(frames_.begin(), frames_.end(), number,
                                      [](const std::unique_ptr<Frame>& f, std::uint64_t n) { return f->number < n; });
  return static_cast<std::size_t>(frame - frames_.begin());
}

}  // namespace ear::smoother
