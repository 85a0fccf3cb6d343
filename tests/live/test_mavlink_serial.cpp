// A board on a serial line, which a pseudo terminal stands in for: its samples in by its own clock, odometry out.
#include <doctest/doctest.h>

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <random>
#include <thread>

#include "src/live/mavlink_lines.h"
#include "src/mavlink/odometry_message.h"

using namespace ear;
using namespace ear::live;

namespace {

using namespace std::chrono_literals;

constexpr double kPerTick = 1e-6;  // [rad/s] of the gyroscope's x axis: so a sample can be told from the others

/// A flight controller that stands. It started a thousand seconds ago, and its clock runs 100 ppm fast.
class Board {
 public:
  Board() : terminal_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    REQUIRE(terminal_ >= 0);
    REQUIRE(::grantpt(terminal_) == 0);
    REQUIRE(::unlockpt(terminal_) == 0);
    address_ = std::string("serial:") + ::ptsname(terminal_) + ":921600";
    thread_ = std::thread([this] { run(); });
  }
  ~Board() {
    stop_ = true;
    thread_.join();
    ::close(terminal_);
  }
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;
  Board(Board&&) = delete;
  Board& operator=(Board&&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }
  /// From now on its clock says something else, as after a restart.
  void restart() { boot_ns_ = clock_.now(); }
  void answer(bool answers) { answers_ = answers; }
  [[nodiscard]] int odometry() const { return odometry_; }

  /// When it took its inertial samples, in the time of this process, which its clock is not.
  [[nodiscard]] std::vector<TimeNs> taken() {
    const std::lock_guard lock(mutex_);
    return taken_;
  }

 private:
  static constexpr double kDrift = 1.0001;

  [[nodiscard]] std::int64_t now_ns() const {
    return static_cast<std::int64_t>(kDrift * static_cast<double>(clock_.now() - boot_ns_));
  }
  void send(const mavlink::Payload& payload) {
    const std::vector<std::uint8_t> bytes = mavlink::to_bytes({{1, 1}, sequence_++, payload});
    if (rng_() % 10 == 0) static_cast<void>(!::write(terminal_, "\xFD noise", 7));  // a line is not perfect
    static_cast<void>(!::write(terminal_, bytes.data(), bytes.size()));
  }

  void run() {
    auto next = std::chrono::steady_clock::now();
    for (int tick = 0; !stop_; ++tick, next += 5ms) {
      const std::int64_t stamp_us = now_ns() / 1000;
      {
        const std::lock_guard lock(mutex_);
        taken_.push_back(clock_.now());
      }
      send(to_payload(mavlink::ImuMessage{stamp_us, {0.0, 0.0, 9.81}, {kPerTick * tick, 0.0, 0.0}, 0}));
      if (tick % 2 == 0) send(to_payload(mavlink::WheelDistance{stamp_us, {}, 2}));
      if (tick % 10 == 0) {
        for (const std::uint8_t id : {std::uint8_t{4}, std::uint8_t{7}})
          send(to_payload(mavlink::DistanceSensor{stamp_us / 1000, 0.25, 0.02, 4.0, id, 0}));
      }
      while (std::chrono::steady_clock::now() < next + 5ms) hear();
    }
  }

  void hear() {
    pollfd ready{terminal_, POLLIN, 0};
    std::array<std::uint8_t, 512> bytes{};
    if (::poll(&ready, 1, 1) <= 0) return;
    const ssize_t count = ::read(terminal_, bytes.data(), bytes.size());
    if (count <= 0) return;
    for (const mavlink::Packet& packet : parser_.add(bytes.data(), static_cast<std::size_t>(count))) {
      if (packet.payload.type.id == mavlink::kOdometryType.id) ++odometry_;
      const auto request = mavlink::to_time_sync(packet.payload);
      if (request && request->tc1 == 0 && answers_) {
        send(to_payload(mavlink::TimeSync{now_ns(), request->ts1, packet.sender.system, packet.sender.component}));
      }
    }
  }

  LiveClock clock_;
  std::atomic<TimeNs> boot_ns_{clock_.now() - 1'000'000'000'000};
  std::atomic<bool> stop_{false}, answers_{true};
  std::atomic<int> odometry_{0};
  int terminal_;
  std::string address_;
  mavlink::Parser parser_;
  std::uint8_t sequence_ = 0;
  std::minstd_rand rng_{4};
  std::mutex mutex_;
  std::vector<TimeNs> taken_;
  std::thread thread_;
};

/// Of a sample: which one it is, and its time by our clock.
struct TickedStamp {
  std::size_t tick;
  TimeNs t_ns;
};

/// What `ear live` has at the other end of the line.
struct Ear {
  static Calibration calibration() {
    Calibration calibration;
    calibration.encoder.emplace();
    calibration.lasers.emplace();
    calibration.lasers->rate_hz = 20.0;
    for (const double x : {0.2, -0.2}) {  // 0.25 m above the ground
      calibration.lasers->beams.push_back(
          {"", {x, 0.0, 0.25 - calibration.encoder->wheel_radius[0]}, -Eigen::Vector3d::UnitZ()});
    }
    return calibration;
  }
  explicit Ear(const std::string& address) {
    MavlinkSettings settings;
    settings.address = address;
    settings.inputs = {MavlinkInputs::Imu::highres, true, {4, 7}};
    IntakeTaps taps;
    taps.imu = [this](const ImuSample& sample, const std::optional<NavState>&) {
      const std::lock_guard lock(mutex);
      imu.push_back({static_cast<std::size_t>(std::lround(sample.gyro_B.x() / kPerTick)), sample.t_ns});
    };
    taps.encoder = [this](const EncoderSample&) { ++wheels; };
    taps.laser = [this](const QueuedOdometry::Ranges& sample) {
      ranges += std::abs(sample.range[1] - 0.25) < 1e-6 ? 1 : 0;
    };
    intake = std::make_unique<Intake>(estimator, calibration(), clock, taps);
    lines = std::make_unique<MavlinkLines>(std::vector<MavlinkSettings>{settings}, *intake);
    outputs = lines.get();
  }
  ~Ear() {
    outputs = nullptr;
    lines.reset();
    estimator.stop();
  }
  Ear(const Ear&) = delete;
  Ear& operator=(const Ear&) = delete;
  Ear(Ear&&) = delete;
  Ear& operator=(Ear&&) = delete;

  /// Looks until this was said or so much came.
  template <typename Done>
  bool wait(const Done& done) {
    for (int i = 0; i < 1000; ++i) {
      for (std::string& text : lines->look()) said += text + "\n";
      if (done()) return true;
      std::this_thread::sleep_for(20ms);
    }
    return false;
  }
  [[nodiscard]] bool heard(const std::string& words) const { return said.find(words) != std::string::npos; }
  [[nodiscard]] std::vector<TickedStamp> stamps() {
    const std::lock_guard lock(mutex);
    return imu;
  }

  LiveClock clock;
  std::mutex mutex;
  std::vector<TickedStamp> imu;
  std::atomic<int> wheels{0}, ranges{0};
  std::string said;
  std::atomic<MavlinkLines*> outputs{nullptr};
  LiveEstimator estimator{Config{},
                          calibration(),
                          {},
                          {[this](const LiveFrame& frame, const Odometry&) {
                             if (MavlinkLines* const to = outputs) to->take(frame);
                           },
                           [this](const LiveSample& sample) {
                             if (MavlinkLines* const to = outputs) to->take(sample);
                           }}};
  std::unique_ptr<Intake> intake;
  std::unique_ptr<MavlinkLines> lines;
};

}  // namespace

TEST_CASE("mavlink serial: samples of a board get our time by TIMESYNC, and odometry goes back") {
  Board board;
  Ear ear(board.address());
  const bool all_came =
      ear.wait([&] { return ear.stamps().size() > 200 && ear.wheels > 50 && ear.ranges > 10 && board.odometry() > 5; });
  CAPTURE(ear.stamps().size());
  CAPTURE(ear.wheels.load());
  CAPTURE(ear.ranges.load());
  CAPTURE(board.odometry());
  REQUIRE(all_came);
  CHECK(ear.heard("mavlink: the clocks are synchronised"));
  const std::vector<TickedStamp> stamps = ear.stamps();
  const std::vector<TimeNs> taken = board.taken();
  std::vector<double> off;
  for (std::size_t i = stamps.size() - 100; i < stamps.size(); ++i) {
    REQUIRE(stamps[i].tick < taken.size());
    off.push_back(std::abs(seconds_between(taken[stamps[i].tick], stamps[i].t_ns)));
  }
  std::sort(off.begin(), off.end());
  MESSAGE("stamps are off by ", 1e3 * off[50], " ms in the median, ", 1e3 * off[99], " ms at most");
  CHECK(off[50] < 0.02);  // a busy machine answers late; the clocks are 1000 s apart
}

TEST_CASE("mavlink serial: a board that does not answer, and one that starts again, are named") {
  Board board;
  board.answer(false);
  Ear ear(board.address());
  CHECK(ear.wait([&] { return ear.heard("samples passed over: too few answers to TIMESYNC"); }));
  CHECK(ear.stamps().empty());
  board.answer(true);
  CHECK(ear.wait([&] { return ear.stamps().size() > 50; }));
  board.restart();
  CHECK(ear.wait([&] { return ear.heard("the sender's clock was set: has it restarted?"); }));
  const std::size_t before = ear.stamps().size();
  CHECK(ear.wait([&] { return ear.stamps().size() > before + 50; }));
}
