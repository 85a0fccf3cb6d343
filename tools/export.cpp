// ear export RECORDING --format euroc|rosbag1|mcap --out PATH: a recording for other programs.
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "src/bag/bag.h"
#include "src/recording/input_error.h"
#include "src/recording/recording.h"
#include "src/rosbag2/rosbag2.h"
#include "tools/commands.h"
#include "tools/evaluation/read.h"
#include "tools/opened_recording.h"
#include "tools/progress.h"

namespace ear::tools {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  fs::path recording;
  fs::path out;
  fs::path config;
  std::string format;
};

void require_new(const fs::path& path) {
  if (fs::exists(path)) throw InputError(located(path, 0, "", "is there already"));
}

/// Hard links, or copies across file systems.
void link_tree(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const fs::directory_entry& entry : fs::directory_iterator(from)) {
    const fs::path target = to / entry.path().filename();
    if (entry.is_directory()) {
      link_tree(entry.path(), target);
      continue;
    }
    std::error_code failed;
    fs::create_hard_link(entry.path(), target, failed);
    if (failed) fs::copy_file(entry.path(), target);
  }
}

/// What EuRoC's own recordings have: cameras, IMU and truth.
void export_euroc(const fs::path& mav0, const fs::path& out) {
  for (const char* sensor : {"cam0", "cam1", "imu0", "state_groundtruth_estimate0"}) {
    if (fs::exists(mav0 / sensor)) link_tree(mav0 / sensor, out / "mav0" / sensor);
  }
  std::printf("%s: cameras, IMU and truth in the EuRoC layout\n", out.c_str());
}

void export_calibration(const fs::path& mav0, const fs::path& folder) {
  for (const char* sensor : {"cam0", "cam1", "imu0", "encoder0", "laser0"}) {
    const fs::path file = mav0 / sensor / "sensor.yaml";
    if (!fs::exists(file)) continue;
    fs::create_directories(folder / sensor);
    fs::copy_file(file, folder / sensor / "sensor.yaml");
  }
}

void export_bag(const fs::path& mav0, const fs::path& out, const BagTopics& topics) {
  require_new(calibration_folder(out, topics));
  RecordingOptions options;
  options.accept_bad_calibration = true;  // the samples are what is asked for
  Recording recording(mav0, options);
  BagWriter bag(out, topics, recording.calibration());
  if (fs::exists(mav0 / "state_groundtruth_estimate0/data.csv")) {
    for (const evaluation::Pose& pose : evaluation::read_truth(mav0)) bag.write_truth(pose.t_ns, pose.q_WB, pose.p_WB);
  }
  std::size_t samples = 0;
  Progress progress;
  while (const auto sample = recording.next()) {
    std::visit(Overloaded{[&](const RecordedFrame& frame) { bag.write(frame, frame.arrival_ns); },
                          [&](const auto& other) { bag.write(other); }},
               *sample);
    progress.show(std::to_string(++samples) + " samples");
  }
  progress.finish();
  bag.close();
  export_calibration(mav0, calibration_folder(out, topics));
  std::printf("%s: %zu samples; calibration: %s\n", out.c_str(), samples, calibration_folder(out, topics).c_str());
}

void export_mcap(const fs::path& mav0, const fs::path& out) {
  RecordingOptions options;
  options.accept_bad_calibration = true;  // the samples are what is asked for
  Recording recording(mav0, options);
  std::vector<TruePose> truth;
  if (fs::exists(mav0 / "state_groundtruth_estimate0/data.csv")) {
    for (const evaluation::Pose& pose : evaluation::read_truth(mav0))
      truth.push_back({pose.t_ns, pose.q_WB, pose.p_WB});
  }
  Progress progress;
  const std::size_t samples = write_mcap(
      recording, out, mav0, truth, [&](std::size_t written) { progress.show(std::to_string(written) + " samples"); });
  progress.finish();
  std::printf("%s: %zu samples and the sensors' calibration\n", out.c_str(), samples);
}

void export_recording(const ExportArguments& args) {
  require_new(args.out);
  OpenedRecording opened(args.recording, args.config);
  const fs::path mav0 = find_mav0(opened.folder());
  if (args.format == "euroc") {
    export_euroc(mav0, args.out);
  } else if (args.format == "mcap") {
    export_mcap(mav0, args.out);
  } else {
    export_bag(mav0, args.out, args.config.empty() ? BagTopics{} : load_topics(args.config));
  }
}

}  // namespace

void add_export_command(CLI::App& app) {
  const auto args = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand("export", "a recording for other programs (docs/bags.md)");
  command->add_option("RECORDING", args->recording, "folder of the recording, or a bag of ROS 1 or 2")->required();
  command
      ->add_option("--format", args->format,
                   "euroc: a folder with cameras, IMU and truth; rosbag1, mcap: a bag of all, of ROS 1 or ROS 2")
      ->required()
      ->check(CLI::IsMember({"euroc", "rosbag1", "mcap"}));
  command->add_option("--out", args->out, "folder or bag to write; must not be there yet")->required();
  command->add_option("--config", args->config, "settings, of which the bag's topics count")->check(CLI::ExistingFile);
  command->callback([args] { export_recording(*args); });
}

}  // namespace ear::tools
