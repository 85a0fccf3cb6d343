#include "tools/paper/schedule.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <stdexcept>

#include "tools/experiments/in_parallel.h"
#include "tools/paper/measure/configuration.h"
#include "tools/paper/measure/run.h"
#include "tools/paper/progress_log.h"
#include "tools/paper/source_hashes.h"
#include "tools/simulator/picture_files.h"
#include "tools/simulator/recording_writer.h"
#include "tools/simulator/sequence.h"

namespace ear::paper {
namespace {

namespace fs = std::filesystem;

constexpr double kFullRate = 30.0;         // [Hz] of a recording's camera
constexpr double kCalibrationError = 1.0;  // simulator::Options::calibration_error
constexpr double kBytesPerSecond = 14e6;   // of a recording with images

// Processor time of each piece of work, per second of a recording [s]: for the time that is left.
constexpr double kRenderCost = 2.5;
constexpr double kImagesCost = 0.3;
constexpr double kSimulateCost = 0.01;
constexpr double kTracksCost = 0.025;

/// A run that is missing.
struct Run {
  Setup setup;
  fs::path file;
};

/// All missing runs on one simulation or recording.
struct Job {
  std::string sequence;
  double camera_rate_hz = kFullRate;
  std::uint64_t seed = 1;
  std::vector<Run> runs;
  double duration = 0.0;  ///< of the recording [s]
  double cost = 0.0;
};

std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(hash));
  return digits.data();
}

/// What a simulation depends on, but for the camera's rate.
std::string simulation_text(const Conditions& c, const std::string& sequence, std::uint64_t seed) {
  return "simulator " + simulator_sources() + "\n" + sequence + " " + std::to_string(seed) + " " +
         (c.duration ? std::to_string(*c.duration) : "whole") + " calibration error " +
         std::to_string(kCalibrationError) + "\n";
}

fs::path recording_folder(const Conditions& c, const Job& job) {
  return c.out / "recordings" /
         (job.sequence + "_" + std::to_string(job.seed) + "_" + hash_of(simulation_text(c, job.sequence, job.seed)));
}

double duration_of(const Conditions& c, const std::string& sequence) {
  const simulator::Sequence plan = simulator::find_sequence(sequence);
  const double whole = std::accumulate(plan.legs.begin(), plan.legs.end(), 0.0,
                                       [](double sum, const simulator::Leg& leg) { return sum + leg.duration; });
  return std::min(whole, c.duration.value_or(whole));
}

double cost_of(const Conditions& c, const Job& job, const Run& run) {
  return job.duration * (c.tracks ? kTracksCost : kImagesCost) * run.setup.camera_rate_hz / kFullRate;
}

double preparation_cost(const Conditions& c, const Job& job) {
  if (c.tracks) return job.duration * kSimulateCost;
  return fs::exists(recording_folder(c, job)) ? 0.0 : job.duration * kRenderCost;
}

std::vector<Job> jobs_of(const Conditions& c, const std::vector<Setup>& setups) {
  std::vector<Job> jobs;
  for (const std::uint64_t seed : c.seeds) {
    for (const Setup& setup : setups) {
      const fs::path file = result_file(c, setup, seed);
      if (fs::exists(file)) continue;
      const double rate = c.tracks ? setup.camera_rate_hz : kFullRate;
      auto job = std::find_if(jobs.begin(), jobs.end(), [&](const Job& j) {
        return j.sequence == setup.sequence && j.seed == seed && j.camera_rate_hz == rate;
      });
      if (job == jobs.end()) {
        job = jobs.insert(jobs.end(), {setup.sequence, rate, seed, {}, duration_of(c, setup.sequence), 0.0});
      }
      const bool known =
          std::any_of(job->runs.begin(), job->runs.end(), [&](const Run& run) { return run.file == file; });
      if (!known) job->runs.push_back({setup, file});
    }
  }
  for (Job& job : jobs) {
    job.cost = preparation_cost(c, job);
    for (const Run& run : job.runs) job.cost += cost_of(c, job, run);
  }
  std::stable_sort(jobs.begin(), jobs.end(), [](const Job& a, const Job& b) { return a.cost > b.cost; });
  return jobs;
}

simulator::Options options_of(const Conditions& c, const Job& job) {
  simulator::Options options;
  options.sequence = job.sequence;
  options.seed = job.seed;
  options.duration = c.duration;
  options.camera_rate_hz = job.camera_rate_hz;
  options.tracks = c.tracks;
  options.calibration_error = kCalibrationError;
  return options;
}

std::string name_of(const Job& job) { return job.sequence + ", seed " + std::to_string(job.seed); }

/// Renders the recording unless it is there. One that was interrupted begins anew.
void make_recording(const Conditions& c, const Job& job, ProgressLog& log) {
  const fs::path folder = recording_folder(c, job);
  if (fs::exists(folder)) return;
  const fs::path part = folder.string() + ".part";
  fs::remove_all(part);
  const simulator::Simulation simulation(options_of(c, job));
  simulator::write_recording(simulation, part);
  const double cost = preparation_cost(c, job);
  std::size_t before = 0;
  simulator::render_images(simulation, simulator::all_pictures(simulation), part, 1,
                           [&](std::size_t done, std::size_t total) {
                             const double share = static_cast<double>(done - before) / static_cast<double>(total);
                             before = done;
                             log.advance(cost * share, "rendering " + name_of(job));
                           });
  fs::rename(part, folder);
}

void work_on(const Conditions& c, const Job& job, ProgressLog& log) {
  const auto run_all = [&](const auto& run_one) {
    for (const Run& run : job.runs) {
      const Configuration& configuration = find_configuration(run.setup.configuration);
      write_complete(run.file, to_json(run_one(run.setup, configuration)));
      log.finish_run(cost_of(c, job, run), name_of(job) + ", " + configuration.title);
    }
  };
  if (c.tracks) {
    const simulator::Simulation simulation(options_of(c, job));
    log.advance(preparation_cost(c, job), "simulated " + name_of(job));
    run_all([&](const Setup&, const Configuration& configuration) { return run_on_tracks(simulation, configuration); });
    return;
  }
  make_recording(c, job, log);
  const fs::path folder = recording_folder(c, job);
  run_all([&](const Setup& setup, const Configuration& configuration) {
    return run_on_images(folder, setup.camera_rate_hz < kFullRate ? setup.camera_rate_hz : 0.0, configuration);
  });
  if (!c.keep_recordings) fs::remove_all(folder);
}

void require_space(const Conditions& c, const std::vector<Job>& jobs) {
  if (c.tracks) return;
  std::vector<double> sizes;
  for (const Job& job : jobs) {
    if (!fs::exists(recording_folder(c, job))) sizes.push_back(job.duration * kBytesPerSecond);
  }
  std::sort(sizes.rbegin(), sizes.rend());
  if (!c.keep_recordings) sizes.resize(std::min(sizes.size(), static_cast<std::size_t>(c.threads)));
  const double needed = std::accumulate(sizes.begin(), sizes.end(), 0.0);
  const auto available = static_cast<double>(fs::space(c.out).available);
  if (needed <= available) return;
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), ": the recordings need about %.0f GB, %.0f GB are free%s", 1e-9 * needed,
                1e-9 * available, c.keep_recordings ? "; --discard-recordings keeps few at a time" : "");
  throw std::runtime_error(c.out.string() + text.data());
}

}  // namespace

fs::path result_file(const Conditions& c, const Setup& setup, std::uint64_t seed) {
  const std::string rate = std::to_string(std::lround(setup.camera_rate_hz)) + "Hz";
  const std::string made_of = simulation_text(c, setup.sequence, seed) + "estimator " + estimator_sources() + "\n" +
                              (c.tracks ? "tracks " : "images ") + std::to_string(setup.camera_rate_hz) + "\n" +
                              settings_text(find_configuration(setup.configuration));
  const std::string name = setup.sequence + "_" + rate + "_" + std::to_string(seed) + "_" + hash_of(made_of);
  return c.out / "runs" / (name + ".json");
}

std::size_t measure(const Conditions& c, const std::vector<Setup>& setups) {
  fs::create_directories(c.out / "runs");
  const std::vector<Job> jobs = jobs_of(c, setups);
  require_space(c, jobs);
  const auto cost = [](double sum, const Job& job) { return sum + job.cost; };
  const auto count = [](std::size_t sum, const Job& job) { return sum + job.runs.size(); };
  const std::size_t runs = std::accumulate(jobs.begin(), jobs.end(), std::size_t{0}, count);
  ProgressLog log(std::accumulate(jobs.begin(), jobs.end(), 0.0, cost), runs);
  experiments::in_parallel(jobs.size(), c.threads, [&](std::size_t i) { work_on(c, jobs[i], log); });
  log.finish();
  return runs;
}

std::vector<Result> results_of(const Conditions& c, const Setup& setup) {
  std::vector<Result> results;
  for (const std::uint64_t seed : c.seeds) results.push_back(read_result(result_file(c, setup, seed)));
  return results;
}

}  // namespace ear::paper
