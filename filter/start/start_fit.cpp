#include "filter/start/start_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "filter/ekf/initial_state.h"

namespace ear {
namespace {

constexpr double kSizeSigma = 0.01;  // [m/s^2] chosen: of gravity's known size

}  // namespace

StartFit::Vector start_sigma(const PriorConfig& prior, const Calibration& calibration) {
  StartFit::Vector sigma = StartFit::Vector::Constant(HUGE_VAL);
  sigma.segment<3>(StartFit::gyro_bias).setConstant(prior.gyro_bias);
  sigma.segment<3>(StartFit::accel_bias).setConstant(prior.accel_bias);
  sigma.segment<3>(StartFit::camera_rotation).setConstant(prior.camera_rotation);
  sigma(StartFit::time_offset) = prior.time_offset;
  sigma.segment<3>(StartFit::stereo_rotation).setConstant(prior.stereo_rotation);
  sigma.tail<6>().setOnes();  // of a camera that is not there
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    sigma.segment<3>(StartFit::lens_of(static_cast<int>(i))) = lens_sigma(prior, calibration.cameras[i]);
  }
  return sigma;
}

StartFit::StartFit(const Vector& prior_sigma, const Vector& x) {
  prior_information_ = prior_sigma.array().square().inverse();
  A_ = prior_information_.asDiagonal();
  b_ = -prior_information_.cwiseProduct(x);
}

void StartFit::add(const Rows& H, const Eigen::Vector3d& z, double variance) {
  add(H.transpose() * H / variance, H.transpose() * z / variance);
  cost_ += z.squaredNorm() / variance;
  rows_ += 3.0;
}

bool StartFit::expected(const Vector& x, double sigmas) const {
  const Vector squares = x.array().square() * prior_information_.array();
  return squares.head<lens_of(0)>().maxCoeff() <= sigmas * sigmas;
}

StartFit::Matrix StartFit::information(const Vector& x) const {
  const Eigen::Vector3d along = x.segment<3>(gravity).normalized() / kSizeSigma;
  Matrix A = A_;
  A.block<3, 3>(gravity, gravity) += along * along.transpose();
  return A;
}

StartFit::MotionMatrix StartFit::motion_information(const Vector& x) const {
  constexpr int rest = size - motion_size;
  const Matrix A = information(x);
  const auto shared = A.topRightCorner<motion_size, rest>();
  return A.topLeftCorner<motion_size, motion_size>() -
         shared * A.bottomRightCorner<rest, rest>().ldlt().solve(shared.transpose());
}

/// Gravity's size is a row along its direction in x.
StartFit::Vector StartFit::step(const Vector& x, const Vector& b) const {
  const Eigen::Vector3d g = x.segment<3>(gravity);
  Vector rhs = b;
  rhs.segment<3>(gravity) += g.normalized() * ((-kGravity_W.z() - g.norm()) / (kSizeSigma * kSizeSigma));
  return information(x).ldlt().solve(rhs);
}

/// Again as gravity's direction gets better.
StartFit::Vector StartFit::solution() const {
  constexpr int kIterations = 3;  // chosen
  Vector x = A_.ldlt().solve(b_);
  for (int i = 0; i < kIterations; ++i) x += step(x, b_ - A_ * x);
  return x;
}

std::optional<StartFit::Vector> StartFit::solve() const {
  const Vector x = solution();
  const double squares = x.dot(A_ * x) - 2.0 * b_.dot(x) + cost_;
  return squares <= kWorstFit * kWorstFit * rows_ ? std::optional(x) : std::nullopt;
}

Eigen::Matrix3d turn_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return Eigen::Quaterniond::FromTwoVectors(a, b).toRotationMatrix();
}

ImuState start_state(TimeNs t_ns, const StartFit::Vector& x) {
  ImuState state;
  state.t_ns = t_ns;
  state.R_WB = turn_between(x.segment<3>(StartFit::gravity), kGravity_W);
  state.v_W = state.R_WB * x.segment<3>(StartFit::velocity);
  state.b_g = x.segment<3>(StartFit::gyro_bias);
  state.b_a = x.segment<3>(StartFit::accel_bias);
  return state;
}

}  // namespace ear
