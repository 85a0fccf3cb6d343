#include "src/live/player.h"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <utility>

namespace ear::live {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr std::size_t kAhead = 64;  // samples that wait for their time
constexpr std::size_t kFramesAhead = 8;

/// One sensor's thread: takes samples that were dealt to it, and waits until it is time for each.
class Sensor {
 public:
  Sensor(Intake& intake, TimeNs first_ns, std::size_t ahead)
      : intake_(intake), first_ns_(first_ns), ahead_(ahead), thread_([this] { run(); }) {}
  ~Sensor() {
    {
      const std::lock_guard lock(mutex_);
      end_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Sensor(const Sensor&) = delete;
  Sensor& operator=(const Sensor&) = delete;
  Sensor(Sensor&&) = delete;
  Sensor& operator=(Sensor&&) = delete;

  /// Waits while it has enough. `drop`: what waits is not played any more.
  void deal(Sample sample) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return samples_.size() < ahead_ || drop_; });
    samples_.push_back(std::move(sample));
    changed_.notify_all();
  }
  void drop() {
    const std::lock_guard lock(mutex_);
    drop_ = true;
    changed_.notify_all();
  }

 private:
  void run() {
    while (true) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return !samples_.empty() || end_; });
      if (samples_.empty() || drop_) return;
      const Sample sample = std::move(samples_.front());
      samples_.pop_front();
      changed_.notify_all();
      const TimeNs due = sample_time(sample);
      if (changed_.wait_until(lock, start_ + std::chrono::nanoseconds(due - first_ns_), [this] { return drop_; })) {
        return;
      }
      lock.unlock();
      hand_in(sample);
    }
  }

  static TimeNs sample_time(const Sample& sample) {
    const auto* const frame = std::get_if<RecordedFrame>(&sample);
    return frame != nullptr ? frame->arrival_ns : time_of(sample);
  }

  void hand_in(const Sample& sample) {
    std::visit(Overloaded{[this](const RecordedFrame& s) { intake_.add(static_cast<const StereoFrame&>(s)); },
                          [this](const auto& s) { intake_.add(s); }},
               sample);
  }

  Intake& intake_;
  TimeNs first_ns_;
  std::size_t ahead_;
  SteadyClock::time_point start_ = SteadyClock::now();
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Sample> samples_;
  bool end_ = false;
  bool drop_ = false;
  std::thread thread_;
};

}  // namespace

class Player::Feed {
 public:
  Feed(Intake& intake, const Calibration& calibration, TimeNs first_ns)
      : imu_(intake, first_ns, kAhead),
        encoder_(intake, later_by(calibration.encoder ? -calibration.encoder->time_offset : 0.0, first_ns), kAhead),
        laser_(intake, later_by(calibration.lasers ? -calibration.lasers->time_offset : 0.0, first_ns), kAhead),
        camera_(intake, first_ns, kFramesAhead) {}

  void deal(Sample sample) {
    Sensor& its_sensor = sensor(sample);
    its_sensor.deal(std::move(sample));
  }
  void drop() {
    for (Sensor* one : {&imu_, &encoder_, &laser_, &camera_}) one->drop();
  }

 private:
  Sensor& sensor(const Sample& sample) {
    switch (sample.index()) {
      case 0:
        return imu_;
      case 1:
        return encoder_;
      case 2:
        return laser_;
      default:
        return camera_;
    }
  }

  Sensor imu_, encoder_, laser_, camera_;
};

Player::Player(Recording recording) : recording_(std::move(recording)) {}

Player::~Player() { stop(); }

void Player::start(Intake& intake) {
  feed_ = std::make_unique<Feed>(intake, recording_.calibration(), recording_.span().first_ns);
  dealer_ = std::thread([this] { deal(); });
}

void Player::deal() {
  while (std::optional<Sample> sample = recording_.next()) {
    if (stop_) break;
    feed_->deal(std::move(*sample));
  }
  if (stop_) feed_->drop();
  feed_.reset();  // plays what waits
  done_ = true;
}

void Player::stop() {
  stop_ = true;
  if (!dealer_.joinable()) return;
  dealer_.join();
}

}  // namespace ear::live
