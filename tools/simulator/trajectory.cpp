#include "tools/simulator/trajectory.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ear::simulator {
namespace {

// Weights of the six control points around f in [0, 1): value, first and second derivative with respect to f.
struct Basis {
  Eigen::Matrix<double, 6, 1> value, first, second;
};

Basis quintic_basis(double f) {
  const double f2 = f * f;
  const double f3 = f2 * f;
  const double f4 = f3 * f;
  const double f5 = f4 * f;
  const double g = 1.0 - f;
  Basis basis;
  basis.value << g * g * g * g * g,                                     //
      26.0 - 50.0 * f + 20.0 * f2 + 20.0 * f3 - 20.0 * f4 + 5.0 * f5,   //
      66.0 - 60.0 * f2 + 30.0 * f4 - 10.0 * f5,                         //
      26.0 + 50.0 * f + 20.0 * f2 - 20.0 * f3 - 20.0 * f4 + 10.0 * f5,  //
      1.0 + 5.0 * f + 10.0 * f2 + 10.0 * f3 + 5.0 * f4 - 5.0 * f5,      //
      f5;
  basis.first << -5.0 * g * g * g * g,                       //
      -50.0 + 40.0 * f + 60.0 * f2 - 80.0 * f3 + 25.0 * f4,  //
      -120.0 * f + 120.0 * f3 - 50.0 * f4,                   //
      50.0 + 40.0 * f - 60.0 * f2 - 80.0 * f3 + 50.0 * f4,   //
      5.0 + 20.0 * f + 30.0 * f2 + 20.0 * f3 - 25.0 * f4,    //
      5.0 * f4;
  basis.second << 20.0 * g * g * g,                //
      40.0 + 120.0 * f - 240.0 * f2 + 100.0 * f3,  //
      -120.0 + 360.0 * f2 - 200.0 * f3,            //
      40.0 - 120.0 * f - 240.0 * f2 + 200.0 * f3,  //
      20.0 + 60.0 * f + 60.0 * f2 - 100.0 * f3,    //
      20.0 * f3;
  basis.value /= 120.0;
  basis.first /= 120.0;
  basis.second /= 120.0;
  return basis;
}

}  // namespace

Trajectory::Trajectory(double period, Eigen::Matrix<double, 6, Eigen::Dynamic> states, const Eigen::Isometry3d& T_BO)
    : period_(period),
      states_(std::move(states)),
      R_OB_(T_BO.linear().transpose()),
      p_OB_(-T_BO.linear().transpose() * T_BO.translation()) {}

Kinematics Trajectory::at(double t) const {
  const double position = t / period_;
  const double whole = std::floor(position);
  const Basis basis = quintic_basis(position - whole);
  const auto first = static_cast<Eigen::Index>(whole) - 2;
  AxleState s = AxleState::Zero();
  AxleState ds = AxleState::Zero();
  AxleState dds = AxleState::Zero();
  for (Eigen::Index i = 0; i < 6; ++i) {
    const Eigen::Index column = std::clamp<Eigen::Index>(first + i, 0, states_.cols() - 1);
    s += basis.value(i) * states_.col(column);
    ds += basis.first(i) * states_.col(column);
    dds += basis.second(i) * states_.col(column);
  }
  ds /= period_;
  dds /= period_ * period_;

  const double cr = std::cos(s(4));
  const double sr = std::sin(s(4));
  const double cp = std::cos(s(5));
  const double sp = std::sin(s(5));
  const double dyaw = ds(3);
  const double droll = ds(4);
  const double dpitch = ds(5);

  Kinematics k;
  k.R_WO = (Eigen::AngleAxisd(s(3), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(s(4), Eigen::Vector3d::UnitX()) *
            Eigen::AngleAxisd(s(5), Eigen::Vector3d::UnitY()))
               .toRotationMatrix();
  k.p_WO = s.head<3>();
  k.v_O_W = ds.head<3>();
  // Rates of the three angles about their axes, seen from O; then their derivative.
  k.omega_O = {cp * droll - sp * cr * dyaw, dpitch + sr * dyaw, sp * droll + cp * cr * dyaw};
  const Eigen::Vector3d alpha_O(
      cp * dds(4) - sp * dpitch * droll - (cp * dpitch * cr - sp * sr * droll) * dyaw - sp * cr * dds(3),
      dds(5) + cr * droll * dyaw + sr * dds(3),
      sp * dds(4) + cp * dpitch * droll - (sp * dpitch * cr + cp * sr * droll) * dyaw + cp * cr * dds(3));

  k.R_WB = k.R_WO * R_OB_;
  k.omega_B = R_OB_.transpose() * k.omega_O;
  k.p_WB = k.p_WO + k.R_WO * p_OB_;
  k.v_W = k.v_O_W + k.R_WO * k.omega_O.cross(p_OB_);
  k.a_W = dds.head<3>() + k.R_WO * (alpha_O.cross(p_OB_) + k.omega_O.cross(k.omega_O.cross(p_OB_)));
  return k;
}

}  // namespace ear::simulator
