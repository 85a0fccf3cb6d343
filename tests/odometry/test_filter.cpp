// The filter as a whole, on simulated feature tracks: starting, standing, moving, and input that is wrong.
#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "filter/filter.h"
#include "tests/support/simulated_run.h"
#include "tools/experiments/sample_feed.h"
#include "tools/simulator/simulation.h"

using namespace ear;
using namespace ear::test;

namespace {

simulator::Simulation simulate(const char* sequence, double duration, bool perfect = true) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = 8101;
  options.duration = duration;
  if (perfect) options.calibration_error = 0.0;
  return simulator::Simulation(options);
}

double largest_error(const std::vector<EvaluatedEstimate>& run) {
  double largest = 0.0;
  for (const EvaluatedEstimate& e : run) largest = std::max(largest, e.dp_W.norm());
  return largest;
}

/// The same motion seen by somebody who switches on only after `start` seconds, with so many cameras.
std::size_t estimates_when_started_at(const simulator::Simulation& simulation, double start, double end,
                                      std::size_t cameras) {
  FilterConfig config;
  config.odometer.model = OdometerModel::none;
  Calibration calibration = simulation.calibration();
  calibration.cameras.resize(cameras);
  Filter filter(config, calibration);
  struct LateStart {
    Filter& filter;
    TimeNs from;
    void add_imu(const ImuSample& sample) {
      if (sample.t_ns >= from) filter.add_imu(sample);
    }
    void add_encoder(const EncoderSample& sample) { filter.add_encoder(sample); }
    void add_laser(const LaserSample& sample) { filter.add_laser(sample); }
  };
  const TimeNs first = simulation.frame_times().front();
  LateStart receiver{filter, first + static_cast<TimeNs>(1e9 * start)};
  experiments::SampleFeed feed(simulation);
  std::size_t estimates = 0;
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    const TimeNs t_ns = simulation.frame_times()[i];
    feed.until_frame(t_ns, receiver);
    const double t = seconds_between(first, t_ns);
    FeatureFrame frame = simulation.tracks(i);
    for (FeatureObservation& o : frame.features) o.has_right = o.has_right && cameras == 2;
    if (t >= start && t < end && filter.process(frame)) ++estimates;
  }
  CHECK(filter.status() == (estimates > 0 ? Status::tracking : Status::waiting_for_standstill));
  return estimates;
}

}  // namespace

TEST_CASE("filter: starts within a second of standing, level and at the origin") {
  const simulator::Simulation simulation = simulate("flat1", 2.0);
  Filter filter(FilterConfig{}, simulation.calibration());
  const auto run = run_filter(filter, simulation);
  REQUIRE(!run.empty());
  CHECK(run.front().t < 1.0);
  CHECK(run.front().estimate.state.p_WB.norm() < 1e-3);
  CHECK(run.front().dtheta_W.norm() < 0.02);  // an accelerometer bias of 0.1 m/s^2 tilts by 0.01 rad
}

TEST_CASE("filter: without wheels, a vehicle that moves gets a pose from two cameras, and later from one") {
  const simulator::Simulation simulation = simulate("flat1", 9.0);
  CHECK(estimates_when_started_at(simulation, 0.0, 9.0, 1) > 200);
  const std::size_t of_one = estimates_when_started_at(simulation, 5.0, 9.0, 1);
  const std::size_t of_two = estimates_when_started_at(simulation, 5.0, 9.0, 2);
  CHECK(of_two > 60);
  CHECK(of_one < of_two);
}

TEST_CASE("filter: standing for a minute it stays where it is") {
  const simulator::Simulation simulation = simulate("static", 60.0);
  Filter filter(FilterConfig{}, simulation.calibration());
  const auto run = run_filter(filter, simulation);
  REQUIRE(run.size() > 1700);
  CHECK(run.back().dp_W.norm() < 0.005);
  CHECK(std::abs(run.back().dtheta_W.z()) < 0.1 * M_PI / 180.0);
  CHECK(run.back().estimate.frame.standing);
  CHECK(run.back().estimate.frame.clones <= 1);  // standing fills no window with copies
}

TEST_CASE("filter: cameras alone, images that are the same to the byte show that it stands still") {
  const simulator::Simulation simulation = simulate("static", 15.0);
  FilterConfig config;
  config.odometer.model = OdometerModel::none;
  Filter filter(config, simulation.calibration());
  FeatureFrame first;
  const auto run = run_filter(filter, simulation, [&](FeatureFrame& frame) {
    if (first.features.empty()) first = frame;
    frame.repeated = frame.t_ns != first.t_ns;
    frame.features = first.features;
  });
  REQUIRE(run.size() > 400);
  CHECK(run.back().estimate.frame.standing);
  CHECK(run.back().dp_W.norm() < 0.005);
  for (const EvaluatedEstimate& e : run) CHECK(e.estimate.health.status == HealthStatus::tracking);
}

TEST_CASE("filter: of a camera whose driver hands over each image twice, the second one is none") {
  for (const char* sequence : {"flat1", "fly1"}) {
    CAPTURE(sequence);
    const simulator::Simulation simulation = simulate(sequence, 25.0);
    Filter sound(FilterConfig{}, simulation.calibration());
    const double largest = largest_error(run_filter(sound, simulation));
    Filter filter(FilterConfig{}, simulation.calibration());
    std::vector<FeatureObservation> last;
    const auto run = run_filter(filter, simulation, [&](FeatureFrame& frame) {
      frame.repeated = !frame.repeated && !last.empty();
      if (frame.repeated) frame.features = last;
      last = frame.repeated ? std::vector<FeatureObservation>{} : frame.features;
    });
    CHECK(run.size() > 300);
    CHECK(run.back().t > 24.9);
    CHECK(largest_error(run) < 1.5 * largest);
    for (const EvaluatedEstimate& e : run) CHECK_FALSE(e.estimate.health.faulty.any());
  }
}

TEST_CASE("filter: where the gate refuses most features of a frame, it uses none of them") {
  const simulator::Simulation simulation = simulate("flat1", 14.0);
  const TimeNs first_ns = simulation.frame_times().front();
  Filter filter(FilterConfig{}, simulation.calibration());
  std::mt19937_64 rng(52);
  std::normal_distribution<double> off(0.0, 0.05);  // 20 pixels
  const auto run = run_filter(filter, simulation, [&](FeatureFrame& frame) {
    const double t = seconds_between(first_ns, frame.t_ns);
    if (t < 8.0 || t > 9.0) return;
    for (FeatureObservation& o : frame.features) {
      o.has_right = false;  // else both cameras show how noisy the features are
      if (o.id % 4 != 0) o.left += Eigen::Vector2d(off(rng), off(rng));
    }
  });
  int refused = 0;
  for (const EvaluatedEstimate& e : run) {
    const FrameStatistics& seen = e.estimate.frame;
    if (seen.features_used + seen.features_rejected < 10) continue;
    CHECK((seen.features_used == 0 || seen.features_used >= seen.features_rejected));
    refused += seen.features_used == 0 ? 1 : 0;
  }
  CHECK(refused > 5);
  CHECK(run.back().dp_W.norm() < 0.05);
}

TEST_CASE("filter: biases learned at rest are less certain once the vehicle moves and shakes") {
  const simulator::Simulation simulation = simulate("flat1", 4.0);
  Filter filter(FilterConfig{}, simulation.calibration());
  double at_rest = 0.0, moving = 0.0;  // [rad/s] of the gyroscope, last at rest and first in motion
  for (const EvaluatedEstimate& e : run_filter(filter, simulation)) {
    const double sigma = std::sqrt(e.estimate.covariance(estimate_error::gyro_bias, estimate_error::gyro_bias));
    if (e.estimate.frame.standing) at_rest = sigma;
    if (!e.estimate.frame.standing && at_rest > 0.0 && moving == 0.0) moving = sigma;
  }
  REQUIRE(at_rest > 0.0);
  REQUIRE(moving > 0.0);
  CHECK(moving > 1.1 * at_rest);
  CHECK(moving < std::hypot(at_rest, 6e-4));
}

TEST_CASE("filter: follows a drive, with both cameras and with one") {
  const simulator::Simulation simulation = simulate("flat1", 25.0);
  Filter stereo(FilterConfig{}, simulation.calibration());
  CHECK(largest_error(run_filter(stereo, simulation)) < 0.05);
  Filter mono(FilterConfig{}, simulation.calibration());
  const auto without_right = [](FeatureFrame& frame) {
    for (FeatureObservation& feature : frame.features) feature.has_right = false;
  };
  CHECK(largest_error(run_filter(mono, simulation, without_right)) < 0.5);
}

TEST_CASE("filter: learns the calibration, and leaves it alone where it is frozen") {
  const simulator::Simulation simulation = simulate("flat1", 30.0, false);
  const Eigen::Isometry3d T_true = simulation.true_calibration().cameras[0].T_BC;
  const Eigen::Isometry3d T_told = simulation.calibration().cameras[0].T_BC;
  const double offset_true = simulation.true_calibration().camera_time_offset;
  const auto angle_to_truth = [&](const Eigen::Matrix3d& R) { return log_so3(R * T_true.linear().transpose()).norm(); };

  // Camera and gyroscope show how they are turned against each other. Which of them is turned against the accelerometer
  // is known as well as the gyroscope's axes are.
  for (const auto& [gyro_axes, share] : {std::pair{FilterConfig{}.prior.gyro_scale, 0.7}, std::pair{1e-4, 0.5}}) {
    FilterConfig config;
    config.prior.gyro_scale = gyro_axes;
    CAPTURE(config.prior.gyro_scale);
    Filter learning(config, simulation.calibration());
    run_filter(learning, simulation);
    CHECK(angle_to_truth(learning.ekf().state().camera.T_BC0.R) < share * angle_to_truth(T_told.linear()));
    CHECK(std::abs(learning.ekf().state().camera.time_offset - offset_true) < 0.5e-3);
  }

  FilterConfig frozen_config;
  frozen_config.online_calibration.camera_extrinsics = false;
  frozen_config.online_calibration.time_offset = false;
  Filter frozen(frozen_config, simulation.calibration());
  run_filter(frozen, simulation);
  CHECK((frozen.ekf().state().camera.T_BC0.R - T_told.linear()).norm() < 1e-9);
  CHECK(frozen.ekf().state().camera.time_offset == simulation.calibration().camera_time_offset);
}

TEST_CASE("filter: finds out how late the encoders are, unless that is frozen") {
  const simulator::Simulation simulation = simulate("flat1", 30.0);
  const auto offset = [&](double late, bool learned) {
    FilterConfig config;
    config.online_calibration.encoder_time_offset = learned;
    Filter filter(config, simulation.calibration());
    experiments::ReplayOptions options;
    options.change_encoder = [late](EncoderSample sample) {
      sample.t_ns = later_by(late, sample.t_ns);
      return sample;
    };
    experiments::replay(
        simulation, filter, [](TimeNs, const Estimate&) {}, options);
    return filter.ekf().state().odometer.time_offset;
  };
  CHECK(std::abs(offset(0.0, true)) < 1.5e-3);
  CHECK(std::abs(offset(0.03, true) + 0.03) < 4e-3);  // 15 standard deviations of the prior: it is drawn to that
  CHECK(std::abs(offset(-0.02, true) - 0.02) < 3e-3);
  CHECK(offset(0.03, false) == 0.0);
}

TEST_CASE("filter: swaying in place it stays where it is, by camera and IMU alone") {
  // The features of the first clones end long before the swaying does: the window must follow them.
  const simulator::Simulation simulation = simulate("sway1", 36.0);
  FilterConfig config;
  config.odometer.model = OdometerModel::none;
  Filter filter(config, simulation.calibration());
  CHECK(largest_error(run_filter(filter, simulation)) < 0.03);
}

TEST_CASE("filter: swaying in view of the same features all the time it stays where it is") {
  // No feature ends, and the newest frames are alike: nothing but hunger makes the window use what it has. Without it
  // the error is 6 m.
  simulator::Options options;
  options.sequence = "sway3";
  options.seed = 8102;
  options.calibration_error = 0.0;
  options.track.mean_life = 1e6;
  const simulator::Simulation simulation(options);
  FilterConfig config;
  config.odometer.model = OdometerModel::none;
  Filter filter(config, simulation.calibration());
  CHECK(largest_error(run_filter(filter, simulation)) < 0.05);
}

TEST_CASE("filter: turning on the spot does not push the translation out of the window") {
  // All frames at one place, turning: most clones before the turn are still there. As no feature ends here, hunger
  // takes one each 0.4 s.
  const simulator::Simulation simulation = simulate("flat1", 12.0);
  Filter filter(FilterConfig{}, simulation.calibration());
  run_filter(filter, simulation);
  const std::vector<Clone> before = filter.ekf().state().clones;
  FeatureFrame frame = simulation.tracks(simulation.frame_times().size() - 1);
  ImuSample sample = simulation.imu().back();
  for (int i = 0; i < 40; ++i) {  // 1.3 s at 0.5 rad/s to the left
    for (int k = 0; k < 7; ++k) {
      sample.t_ns += 4'714'286;
      sample.gyro_B = filter.ekf().state().imu.b_g + Eigen::Vector3d(0.0, 0.0, 0.5);
      sample.accel_B = filter.ekf().state().imu.R_WB.transpose() * -kGravity_W + filter.ekf().state().imu.b_a;
      filter.add_imu(sample);
    }
    frame.t_ns += 33'000'000;
    const Eigen::Matrix3d R_BC = simulation.calibration().cameras[0].T_BC.linear();
    const Eigen::Matrix3d R_C1C0 = R_BC.transpose() * exp_so3({0.0, 0.0, -0.5 * 0.033}) * R_BC;
    for (FeatureObservation& feature : frame.features) {
      feature.left = Eigen::Vector3d(R_C1C0 * feature.left.homogeneous()).hnormalized();
      feature.has_right = false;
    }
    REQUIRE(filter.process(frame));
  }
  const auto kept = [&](std::uint64_t number) {
    for (const Clone& clone : filter.ekf().state().clones) {
      if (clone.frame == number) return true;
    }
    return false;
  };
  CHECK(kept(before[4].frame));
  CHECK(kept(before[before.size() / 2].frame));
}

TEST_CASE("filter: the same input gives the same bits") {
  const simulator::Simulation simulation = simulate("fly1", 8.0, false);
  Filter a(FilterConfig{}, simulation.calibration());
  Filter b(FilterConfig{}, simulation.calibration());
  const auto run_a = run_filter(a, simulation);
  const auto run_b = run_filter(b, simulation);
  REQUIRE(run_a.size() == run_b.size());
  CHECK(run_a.back().estimate.state.p_WB == run_b.back().estimate.state.p_WB);
  CHECK(run_a.back().estimate.covariance == run_b.back().estimate.covariance);
}

TEST_CASE("filter: predict carries the state on at the IMU's rate") {
  const simulator::Simulation simulation = simulate("flat1", 10.0);
  Filter filter(FilterConfig{}, simulation.calibration());
  CHECK_FALSE(filter.predict(0));
  const auto run = run_filter(filter, simulation);
  const NavState& last = run.back().estimate.state;
  const std::optional<NavState> same = filter.predict(last.t_ns);
  const std::optional<NavState> later = filter.predict(last.t_ns + 5'000'000);
  REQUIRE(same);
  REQUIRE(later);
  CHECK((same->p_WB - last.p_WB).norm() == 0.0);
  CHECK(later->t_ns == last.t_ns + 5'000'000);
  CHECK((later->p_WB - last.p_WB - 0.005 * last.v_W).norm() < 1e-4);
}

TEST_CASE("filter: samples that are not numbers, late or twice are refused and counted") {
  const simulator::Simulation simulation = simulate("flat1", 1.0);
  Filter filter(FilterConfig{}, simulation.calibration());
  ImuSample sample = simulation.imu().front();
  filter.add_imu(sample);
  filter.add_imu(sample);  // twice
  sample.t_ns -= 1;
  filter.add_imu(sample);  // late
  sample.t_ns += 10'000'000;
  sample.gyro_B.x() = std::numeric_limits<double>::quiet_NaN();
  filter.add_imu(sample);
  sample.gyro_B.x() = 0.0;
  sample.accel_B.z() = std::numeric_limits<double>::infinity();
  filter.add_imu(sample);
  CHECK(filter.input_counts().imu.accepted == 1);
  CHECK(filter.input_counts().imu.not_later == 2);
  CHECK(filter.input_counts().imu.not_finite == 2);
  CHECK(filter.input_counts().imu.gaps == 0);
}

TEST_CASE("filter: wild observations do no harm") {
  const simulator::Simulation simulation = simulate("flat1", 20.0);
  Filter filter(FilterConfig{}, simulation.calibration());
  std::size_t frames = 0;
  const auto wild = [&](FeatureFrame& frame) {
    ++frames;
    for (FeatureObservation& feature : frame.features) {
      if ((feature.id + frames) % 40 == 0) feature.left.x() += 0.1;  // 40 px off, now and then
      if (feature.id % 50 == 1) feature.left.y() = std::numeric_limits<double>::quiet_NaN();
    }
  };
  const auto run = run_filter(filter, simulation, wild);
  REQUIRE(run.size() > 500);
  CHECK(largest_error(run) < 0.1);
  for (const EvaluatedEstimate& e : run) {
    REQUIRE(e.estimate.state.p_WB.allFinite());
    REQUIRE(e.estimate.covariance.allFinite());
  }
  using Solver = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
  CHECK(Solver(filter.ekf().covariance().matrix()).eigenvalues().minCoeff() > -1e-9);
}

TEST_CASE("filter: an unknown focal length counts as a baseline that is less well known, where none states its error") {
  const simulator::Simulation simulation = simulate("flat1", 3.0);
  Calibration calibration = simulation.calibration();
  const PriorConfig prior;
  const auto sigma = [&](double focal_length) {
    FilterConfig config;
    config.prior.focal_length = focal_length;
    Filter filter(config, calibration);
    run_filter(filter, simulation);
    return Eigen::Vector3d(filter.ekf().covariance().matrix().diagonal().segment<3>(err::stereo + 3).cwiseSqrt());
  };
  const double baseline =
      (calibration.cameras[1].T_BC.translation() - calibration.cameras[0].T_BC.translation()).norm();
  const double along = std::hypot(prior.stereo_position, prior.focal_length * baseline);
  const auto near = [](double value, double expected) { return std::abs(value / expected - 1.0) < 0.12; };
  const double lenses = std::sqrt(0.5) * prior.focal_length * baseline;  // as far as the mean of both is wrong
  CHECK(near(sigma(prior.focal_length).x(), std::hypot(along, lenses)));
  CHECK(near(sigma(prior.focal_length).y(), prior.stereo_position));
  CHECK(near(sigma(0.0).x(), prior.stereo_position));
  calibration.cameras[1].pose_sigma = PoseSigma{prior.stereo_rotation, 3e-5};
  CHECK(near(sigma(prior.focal_length).x(), std::hypot(3e-5, lenses)));
  for (CameraCalibration& camera : calibration.cameras) camera.intrinsics_sigma = IntrinsicsSigma{1e-3, 0.1};
  CHECK(near(sigma(prior.focal_length).x(), 3e-5));
}

TEST_CASE("filter: lenses that a calibration did not show keep their prior, others are as well known as stated") {
  const simulator::Simulation simulation = simulate("static", 3.0);  // where only what both lenses differ by shows
  Calibration calibration = simulation.calibration();
  calibration.cameras[1].pose_sigma = PoseSigma{1e-4, 3e-5};
  const auto within = [&](double focal_length) {
    Filter filter(FilterConfig{}, calibration);
    run_filter(filter, simulation);
    for (int camera = 0; camera < 2; ++camera) {
      const int at = err::lens(camera);
      const double sigma = std::sqrt(filter.ekf().covariance().matrix()(at, at));
      CAPTURE(sigma);
      CHECK(sigma > 0.5 * focal_length);
      CHECK(sigma < 1.01 * focal_length);
    }
  };
  within(PriorConfig{}.focal_length);
  for (CameraCalibration& camera : calibration.cameras) camera.intrinsics_sigma = IntrinsicsSigma{0.02, 0.01};
  within(0.02 / calibration.cameras[0].fu);
}

TEST_CASE("filter: a gap in the inertial data is counted and survived") {
  const simulator::Simulation simulation = simulate("flat1", 15.0);
  Filter filter(FilterConfig{}, simulation.calibration());
  struct WithGap {
    Filter& filter;
    TimeNs start;
    void add_imu(const ImuSample& sample) {
      const double t = seconds_between(start, sample.t_ns);
      if (t < 8.0 || t > 8.2) filter.add_imu(sample);
    }
    void add_encoder(const EncoderSample& sample) { filter.add_encoder(sample); }
    void add_laser(const LaserSample& sample) { filter.add_laser(sample); }
  };
  WithGap receiver{filter, simulation.imu().front().t_ns};
  experiments::SampleFeed feed(simulation);
  std::optional<Estimate> estimate;
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    feed.until_frame(simulation.frame_times()[i], receiver);
    estimate = filter.process(simulation.tracks(i));
  }
  CHECK(filter.input_counts().imu.gaps == 1);
  REQUIRE(estimate);
  const simulator::Truth truth = simulation.truth(estimate->state.t_ns);
  CHECK((estimate->state.v_W.norm() - truth.v_W.norm()) < 0.1);
}

TEST_CASE("filter: frames wait for inertial samples that a driver holds back, and little is lost") {
  const simulator::Simulation simulation = simulate("fly1", 12.0, false);
  const TimeNs first_ns = simulation.frame_times().front();
  FilterConfig config;
  config.odometer.model = OdometerModel::none;
  struct Driver {
    Filter& filter;
    TimeNs from_ns, to_ns;
    std::vector<ImuSample> held;
    void add_imu(const ImuSample& sample) {
      held.push_back(sample);
      if (sample.t_ns > from_ns && sample.t_ns < to_ns) return;
      for (const ImuSample& each : held) filter.add_imu(each);
      held.clear();
    }
    void add_encoder(const EncoderSample&) {}
    void add_laser(const LaserSample&) {}
  };
  const auto run = [&](double held_up, int& refused) {
    Filter filter(config, simulation.calibration());
    const TimeNs from_ns = first_ns + 8'000'000'000;
    Driver driver{filter, from_ns, from_ns + static_cast<TimeNs>(1e9 * held_up), {}};
    experiments::SampleFeed feed(simulation);
    std::optional<Estimate> estimate;
    for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
      const TimeNs t_ns = simulation.frame_times()[i];
      feed.until_frame(t_ns, driver);
      refused += filter.check_stamp(t_ns) == FrameStamp::no_samples ? 1 : 0;
      estimate = filter.process(simulation.tracks(i));
    }
    REQUIRE(estimate);
    return *estimate;
  };
  int refused_before = 0, refused = 0;
  const Estimate before = run(0.0, refused_before);
  const Estimate estimate = run(0.45, refused);
  CHECK(refused_before == 0);
  CHECK(refused > 4);
  const Eigen::Vector3d dp_W = estimate.state.p_WB - before.state.p_WB;
  const Eigen::Matrix3d P = before.covariance.block<3, 3>(estimate_error::position, estimate_error::position);
  CHECK(dp_W.norm() < 0.1 * std::sqrt(P.trace()));  // 0.03; 0.15 if they do not wait
}

TEST_CASE("filter: settings and calibrations that cannot be are refused by name") {
  const simulator::Simulation simulation = simulate("flat1", 0.5);
  FilterConfig config;
  config.window = 1;
  CHECK_THROWS_WITH_AS(Filter(config, simulation.calibration()), "filter.window: at least 3 clones are needed",
                       std::invalid_argument);
  Calibration calibration = simulation.calibration();
  calibration.cameras[0].T_BC.linear() *= 1.1;
  CHECK_THROWS_AS(Filter(FilterConfig{}, calibration), std::invalid_argument);
  calibration.cameras.clear();
  CHECK_NOTHROW(Filter(FilterConfig{}, calibration));  // wheels are enough
  calibration.encoder->track_width = 0.0;
  CHECK_THROWS_AS(Filter(FilterConfig{}, calibration), std::invalid_argument);
  calibration.encoder.reset();
  CHECK_THROWS_AS(Filter(FilterConfig{}, calibration), std::invalid_argument);
}

TEST_CASE("filter: wheels and lasers whose stamps are off by what the calibration says give the same estimates") {
  const simulator::Simulation simulation = simulate("wave1", 15.0, false);
  const auto run = [&](TimeNs encoder_ns, TimeNs laser_ns, double encoder_offset, double laser_offset) {
    Calibration calibration = simulation.calibration();
    calibration.encoder->time_offset = encoder_offset;
    calibration.lasers->time_offset = laser_offset;
    Filter filter(FilterConfig{}, calibration);
    experiments::ReplayOptions options;
    options.change_encoder = [&](EncoderSample sample) {
      sample.t_ns += encoder_ns;
      return sample;
    };
    options.change_laser = [&](LaserSample sample) {
      sample.t_ns += laser_ns;
      return sample;
    };
    std::vector<Estimate> estimates;
    const auto keep = [&](TimeNs /*stamp_ns*/, const Estimate& estimate) { estimates.push_back(estimate); };
    experiments::replay(simulation, filter, keep, options);
    CHECK(filter.input_counts().encoder.accepted > 1000);
    CHECK(filter.input_counts().laser.accepted > 500);
    return estimates;
  };
  const auto equal = [](const std::vector<Estimate>& a, const std::vector<Estimate>& b) {
    bool same = a.size() == b.size();
    for (std::size_t i = 0; same && i < a.size(); ++i) {
      same = a[i].state.p_WB == b[i].state.p_WB && a[i].state.q_WB.coeffs() == b[i].state.q_WB.coeffs() &&
             a[i].covariance == b[i].covariance && a[i].terrain.slope_along == b[i].terrain.slope_along;
    }
    return same;
  };
  const std::vector<Estimate> plain = run(0, 0, 0.0, 0.0);
  REQUIRE(plain.size() > 300);
  CHECK(plain.back().terrain.known);
  CHECK(equal(run(50'000'000, 0, -0.05, 0.0), plain));
  CHECK(equal(run(-50'000'000, 0, 0.05, 0.0), plain));
  CHECK(equal(run(0, 50'000'000, 0.0, -0.05), plain));
  CHECK(equal(run(-3'500'000'000'000, 20'000'000, 3500.0, -0.02), plain));
  CHECK_FALSE(equal(run(50'000'000, 0, 0.0, 0.0), plain));
  CHECK_FALSE(equal(run(0, 50'000'000, 0.0, 0.0), plain));
}
