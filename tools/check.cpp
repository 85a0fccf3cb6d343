// ear check RECORDING [--calibration F]... [--json]: reads everything and says whether it can be used, and what is odd.
// Exit code: 0 usable (perhaps with warnings), 2 unusable.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "ear/odometry.h"
#include "src/recording/config_file.h"
#include "src/recording/recording_check.h"
#include "tools/commands.h"
#include "tools/opened_recording.h"

namespace ear::tools {
namespace {

constexpr int kUnusable = 2;

struct CheckArguments {
  std::filesystem::path recording;
  std::vector<std::filesystem::path> calibration_files;
  std::filesystem::path config;
  bool json = false;
};

const char* name_of(Severity severity) { return severity == Severity::error ? "error" : "warning"; }

nlohmann::ordered_json to_json(const RecordingReport& report) {
  nlohmann::ordered_json json;
  json["usable"] = report.usable();
  json["streams"] = nlohmann::ordered_json::array();
  for (const StreamReport& stream : report.streams) {
    const TimingReport& timing = stream.timing;
    json["streams"].push_back({{"name", stream.name},
                               {"count", timing.count},
                               {"rate_hz", timing.rate_hz},
                               {"nominal_rate_hz", stream.nominal_rate_hz},
                               {"first_ns", timing.first_ns},
                               {"last_ns", timing.last_ns},
                               {"jitter_s", timing.jitter_s},
                               {"gaps", timing.gaps},
                               {"longest_gap_s", timing.longest_gap},
                               {"covered_by_imu", stream.covered_by_imu}});
  }
  json["imu"] = {{"clipped", report.imu.clipped}, {"repeated", report.imu.repeated}};
  if (const auto& noise = report.imu.standing_noise) {
    json["imu"]["standing_noise"] = {{"gyroscope_noise_density", noise->gyro},
                                     {"accelerometer_noise_density", noise->accel},
                                     {"seconds", noise->windows}};
  }
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& finding : report.findings) {
    json["findings"].push_back(
        {{"severity", name_of(finding.severity)}, {"where", finding.where}, {"message", finding.message}});
  }
  json["warnings"] = nlohmann::ordered_json::array();
  for (const Warning& warning : report.warnings) {
    json["warnings"].push_back({{"kind", warning.kind}, {"count", warning.count}, {"first", warning.first}});
  }
  return json;
}

void print_streams(const RecordingReport& report) {
  if (report.streams.empty()) return;
  TimeNs start_ns = report.streams.front().timing.first_ns;
  for (const StreamReport& stream : report.streams) {
    if (stream.timing.count > 0) start_ns = std::min(start_ns, stream.timing.first_ns);
  }
  std::printf("%-10s %8s %9s %8s %9s %9s %10s %6s %9s %8s\n", "stream", "samples", "rate", "nominal", "start", "end",
              "jitter", "gaps", "longest", "with IMU");
  for (const StreamReport& stream : report.streams) {
    const TimingReport& timing = stream.timing;
    if (timing.count == 0) {
      std::printf("%-10s %8d\n", stream.name.c_str(), 0);
      continue;
    }
    std::printf("%-10s %8zu %6.1f Hz %5.1f Hz %7.2f s %7.2f s %7.3f ms %6zu %7.3f s %6.1f %%\n", stream.name.c_str(),
                timing.count, timing.rate_hz, stream.nominal_rate_hz, seconds_between(start_ns, timing.first_ns),
                seconds_between(start_ns, timing.last_ns), 1e3 * timing.jitter_s, timing.gaps, timing.longest_gap,
                100.0 * stream.covered_by_imu);
  }
}

void print_imu(const ImuReport& imu) {
  std::printf("\nIMU        %zu clipped samples, %zu repeated", imu.clipped, imu.repeated);
  if (const auto& noise = imu.standing_noise) {
    std::printf("; noise at rest (%zu s): gyroscope %.2g rad/s/sqrt(Hz), accelerometer %.2g m/s^2/sqrt(Hz)",
                noise->windows, noise->gyro, noise->accel);
  }
  std::printf("\n");
}

void print(const RecordingReport& report) {
  print_streams(report);
  if (!report.streams.empty()) print_imu(report.imu);
  if (!report.findings.empty() || !report.warnings.empty()) std::printf("\n");
  for (const Finding& finding : report.findings) {
    std::printf("%-8s   %s: %s\n", name_of(finding.severity), finding.where.c_str(), finding.message.c_str());
  }
  for (const Warning& warning : report.warnings) {
    std::printf("left out   %s, %zu times; the first: %s\n", warning.kind.c_str(), warning.count,
                warning.first.c_str());
  }
  std::printf("\n%s\n", report.usable() ? "usable" : "not usable");
}

// What the estimator refuses makes a recording unusable, too.
void try_estimator(const Config& config, RecordingReport& report) {
  if (!report.calibration || !report.usable()) return;
  try {
    const Odometry odometry(config, *report.calibration);
  } catch (const std::invalid_argument& error) {
    report.findings.push_back({Severity::error, "estimator", error.what()});
  }
}

void check(const CheckArguments& arguments) {
  const Config config = arguments.config.empty() ? Config{} : load_config(arguments.config);
  const OpenedRecording opened(arguments.recording, arguments.config);
  RecordingReport report = check_recording([&](const RecordingOptions& options) { return opened.read(options); },
                                           arguments.calibration_files);
  try_estimator(config, report);
  if (arguments.json) {
    std::cout << to_json(report).dump(2) << '\n';
  } else {
    print(report);
  }
  if (!report.usable()) throw CLI::RuntimeError(kUnusable);
}

}  // namespace

void add_check_command(CLI::App& app) {
  const auto arguments = std::make_shared<CheckArguments>();
  CLI::App* const command =
      app.add_subcommand("check", "Say whether a recording can be used, and what is odd about it");
  command
      ->add_option("recording", arguments->recording, "Folder of the recording, or a bag of ROS 1 or 2 (docs/bags.md)")
      ->required();
  command->add_option("--calibration", arguments->calibration_files,
                      "Kalibr's camchain-imucam.yaml or imu.yaml, instead of the recording's own; may be given twice");
  command
      ->add_option("--config", arguments->config,
                   "Settings of the estimator that is to use it, and a bag's topics (docs/bags.md)")
      ->check(CLI::ExistingFile);
  command->add_flag("--json", arguments->json, "Print JSON");
  command->footer("Exit code: 0 usable (perhaps with warnings), 2 unusable.");
  command->callback([arguments] { check(*arguments); });
}

}  // namespace ear::tools
