// Movements by hand, made up: sensors that are right, and each mistake that the check is there to find.
#include "src/live/preflight.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace ear;
using namespace ear::live;

namespace {

constexpr double kTrack = 0.4, kRadius = 0.075;
constexpr std::int64_t kResolution = 10000;

/// What can be wrong.
struct Mistakes {
  double accel = 1.0, gyro = 1.0, wheels = 1.0, beams = 1.0;  ///< factors
  bool swapped_wheels = false;
  double delay = 0.0;
};

class Hand {
 public:
  explicit Hand(const Mistakes& mistakes) : mistakes_(mistakes), preflight_(calibration()) {}

  static Calibration calibration() {
    Calibration calibration;
    calibration.cameras.resize(2);
    calibration.encoder.emplace();
    calibration.encoder->resolution = kResolution;
    calibration.encoder->wraps = false;
    calibration.encoder->wheel_radius = {kRadius, kRadius};
    calibration.encoder->track_width = kTrack;
    calibration.lasers.emplace();
    calibration.lasers->beams.resize(1);
    return calibration;
  }

  /// Moves with constant speed and rate for a second, and rests for one.
  void move(const Eigen::Vector3d& way_B, const Eigen::Vector3d& angle_B) {
    go(way_B, angle_B, 1.0);
    go(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 1.2);
  }
  void rest() { go(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 2.0); }

  PreflightItem item(const std::string& name) const {
    for (const PreflightItem& item : preflight_.items()) {
      if (item.name == name) return item;
    }
    return {PreflightItem::Result::missing, "there is none", ""};
  }

 private:
  void go(const Eigen::Vector3d& way_B, const Eigen::Vector3d& angle_B, double seconds) {
    constexpr double kStep = 0.005;
    const int steps = static_cast<int>(std::lround(seconds / kStep));
    for (int i = 0; i < steps; ++i) {
      t_ns_ += 5'000'000;
      const Eigen::Vector3d d = angle_B / steps;
      if (d.norm() > 0.0) q_WB_ = q_WB_ * Eigen::Quaterniond(Eigen::AngleAxisd(d.norm(), d.normalized()));
      p_WB_ += q_WB_ * (way_B / steps);
      left_ += way_B.x() / steps - 0.5 * kTrack * d.z();
      right_ += way_B.x() / steps + 0.5 * kTrack * d.z();
      deliver(d / kStep, q_WB_ * way_B / seconds);
    }
  }

  void deliver(const Eigen::Vector3d& rate_B, const Eigen::Vector3d& v_W) {
    const auto counts = [&](double way) {
      return std::llround(mistakes_.wheels * way / (2.0 * M_PI * kRadius) * kResolution);
    };
    const bool swapped = mistakes_.swapped_wheels;
    preflight_.add(EncoderSample{t_ns_, counts(swapped ? right_ : left_), counts(swapped ? left_ : right_)});
    preflight_.add(QueuedOdometry::Ranges{t_ns_, {0.1 + mistakes_.beams * p_WB_.z()}});
    LiveFrame frame;
    frame.t_ns = t_ns_;
    frame.estimate.emplace();
    frame.estimate->state.q_WB = q_WB_;
    frame.estimate->state.p_WB = p_WB_;
    frame.estimate->state.v_W = v_W;
    frame.health.since_ns = 1'000'000'000;
    Calibration learned = calibration();
    learned.camera_time_offset = mistakes_.delay;
    preflight_.add(frame, learned);
    preflight_.add(ImuSample{t_ns_, mistakes_.gyro * rate_B,
                             mistakes_.accel * (q_WB_.conjugate() * Eigen::Vector3d(0.0, 0.0, 9.81))});
  }

  Mistakes mistakes_;
  Preflight preflight_;
  TimeNs t_ns_ = 1'000'000'000;
  Eigen::Quaterniond q_WB_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_WB_ = Eigen::Vector3d::Zero();
  double left_ = 0.0, right_ = 0.0;
};

/// All movements; what became of one item.
PreflightItem after_all(const Mistakes& mistakes, const std::string& name) {
  Hand hand(mistakes);
  hand.rest();
  hand.move({0.0, 0.0, 0.2}, Eigen::Vector3d::Zero());
  hand.move({0.0, 0.0, -0.2}, Eigen::Vector3d::Zero());
  hand.move({0.6, 0.0, 0.0}, Eigen::Vector3d::Zero());
  hand.move(Eigen::Vector3d::Zero(), {0.0, 0.0, 1.5});
  hand.move(Eigen::Vector3d::Zero(), {0.4, 0.0, 0.0});
  return hand.item(name);
}

constexpr auto kRight = PreflightItem::Result::right;
constexpr auto kWrong = PreflightItem::Result::wrong;

}  // namespace

TEST_CASE("preflight: sensors that are right pass every item") {
  for (const char* name : {"stand", "lift", "push", "turn", "roll", "delay"}) {
    const PreflightItem item = after_all({}, name);
    CAPTURE(name);
    CAPTURE(item.words);
    CHECK(item.result == kRight);
  }
}

TEST_CASE("preflight: what was not done is missing") {
  Hand hand({});
  hand.rest();
  CHECK(hand.item("stand").result == kRight);
  CHECK(hand.item("lift").result == PreflightItem::Result::missing);
  CHECK(hand.item("lift").words.find("20 cm") != std::string::npos);
}

TEST_CASE("preflight: each mistake is found by its item") {
  Mistakes in_g, backward, swapped, small_wheels, beams, gyro, delay;
  in_g.accel = 1.0 / 9.81;
  backward.wheels = -1.0;
  swapped.swapped_wheels = true;
  small_wheels.wheels = 1.3;
  beams.beams = -1.0;
  gyro.gyro = -1.0;
  delay.delay = 0.03;
  CHECK(after_all(in_g, "stand").result == kWrong);
  CHECK(after_all(backward, "push").result == kWrong);
  CHECK(after_all(swapped, "turn").words.find("swapped") != std::string::npos);
  CHECK(after_all(swapped, "turn").result == kWrong);
  CHECK(after_all(small_wheels, "push").result == kWrong);
  CHECK(after_all(beams, "lift").result == kWrong);
  CHECK(after_all(gyro, "roll").result == kWrong);
  CHECK(after_all(gyro, "turn").result == kWrong);
  CHECK(after_all(delay, "delay").result == kWrong);
}
