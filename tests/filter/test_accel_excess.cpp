#include "filter/sources/accel_excess.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "filter/ingest/limits.h"

using namespace ear;

namespace {

constexpr double kDt = 1.0 / 30.0;
constexpr double kSigma = 0.02;  // [m/s] of a velocity by two images

Covariance state_covariance(double bias, double tilt, double mounting = 0.0, double time_offset = 0.0) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<2>(err::theta).setConstant(tilt);
  sigma.segment<3>(err::b_a).setConstant(bias);
  sigma.segment<3>(err::camera).setConstant(mounting);
  sigma(err::time_offset) = time_offset;
  Covariance P(err::clones);
  P.reset(sigma);
  return P;
}

/// A vehicle whose velocity the state has wrong, by samples that are off.
struct Vehicle {
  double off = 0.0;        ///< [m/s^2] of the samples, along x
  double wrong = 0.0;      ///< [m/s] of the velocity, along y, at the beginning
  double corrected = 0.0;  ///< share of the velocity's error that each frame corrects
  double noise = 1.0;      ///< of the images, times what is stated
  double gained = 0.0;     ///< [m/s] noise of what the samples add in a frame
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();

  Vehicle(double off_by, unsigned seed) : off(off_by), rng_(seed) {}

  AccelExcess::Frame next() {
    std::normal_distribution<double> normal;
    if (steps_ == 0) error_.y() = wrong;
    error_ *= 1.0 - corrected;
    AccelExcess::Frame frame;
    frame.t_ns = static_cast<TimeNs>(1e9 * kDt * ++steps_);
    frame.duration = kDt;
    frame.v_W = truth_ + error_;
    const auto draw = [&] { return Eigen::Vector3d(Eigen::Vector3d::NullaryExpr([&] { return normal(rng_); })); };
    const Eigen::Vector3d by_samples = kDt * Eigen::Vector3d::UnitX() * off + gained * draw();
    frame.gained_W = kDt * accel + by_samples;
    frame.gained_variance.setConstant(gained * gained);
    frame.beyond_W = -error_ - 0.5 * by_samples + noise * kSigma * draw();
    frame.beyond_variance.setConstant(kSigma * kSigma);
    truth_ += kDt * accel;
    error_ += by_samples;
    return frame;
  }

 private:
  std::mt19937_64 rng_;
  int steps_ = 0;
  Eigen::Vector3d truth_ = Eigen::Vector3d::Zero(), error_ = Eigen::Vector3d::Zero();
};

/// What is found, and after how many frames; 0 if nothing is.
struct Found {
  double size = 0.0;
  int frames = 0;
};

Found find(Vehicle vehicle, const Covariance& P, int frames) {
  AccelExcess excess;
  for (int i = 1; i <= frames; ++i) {
    excess.add(vehicle.next(), P);
    const double size = excess.take(P);
    if (size > 0.0) return {size, i};
  }
  return {};
}

}  // namespace

TEST_CASE("accel excess: the growth of the velocity is the acceleration that is off, to within its variance") {
  const Covariance P = state_covariance(0.0, 0.0);
  struct Case {
    double corrected, gained;
  };
  for (const Case& given : {Case{0.0, 0.0}, Case{0.3, 0.0}, Case{0.3, 0.005}, Case{0.3, 0.02}}) {
    CAPTURE(given.corrected);
    CAPTURE(given.gained);
    double squares = 0.0, mean = 0.0;
    constexpr int kRuns = 400;
    for (unsigned seed = 0; seed < kRuns; ++seed) {
      Vehicle vehicle(0.3, seed);
      vehicle.accel.x() = -0.3;  // by the samples it does not move: nothing is allowed for the depths
      vehicle.corrected = given.corrected;
      vehicle.gained = given.gained;
      AccelExcess excess;
      for (int i = 0; i < 60; ++i) excess.add(vehicle.next(), P);
      const auto growth = excess.growth(P);
      REQUIRE(growth);
      mean += growth->value.x() / kRuns;
      const Eigen::Array3d error = growth->value - Eigen::Array3d(-0.3, 0.0, 0.0);
      squares += (error.square() / growth->variance).mean() / kRuns;
    }
    CHECK(std::abs(mean + 0.3) < 0.01);
    CHECK(squares > 0.85);  // 1200 draws: 0.04
    CHECK(squares < 1.15);
  }
}

TEST_CASE("accel excess: a bias that jumped is found in a second, where updates correct the velocity or not") {
  const Covariance P = state_covariance(0.03, 2e-3);
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    for (const double corrected : {0.0, 0.1}) {
      Vehicle vehicle(0.5, seed);
      vehicle.corrected = corrected;
      const Found found = find(vehicle, P, 60);
      CHECK(found.frames > 0);
      CHECK(found.frames < 30);
      CHECK(found.size > 0.25);
      CHECK(found.size < 0.9);
    }
  }
}

TEST_CASE("accel excess: sound samples, and a velocity that is wrong, are none") {
  const Covariance P = state_covariance(0.01, 1e-3);
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    CHECK(find(Vehicle(0.0, seed), P, 3000).frames == 0);
    Vehicle off(0.0, seed);
    off.wrong = 1.0;
    CHECK(find(off, P, 300).frames == 0);
    off.corrected = 0.2;  // within a few frames
    CHECK(find(off, P, 300).frames == 0);
    Vehicle noisy(0.0, seed);
    noisy.noise = 8.0;
    CHECK(find(noisy, P, 3000).frames > 0);  // the case before would show it
  }
}

TEST_CASE("accel excess: what bias, tilt, mounting and time offset may explain is none") {
  const Vehicle vehicle(0.5, 3);
  CHECK(find(vehicle, state_covariance(0.01, 1e-3), 300).frames > 0);
  CHECK(find(vehicle, state_covariance(0.2, 1e-3), 300).frames == 0);
  CHECK(find(vehicle, state_covariance(0.01, 0.02), 300).frames == 0);  // 0.2 m/s^2 of gravity
  Vehicle braking = vehicle;
  braking.accel.y() = -5.0;
  CHECK(find(braking, state_covariance(0.01, 1e-3), 300).frames == 0);  // a twentieth of it by depths
  braking.accel.y() = -1.0;
  CHECK(find(braking, state_covariance(0.01, 1e-3), 300).frames > 0);
  CHECK(find(braking, state_covariance(0.01, 1e-3, 0.2), 300).frames == 0);
}

TEST_CASE("accel excess: a frame that is not finite is none") {
  const Covariance P = state_covariance(0.01, 1e-3);
  Vehicle vehicle(0.0, 5);
  AccelExcess excess;
  for (int i = 0; i < 60; ++i) {
    AccelExcess::Frame frame = vehicle.next();
    if (i == 20) frame.beyond_W.x() = NAN;
    excess.add(frame, P);
    CHECK(excess.take(P) == 0.0);
  }
  CHECK(excess.growth(P).has_value());  // of the frames since
}

TEST_CASE("accel excess: frames that do not follow each other begin anew") {
  const Covariance P = state_covariance(0.01, 1e-3);
  Vehicle vehicle(0.5, 4);
  AccelExcess excess;
  for (int i = 0; i < 200; ++i) {
    const AccelExcess::Frame frame = vehicle.next();
    if (i % 12 == 0) continue;  // what is left spans less than half a second
    excess.add(frame, P);
    CHECK(excess.take(P) == 0.0);
  }
}
