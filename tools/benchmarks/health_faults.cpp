// health_faults: how soon the health says that something is wrong, and when it is content again, on simulated feature
// tracks. Without --fault: what it says of clean runs, where it should say nothing.
//
//   health_faults --sequences flat1,fly1 --seeds 501,502 --fault camera_frozen@20+5 --fault wheel_lifted@20+5
//
// One line per fault and run; --verbose lists every change of status.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "filter/filter.h"
#include "src/health_text.h"
#include "tools/experiments/replay_simulation.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {
namespace {

struct Arguments {
  std::vector<std::string> sequences{"flat1"};
  std::vector<std::uint64_t> seeds{501};
  std::vector<std::string> faults;
  double camera_rate_hz = 30.0;
  bool verbose = false;
};

/// What the health said from some moment on.
struct Change {
  double t = 0.0;  ///< [s] of the motion
  HealthStatus status = HealthStatus::initialising;
  std::string text;
};

/// What was said during a whole run, polled after every sample.
struct Log {
  std::vector<Change> changes;
  double lost = 0.0;      ///< [s]
  double duration = 0.0;  ///< [s]

  void add(double t, const Health& health) {
    const std::string text = to_text(health);
    if (changes.empty() || changes.back().text != text) changes.push_back({t, health.status, text});
    if (health.status == HealthStatus::lost) lost += t - duration;
    duration = t;
  }
};

Log listen(const simulator::Simulation& simulation) {
  Filter filter(FilterConfig{}, simulation.calibration());
  const TimeNs start_ns = simulation.truth_times().front();
  Log log;
  ReplayOptions options;
  options.after = [&](const simulator::Delivery& delivery) {
    log.add(seconds_between(start_ns, delivery.arrival_ns), filter.health());
  };
  replay(
      simulation, filter, [](TimeNs, const Estimate&) {}, options);
  return log;
}

bool complains(const Change& change) {
  return change.status == HealthStatus::degraded || change.status == HealthStatus::lost;
}

/// When something was first said within [from, to]; what had been said before counts as well.
const Change* first_complaint(const Log& log, double from, double to) {
  for (std::size_t i = 0; i < log.changes.size(); ++i) {
    const double until = i + 1 < log.changes.size() ? log.changes[i + 1].t : log.duration;
    if (complains(log.changes[i]) && until > from && log.changes[i].t <= to) return &log.changes[i];
  }
  return nullptr;
}

/// Since when nothing was said any more, for a second at least; nothing if that never came.
double content_after(const Log& log, double from) {
  for (std::size_t i = 0; i < log.changes.size(); ++i) {
    const double until = i + 1 < log.changes.size() ? log.changes[i + 1].t : log.duration + 1.0;
    if (log.changes[i].status == HealthStatus::tracking && until > from + 1.0)
      return std::max(0.0, log.changes[i].t - from);
  }
  return -1.0;
}

void report_fault(const std::string& name, const simulator::Fault& fault, const Log& log) {
  const Change* complaint = first_complaint(log, fault.start, fault.end() + 1.0);
  std::printf("%s %-32s ", name.c_str(), to_string(fault).c_str());
  if (complaint == nullptr) {
    std::printf("| nothing said\n");
    return;
  }
  std::printf("| said after %.2f s | content %.2f s after its end | lost for %.1f s | %s\n",
              std::max(0.0, complaint->t - fault.start), content_after(log, fault.end()), log.lost,
              complaint->text.c_str());
}

void run(const Arguments& args) {
  const bool all = args.sequences == std::vector<std::string>{"all"};
  double duration = 0.0;
  int alarms = 0;
  for (const std::string& sequence : all ? simulator::sequence_names() : args.sequences) {
    for (const std::uint64_t seed : args.seeds) {
      const std::vector<std::string> cases = args.faults.empty() ? std::vector<std::string>{""} : args.faults;
      for (const std::string& text : cases) {
        simulator::Options options;
        options.sequence = sequence;
        options.seed = seed;
        options.camera_rate_hz = args.camera_rate_hz;
        if (!text.empty()) options.faults.push_back(simulator::parse_fault(text));
        const Log log = listen(simulator::Simulation(options));
        const std::string name = sequence + " " + std::to_string(seed);
        if (args.verbose) {
          for (const Change& change : log.changes) std::printf("  %8.3f %s\n", change.t, change.text.c_str());
        }
        if (!text.empty()) {
          report_fault(name, options.faults.front(), log);
          continue;
        }
        int here = 0;
        bool complained = false;
        for (const Change& change : log.changes) {
          here += complains(change) && !complained ? 1 : 0;
          complained = complains(change);
        }
        std::printf("%s | %d alarms in %.0f s | lost for %.1f s\n", name.c_str(), here, log.duration, log.lost);
        alarms += here;
        duration += log.duration;
        std::fflush(stdout);
      }
    }
  }
  if (args.faults.empty())
    std::printf("%d alarms in %.0f s: %.1f per hour\n", alarms, duration, 3600.0 * alarms / duration);
}

int parse_and_run(int argc, char** argv) {
  Arguments args;
  CLI::App app{"health_faults: what the health says of simulated faults, and of clean runs"};
  app.add_option("--sequences", args.sequences, "a,b,.. or all")->delimiter(',')->capture_default_str();
  app.add_option("--seeds", args.seeds, "several with commas")->delimiter(',')->capture_default_str();
  app.add_option("--fault", args.faults, "one per run, as in ear simulate; may be repeated");
  app.add_option("--rate", args.camera_rate_hz, "of the camera [Hz]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--verbose", args.verbose, "every change of what the health says");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {  // also --help
    return app.exit(error);
  }
  run(args);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace ear::experiments

int main(int argc, char** argv) {
  try {
    return ear::experiments::parse_and_run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "health_faults: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
