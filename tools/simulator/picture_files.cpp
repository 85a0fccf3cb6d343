#include "tools/simulator/picture_files.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <fstream>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <thread>

#include "tools/simulator/picture_maker.h"

namespace ear::simulator {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFaultLine = "  - ";  // begins one fault in simulation.yaml

void make_folders(const Simulation& simulation, const fs::path& directory) {
  for (std::size_t camera = 0; camera < simulation.calibration().cameras.size(); ++camera) {
    fs::create_directories(image_path(directory, camera, 0).parent_path());
  }
}

fs::path path_of(const Simulation& simulation, const fs::path& directory, const Shot& picture) {
  return image_path(directory, picture.camera, simulation.exposures().at(picture.exposure));
}

std::vector<std::string> picture_faults(const std::vector<Fault>& faults) {
  std::vector<std::string> texts;
  for (const Fault& fault : faults) {
    if (changes_pictures(fault)) texts.push_back(to_string(fault));
  }
  return texts;
}

// Those of a recording made before.
std::vector<std::string> picture_faults(const fs::path& recording) {
  std::ifstream file(origin_file(recording));
  std::vector<Fault> faults;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind(kFaultLine, 0) == 0) faults.push_back(parse_fault(line.substr(std::string(kFaultLine).size())));
  }
  return picture_faults(faults);
}

}  // namespace

fs::path image_path(const fs::path& directory, std::size_t camera, TimeNs taken_ns) {
  return directory / "mav0" / ("cam" + std::to_string(camera)) / "data" / (std::to_string(taken_ns) + ".png");
}

std::vector<Shot> all_pictures(const Simulation& simulation) {
  std::vector<Shot> pictures;
  for (const Frame& frame : simulation.frames()) {
    for (std::size_t camera = 0; camera < simulation.calibration().cameras.size(); ++camera) {
      pictures.push_back({frame.exposure, camera});
    }
  }
  return pictures;
}

void render_images(const Simulation& simulation, const std::vector<Shot>& pictures, const fs::path& directory,
                   int threads, const Progress& progress) {
  const PictureMaker maker(simulation);
  make_folders(simulation, directory);

  // Noise does not compress, and the encoder must not cost more than the picture: run lengths. Without a level OpenCV
  // takes zlib's fastest, and one filter instead of a choice per row; the files become 4 % larger.
  const std::vector<int> png{cv::IMWRITE_PNG_STRATEGY, cv::IMWRITE_PNG_STRATEGY_RLE};
  std::atomic<std::size_t> next{0};
  std::size_t done = 0;
  std::exception_ptr failure;
  std::mutex mutex;  // of `done`, `failure` and the progress
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < pictures.size(); i = next++) {
        const fs::path path = path_of(simulation, directory, pictures[i]);
        if (!cv::imwrite(path.string(), maker.make(pictures[i]), png)) {
          throw std::runtime_error(path.string() + ": cannot be written");
        }
        const std::lock_guard lock(mutex);
        progress(++done, pictures.size());
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
      next = pictures.size();  // the others stop, too
    }
  };
  std::vector<std::thread> pool;
  for (int i = 1; i < threads; ++i) pool.emplace_back(work);
  work();
  for (std::thread& thread : pool) thread.join();
  if (failure) std::rethrow_exception(failure);
}

std::vector<std::string> picture_origin(const Simulation& simulation) {
  const Options& options = simulation.options();
  std::vector<std::string> lines{"sequence: " + options.sequence, "seed: " + std::to_string(options.seed),
                                 "frames: " + std::to_string(simulation.exposures().size()),
                                 "camera_rate_hz: " + std::to_string(options.camera_rate_hz)};
  lines.emplace_back(options.lens == LensModel::equidistant ? "lens: equidistant" : "lens: radial-tangential");
  if (options.k3 != 0.0) lines.back() += ", k3 " + std::to_string(options.k3);
  return lines;
}

fs::path origin_file(const fs::path& directory) { return directory / "simulation.yaml"; }

void require_same_pictures(const Simulation& simulation, const fs::path& other) {
  const fs::path origin = origin_file(other);
  std::ifstream file(origin);
  if (!file) throw std::runtime_error(origin.string() + ": cannot be read; is that a simulated recording?");
  const auto refuse = [&origin](const std::string& said, const std::string& needed) {
    throw std::runtime_error(origin.string() + ": says '" + said + "', the pictures needed are of '" + needed + "'");
  };
  std::string line;
  std::getline(file, line);  // a comment
  for (const std::string& expected : picture_origin(simulation)) {
    std::getline(file, line);
    if (line != expected) refuse(line, expected);
  }
  const std::vector<std::string> there = picture_faults(other);
  const std::vector<std::string> here = picture_faults(simulation.options().faults);
  if (!there.empty() && there != here) refuse(there.front(), here.empty() ? "no such fault" : here.front());
}

std::vector<Shot> link_images(const Simulation& simulation, const fs::path& directory, const fs::path& other) {
  make_folders(simulation, directory);
  const bool faults_there = !picture_faults(other).empty();
  std::vector<Shot> missing;
  for (const Shot& picture : all_pictures(simulation)) {
    // Where the other one has no faults, a frozen or swapped image is found there under its own name.
    const Shot source = faults_there ? picture : shown(simulation.exposures(), simulation.options().faults, picture);
    if (!faults_there && changed_by_faults(simulation, source)) {
      missing.push_back(picture);
      continue;
    }
    const fs::path from = path_of(simulation, other, source);
    const fs::path to = path_of(simulation, directory, picture);
    std::error_code cannot_link;
    fs::create_hard_link(from, to, cannot_link);
    if (cannot_link) fs::copy_file(from, to);
  }
  return missing;
}

}  // namespace ear::simulator
