// Two worlds of one vehicle, before and after a restart.
#include <doctest/doctest.h>

#include <cmath>

#include "filter/ekf/so3.h"
#include "filter/start/map_alignment.h"
#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

namespace {

using Matrix = Eigen::Matrix<double, estimate_error::size, estimate_error::size>;

NavState state(double yaw, const Eigen::Vector3d& p_WB, const Eigen::Vector3d& v_W) {
  NavState x;
  x.q_WB = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX());
  x.p_WB = p_WB;
  x.v_W = v_W;
  return x;
}

}  // namespace

TEST_CASE("map_alignment: the vehicle is where it was last known to be") {
  const NavState last_W = state(1.1, {4.0, -2.0, 0.5}, {1.0, 0.0, 0.0});
  const NavState start_A = state(-0.4, {0.1, 0.2, 0.3}, {0.0, 0.5, 0.0});
  const MapAlignment alignment = MapAlignment::join(last_W, start_A, 0.1, 0.2);
  const NavState start_W = alignment.to_world(start_A);
  CHECK(start_W.p_WB.isApprox(last_W.p_WB, 1e-12));
  CHECK(start_W.q_WB.angularDistance(last_W.q_WB) < 1e-12);
  CHECK(start_W.v_W.norm() == doctest::Approx(0.5));
}

TEST_CASE("map_alignment: gravity stays gravity, whatever the tilt before") {
  NavState last_W = state(1.1, {4.0, -2.0, 0.5}, Eigen::Vector3d::Zero());
  last_W.q_WB = last_W.q_WB * Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()));
  const MapAlignment alignment =
      MapAlignment::join(last_W, state(0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()), 0.0, 0.0);
  CHECK((alignment.q_WA * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitZ(), 1e-12));
}

TEST_CASE("map_alignment: its own uncertainty is that of the place and, with the distance, of the yaw") {
  const NavState last_W = state(0.0, {4.0, -2.0, 0.5}, Eigen::Vector3d::Zero());
  const NavState start_A = state(0.7, {1.0, 0.0, 0.0}, Eigen::Vector3d::Zero());
  const MapAlignment alignment = MapAlignment::join(last_W, start_A, 0.1, 0.3);
  const Matrix at_start = alignment.to_world(Matrix::Zero(), start_A);
  CHECK(at_start.block<3, 3>(estimate_error::position, estimate_error::position)
            .isApprox(0.09 * Eigen::Matrix3d::Identity(), 1e-12));
  CHECK(at_start(estimate_error::rotation + 2, estimate_error::rotation + 2) == doctest::Approx(0.01));
  const NavState later_A = state(0.7, {1.0, 20.0, 0.0}, Eigen::Vector3d::Zero());
  const Matrix later = alignment.to_world(Matrix::Zero(), later_A);
  CHECK(later.block<3, 3>(estimate_error::position, estimate_error::position).trace() ==
        doctest::Approx(3 * 0.09 + 4.0));  // 20 m times 0.1 rad
}

TEST_CASE("map_alignment: a yaw error moves what it says it moves") {
  const NavState last_W = state(0.3, {4.0, -2.0, 0.5}, Eigen::Vector3d::Zero());
  const NavState start_A = state(0.7, {1.0, 0.0, 0.0}, Eigen::Vector3d::Zero());
  const NavState later_A = state(1.7, {3.0, 5.0, 1.0}, {1.0, -0.5, 0.2});
  const MapAlignment alignment = MapAlignment::join(last_W, start_A, 1.0, 0.0);
  const double e = 1e-6;
  NavState turned_W = last_W;
  turned_W.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(e, Eigen::Vector3d::UnitZ())) * last_W.q_WB;
  const NavState a = alignment.to_world(later_A);
  const NavState b = MapAlignment::join(turned_W, start_A, 1.0, 0.0).to_world(later_A);
  Eigen::Matrix<double, estimate_error::size, 1> d = Eigen::Matrix<double, estimate_error::size, 1>::Zero();
  d.segment<3>(estimate_error::rotation) = log_so3((b.q_WB * a.q_WB.conjugate()).toRotationMatrix()) / e;
  d.segment<3>(estimate_error::velocity) = (b.v_W - a.v_W) / e;
  d.segment<3>(estimate_error::position) = (b.p_WB - a.p_WB) / e;
  CHECK((alignment.to_world(Matrix::Zero(), later_A) - d * d.transpose()).norm() < 1e-4);
}

TEST_CASE("map_alignment: a state in doubt is as uncertain as the way that it may have gone, and stays so") {
  NavState last_W = state(0.0, {4.0, -2.0, 0.5}, {0.6, 0.8, 0.0});
  last_W.t_ns = 5'000'000'000;
  MapAlignment alignment;
  alignment.doubt(last_W, 8'000'000'000);
  CHECK(alignment.position_sigma ==
        doctest::Approx(3.0 * (1.0 + 1.0)));  // three seconds, at a speed of one, and one more
  alignment.doubt(last_W, 6'000'000'000);
  CHECK(alignment.position_sigma == doctest::Approx(6.0));
  CHECK(alignment.to_world(last_W).p_WB == last_W.p_WB);
}

TEST_CASE("map_alignment: the yaw is known as the gyroscope shows it, and less where its samples are missing") {
  constexpr double kNoise = 1e-3;  // [rad/s/sqrt(Hz)]
  constexpr double kRate = 0.4;    // [rad/s] about z
  const auto yaw_sigma = [&](double gap, double factor) {
    ImuBuffer imu(1024);
    for (int i = 0; i <= 600; ++i) {  // 3 s, and what is missing after the first of them
      const double t = 5e-3 * i + (i > 200 ? gap : 0.0);
      imu.push({static_cast<TimeNs>(1e9 * t), {0.0, 0.0, kRate}, {0.0, 0.0, 9.80665}}, {i == 201 ? factor : 1.0, 1.0});
    }
    Estimate last;
    last.covariance.setZero();
    ImuState x;
    x.t_ns = static_cast<TimeNs>(1e9 * (3.0 + gap));
    const MapAlignment alignment = align_after_restart(last, x, imu, kNoise);
    const Eigen::Vector3d ahead = alignment.q_WA * Eigen::Vector3d::UnitX();
    CHECK(std::abs(std::remainder(std::atan2(ahead.y(), ahead.x()) - kRate * (3.0 + gap), 2.0 * M_PI)) < 1e-6);
    return alignment.yaw_sigma;
  };
  CHECK(yaw_sigma(0.0, 1.0) == about(kNoise * std::sqrt(3.0), 0.01));
  CHECK(yaw_sigma(1.5, 1.0) == about(1.5 * kRate, 0.01));  // how long it took is not known
  CHECK(yaw_sigma(1.5, 300.0) == about(std::hypot(1.5 * kRate, 300.0 * kNoise * std::sqrt(1.5)), 0.01));
  CHECK(yaw_sigma(1.5, 1e4) == about(M_PI / std::sqrt(3.0), 0.01));  // any yaw
}
