#include "filter/start/image_start.h"

#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "ear/filter_config.h"
#include "filter/ekf/initial_state.h"
#include "filter/ekf/so3.h"
#include "filter/start/start_moments.h"
#include "tests/support/about.h"
#include "tests/support/workload.h"
#include "tools/simulator/simulation.h"

using namespace ear;

namespace {

constexpr double kSigma = 0.6 / 385.0;  // of an observation, normalized

/// A second of a swaying flight.
StartMoment moment(const StartFit::Vector& x) {
  ImuBuffer imu(4096);
  for (int i = -100; i < 1300; ++i) {
    const double t = 0.001 * i;
    ImuSample sample;
    sample.t_ns = 1'000'000 * i;
    sample.gyro_B << 0.4 * std::sin(3.0 * t), 0.7 - t, 0.5 * std::cos(2.0 * t);
    sample.accel_B << 1.5 * std::sin(5.0 * t), t, 9.8 + std::cos(4.0 * t);
    imu.push(sample);
  }
  return start_moments({0, 500'000'000, 1'000'000'000}, x, imu).back();
}

StartSums sums(const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a) {
  StartFit::Vector x = StartFit::Vector::Zero();
  x.segment<3>(StartFit::gyro_bias) = b_g;
  x.segment<3>(StartFit::accel_bias) = b_a;
  return moment(x).sums;
}

/// One and a half seconds of a simulation, as its left camera sees them, or both.
struct Clip {
  std::vector<TimedFrame> frames;
  ImuBuffer imu{4096};
  CameraState cameras;
  StartNoise noise;

  template <typename ChangeSample>
  Clip(const simulator::Simulation& simulation, double from, const ChangeSample& change, bool stereo = false) {
    const TimeNs begin_ns = simulation.imu().front().t_ns + static_cast<TimeNs>(1e9 * from);
    const TimeNs end_ns = begin_ns + 1'500'000'000;
    for (ImuSample sample : simulation.imu()) {
      if (sample.t_ns < begin_ns - 20'000'000 || sample.t_ns > end_ns + 20'000'000) continue;
      change(sample);
      imu.push(sample);
    }
    const Calibration& calibration = simulation.calibration();
    cameras = camera_state(calibration);
    noise = {start_sigma(PriorConfig{}, calibration), calibration.imu, kSigma};
    for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
      const TimeNs t_ns = simulation.frame_times()[i];
      if (t_ns < begin_ns || t_ns > end_ns) continue;
      frames.push_back({t_ns, simulation.tracks(i)});
      for (FeatureObservation& o : frames.back().features.features) o.has_right = o.has_right && stereo;
    }
  }

  [[nodiscard]] StartAttempt start() const { return image_start(frames, imu, cameras, noise); }
};

simulator::Simulation fly(double rate_hz, std::uint64_t seed, double calibration_error) {
  simulator::Options options;
  options.sequence = "fly1";
  options.seed = seed;
  options.duration = 25.0;
  options.camera_rate_hz = rate_hz;
  options.calibration_error = calibration_error;
  return simulator::Simulation(options);
}

const auto kUnchanged = [](ImuSample&) {};

}  // namespace

TEST_CASE("start sums: the derivatives by the biases are those of the sums") {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const StartSums s = sums(zero, zero);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
    const StartSums g = sums(step, zero), a = sums(zero, step);
    CHECK((log_so3(g.R * s.R.transpose()) / kStep - s.R_by_b_g.col(i)).norm() < 1e-4);
    CHECK(((g.velocity - s.velocity) / kStep - s.velocity_by_b_g.col(i)).norm() < 1e-3);
    CHECK(((g.position - s.position) / kStep - s.position_by_b_g.col(i)).norm() < 1e-3);
    CHECK(((a.velocity - s.velocity) / kStep - s.velocity_by_b_a().col(i)).norm() < 1e-6);
    CHECK(((a.position - s.position) / kStep - s.position_by_b_a.col(i)).norm() < 1e-6);
  }
}

TEST_CASE("image start: the derivatives of a point's image are those of the image") {
  CameraState cameras;
  cameras.T_BC0 = {exp_so3(Eigen::Vector3d(0.3, -0.9, 0.4)), Eigen::Vector3d(0.1, 0.02, -0.05)};
  cameras.T_C0C1 = {exp_so3(Eigen::Vector3d(0.05, 0.1, -0.08)), Eigen::Vector3d(0.2, -0.01, 0.03)};
  StartFit::Vector x;
  x << 0.7, -0.3, 0.2, 0.4, 0.8, -9.7, 0.02, -0.01, 0.03, 0.1, -0.05, 0.08, 0.0, 0.0, 0.0, 3e-3, 0.0, 0.0, 0.0, 0.02,
      -0.01, 0.03, -0.02, 0.02, 0.01;
  const Eigen::Vector3d point(0.2, -0.1, 0.25);
  for (const int camera : {0, 1}) {
    CAPTURE(camera);
    const PointImage image = image_of(point, x, moment(x), cameras, camera);
    REQUIRE(image.depth > 0.1);
    constexpr double kStep = 1e-5;
    for (int i = 0; i < 3; ++i) {
      const PointImage moved = image_of(point + kStep * Eigen::Vector3d::Unit(i), x, moment(x), cameras, camera);
      CHECK(((moved.uv - image.uv) / kStep - image.by_point.col(i)).norm() < 1e-4);
      StartMoment turned = moment(x), shifted = moment(x);
      turned.sums.R = exp_so3(kStep * Eigen::Vector3d::Unit(i)) * turned.sums.R;
      shifted.error(i) += kStep;
      CHECK(((image_of(point, x, turned, cameras, camera).uv - image.uv) / kStep - image.by_turn.col(i)).norm() < 1e-4);
      CHECK(((image_of(point, x, shifted, cameras, camera).uv - image.uv) / kStep - image.by_position.col(i)).norm() <
            1e-4);
    }
    for (int i = 0; i < StartFit::size; ++i) {
      CAPTURE(i);
      const StartFit::Vector other = x + kStep * StartFit::Vector::Unit(i);
      const PointImage moved = image_of(point, other, moment(other), cameras, camera);
      // The offset's derivative takes the rate and force of a sample, half a millisecond off.
      const double most = i == StartFit::time_offset ? 1e-2 : 1e-3;
      CHECK(((moved.uv - image.uv) / kStep - image.by_state.col(i)).norm() < most);
      const Eigen::Vector3d path = moment(other).position(other) - moment(x).position(x);
      CHECK((path / kStep - moment(x).position_by_state().col(i)).norm() < most);
    }
  }
}

TEST_CASE("image start: the noise of the path is that of many integrations") {
  const ImuCalibration noise = [] {
    ImuCalibration imu;
    imu.gyro_noise = 2e-3;
    imu.accel_noise = 2e-2;
    return imu;
  }();
  const StartFit::Vector x = StartFit::Vector::Zero();
  const std::vector<TimeNs> times{0, 400'000'000, 1'000'000'000};
  std::mt19937_64 rng(3);
  const auto samples = [&](double noisy) {
    std::normal_distribution<double> normal;
    ImuBuffer imu(4096);
    for (int i = 0; i <= 200; ++i) {
      ImuSample sample;
      sample.t_ns = 5'000'000 * i;
      sample.gyro_B << 0.0, 0.8, 0.0;
      sample.accel_B << 1.0, 0.5, 9.81;
      for (int k = 0; k < 3; ++k) {
        sample.gyro_B(k) += noisy * noise.gyro_noise / std::sqrt(0.005) * normal(rng);
        sample.accel_B(k) += noisy * noise.accel_noise / std::sqrt(0.005) * normal(rng);
      }
      imu.push(sample);
    }
    return imu;
  };
  const ImuBuffer without = samples(0.0);
  const std::vector<StartMoment> exact = start_moments(times, x, without);
  const Eigen::MatrixXd stated = path_noise(times, x, without, noise);
  Eigen::MatrixXd drawn = Eigen::MatrixXd::Zero(12, 12);
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    const std::vector<StartMoment> noisy = start_moments(times, x, samples(1.0));
    Eigen::VectorXd e(12);
    for (std::size_t k = 1; k < times.size(); ++k) {
      auto errors = e.segment<StartMoment::errors>(StartMoment::errors_before(k));
      errors.head<3>() = log_so3(noisy[k].sums.R * exact[k].sums.R.transpose());
      errors.tail<3>() = noisy[k].position(x) - exact[k].position(x);
    }
    drawn += e * e.transpose() / kDraws;
  }
  const Eigen::VectorXd sigma = stated.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled =
      sigma.cwiseInverse().asDiagonal() * (drawn - stated) * sigma.cwiseInverse().asDiagonal();
  CHECK(scaled.cwiseAbs().maxCoeff() < 0.08);
}

TEST_CASE("image start: velocity, tilt and bias in flight, by a calibration as wrong as real ones are" *
          doctest::skip(test::kStatistics)) {
  struct Sums {
    int starts = 0, windows = 0;
    double squares = 0.0;
  };
  std::array<Sums, 2> by_cameras;
  for (const double rate : {30.0, 10.0}) {
    for (const std::uint64_t seed : {841U, 842U, 843U}) {
      const simulator::Simulation simulation = fly(rate, seed, 1.0);
      for (const bool stereo : {false, true}) {
        Sums& sums = by_cameras.at(stereo ? 1 : 0);
        for (double from = 8.0; from < 22.0; from += 1.0) {
          CAPTURE(rate);
          CAPTURE(seed);
          CAPTURE(stereo);
          CAPTURE(from);
          ++sums.windows;
          const StartAttempt attempt = Clip(simulation, from, kUnchanged, stereo).start();
          CHECK((attempt.x || attempt.lacks != Reason::none));
          if (!attempt.x) continue;
          ++sums.starts;
          const ImuState& x = *attempt.x;
          const simulator::Truth truth = simulation.truth(x.t_ns);
          const Eigen::Vector3d up_B = x.R_WB.transpose() * Eigen::Vector3d::UnitZ();
          const double tilt = std::acos(std::min(1.0, up_B.dot(truth.R_WB.transpose() * Eigen::Vector3d::UnitZ())));
          const double v_error = (x.R_WB.transpose() * x.v_W - truth.R_WB.transpose() * truth.v_W).norm();
          CHECK(tilt < 0.06);
          CHECK(v_error < 0.05 + (stereo ? 0.1 : 0.3) * truth.v_W.norm());
          CHECK((x.b_g - truth.b_g).norm() < 0.02);
          sums.squares += std::pow(v_error / (0.3 + truth.v_W.norm()), 2);
        }
      }
    }
  }
  for (const bool stereo : {false, true}) {
    CAPTURE(stereo);
    const Sums& sums = by_cameras.at(stereo ? 1 : 0);
    const double rms = std::sqrt(sums.squares / sums.starts);
    MESSAGE((stereo ? 2 : 1), " cameras: ", sums.starts, " of ", sums.windows,
            " windows of 1.5 s start, the velocity to ", rms);
    CHECK(sums.starts >= (stereo ? sums.windows : 40));
    CHECK(rms < (stereo ? 0.03 : 0.07));
  }
}

TEST_CASE("image start: how noisy the inertial samples are, against what is stated" *
          doctest::skip(test::kStatistics)) {
  struct Case {
    ImuNoiseFactors times;
    bool stereo;
    double gyro = 0.0, accel = 0.0, squares = 0.0;
    int starts = 0;
  };
  std::vector<Case> cases;
  for (const bool stereo : {false, true}) {
    for (const ImuNoiseFactors& times : {ImuNoiseFactors{1.0, 1.0}, {4.0, 1.0}, {1.0, 5.0}}) {
      cases.push_back({times, stereo});
    }
  }
  std::mt19937_64 rng(7);
  std::normal_distribution<double> normal;
  for (const std::uint64_t seed : {845U, 846U, 847U}) {
    const simulator::Simulation simulation = fly(30.0, seed, 0.0);
    const ImuCalibration& imu = simulation.calibration().imu;
    const auto add = [&](Eigen::Vector3d& value, double density, double factor) {
      const double sigma = density * std::sqrt((factor * factor - 1.0) * imu.rate_hz);
      for (double& v : value) v += sigma * normal(rng);
    };
    for (Case& one : cases) {
      const auto noisier = [&](ImuSample& sample) {
        add(sample.gyro_B, imu.gyro_noise, one.times.gyro);
        add(sample.accel_B, imu.accel_noise, one.times.accel);
      };
      for (double from = 8.0; from < 22.0; from += one.stereo ? 1.0 : 0.25) {
        const StartAttempt attempt = Clip(simulation, from, noisier, one.stereo).start();
        if (!attempt.x) continue;
        ++one.starts;
        one.gyro += std::log(attempt.imu_noise.value().gyro);
        one.accel += std::log(attempt.imu_noise.value().accel);
        const ImuState& x = *attempt.x;
        const simulator::Truth truth = simulation.truth(x.t_ns);
        const Eigen::Vector3d error = x.R_WB.transpose() * x.v_W - truth.R_WB.transpose() * truth.v_W;
        const StartFit::MotionMatrix covariance = attempt.information->inverse();
        one.squares += error.dot(covariance.topLeftCorner<3, 3>().ldlt().solve(error));
      }
    }
  }
  for (const Case& one : cases) {
    const double gyro = std::exp(one.gyro / one.starts), accel = std::exp(one.accel / one.starts);
    const double nees = one.squares / one.starts;
    MESSAGE((one.stereo ? 2 : 1), " cameras, ", one.times.gyro, ", ", one.times.accel, " times: measured ", gyro, ", ",
            accel, ", ", one.starts, " starts, NEES of the velocity ", nees);
    CHECK(gyro == test::about(one.times.gyro, 0.4));
    CHECK(accel == test::about(one.times.accel, 0.5));
    CHECK(one.starts >= 25);
    CHECK(nees < (one.times.accel == 1.0 ? 4.0 : 10.0));  // few of its squares are determined
  }
}

TEST_CASE("image start: no length is shown at a steady speed, and what contradicts itself starts nothing") {
  simulator::Options options;
  options.sequence = "flat1";
  options.seed = 923;
  options.duration = 12.0;
  options.calibration_error = 0.0;
  const simulator::Simulation steady(options);
  int unseen = 0;
  for (double from = 6.0; from < 10.0; from += 0.5) {
    const StartAttempt attempt = Clip(steady, from, kUnchanged).start();
    if (attempt.x) {  // not quite steady
      const double speed = steady.truth(attempt.x->t_ns).v_W.norm();
      MESSAGE("at ", from, " s it starts with ", attempt.x->v_W.norm(), " m/s of ", speed);
      CHECK(attempt.x->v_W.norm() == test::about(speed, 0.2));
    }
    unseen += attempt.x ? 0 : 1;
  }
  CHECK(unseen >= 6);
  const StartAttempt by_two = Clip(steady, 6.0, kUnchanged, true).start();
  REQUIRE(by_two.x);
  CHECK(by_two.x->v_W.norm() == test::about(steady.truth(by_two.x->t_ns).v_W.norm(), 0.03));

  const simulator::Simulation simulation = fly(30.0, 844, 0.0);
  const auto lacks = [&](const auto& change) { return Clip(simulation, 10.0, change).start().lacks; };
  REQUIRE(lacks(kUnchanged) == Reason::none);
  CHECK(lacks([](ImuSample& sample) { sample.accel_B /= 9.81; }) != Reason::none);
  CHECK(lacks([](ImuSample& sample) { sample.gyro_B *= 180.0 / M_PI; }) != Reason::none);
  CHECK(lacks([](ImuSample& sample) { sample.gyro_B = -sample.gyro_B; }) != Reason::none);
  CHECK(lacks([](ImuSample& sample) {
          std::swap(sample.accel_B.x(), sample.accel_B.y());
          std::swap(sample.gyro_B.x(), sample.gyro_B.y());
        }) != Reason::none);

  Clip exchanged(simulation, 10.0, kUnchanged, true);
  REQUIRE(exchanged.start().x);
  for (TimedFrame& frame : exchanged.frames) {
    for (FeatureObservation& o : frame.features.features) {
      if (o.has_right) std::swap(o.left, o.right);
    }
  }
  CHECK_FALSE(exchanged.start().x);

  Clip bent(simulation, 10.0, kUnchanged, true);
  bent.cameras.T_C0C1.R = exp_so3(Eigen::Vector3d(2e-3, -2e-3, 2e-3)) * bent.cameras.T_C0C1.R;
  const StartAttempt by_bent = bent.start();
  REQUIRE(by_bent.x);
  CHECK(by_bent.x->v_W.norm() == test::about(simulation.truth(by_bent.x->t_ns).v_W.norm(), 0.05));

  Clip few_right(simulation, 10.0, kUnchanged, true);
  for (TimedFrame& frame : few_right.frames) {
    for (FeatureObservation& o : frame.features.features) {
      o.has_right = o.has_right && o.id % 20 == 0;
      o.right.x() += 0.02;
    }
  }
  const StartAttempt by_left = few_right.start();
  REQUIRE(by_left.x);
  CHECK(by_left.x->v_W == Clip(simulation, 10.0, kUnchanged).start().x.value().v_W);

  Clip blind(simulation, 10.0, kUnchanged);
  for (TimedFrame& frame : blind.frames) frame.features.features.resize(5);
  CHECK(blind.start().lacks == Reason::few_frames);
  blind.frames.resize(2);
  CHECK(blind.start().lacks == Reason::few_frames);
}
