// Numbers and stamps that cannot be, stream by stream: refused, counted by reason, and without harm to the estimate.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "ear/odometry.h"
#include "filter/filter.h"
#include "tests/support/tapped_run.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr TimeNs kMax = std::numeric_limits<TimeNs>::max();
constexpr TimeNs kMin = std::numeric_limits<TimeNs>::min();
constexpr TimeNs kHour = 3'600'000'000'000;

const simulator::Simulation& drive() {
  static const simulator::Simulation kSimulation = [] {
    simulator::Options options;
    options.sequence = "flat1";
    options.seed = 8102;
    options.duration = 14.0;
    return simulator::Simulation(options);
  }();
  return kSimulation;
}

struct Outcome {
  InputCounts counts;
  int resets = 0;
  std::size_t estimates = 0;
  double speed_error = 0.0;  ///< at the end [m/s]
  double way_error = 0.0;    ///< at the end, of the distance from the start [m]
};

Outcome outcome(const Taps& taps) {
  Filter filter(FilterConfig{}, drive().calibration());
  Outcome result;
  std::optional<Estimate> last;
  run_tapped(drive(), filter, taps, [&](double, const std::optional<Estimate>& estimate) {
    if (!estimate) return;
    REQUIRE(estimate->state.p_WB.allFinite());
    REQUIRE(estimate->covariance.allFinite());
    REQUIRE(estimate->covariance.diagonal().minCoeff() > 0.0);
    last = estimate;
    ++result.estimates;
  });
  REQUIRE(last);
  result.counts = filter.input_counts();
  result.resets = filter.health().reset_counter;
  const simulator::Truth truth = drive().truth(last->state.t_ns);
  const simulator::Truth start = drive().truth(drive().deliveries().front().arrival_ns);
  result.speed_error = std::abs(last->state.v_W.norm() - truth.v_W.norm());
  result.way_error = std::abs(last->state.p_WB.norm() - (truth.p_WB - start.p_WB).norm());
  return result;
}

/// Within 50 ms from 8 s on, while it drives.
bool now(double t) { return t >= 8.0 && t < 8.05; }

void check_unharmed(const Outcome& o) {
  CHECK(o.estimates > 350);
  CHECK(o.speed_error < 0.03);
  CHECK(o.way_error < 0.05);
  CHECK(o.resets == 0);
}

}  // namespace

TEST_CASE("bad input: none, and nothing is refused") {
  const Outcome o = outcome({});
  check_unharmed(o);
  CHECK(o.counts.imu.accepted == drive().imu().size());
  CHECK(o.counts.encoder.accepted == drive().encoders().size());
  CHECK(o.counts.laser.accepted == drive().lasers().size());
  for (const StreamCounts& counts : {o.counts.imu, o.counts.encoder, o.counts.laser}) {
    CHECK(counts.rejected() == 0);
    CHECK(counts.gaps == 0);
  }
  CHECK(o.counts.features_rejected == 0);
}

TEST_CASE("bad input: inertial samples") {
  using Change = std::function<int(double, ImuSample&)>;
  const auto with = [](const Change& change) {
    Taps taps;
    taps.imu = [change](double t, ImuSample& s) { return now(t) ? change(t, s) : 1; };
    const Outcome o = outcome(taps);
    check_unharmed(o);
    return o.counts.imu;
  };
  CHECK(with([](double, ImuSample& s) { return s.gyro_B.x() = kNaN, 1; }).not_finite == 10);
  CHECK(with([](double, ImuSample& s) { return s.accel_B.z() = -kInf, 1; }).not_finite == 10);
  CHECK(with([](double, ImuSample& s) { return s.accel_B *= 1000.0, 1; }).implausible == 10);  // mm/s^2
  CHECK(with([](double, ImuSample& s) { return s.gyro_B.y() = 1e300, 1; }).implausible == 10);
  CHECK(with([](double, ImuSample& s) { return s.t_ns = kMax, 1; }).implausible == 10);
  CHECK(with([](double, ImuSample& s) { return s.t_ns = kMin, 1; }).implausible == 10);
  CHECK(with([](double, ImuSample&) { return 2; }).not_later == 10);
  CHECK(with([](double, ImuSample& s) { return s.t_ns -= kHour, 1; }).not_later == 10);
  CHECK(with([](double t, ImuSample& s) { return s.t_ns += t < 8.004 ? kHour : 0, 1; }).far_ahead == 1);
  CHECK(with([](double, ImuSample&) { return 0; }).gaps == 1);
}

TEST_CASE("bad input: wheel encoders") {
  const auto with = [](const std::function<int(double, EncoderSample&)>& change) {
    Taps taps;
    taps.encoder = change;
    const Outcome o = outcome(taps);
    check_unharmed(o);
    return o.counts.encoder;
  };
  CHECK(with([](double t, EncoderSample& s) { return s.t_ns += now(t) ? kHour : 0, 1; }).far_ahead > 2);
  CHECK(with([](double t, EncoderSample& s) { return s.t_ns -= now(t) ? kHour : 0, 1; }).not_later > 2);
  CHECK(with([](double t, EncoderSample& s) { return s.t_ns = now(t) ? kMin : s.t_ns, 1; }).implausible > 2);
  CHECK(with([](double t, EncoderSample& s) { return s.left_count = now(t) ? kMax : s.left_count, 1; }).implausible >
        2);
  CHECK(with([](double t, EncoderSample&) { return now(t) ? 3 : 1; }).not_later > 4);
  CHECK(with([](double t, EncoderSample&) { return t > 7.0 && t < 9.0 ? 0 : 1; }).gaps == 1);
  // A first reading from the future: the next ones count nevertheless.
  bool first = true;
  const StreamCounts future = with([&first](double, EncoderSample& s) {
    s.t_ns += first ? kHour : 0;
    first = false;
    return 1;
  });
  CHECK(future.accepted >= drive().encoders().size() - 1);
}

TEST_CASE("bad input: lasers") {
  const auto with = [](const std::function<int(double, LaserSample&)>& change) {
    Taps taps;
    taps.laser = [change](double t, LaserSample& s) { return now(t) ? change(t, s) : 1; };
    const Outcome o = outcome(taps);
    check_unharmed(o);
    return o.counts.laser;
  };
  CHECK(with([](double, LaserSample& s) { return s.range[1] = kInf, 1; }).not_finite > 1);
  CHECK(with([](double, LaserSample& s) { return s.range[0] = -0.2, 1; }).implausible > 1);
  CHECK(with([](double, LaserSample& s) { return s.range[0] = 1e4, 1; }).implausible > 1);
  CHECK(with([](double, LaserSample& s) { return s.range.clear(), 1; }).implausible > 1);
  CHECK(with([](double, LaserSample& s) { return s.range.resize(40, 0.1), 1; }).implausible > 1);
  CHECK(with([](double, LaserSample& s) { return s.range[2] = kNaN, 1; }).rejected() == 0);  // no return
  CHECK(with([](double, LaserSample& s) { return s.t_ns += kHour, 1; }).far_ahead > 1);
  CHECK(with([](double, LaserSample&) { return 2; }).not_later > 1);
}

TEST_CASE("bad input: features and the stamps of frames") {
  const auto with = [](const std::function<int(double, FeatureFrame&)>& change) {
    Taps taps;
    taps.frame = [change](double t, FeatureFrame& f) { return t > 8.0 && t < 8.3 ? change(t, f) : 1; };
    const Outcome o = outcome(taps);
    check_unharmed(o);
    return o.counts.features_rejected;
  };
  CHECK(with([](double, FeatureFrame& f) { return f.features.at(0).left.x() = kNaN, 1; }) == 9);
  CHECK(with([](double, FeatureFrame& f) { return f.features.at(0).left.y() = -kInf, 1; }) == 9);
  CHECK(with([](double, FeatureFrame& f) { return f.features.at(0).left.y() = 400.0, 1; }) == 9);  // pixels
  CHECK(with([](double, FeatureFrame& f) { return f.features.at(1).id = f.features.at(0).id, 1; }) == 18);
  CHECK(with([](double, FeatureFrame& f) { return f.t_ns = kMax, 1; }) == 0);
  CHECK(with([](double, FeatureFrame& f) { return f.t_ns = kMin, 1; }) == 0);
  CHECK(with([](double, FeatureFrame& f) { return f.t_ns += kHour, 1; }) == 0);
  CHECK(with([](double, FeatureFrame& f) { return f.t_ns -= kHour, 1; }) == 0);
  CHECK(with([](double, FeatureFrame&) { return 3; }) == 0);
}

TEST_CASE("bad input: one camera sees nothing in a right image") {
  const auto rejected_with = [](std::size_t cameras) {
    Calibration calibration = drive().calibration();
    calibration.cameras.resize(cameras);
    Filter filter(FilterConfig{}, calibration);
    FeatureFrame frame{1'000'000'000, {}};
    frame.features.resize(2);
    frame.features[0].id = 1;
    frame.features[1].has_right = true;
    filter.add_imu({frame.t_ns, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
    (void)filter.process(frame);
    return filter.input_counts().features_rejected;
  };
  CHECK(rejected_with(2) == 0);
  CHECK(rejected_with(1) == 1);
}

TEST_CASE("bad input: an accelerometer in units of g starts nothing") {
  Filter filter(FilterConfig{}, drive().calibration());
  Taps taps;
  taps.imu = [](double, ImuSample& s) { return s.accel_B /= 9.81, 1; };
  taps.encoder = [](double, EncoderSample&) { return 0; };
  run_tapped(drive(), filter, taps, [](double, const std::optional<Estimate>& e) { CHECK_FALSE(e); });
  CHECK(filter.status() == Status::waiting_for_standstill);
}

TEST_CASE("bad input: times that are none are asked for in vain") {
  Odometry odometry(Config{}, drive().calibration());
  for (const TimeNs t_ns : {kMin, kMax}) {
    CHECK_FALSE(odometry.step(t_ns));
    CHECK_FALSE(odometry.predict(t_ns));
    StereoFrame frame;
    frame.t_ns = t_ns;
    CHECK_FALSE(odometry.add_stereo(frame));
  }
  CHECK(odometry.input_counts().camera.implausible == 2);
  CHECK(odometry.input_counts().steps_rejected == 2);
}

TEST_CASE("bad input: images that do not fit, or have no pixels, are refused and counted") {
  Odometry odometry(Config{}, drive().calibration());
  ImuSample sample;
  sample.t_ns = 1'000'000'000;
  sample.accel_B.z() = 9.81;
  odometry.add_imu(sample);
  const CameraCalibration& camera = drive().calibration().cameras.front();
  const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width * camera.height), 100);
  StereoFrame frame;
  frame.t_ns = 900'000'000;
  CHECK_FALSE(odometry.add_stereo(frame));  // empty
  frame.left = {pixels.data(), 16, 16, 16};
  CHECK_FALSE(odometry.add_stereo(frame));
  frame.left = {pixels.data(), camera.width, camera.height, camera.width - 1};
  CHECK_FALSE(odometry.add_stereo(frame));
  frame.left = {nullptr, camera.width, camera.height, camera.width};
  CHECK_FALSE(odometry.add_stereo(frame));
  CHECK(odometry.input_counts().camera.implausible == 4);
  CHECK(odometry.input_counts().camera.accepted == 0);
}

TEST_CASE("bad input: a clock that jumps before any sample was accepted is no fault of those that come later") {
  Filter filter(FilterConfig{}, drive().calibration());
  TimeNs t_ns = kHour;
  const auto add = [&](int count, TimeNs jump_ns, double rate) {
    for (int i = 0; i < count; ++i, t_ns += 5'000'000) {
      filter.add_imu({t_ns + jump_ns, {rate, 0.0, 0.0}, {0.0, 0.0, 9.81}});
      filter.add_encoder({t_ns, 0, 0});
    }
  };
  add(400, 0, kNaN);
  add(100, 200'000'000, kNaN);
  CHECK(filter.input_counts().clock_jumps == 1);
  add(100, 200'000'000, 0.0);
  filter.process(FeatureFrame{filter.camera_time(t_ns - 5'000'000), {}});
  CHECK_FALSE(filter.health().faulty[index_of(Source::gyroscope)]);
}
