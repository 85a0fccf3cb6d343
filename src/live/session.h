// All that runs in `ear live`, from the first sample to the last estimate.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/live/calibration_source.h"
#include "src/live/estimate_files.h"
#include "src/live/live_report.h"
#include "src/live/mavlink_lines.h"
#include "src/live/notify.h"
#include "src/live/player.h"
#include "src/live/preflight.h"
#include "src/live/recorder.h"
#include "src/live/ros_node.h"
#include "src/live/stereo_camera.h"

namespace ear::live {

struct SessionOptions {
  std::filesystem::path out;     ///< folder for estimate.tum and states.csv; empty: none
  std::filesystem::path record;  ///< MCAP file; empty: none
  double duration = 0.0;         ///< [s]; 0: without end
  bool check = false;            ///< by hand, before a flight: see Preflight
};

/// Who looks at what the estimator does, on its thread; each may be empty.
struct Onlooker {
  MakeEstimator make;                        ///< in place of the filter
  std::function<QueuedFrame*()> keep_frame;  ///< as LiveListeners
  std::function<void(const LiveFrame&, const Odometry&)> on_frame;
};

class Session {
 public:
  /// Opens sources and outputs, and begins to estimate. `ros` and `player` may be null, and must outlive it; a
  /// recording stands for all sensors. Throws InputError and std::runtime_error.
  Session(const SessionOptions& options, const LiveSettings& settings, const Calibration& calibration,
          const std::filesystem::path& calibration_folder, RosNode* ros, Player* player, Onlooker onlooker = {});

  /// Looks after all of it, until there is a reason to stop, which it returns. `wait` waits some 0.2 s for one from
  /// outside, such as a signal.
  [[nodiscard]] std::string run(const std::function<std::optional<std::string>()>& wait, Notifier& notifier);

  /// Estimates what has come, closes the files, and logs what there was.
  void stop();

  /// Of a check: throws InputError unless all is right.
  void judge() const;

 private:
  [[nodiscard]] LiveListeners listeners();
  [[nodiscard]] IntakeTaps taps();
  template <typename What>
  void send(const What& what);
  template <typename What>
  void note(const What& what);
  [[nodiscard]] bool all_right() const;
  void log_news();
  void report_status(Notifier& notifier, TimeNs now);

  /// What systemd was told of.
  struct LastTold {
    TimeNs alive_ns = 0;        ///< when the estimator last took samples, or there were none
    TimeNs status_ns = 0;       ///< when the status was sent
    std::uint64_t samples = 0;  ///< then
  };

  SessionOptions options_;
  RosNode* ros_;
  Player* player_;
  Onlooker onlooker_;
  LiveClock clock_;
  LiveReport report_;
  EstimateFiles files_;
  std::unique_ptr<Recorder> recorder_;           ///< with options.record
  std::unique_ptr<Preflight> preflight_;         ///< with options.check
  std::atomic<MavlinkLines*> outputs_{nullptr};  ///< null until all is there
  LiveEstimator estimator_;
  Intake intake_;
  std::unique_ptr<MavlinkLines> lines_;
  std::unique_ptr<StereoCamera> cameras_;
  LastTold last_reported_;
};

}  // namespace ear::live
