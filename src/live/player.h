// A recording in place of the sensors, in real time: each sensor on a thread of its own, as drivers would.
#pragma once

#include <atomic>
#include <memory>
#include <thread>

#include "src/live/intake.h"
#include "src/recording/recording.h"

namespace ear::live {

class Player {
 public:
  explicit Player(Recording recording);
  ~Player();  ///< as stop()
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;
  Player(Player&&) = delete;
  Player& operator=(Player&&) = delete;

  [[nodiscard]] const Calibration& calibration() const { return recording_.calibration(); }

  /// Begins: each sample goes to `intake` when it was taken, stamped as the recording is.
  void start(Intake& intake);
  /// At the end of the recording, or of stop().
  [[nodiscard]] bool done() const { return done_; }
  void stop();

 private:
  class Feed;

  void deal();

  Recording recording_;
  std::unique_ptr<Feed> feed_;
  std::atomic<bool> stop_ = false;
  std::atomic<bool> done_ = false;
  std::thread dealer_;
};

}  // namespace ear::live
