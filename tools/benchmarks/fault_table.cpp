// fault_table: what faults of the sensors cost, how soon the health says so, and when it is content again, on simulated
// feature tracks. Without faults: what the health says of sound sensors, where it should say nothing.
//
//   fault_table --sequences flat1,wave1,fly1 --seeds 501..505 --faults all
//   fault_table --sequences flat1 --seeds 501 --faults camera_frozen@20+5,wheel_lifted@20+5 --verbose
//   fault_table --sequences all --seeds 501..505
//
// One row of a Markdown table per fault and sequence, over all seeds.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "filter/ekf/state.h"
#include "src/health_text.h"
#include "src/recording/config_file.h"
#include "tools/benchmarks/program.h"
#include "tools/experiments/figures.h"
#include "tools/experiments/in_parallel.h"
#include "tools/experiments/seeds.h"
#include "tools/experiments/statistics.h"
#include "tools/progress.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {
namespace {

constexpr double kSoon = 1.0;            // [s] after a fault's end what is said may still be meant for it
constexpr double kContent = 1.0;         // [s] for which nothing is said: it is over
constexpr double kCause = 1.0;           // [s] after which a complaint is not about what happened
constexpr double kBeforeLanding = 0.25;  // [s] a landing is hard from then on
constexpr double kSlip = 0.02;           // [m/s] of the rim over the ground: a wheel that slips
constexpr double kWrongRange = 6.0;      // times the noise of a beam: a range that is wrong

struct Arguments {
  std::vector<std::string> sequences{"flat1"};
  std::vector<std::string> seeds{"501..505"};
  std::vector<std::string> faults;
  double start = 20.0;
  std::string config;
  double camera_rate_hz = 30.0;
  int threads = 2;
  bool verbose = false;
};

/// What the health said from some moment on.
struct Change {
  double t = 0.0;  ///< [s] of the motion
  HealthStatus status = HealthStatus::initialising;
  SourceSet faulty;
  std::string text;

  [[nodiscard]] bool complains() const { return status == HealthStatus::degraded || status == HealthStatus::lost; }
};

/// What was said during a whole run, asked after every sample.
struct Log {
  std::vector<Change> changes;
  double lost = 0.0;      ///< [s]
  double duration = 0.0;  ///< [s]

  void add(double t, const Health& health) {
    const std::string text = to_text(health);
    if (changes.empty() || changes.back().text != text) changes.push_back({t, health.status, health.faulty, text});
    if (health.status == HealthStatus::lost) lost += t - duration;
    duration = t;
  }
  /// Until when the i-th change held.
  [[nodiscard]] double until(std::size_t i) const { return i + 1 < changes.size() ? changes[i + 1].t : duration; }
};

/// One run.
struct Outcome {
  simulator::Fault fault;
  Log log;
  Figures figures;
};

Outcome run(const simulator::Simulation& simulation, const FilterConfig& config) {
  Outcome outcome;
  const TimeNs start_ns = simulation.truth_times().front();
  outcome.figures =
      measure(simulation, simulation.calibration(), config, evaluation::AlignmentKind::yaw,
              [&](TimeNs t_ns, const Health& health) { outcome.log.add(seconds_between(start_ns, t_ns), health); });
  return outcome;
}

/// How long after the fault began something was first said; what had been said before counts as well.
std::optional<double> said_after(const Log& log, const simulator::Fault& fault) {
  for (std::size_t i = 0; i < log.changes.size(); ++i) {
    if (!log.changes[i].complains() || log.until(i) <= fault.start) continue;
    if (log.changes[i].t > fault.end() + kSoon) break;
    return std::max(0.0, log.changes[i].t - fault.start);
  }
  return std::nullopt;
}

/// How long after the fault's end nothing was said any more.
std::optional<double> content_after(const Log& log, const simulator::Fault& fault) {
  for (std::size_t i = 0; i < log.changes.size(); ++i) {
    const bool last = i + 1 == log.changes.size();
    if (log.changes[i].status != HealthStatus::tracking || log.until(i) <= fault.end()) continue;
    const double from = std::max(log.changes[i].t, fault.end());
    if (last || log.until(i) > from + kContent) return from - fault.end();
  }
  return std::nullopt;
}

/// Runs work(0) .. work(count - 1) and shows how far it is.
template <typename Work>
auto run_all(std::size_t count, int threads, const Work& work) {
  std::vector<decltype(work(0))> results(count);
  std::atomic<std::size_t> done{0};
  std::mutex mutex;
  tools::Progress progress;
  in_parallel(count, threads, [&](std::size_t i) {
    results[i] = work(i);
    const std::string text = std::to_string(++done) + " of " + std::to_string(count) + " runs";
    const std::lock_guard<std::mutex> lock(mutex);
    progress.show(text);
  });
  progress.finish();
  return results;
}

std::string title_of(const simulator::Options& options) {
  return options.sequence + ' ' + std::to_string(options.seed);
}

void tell(const std::string& title, const Log& log) {
  std::printf("%s\n", title.c_str());
  for (const Change& change : log.changes) std::printf("  %8.3f %s\n", change.t, change.text.c_str());
}

// ---- Faults

double largest(const std::vector<double>& values) {
  return values.empty() ? std::nan("") : *std::max_element(values.begin(), values.end());
}

/// Over the seeds.
struct FaultRow {
  std::string fault, sequence;
  std::vector<double> clean = {}, ate = {}, ratio = {}, said = {}, content = {}, lost = {}, untrue = {};
  int unnoticed = 0;
  int never_content = 0;

  void add(const Outcome& sound, const Outcome& faulty) {
    const simulator::Fault& what = faulty.fault;
    if (sound.figures.ate_rmse && faulty.figures.ate_rmse) {
      clean.push_back(*sound.figures.ate_rmse);
      ate.push_back(*faulty.figures.ate_rmse);
      ratio.push_back(ate.back() / clean.back());
    }
    lost.push_back(faulty.log.lost);
    untrue.push_back(faulty.figures.false_tracking.value_or(0.0));
    if (const auto t = said_after(faulty.log, what)) {
      said.push_back(*t);
    } else {
      ++unnoticed;
    }
    if (const auto t = content_after(faulty.log, what)) {
      content.push_back(*t);
    } else {
      ++never_content;
    }
  }

  void print() const {
    if (lost.empty()) return;
    std::printf("| `%s` | %s | %.4f | %.4f | %.2f / %.2f | %.2f / %.2f | %d | %.1f / %.1f | %d | %.1f | %.1f |\n",
                fault.c_str(), sequence.c_str(), median(clean), median(ate), median(ratio), largest(ratio),
                median(said), largest(said), unnoticed, median(content), largest(content), never_content, largest(lost),
                largest(untrue));
  }
};

/// NAME or NAME.TARGET is that fault at the usual time; `all` are all of them, at whatever they usually hit.
std::vector<simulator::Fault> faults_of(const Arguments& args) {
  std::vector<simulator::Fault> faults;
  const std::string when = "@" + std::to_string(args.start);
  for (const std::string& text : args.faults) {
    if (text == "all") {
      for (const simulator::FaultType& type : simulator::fault_types()) {
        faults.push_back(simulator::parse_fault(type.name + when));
      }
    } else {
      std::string whole = text;
      if (text.find('@') == std::string::npos) whole.insert(std::min(text.find('='), text.size()), when);
      faults.push_back(simulator::parse_fault(whole));
    }
  }
  return faults;
}

std::string name_of(const simulator::Fault& fault) {
  const std::string text = simulator::to_string(fault);
  const std::size_t parameter = text.find('=');
  return text.substr(0, text.find('@')) + (parameter == std::string::npos ? "" : text.substr(parameter));
}

/// Where in this motion the fault is: landings are hard when there is one. Nothing if it cannot be.
std::optional<simulator::Fault> placed(simulator::Fault fault, const simulator::Options& options) {
  if (fault.kind != simulator::FaultKind::hard_landing) return fault;
  const simulator::Simulation simulation(options);
  if (simulation.plan().touchdowns.empty()) return std::nullopt;
  fault.start = simulation.plan().touchdowns.front() - kBeforeLanding;
  fault.duration = 2.0 * kBeforeLanding;
  return fault;
}

void compare_faults(const std::vector<simulator::Options>& simulations, const std::vector<simulator::Fault>& faults,
                    const FilterConfig& config, const Arguments& args) {
  const std::size_t cases = faults.size() + 1;  // the first is without
  using Result = std::optional<Outcome>;
  const std::vector<Result> outcomes = run_all(simulations.size() * cases, args.threads, [&](std::size_t i) -> Result {
    simulator::Options options = simulations[i / cases];
    if (i % cases == 0) return run(simulator::Simulation(options), config);
    const std::optional<simulator::Fault> fault = placed(faults[i % cases - 1], options);
    if (!fault) return std::nullopt;
    options.faults.push_back(*fault);
    Outcome outcome = run(simulator::Simulation(options), config);
    outcome.fault = *fault;
    return outcome;
  });
  std::printf(
      "| fault | sequence | ATE without [m] | with [m] | ratio, median / worst | said after [s], median / worst | "
      "never "
      "| content after its end [s], median / worst | never | lost for [s] "
      "| false tracking [%%] |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (std::size_t f = 0; f < faults.size(); ++f) {
    std::vector<FaultRow> rows;
    for (std::size_t i = 0; i < simulations.size(); ++i) {
      if (rows.empty() || rows.back().sequence != simulations[i].sequence) {
        rows.push_back({name_of(faults[f]), simulations[i].sequence});
      }
      const Result& faulty = outcomes[i * cases + f + 1];
      if (!faulty) continue;
      rows.back().add(*outcomes[i * cases], *faulty);
      if (args.verbose) tell(title_of(simulations[i]) + ' ' + to_string(faulty->fault), faulty->log);
    }
    for (const FaultRow& row : rows) row.print();
  }
}

// ---- Sound sensors

/// When sensors err in a simulation without faults: wheels slip or leave the ground, beams
/// are lost where it is rough, lenses are covered.
class Causes {
 public:
  explicit Causes(const simulator::Simulation& simulation) : simulation_(simulation) {
    simulator::Options options = simulation.options();
    options.sensor_noise = false;
    options.tracks = false;
    const simulator::Simulation ideal(options);
    const LaserCalibration& lasers = *simulation.true_calibration().lasers;
    for (std::size_t i = 0; i < simulation.lasers().size(); ++i) {
      const LaserSample& reading = simulation.lasers()[i];
      for (std::size_t beam = 0; beam < reading.range.size(); ++beam) {
        const double off = reading.range[beam] - ideal.lasers()[i].range[beam];
        if (!(std::abs(off) < kWrongRange * lasers.noise)) wrong_ranges_[beam].push_back(time_of(reading.t_ns));
      }
    }
  }

  /// Did what is named at fault err a moment ago? Not asked of what was named `before` and still is.
  [[nodiscard]] bool explain(const Change& change, const SourceSet& before) const {
    for (std::size_t source = 0; source < kSourceCount; ++source) {
      const bool named = change.faulty[source] && !before[source];
      if (named && !errs(static_cast<Source>(source), change.t)) return false;
    }
    return change.status != HealthStatus::lost;
  }

 private:
  [[nodiscard]] double time_of(TimeNs t_ns) const { return seconds_between(simulation_.truth_times().front(), t_ns); }

  [[nodiscard]] bool errs(Source source, double t) const {
    switch (source) {
      case Source::camera_left:
      case Source::camera_right:
        return simulation_.obstruction().active(t) || simulation_.obstruction().active(t - kCause);
      case Source::wheel_left:
      case Source::wheel_right:
        return slips(t) || flies(t);
      case Source::beam_0:
      case Source::beam_1:
      case Source::beam_2: {
        if (flies(t)) return true;
        const std::vector<double>& wrong = wrong_ranges_[index_of(source) - index_of(Source::beam_0)];
        const auto next = std::upper_bound(wrong.begin(), wrong.end(), t);
        return next != wrong.begin() && *std::prev(next) > t - kCause;
      }
      default:
        return false;
    }
  }

  /// In the air wheels turn as they like, and the ground is far.
  [[nodiscard]] bool flies(double t) const {
    const TimeNs start_ns = simulation_.truth_times().front();
    return simulation_.truth(start_ns + static_cast<TimeNs>(1e9 * t)).mode == simulator::Mode::air;
  }

  [[nodiscard]] bool slips(double t) const {
    const simulator::MotionPlan& plan = simulation_.plan();
    const double period = plan.trajectory.period();
    for (std::size_t i = 0; i < plan.slip.size(); ++i) {
      const double at = period * static_cast<double>(i);
      if (at < t - kCause || at > t) continue;
      if (std::max(std::abs(plan.slip[i][0]), std::abs(plan.slip[i][1])) > kSlip) return true;
    }
    return false;
  }

  const simulator::Simulation& simulation_;
  std::array<std::vector<double>, kMaxBeams> wrong_ranges_;  ///< [s]
};

/// What was said of one run.
struct Alarms {
  double duration = 0.0;  ///< [s]
  int founded = 0;
  int unfounded = 0;
  double lost = 0.0;  ///< [s]
  Log log;
};

/// An alarm is what is said between two times of being content.
Alarms listen(const simulator::Simulation& simulation, const FilterConfig& config) {
  const Causes causes(simulation);
  Alarms alarms;
  alarms.log = run(simulation, config).log;
  alarms.duration = alarms.log.duration;
  alarms.lost = alarms.log.lost;
  bool complained = false;
  bool founded = true;
  SourceSet named;
  for (const Change& change : alarms.log.changes) {
    if (change.complains()) {
      founded = (!complained || founded) && causes.explain(change, named);
    } else if (complained) {
      ++(founded ? alarms.founded : alarms.unfounded);
    }
    complained = change.complains();
    named = change.faulty;
  }
  if (complained) ++(founded ? alarms.founded : alarms.unfounded);
  return alarms;
}

void count_alarms(const std::vector<simulator::Options>& simulations, const FilterConfig& config,
                  const Arguments& args) {
  const std::vector<Alarms> runs = run_all(simulations.size(), args.threads, [&](std::size_t i) {
    return listen(simulator::Simulation(simulations[i]), config);
  });
  std::printf("| sequence | time [s] | alarms with a cause | without | lost for [s] |\n|---|---|---|---|---|\n");
  Alarms total;
  for (std::size_t i = 0; i < runs.size();) {
    const std::string& sequence = simulations[i].sequence;
    Alarms sum;
    for (; i < runs.size() && simulations[i].sequence == sequence; ++i) {
      if (args.verbose) tell(title_of(simulations[i]), runs[i].log);
      for (Alarms* alarms : {&sum, &total}) {
        alarms->duration += runs[i].duration;
        alarms->founded += runs[i].founded;
        alarms->unfounded += runs[i].unfounded;
        alarms->lost += runs[i].lost;
      }
    }
    std::printf("| %s | %.0f | %d | %d | %.1f |\n", sequence.c_str(), sum.duration, sum.founded, sum.unfounded,
                sum.lost);
  }
  std::printf("| all | %.0f | %d | %d, %.1f per hour | %.1f |\n", total.duration, total.founded, total.unfounded,
              3600.0 * total.unfounded / total.duration, total.lost);
}

// ---- Command line

std::vector<simulator::Options> simulations_of(const Arguments& args) {
  const bool all = args.sequences == std::vector<std::string>{"all"};
  std::vector<simulator::Options> simulations;
  for (const std::string& sequence : all ? simulator::sequence_names() : args.sequences) {
    for (const std::uint64_t seed : parse_seeds(args.seeds)) {
      simulator::Options options;
      options.sequence = sequence;
      options.seed = seed;
      options.camera_rate_hz = args.camera_rate_hz;
      options.calibration_error = 1.0;
      simulations.push_back(options);
    }
  }
  return simulations;
}

int parse_and_run(int argc, char** argv) {
  Arguments args;
  CLI::App app{"fault_table: what faults cost, and what the health says of them and of sound sensors", "fault_table"};
  app.add_option("--sequences", args.sequences, "a,b,.. or all")->delimiter(',')->capture_default_str();
  app.add_option("--seeds", args.seeds, "7 or 501..505, several with commas")->delimiter(',')->capture_default_str();
  app.add_option("--faults", args.faults, "one per run, as in ear simulate, the time may be missing; or all")
      ->delimiter(',');
  app.add_option("--start", args.start, "[s] of the faults without a time")->capture_default_str();
  app.add_option("--rate", args.camera_rate_hz, "of the camera [Hz]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--config", args.config, "settings")->check(CLI::ExistingFile);
  app.add_option("--threads", args.threads, "the figures do not depend on it")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--verbose", args.verbose, "every change of what the health says");
  return tools::run_program(app, argc, argv, [&] {
    const FilterConfig config = args.config.empty() ? FilterConfig{} : load_config(args.config).filter;
    const std::vector<simulator::Fault> faults = faults_of(args);
    if (faults.empty()) {
      count_alarms(simulations_of(args), config, args);
    } else {
      compare_faults(simulations_of(args), faults, config, args);
    }
  });
}

}  // namespace
}  // namespace ear::experiments

int main(int argc, char** argv) { return ear::tools::run_main(ear::experiments::parse_and_run, argc, argv); }
