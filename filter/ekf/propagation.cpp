#include "filter/ekf/propagation.h"

#include <algorithm>
#include <cmath>

namespace ear {

ImuState integrate(const ImuState& x, const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
  const Eigen::Vector3d phi = x.rate_B(gyro_B) * dt;
  const Eigen::Vector3d f_B = x.force_B(accel_B);
  ImuState next = x;
  next.R_WB = renormalized(x.R_WB * exp_so3(phi));
  next.v_W = x.v_W + kGravity_W * dt + x.R_WB * (gamma<1>(phi) * f_B) * dt;
  next.p_WB = x.p_WB + x.v_W * dt + 0.5 * kGravity_W * dt * dt + x.R_WB * (gamma<2>(phi) * f_B) * dt * dt;
  next.t_ns = x.t_ns + static_cast<TimeNs>(std::llround(dt * 1e9));
  return next;
}

ImuState integrate_to(TimeNs t_ns, ImuState x, const ImuBuffer& samples) {
  if (t_ns <= x.t_ns) return x;
  samples.for_each_piece(x.t_ns, t_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
    x = integrate(x, gyro_B, accel_B, dt);
  });
  x.t_ns = t_ns;
  return x;
}

BodyMotion motion_at(TimeNs t_ns, const ImuState& x, const ImuBuffer& samples) {
  BodyMotion motion{x.R_WB, x.v_W};
  if (t_ns >= x.t_ns) return motion;
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();  // from the body then to the body now
  Eigen::Vector3d gained = Eigen::Vector3d::Zero();      // velocity, in the body then, without gravity
  samples.for_each_piece(t_ns, x.t_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
    gained += turned * x.force_B(accel_B) * dt;
    turned *= exp_so3(x.rate_B(gyro_B) * dt);
  });
  motion.R_WB = x.R_WB * turned.transpose();
  motion.v_W = x.v_W - kGravity_W * seconds_between(t_ns, x.t_ns) - motion.R_WB * gained;
  return motion;
}

double taken_back_sigma(double tilt, double delay) { return kGravity_W.norm() * tilt * std::max(0.0, delay); }

Eigen::Matrix3d gyro_rotation(TimeNs from_ns, TimeNs to_ns, const Eigen::Vector3d& b_g, const ImuBuffer& samples) {
  if (to_ns < from_ns) return gyro_rotation(to_ns, from_ns, b_g, samples).transpose();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  samples.for_each_piece(from_ns, to_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt) {
    R *= exp_so3((gyro_B - b_g) * dt);
  });
  return R;
}

/// With the matrix taken for the identity, the bias that makes of gravity what the matrix makes of it.
NavState nav_state(const ImuState& x) {
  const Eigen::Vector3d rest_B = x.rest_force_B();
  const Eigen::Vector3d more_B = x.accel_matrix.inverse() * rest_B - rest_B;
  return {x.t_ns, Eigen::Quaterniond(x.R_WB).normalized(), x.p_WB, x.v_W, x.b_g, x.b_a + more_B};
}

ErrorTransition error_transition(const ImuState& x, const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B,
                                 double dt, const ImuCalibration& noise) {
  const Eigen::Vector3d phi = x.rate_B(gyro_B) * dt;
  const Eigen::Vector3d f_B = x.force_B(accel_B);
  const Eigen::Matrix3d G1 = gamma<1>(phi);
  const Eigen::Matrix3d G2 = gamma<2>(phi);
  const Eigen::Vector3d v_next = x.v_W + kGravity_W * dt + x.R_WB * (G1 * f_B) * dt;
  const Eigen::Vector3d p_next = x.p_WB + x.v_W * dt + 0.5 * kGravity_W * dt * dt + x.R_WB * (G2 * f_B) * dt * dt;

  // What an error of the gyroscope, and one of the accelerometer, each constant over dt, does to (theta, nu, rho).
  Eigen::Matrix<double, 9, 3> B_gyro;
  B_gyro.topRows<3>() = -x.R_WB * G1 * dt;
  B_gyro.middleRows<3>(3) = -x.R_WB * gamma_derivative<1>(phi, f_B) * (dt * dt) + skew(v_next) * B_gyro.topRows<3>();
  B_gyro.bottomRows<3>() =
      -x.R_WB * gamma_derivative<2>(phi, f_B) * (dt * dt * dt) + skew(p_next) * B_gyro.topRows<3>();
  B_gyro *= x.gyro_matrix;
  Eigen::Matrix<double, 9, 3> B_accel;
  B_accel.topRows<3>().setZero();
  B_accel.middleRows<3>(3) = -x.R_WB * G1 * dt;
  B_accel.bottomRows<3>() = -x.R_WB * G2 * (dt * dt);
  B_accel *= x.accel_matrix;

  ErrorTransition step;
  const Eigen::Matrix3d g_cross = skew(kGravity_W);
  step.Phi.block<3, 3>(err::nu, err::theta) = g_cross * dt;
  step.Phi.block<3, 3>(err::rho, err::theta) = 0.5 * g_cross * dt * dt;
  step.Phi.block<3, 3>(err::rho, err::nu) = Eigen::Matrix3d::Identity() * dt;
  step.Phi.block<9, 3>(err::theta, err::b_g) = B_gyro;
  step.Phi.block<9, 3>(err::theta, err::b_a) = B_accel;

  // White noise of density s has the variance s^2 / dt in a mean over dt; it enters where a bias would.
  const Eigen::Matrix<double, 9, 3> gyro_share = B_gyro * (noise.gyro_noise * noise.gyro_noise / dt);
  const Eigen::Matrix<double, 6, 3> accel_share =
      B_accel.bottomRows<6>() * (noise.accel_noise * noise.accel_noise / dt);
  step.Q.topLeftCorner<9, 9>() = gyro_share.lazyProduct(B_gyro.transpose());
  step.Q.block<6, 6>(err::nu, err::nu) += accel_share.lazyProduct(B_accel.bottomRows<6>().transpose());
  step.Q.diagonal().segment<3>(err::b_g).setConstant(noise.gyro_random_walk * noise.gyro_random_walk * dt);
  step.Q.diagonal().segment<3>(err::b_a).setConstant(noise.accel_random_walk * noise.accel_random_walk * dt);
  return step;
}

void chain(const FilterKernels& kernels, ErrorTransition& total, const ErrorTransition& step) {
  const auto carry = [&](ImuErrorMatrix& M) {
    kernels.carry(step.Phi.data(), err::imu_size, {M.data(), err::imu_size});
    M.transposeInPlace();
  };
  carry(total.Q);
  kernels.carry(step.Phi.data(), err::imu_size, {total.Q.data(), err::imu_size});  // symmetric
  total.Q += step.Q;
  total.Phi.transposeInPlace();
  carry(total.Phi);
}

/// rate = M^ (I + E) measured: each column of E comes in where the bias does.
void chain(GyroEffect& total, const ErrorTransition& step, const Eigen::Vector3d& measured_B) {
  const auto& Phi = step.Phi;
  const auto theta = total.topRows<3>();
  auto nu = total.middleRows<3>(err::nu);
  auto rho = total.bottomRows<3>();
  rho += Phi.block<3, 3>(err::rho, err::nu).lazyProduct(nu) + Phi.block<3, 3>(err::rho, err::theta).lazyProduct(theta);
  nu += Phi.block<3, 3>(err::nu, err::theta).lazyProduct(theta);
  for (int axis = 0; axis < 3; ++axis) {
    total.middleCols<3>(3 * axis) -= measured_B(axis) * Phi.block<9, 3>(err::theta, err::b_g);
  }
}

/// force = A^ (I + E) measured, likewise; it turns nothing.
void chain(AccelEffect& total, const ErrorTransition& step, const Eigen::Vector3d& measured_B) {
  auto nu = total.topRows<3>();
  auto rho = total.bottomRows<3>();
  rho += step.Phi.block<3, 3>(err::rho, err::nu).lazyProduct(nu);
  for (int axis = 0; axis < 3; ++axis) {
    total.middleCols<3>(3 * axis) -= measured_B(axis) * step.Phi.block<6, 3>(err::nu, err::b_a);
  }
}

/// What turns about the body leaves velocity and position where they are: nu = dv + [v]x theta, rho = dp + [p]x theta.
void leave_out_heading(GyroEffect& effect, const ImuState& x) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, 9, 1> heading;
  heading << up, x.v_W.cross(up), x.p_WB.cross(up);
  const Eigen::Matrix<double, 1, 9> turn = effect.row(err::theta + 2);
  effect.noalias() -= heading * turn;
}

}  // namespace ear
