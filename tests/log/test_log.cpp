// The log, and what class Odometry writes to it.
#include <doctest/doctest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>

#include "src/event_log.h"
#include "src/log/log.h"
#include "src/log/repeat_limit.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

// A program's own logger of the name, as an embedding program would have it.
class Captured {
 public:
  explicit Captured(spdlog::level::level_enum level) {
    const auto logger =
        std::make_shared<spdlog::logger>("ear", std::make_shared<spdlog::sinks::ostream_sink_mt>(stream_));
    logger->set_pattern("%l: %v");
    logger->set_level(level);
    spdlog::drop("ear");
    spdlog::register_logger(logger);
  }
  ~Captured() { spdlog::drop("ear"); }
  Captured(const Captured&) = delete;
  Captured& operator=(const Captured&) = delete;

  [[nodiscard]] std::string take() {
    std::string text = stream_.str();
    stream_.str("");
    return text;
  }

 private:
  std::ostringstream stream_;
};

TimeNs seconds(double t) { return static_cast<TimeNs>(1e9 * t); }

std::string text_of(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("log: a program's own logger gets the lines, as they are, from its level on") {
  Captured captured(spdlog::level::warn);
  log_info("nothing of this");
  log_warning("a {} brace is no format");
  log_error("the end");
  CHECK(captured.take() == "warning: a {} brace is no format\nerror: the end\n");
}

TEST_CASE("log: a file gets events too, with times, behind what it held before") {
  const fs::path file = fs::temp_directory_path() / ("ear_log_" + std::to_string(getpid()));
  fs::remove(file);
  for (const char* run : {"first", "second"}) {
    set_up_log({LogLevel::error, file});
    log(LogLevel::debug, "no detail");
    log_info(std::string(run) + " run");
  }
  spdlog::drop("ear");
  const std::string text = text_of(file);
  CHECK(contains(text, " info: first run\n20"));
  CHECK(contains(text, " info: second run\n"));
  CHECK_FALSE(contains(text, "detail"));
  CHECK_THROWS_WITH(set_up_log({LogLevel::error, file / "below"}), doctest::Contains((file / "below").c_str()));
  fs::remove(file);
}

TEST_CASE("repeat limit: one of a kind per interval, and how many were held back") {
  RepeatLimit limit(10.0);
  CHECK(limit.allows("a", seconds(1.0)) == 0);
  CHECK(limit.allows("b", seconds(1.0)) == 0);
  CHECK_FALSE(limit.allows("a", seconds(2.0)));
  CHECK_FALSE(limit.allows("a", seconds(10.9)));
  CHECK(limit.allows("a", seconds(11.0)) == 2);
  CHECK_FALSE(limit.allows("a", seconds(12.0)));
  CHECK(limit.allows("a", seconds(0.0)) == 1);  // a clock that went back must not silence anything
}

TEST_CASE("event log: each change of the health once, lost as a warning") {
  Captured captured(spdlog::level::debug);
  EventLog events;
  Health health;
  const auto note = [&](double t) {
    events.note(seconds(t), health, {});
    return captured.take();
  };
  CHECK(note(0.0).empty());
  health.status = HealthStatus::tracking;
  CHECK(note(1.0) == "info: at 1.000 s: tracking\n");
  CHECK(note(1.1).empty());
  health.status = HealthStatus::degraded;
  health.faulty.set(index_of(Source::camera_left));
  CHECK(note(2.0) == "info: at 2.000 s: degraded: without camera_left; carried by inertia alone\n");
  health = {};
  health.status = HealthStatus::lost;
  CHECK(contains(note(3.0), "warning: at 3.000 s: lost"));
  CHECK(note(3.1).empty());
  health.status = HealthStatus::tracking;
  CHECK(note(4.0).empty());  // was written 3 s before
  CHECK(note(10.9).empty());
  CHECK(note(11.1) == "info: at 11.100 s: tracking\n");  // but it lasts
  health.load_step = 2;
  CHECK(contains(note(11.2), "load step 2"));
  health.status = HealthStatus::degraded;
  CHECK(contains(note(11.3), "degraded"));
  health.imprecise = true;
  CHECK(contains(note(11.4), "imprecise"));
  health.aiding = Aiding::cameras;
  CHECK(contains(note(11.5), "carried by cameras"));
}

TEST_CASE("event log: what is refused is a warning, every ten seconds") {
  Captured captured(spdlog::level::warn);
  EventLog events;
  InputCounts counts;
  std::string all;
  for (int i = 0; i < 250; ++i) {  // 25 s
    ++counts.laser.implausible;
    events.note(seconds(0.1 * i), {}, counts);
    events.note_unusable(seconds(0.1 * i), "too small");
  }
  all = captured.take();
  CHECK(std::count(all.begin(), all.end(), '\n') == 6);
  CHECK(contains(all, "at 0.000 s: laser: refused so far: 1 implausible\n"));
  CHECK(contains(all, "at 10.000 s: laser: refused so far: 101 implausible (99 more"));
  CHECK(contains(all, "images not used: too small (99 more were not written)"));
  ++counts.clock_jumps;
  events.note(seconds(25.0), {}, counts);
  CHECK(contains(captured.take(), "jumped"));
}

}  // namespace ear
