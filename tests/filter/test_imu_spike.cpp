// Spikes of one to five samples are found and crossed by a line; strikes, turns and vibration are not taken for them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "filter/ingest/ingest.h"
#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

namespace {

constexpr double kGravity = 9.81;

/// A body at rest, to whose samples something is added.
class Stream {
 public:
  explicit Stream(double rate_hz = 200.0) : rate_(rate_hz), ingest_(FilterConfig{}, calibration(rate_hz)) {}

  double dt() const { return 1.0 / rate_; }
  const ImuBuffer& samples() const { return ingest_.imu(); }
  std::uint64_t spikes() const { return ingest_.counts().imu_spikes; }
  double white_accel() const { return ingest_.white_accel(); }
  bool in_doubt() const { return ingest_.waits_for_imu(t_ns_); }
  double gyro_sigma() const { return ImuCalibration{}.gyro_noise * std::sqrt(rate_); }

  ImuFault add(const Eigen::Vector3d& rate_B = Eigen::Vector3d::Zero(),
               const Eigen::Vector3d& force_B = Eigen::Vector3d::Zero()) {
    t_ns_ += std::llround(1e9 / rate_);
    const Eigen::Vector3d rest_B(0.0, 0.0, kGravity);
    return store(rate_B + random(gyro_sigma()),
                 rest_B + force_B + random(ImuCalibration{}.accel_noise * std::sqrt(rate_)));
  }
  /// Of the accelerometer, without noise.
  void add_exactly(const Eigen::Vector3d& accel_B) {
    t_ns_ += std::llround(1e9 / rate_);
    store(random(gyro_sigma()), accel_B);
  }
  /// So many samples do not come.
  void lose(int count) { t_ns_ += count * std::llround(1e9 / rate_); }
  void rest(double seconds) {
    for (double t = 0.0; t < seconds; t += dt()) CHECK_FALSE(add().any());
  }
  Eigen::Vector3d random(double sigma) {
    std::normal_distribution<double> normal(0.0, sigma);
    const double x = normal(rng_), y = normal(rng_), z = normal(rng_);
    return {x, y, z};
  }
  /// Largest of the last samples' rates, and deviations from gravity.
  std::pair<double, double> largest(std::size_t count) const {
    double rate = 0.0, force = 0.0;
    for (std::size_t i = samples().size() - count; i < samples().size(); ++i) {
      rate = std::max(rate, samples()[i].gyro_B.norm());
      force = std::max(force, (samples()[i].accel_B - Eigen::Vector3d(0.0, 0.0, kGravity)).norm());
    }
    return {rate, force};
  }
  /// Largest factors on the noise between the last samples, of which `count` are inside.
  ImuNoiseFactors largest_noise(int count) const {
    ImuNoiseFactors largest{0.0, 0.0};
    const TimeNs from_ns = samples()[samples().size() - 2 - static_cast<std::size_t>(count)].t_ns;
    samples().for_each_piece(from_ns, samples().newest().t_ns,
                             [&](const Eigen::Vector3d&, const Eigen::Vector3d&, double, const ImuNoiseFactors& noise) {
                               largest = {std::max(largest.gyro, noise.gyro), std::max(largest.accel, noise.accel)};
                             });
    return largest;
  }

 private:
  ImuFault store(const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B) {
    const ImuSample sample{t_ns_, gyro_B, accel_B};
    return ingest_.store(sample, ingest_.judge(sample, true));
  }
  static Calibration calibration(double rate_hz) {
    Calibration calibration;
    calibration.imu.rate_hz = rate_hz;
    return calibration;
  }

  double rate_;
  Ingest ingest_;
  std::mt19937_64 rng_{29};
  TimeNs t_ns_ = 0;
};

const Eigen::Vector3d kTurn(2.0, -1.5, 1.0);       // [rad/s]
const Eigen::Vector3d kForce(-20.0, 30.0, -15.0);  // [m/s^2]
const Eigen::Vector3d kNone = Eigen::Vector3d::Zero();

}  // namespace

TEST_CASE("imu spike: one to five samples of either sensor or of both are replaced, at 50 to 1000 Hz") {
  for (const double rate_hz : {50.0, 100.0, 200.0, 400.0, 1000.0}) {
    for (const bool gyro : {false, true}) {
      for (const bool accel : {false, true}) {
        for (std::size_t length = 1; length <= 5; ++length) {
          if (!gyro && !accel) continue;
          CAPTURE(rate_hz);
          CAPTURE(gyro);
          CAPTURE(accel);
          CAPTURE(length);
          Stream stream(rate_hz);
          stream.rest(1.0);
          for (std::size_t i = 0; i < length; ++i) {
            CHECK_FALSE(stream.add(gyro ? kTurn : kNone, accel ? kForce : kNone).any());
          }
          const ImuFault fault = stream.add();
          CHECK(fault.gyro == gyro);
          CHECK(fault.accel == accel);
          CHECK(stream.spikes() == 1);
          CHECK(stream.largest(8).first < 6.0 * stream.gyro_sigma());
          CHECK(stream.largest(8).second < 2.0);
          stream.rest(0.5);
        }
      }
    }
  }
}

TEST_CASE("imu spike: until its end is seen, the rate before it is held, with all of the deviation as noise") {
  Stream stream;
  stream.rest(1.0);
  for (int i = 0; i < 5; ++i) {
    stream.add(kTurn);
    CHECK(stream.largest(1).first < 0.1);
    const TimeNs newest_ns = stream.samples().newest().t_ns;
    CHECK(stream.samples().mean_rate(newest_ns - 1'000'000, newest_ns).noise_factor * stream.gyro_sigma() > 2.5);
  }
  stream.add();
  const TimeNs newest_ns = stream.samples().newest().t_ns;
  const MeanRate crossed = stream.samples().mean_rate(newest_ns - 25'000'000, newest_ns);
  CHECK(crossed.noise_factor > 1.0);
  CHECK(crossed.noise_factor < 15.0);  // 0.2 rad/s
}

TEST_CASE("imu spike: a change that lasts is given back, as it was measured, with the sixth sample") {
  Stream stream;
  stream.rest(1.0);
  for (int i = 0; i < 6; ++i) CHECK_FALSE(stream.add(kTurn, kForce).any());
  for (std::size_t i = 1; i <= 6; ++i) {
    const ImuSample& sample = stream.samples()[stream.samples().size() - i];
    CHECK((sample.gyro_B - kTurn).norm() < 0.1);
    CHECK((sample.accel_B - Eigen::Vector3d(0.0, 0.0, kGravity) - kForce).norm() < 1.5);
  }
  for (int i = 0; i < 100; ++i) CHECK_FALSE(stream.add(kTurn, kForce).any());
  CHECK(stream.spikes() == 0);
}

TEST_CASE("imu spike: samples that are lost within one belong to it, up to five") {
  for (const int lost : {1, 5, 6}) {
    CAPTURE(lost);
    Stream stream;
    stream.rest(1.0);
    for (int i = 0; i < 2; ++i) stream.add(kTurn);
    stream.lose(lost);
    stream.add(kTurn);
    CHECK(stream.add().gyro == (lost <= 5));
    CHECK((stream.largest(4).first < 0.1) == (lost <= 5));
  }
}

TEST_CASE("imu spike: it is in doubt until its end") {
  Stream stream;
  stream.rest(1.0);
  CHECK_FALSE(stream.in_doubt());
  for (int i = 0; i < 5; ++i) {
    stream.add(kTurn, kForce);
    CHECK(stream.in_doubt());
  }
  stream.add();
  CHECK_FALSE(stream.in_doubt());
  for (int i = 0; i < 5; ++i) stream.add(kTurn, kForce);
  CHECK(stream.in_doubt());
  stream.add(kTurn, kForce);
  CHECK_FALSE(stream.in_doubt());  // it lasts
}

TEST_CASE("imu spike: what it did does not count as what the body does") {
  for (const double rate_hz : {50.0, 200.0}) {
    for (int length = 1; length <= 5; ++length) {
      CAPTURE(rate_hz);
      CAPTURE(length);
      Stream stream(rate_hz);
      stream.rest(2.0);
      const double white = stream.white_accel();
      for (int i = 0; i < length; ++i) stream.add(kTurn, kForce);
      CHECK(stream.add().gyro);
      // The walk has steps of sqrt(6) of a sample's noise, all axes together: 2 (n + 1)^3 / (12 n) of its variance.
      const double n = length;
      const double expected = std::sqrt(std::pow(n + 1.0, 3) / (6.0 * n));
      CHECK(stream.largest_noise(length).gyro == about(expected, 0.3));
      if (length > 2) CHECK(stream.largest_noise(length).accel == about(expected, 0.3));  // fewer may be a strike's
      CHECK(stream.white_accel() == about(white, 0.1));
    }
  }
}

TEST_CASE(
    "imu spike: equal samples may be those of a strike that is clipped, and keep all of their deviation as noise") {
  // The sum of n with noise of their own has the standard deviation of n deviations.
  Stream stream;
  stream.rest(1.0);
  const Eigen::Vector3d value = kForce + Eigen::Vector3d(0.0, 0.0, kGravity);
  for (int i = 0; i < 4; ++i) stream.add_exactly(value);
  CHECK(stream.add().accel);
  CHECK(stream.largest(5).second < 2.0);
  const double sigma = stream.largest_noise(4).accel * ImuCalibration{}.accel_noise * std::sqrt(200.0);
  CHECK(std::sqrt(4.0) * sigma == about(4.0 * kForce.norm() / std::sqrt(3.0), 0.05));  // of one axis
}

/// Of the turn over so many intervals, of which only the ends were measured, or only the begin: its error's variance
/// over what the buffer says of it. The rate is a random walk.
double variance_ratio(int intervals, bool ends) {
  Stream stream;
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();
  const auto step = [&] { return rate_B += stream.random(0.03); };
  for (int i = 0; i < 200; ++i) stream.add(step());
  double squares = 0.0, stated = 0.0;
  for (int trial = 0; trial < 2000; ++trial) {
    for (int i = 0; i < 20; ++i) stream.add(step());
    const TimeNs from_ns = stream.samples().newest().t_ns;
    Eigen::Vector3d turn = -0.5 * rate_B;
    for (int i = 0; i < intervals; ++i) turn += rate_B, step();
    turn += 0.5 * rate_B;
    const TimeNs to_ns = from_ns + intervals * std::llround(1e9 * stream.dt());
    stream.lose(intervals - 1);
    if (ends) stream.add(rate_B);
    Eigen::Vector3d seen = Eigen::Vector3d::Zero();
    stream.samples().for_each_piece(
        from_ns, to_ns,
        [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt, const ImuNoiseFactors& noise) {
          seen += gyro_B * dt;
          stated += 3.0 * std::pow(noise.gyro * ImuCalibration{}.gyro_noise, 2) * dt;
        });
    squares += (stream.dt() * turn - seen).squaredNorm();
    if (!ends) stream.add(rate_B);
  }
  return squares / stated;
}

TEST_CASE(
    "imu spike: the noise of a gap is that of what moves as before, between both ends or beyond the last sample") {
  // Not exactly: a step across the gap that is more than usual counts as more noise, a part of the noise comes with the
  // sample after, and a few steps are no integral.
  for (const int intervals : {3, 6, 12}) {
    CAPTURE(intervals);
    CHECK(variance_ratio(intervals, true) == about(1.0, 0.25));
    CHECK(variance_ratio(intervals, false) == about(1.0, 0.25));
  }
}

TEST_CASE("imu spike: after lost samples the noise is as before") {
  Stream stream;
  stream.rest(1.0);
  stream.lose(5);
  stream.add();
  stream.rest(0.1);
  const TimeNs newest_ns = stream.samples().newest().t_ns;
  CHECK(stream.samples().mean_rate(newest_ns - 20'000'000, newest_ns).noise_factor == 1.0);
}

TEST_CASE("imu spike: strikes of 10 to 50 ms are not taken for one") {
  for (const double rate_hz : {100.0, 200.0, 400.0, 1000.0}) {
    for (const double duration : {0.02, 0.03, 0.05}) {
      for (const double phase : {0.2, 0.5, 0.8}) {
        CAPTURE(rate_hz);
        CAPTURE(duration);
        CAPTURE(phase);
        Stream stream(rate_hz);
        if (duration < 3.0 * stream.dt()) continue;  // two samples that are alike: the next test
        stream.rest(1.0);
        double left = 0.0;
        for (double t = phase * stream.dt(); t < duration; t += stream.dt()) {
          CHECK_FALSE(stream.add(kNone, {5.0, 0.0, 60.0 * std::sin(M_PI * t / duration)}).any());
        }
        stream.rest(0.3);
        for (std::size_t i = 0; i < stream.samples().size(); ++i) {
          left += stream.dt() * (stream.samples()[i].accel_B.z() - kGravity);
        }
        CHECK(left == about(60.0 * duration * 2.0 / M_PI, 0.15));
      }
    }
  }
}

TEST_CASE(
    "imu spike: one or two samples of the accelerometer that may be a strike keep all of their deviation as noise") {
  const auto share_kept = [](int length, double rate_hz) {  // in the sum
    Stream stream(rate_hz);
    stream.rest(1.0);
    for (int i = 0; i < length; ++i) stream.add(kNone, kForce);
    CHECK(stream.add().accel);
    const double sigma = stream.largest_noise(length).accel * ImuCalibration{}.accel_noise * std::sqrt(rate_hz);
    return std::sqrt(length) * sigma / (length * kForce.norm() / std::sqrt(3.0));  // of one axis
  };
  CHECK(share_kept(1, 50.0) == about(1.0, 0.05));
  CHECK(share_kept(1, 100.0) == about(1.0, 0.05));
  CHECK(share_kept(2, 200.0) == about(1.0, 0.05));
  CHECK(share_kept(1, 200.0) < 0.1);  // a strike of 10 ms has two
  CHECK(share_kept(2, 400.0) < 0.1);
  CHECK(share_kept(3, 50.0) < 0.1);  // that are not alike
}

TEST_CASE("imu spike: fast turns that begin and end smoothly are none, nor is vibration") {
  for (const double rate_hz : {50.0, 100.0, 200.0, 400.0, 1000.0}) {
    CAPTURE(rate_hz);
    Stream stream(rate_hz);
    stream.rest(1.0);
    for (double t = 0.0; t < 4.0; t += stream.dt()) {  // 6 rad/s, up to 57 rad/s^2
      CHECK_FALSE(stream.add({6.0 * std::sin(9.5 * t), 0.0, 0.0}).any());
    }
    stream.rest(0.5);
    for (double t = 0.0; t < 10.0; t += stream.dt()) {  // rotors that speed up for 2 s
      const double share = std::min(1.0, 0.5 * t);
      CHECK_FALSE(stream.add(stream.random(0.3 * share), stream.random(3.0 * share)).any());
    }
    CHECK(stream.spikes() == 0);
  }
}

TEST_CASE("imu spike: it is found in vibration that is smaller") {
  Stream stream;
  for (int i = 0; i < 400; ++i) stream.add(stream.random(0.1), stream.random(1.0));
  for (int i = 0; i < 3; ++i) stream.add(kTurn + stream.random(0.1), kForce + stream.random(1.0));
  CHECK(stream.add(stream.random(0.1), stream.random(1.0)).gyro);
  CHECK(stream.largest(4).first < 0.6);
  CHECK(stream.largest(4).second < 6.0);
}

TEST_CASE("imu spike: the accelerometer's white noise is what two steps in a row share, not the body's motion") {
  for (const double rate : {50.0, 200.0}) {
    CAPTURE(rate);
    for (const double times : {1.0, 4.0}) {
      CAPTURE(times);
      Stream stream(rate);
      const double more = std::sqrt(times * times - 1.0) * ImuCalibration{}.accel_noise * std::sqrt(rate);
      double sum = 0.0, count = 0.0;
      for (double t = 0.0; t < 60.0; t += stream.dt()) {
        const Eigen::Vector3d force(0.3 * std::sin(5.0 * t), 0.5 * std::cos(7.0 * t), 0.0);
        stream.add(kNone, force + stream.random(more));
        if (t < 10.0) continue;
        sum += stream.white_accel();
        count += 1.0;
      }
      CHECK(sum / count == about(times, 0.1 * times));
    }
  }
}
