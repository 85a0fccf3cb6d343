// ear simulate SEQUENCE --out DIR: a recording of a vehicle that does not exist, with its truth.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tools/commands.h"
#include "tools/progress.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/picture_files.h"
#include "tools/simulator/recording_writer.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/simulation.h"

namespace ear::tools {
namespace {

struct SimulateArguments {
  simulator::Options options;
  std::vector<std::string> faults;
  std::filesystem::path out;
  bool no_images = false;
  std::filesystem::path images_from;
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
};

void simulate(const SimulateArguments& args) {
  simulator::Options options = args.options;
  options.tracks = false;
  for (const std::string& fault : args.faults) options.faults.push_back(simulator::parse_fault(fault));
  const simulator::Simulation simulation(options);
  if (!args.images_from.empty()) simulator::require_same_pictures(simulation, args.images_from);
  simulator::write_recording(simulation, args.out,
                             args.no_images ? simulator::WithCameras::no : simulator::WithCameras::yes);

  std::vector<simulator::Shot> pictures;
  if (!args.images_from.empty()) {
    pictures = simulator::link_images(simulation, args.out, args.images_from);
  } else if (!args.no_images) {
    pictures = simulator::all_pictures(simulation);
  }
  if (!pictures.empty()) {
    Progress progress;
    simulator::render_images(simulation, pictures, args.out, args.threads, [&](std::size_t done, std::size_t total) {
      progress.show("rendering " + std::to_string(done) + " of " + std::to_string(total) + " images");
    });
    progress.finish();
  }
  std::printf("%s: %s seed %llu, %.1f s, %.1f m, %zu stereo frames%s\n", args.out.c_str(), options.sequence.c_str(),
              static_cast<unsigned long long>(options.seed),
              seconds_between(simulation.truth_times().front(), simulation.truth_times().back()),
              simulation.path_length(), simulation.frame_times().size(), args.no_images ? " (without images)" : "");
}

std::string list_of_sequences() {
  std::string list = "Sequences:";
  for (const std::string& name : simulator::all_sequence_names()) {
    list += "\n  " + name + ": " + simulator::find_sequence(name).summary;
  }
  return list;
}

}  // namespace

void add_simulate_command(CLI::App& app) {
  const auto args = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand("simulate", "write a recording of a simulated vehicle, with its truth");
  command->footer(list_of_sequences() + "\n\n" + simulator::fault_help());
  command->add_option("sequence", args->options.sequence, "what it does (below)")->required();
  command->add_option("--out", args->out, "folder of the recording; must not hold one yet")->required();
  command->add_option("--seed", args->options.seed, "varies noise, textures and details of the motion")
      ->capture_default_str();
  command->add_option("--duration", args->options.duration, "[s] stop earlier, or keep standing at the end");
  command->add_option("--camera-rate", args->options.camera_rate_hz, "[Hz]")->capture_default_str();
  CLI::Option* calibration_error =
      command->add_option("--calibration-error", args->options.calibration_error,
                          "errors of the calibration that is written, times those of real rigs: 0 none, 1 as they are; "
                          "without it errors of fixed sizes");
  command
      ->add_flag_callback(
          "--perfect-calibration", [args] { args->options.calibration_error = 0.0; }, "--calibration-error 0")
      ->excludes(calibration_error);
  command->add_option("--fault", args->faults, "what goes wrong, as NAME@START+DURATION (below); may be repeated");
  CLI::Option* no_images =
      command->add_flag("--no-images", args->no_images, "no cameras: everything but their folders");
  command
      ->add_option("--images-from", args->images_from,
                   "link the pictures of this recording of the same simulation; faulty ones are rendered")
      ->excludes(no_images);
  command->add_option("--threads", args->threads, "that render; the pictures do not depend on it")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command->callback([args] { simulate(*args); });
}

}  // namespace ear::tools
