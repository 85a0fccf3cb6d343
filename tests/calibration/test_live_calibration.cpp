// A calibration while driving: words about what is missing, bounded memory, and the whole estimate at the end.
#include "tools/calibration/live_calibration.h"

#include "calibration/still_missing.h"
#include "tests/smoother/support.h"
#include "tools/calibration/simulated_drive.h"

using namespace ear;
using namespace ear::calibration;

namespace {

/// What was said, and a place to wait for it.
class Heard {
 public:
  void add(const std::string& words) {
    const std::lock_guard lock(mutex_);
    all_.push_back(words);
    more_.notify_all();
  }
  /// Waits for something with these words in it.
  std::string wait_for(const std::string& part) {
    std::unique_lock lock(mutex_);
    std::string found;
    more_.wait(lock, [&] {
      for (const std::string& words : all_) {
        if (words.find(part) != std::string::npos) found = words;
      }
      return !found.empty();
    });
    return found;
  }

 private:
  std::mutex mutex_;
  std::condition_variable more_;
  std::vector<std::string> all_;
};

/// In the order of time, as `ear live` hands samples over.
void play(const Drive& drive, LiveCalibration& live, const Calibration& given) {
  const std::unique_ptr<Estimator> estimator = live.make()(FilterConfig{}, given);
  std::size_t imu = 0, encoder = 0, laser = 0;
  for (const FeatureFrame& frame : drive.frames) {
    for (; imu < drive.imu.size() && drive.imu[imu].t_ns <= frame.t_ns + 10'000'000; ++imu) {
      estimator->add_imu(drive.imu[imu]);
    }
    for (; encoder < drive.encoders.size() && drive.encoders[encoder].t_ns <= frame.t_ns; ++encoder) {
      estimator->add_encoder(drive.encoders[encoder]);
    }
    for (; laser < drive.lasers.size() && drive.lasers[laser].t_ns <= frame.t_ns; ++laser) {
      estimator->add_laser(drive.lasers[laser]);
    }
    static_cast<void>(estimator->process(frame));
    live.hand_over();
  }
}

struct Made {
  Drive drive;
  Calibration given;
};

Made drive_of(double seconds) {
  simulator::Options options;
  options.sequence = "calibrate";
  options.seed = 31;
  options.duration = seconds;
  options.camera_rate_hz = 20.0;
  options.calibration_error = 1.0;
  const simulator::Simulation simulation(options);
  return {recorded_drive(simulation), simulation.calibration()};
}

}  // namespace

TEST_CASE("live calibration: says which motion is missing, and ends with the whole estimate") {
  const Made made = drive_of(22.0);
  Heard heard;
  LiveCalibrationSettings settings;
  settings.every = 12.0;
  LiveCalibration live(made.given, settings, [&](const std::string& words) { heard.add(words); });
  play(made.drive, live, made.given);
  const std::string words = heard.wait_for("numbers are known well enough");
  CHECK(words.find("take off") != std::string::npos);  // nothing has flown yet: beams
  CHECK(words.find("laser0") != std::string::npos);

  const Result result = live.finish();
  CHECK(result.findings.size() == 57);
  // It swung, which shows the axle's height.
  for (const Finding& finding : result.findings) {
    if (finding.name == "encoder0: position of the axle z") CHECK(finding.shown);
  }
}

TEST_CASE("live calibration: no more is kept than was allowed, and a drive too short ends in words") {
  const Made made = drive_of(12.0);
  Heard heard;
  LiveCalibrationSettings settings;
  settings.longest = 4.0;
  LiveCalibration live(made.given, settings, [&](const std::string& words) { heard.add(words); });
  play(made.drive, live, made.given);
  heard.wait_for("what comes now is not used");
  CHECK(live.recorded() >= 4.0);
  CHECK(live.recorded() < 6.5);

  LiveCalibration empty(made.given, settings, [](const std::string&) {});
  CHECK_THROWS_AS(static_cast<void>(empty.finish()), std::invalid_argument);
}

TEST_CASE("what is still missing: motions, the one that shows most first") {
  const auto finding = [](const char* name, double given, double sigma, bool shown) {
    return Finding{name, "", given, 0.0, 10.0 * sigma, sigma, shown, "", 0.0, ""};
  };
  const std::vector<Finding> findings{finding("encoder0: wheel radius, mean", 75.0, 0.05, true),  // well enough
                                      finding("encoder0: wheel separation", 400.0, 5.0, true),    // shown, but badly
                                      finding("encoder0: position of the axle x", 0.0, 9.0, false),
                                      finding("laser0 rear: direction, 1st tilt", 0.0, 1.0, false)};
  const std::vector<MissingMotion> missing = still_missing(findings);
  REQUIRE(missing.size() == 2);
  CHECK(missing[0].entries.size() == 2);
  CHECK(missing[0].motion.find("turn on the spot") != std::string::npos);
  CHECK(missing_text(findings).find("1 of 4 numbers") == 0);
}
