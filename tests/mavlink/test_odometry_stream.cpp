#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "src/mavlink/odometry_stream.h"

using namespace ear;
using namespace ear::mavlink;

namespace {

constexpr double kImuRate = 200.0;

TimeNs at(double seconds) { return 1'000'000'000'000 + std::llround(1e9 * seconds); }

Estimate estimate_at(double seconds, int tracks = 100) {
  Estimate estimate;
  estimate.state.t_ns = at(seconds);
  estimate.covariance.setIdentity();
  estimate.health.status = HealthStatus::tracking;
  estimate.health.aiding = tracks >= 10 ? Aiding::cameras : Aiding::none;
  estimate.health.quality = std::min(100, std::max(1, 2 * tracks));
  return estimate;
}

OdometryStream make_stream() { return {mounting_of(0.0, 0.0, 0.0), ImuCalibration{}}; }

/// Stamps [s] of what goes out in 10 s, with frames at this rate.
std::vector<double> stamps_sent(double frame_rate) {
  OdometryStream stream = make_stream();
  std::vector<double> sent;
  const auto note = [&](const OdometryMessage& message) {
    sent.push_back(1e-6 * static_cast<double>(message.time_us) - 1000.0);
  };
  int frame = 0;
  for (int i = 0; i < static_cast<int>(10.0 * kImuRate); ++i) {
    const double t = i / kImuRate;
    if (stream.wants_prediction(at(t))) note(stream.add_prediction(estimate_at(t).state));
    if (frame / frame_rate <= t) {  // its image arrives with the first inertial sample after it
      if (const auto message = stream.add_frame(estimate_at(frame / frame_rate), Status::tracking)) note(*message);
      ++frame;
    }
  }
  return sent;
}

}  // namespace

TEST_CASE("mavlink stream: 30 to 50 messages a second, whatever the camera's rate") {
  for (const double rate : {5.0, 10.0, 15.0, 20.0, 25.0, 29.97, 30.0, 45.0, 50.0, 60.0, 90.0}) {
    CAPTURE(rate);
    const std::vector<double> sent = stamps_sent(rate);
    const double sent_rate = static_cast<double>(sent.size() - 1) / (sent.back() - sent.front());
    CHECK(sent_rate > 29.0);
    CHECK(sent_rate < 50.5);
    for (std::size_t i = 1; i < sent.size(); ++i) CHECK(sent[i] > sent[i - 1]);
  }
}

TEST_CASE("mavlink stream: a frame is stamped with its exposure, not with its arrival") {
  OdometryStream stream = make_stream();
  stream.add_imu({at(0.99)});
  stream.add_imu({at(1.004)});
  const auto message = stream.add_frame(estimate_at(1.0), Status::tracking);
  REQUIRE(message);
  CHECK(message->time_us == static_cast<std::uint64_t>(at(1.0)) / 1000);
}

TEST_CASE("mavlink stream: the angular rate is the gyroscope's at the stamp, without its bias") {
  OdometryStream stream = make_stream();
  stream.add_imu({at(0.9), {9.0, 9.0, 9.0}});
  stream.add_imu({at(1.0), {0.0, 0.0, 1.0}});
  stream.add_imu({at(1.1), {0.0, 0.0, 2.0}});
  stream.add_imu({at(1.2), {9.0, 9.0, 9.0}});  // the image took a while to arrive
  Estimate estimate = estimate_at(1.025);
  estimate.state.b_g = {0.0, 0.0, 0.25};
  const auto message = stream.add_frame(estimate, Status::tracking);
  REQUIRE(message);
  CHECK(message->w_V.isApprox(Eigen::Vector3d(0.0, 0.0, -1.0)));
}

TEST_CASE("mavlink stream: nothing before the start") {
  OdometryStream stream = make_stream();
  CHECK_FALSE(stream.add_frame(std::nullopt, Status::waiting_for_standstill));
  CHECK_FALSE(stream.wants_prediction(at(0.1)));
  CHECK(stream.health() == LinkHealth::starting);
}

TEST_CASE("mavlink stream: nothing while lost; what comes after counts as a reset") {
  OdometryStream stream = make_stream();
  const auto first = stream.add_frame(estimate_at(0.0), Status::tracking);
  REQUIRE(first);
  CHECK(first->reset_counter == 0);
  CHECK(stream.health() == LinkHealth::good);
  (void)stream.add_frame(estimate_at(0.1), Status::tracking);
  CHECK(stream.wants_prediction(at(0.14)));

  CHECK_FALSE(stream.add_frame(std::nullopt, Status::waiting_for_standstill));
  CHECK(stream.health() == LinkHealth::lost);
  CHECK_FALSE(stream.wants_prediction(at(0.24)));

  const auto again = stream.add_frame(estimate_at(5.0), Status::tracking);
  REQUIRE(again);
  CHECK(again->reset_counter == 1);
  CHECK(stream.health() == LinkHealth::good);
}

TEST_CASE("mavlink stream: one frame that could not be used is not yet a loss") {
  OdometryStream stream = make_stream();
  (void)stream.add_frame(estimate_at(0.0), Status::tracking);
  CHECK_FALSE(stream.add_frame(std::nullopt, Status::tracking));
  CHECK(stream.health() == LinkHealth::good);
  const auto next = stream.add_frame(estimate_at(0.1), Status::tracking);
  REQUIRE(next);
  CHECK(next->reset_counter == 0);
}

TEST_CASE("mavlink stream: without frames, predictions end") {
  OdometryStream stream = make_stream();
  (void)stream.add_frame(estimate_at(0.0), Status::tracking);
  (void)stream.add_frame(estimate_at(0.1), Status::tracking);
  CHECK(stream.wants_prediction(at(0.15)));
  CHECK_FALSE(stream.wants_prediction(at(0.21)));
  (void)stream.add_frame(estimate_at(3.0), Status::tracking);  // a gap does not make the next one longer
  CHECK(stream.wants_prediction(at(3.1)));
  CHECK_FALSE(stream.wants_prediction(at(3.3)));
}

TEST_CASE("mavlink stream: what inertia alone carries on is lost after a quarter of a second, with wheels it is not") {
  for (const bool wheels : {false, true}) {
    CAPTURE(wheels);
    OdometryStream stream = make_stream();
    CHECK(stream.add_frame(estimate_at(0.0), Status::tracking));
    for (int i = 1; i <= 20; ++i) {
      Estimate blind = estimate_at(0.05 * i, 0);
      if (wheels) blind.health.aiding = Aiding::wheels;
      const bool expected = wheels || i <= 5;
      CHECK(stream.add_frame(blind, Status::tracking).has_value() == expected);
      CHECK((stream.health() == LinkHealth::lost) == !expected);
      if (!expected) CHECK_FALSE(stream.wants_prediction(at(0.05 * i + 0.025)));
    }
    const auto next = stream.add_frame(estimate_at(1.05), Status::tracking);
    REQUIRE(next);
    CHECK(next->reset_counter == (wheels ? 0 : 1));  // it may have jumped
  }
}

TEST_CASE("mavlink stream: the quality is the estimator's; weak is low quality, with hysteresis, or a missing sensor") {
  OdometryStream stream = make_stream();
  const auto after = [&](double t, int quality, bool faulty = false) {
    Estimate estimate = estimate_at(t);
    estimate.health.quality = quality;
    estimate.health.faulty[index_of(Source::wheel_left)] = faulty;
    const auto message = stream.add_frame(estimate, Status::tracking);
    REQUIRE(message);
    CHECK(message->quality == quality);
    return stream.health();
  };
  CHECK(after(0.0, 100) == LinkHealth::good);
  CHECK(after(0.1, 24) == LinkHealth::good);
  CHECK(after(0.2, 8) == LinkHealth::weak);
  CHECK(after(0.3, 24) == LinkHealth::weak);
  CHECK(after(0.4, 40) == LinkHealth::good);
  CHECK(after(0.5, 60, true) == LinkHealth::weak);
  CHECK(after(0.6, 60) == LinkHealth::good);
}

TEST_CASE("mavlink stream: the variance of the angular rate is the noise of one sample and the bias") {
  ImuCalibration imu;
  imu.gyro_noise = 2e-3;
  imu.rate_hz = 400.0;
  OdometryStream stream(mounting_of(0.0, 0.0, 0.0), imu);
  const auto message = stream.add_frame(estimate_at(0.0), Status::tracking);
  REQUIRE(message);
  CHECK(message->velocity_covariance(5, 5) == doctest::Approx(1.0 + 4e-6 * 400.0));
}

TEST_CASE("mavlink stream: every state of health has a text that fits, and names the sensors at fault") {
  for (const LinkHealth health : {LinkHealth::starting, LinkHealth::good, LinkHealth::weak, LinkHealth::lost}) {
    for (unsigned long sources = 0; sources < 1UL << kSourceCount; ++sources) {
      CHECK_FALSE(to_text(health, sources).text.empty());
      CHECK(to_text(health, sources).text.size() <= StatusText::kMaxLength);
    }
  }
  SourceSet faulty;
  faulty.set(index_of(Source::camera_right));
  faulty.set(index_of(Source::gyroscope));
  CHECK(to_text(LinkHealth::weak, faulty).text == "ear: without cameras, gyro");
}
