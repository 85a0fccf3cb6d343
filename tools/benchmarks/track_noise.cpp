// track_noise: by how much the front end's features miss the truth on rendered images, and for how long they do so.
//
//   ear simulate calibrate --seed 7 --calibration-error 0 --camera-rate 10 --out rendered
//   track_noise rendered --sequence calibrate --seed 7 --camera-rate 10
//
// A feature is the point of the scene that the left camera showed where it was first seen.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <opencv2/core/utility.hpp>

#include "src/recording/recording.h"
#include "tools/benchmarks/program.h"
#include "tools/calibration/recorded_drive.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/simulation.h"

namespace ear::tools {
namespace {

struct Arguments {
  std::filesystem::path recording;
  simulator::Options options;
  double wild = 1.0;    ///< [px] a track with an error beyond is of another point: it is counted and left out
  bool moving = false;  ///< only frames that are taken in motion
};

/// One sighting against the truth [px].
struct Sighting {
  double age = 0.0;  ///< [s]
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  std::optional<Eigen::Vector2d> right;
  double range = 0.0;  ///< from the left camera [m]
  bool floor = false;
};

using Track = std::vector<Sighting>;

Eigen::Isometry3d pose_at(const simulator::Simulation& simulation, TimeNs t_ns, std::size_t camera) {
  const simulator::Truth truth = simulation.truth(t_ns);
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
  T_WB.linear() = truth.R_WB;
  T_WB.translation() = truth.p_WB;
  return T_WB * simulation.true_calibration().cameras[camera].T_BC;
}

/// Tracks of two sightings and more, in the order in which they begin.
std::vector<Track> tracks_of(const simulator::Simulation& simulation, const calibration::Drive& drive, bool moving) {
  struct Begun {
    TimeNs t_ns;
    Eigen::Vector3d p_W;
    bool floor;
    std::size_t track;
  };
  const std::vector<CameraCalibration>& cameras = simulation.true_calibration().cameras;
  std::unordered_map<std::uint64_t, Begun> begun;
  std::vector<Track> tracks;
  for (const FeatureFrame& frame : drive.frames) {
    const simulator::Truth truth = simulation.truth(frame.t_ns);
    const bool moves = truth.v_W.norm() > 0.1 || truth.omega_B.norm() > 0.1;
    const std::array<Eigen::Isometry3d, 2> T_WC{pose_at(simulation, frame.t_ns, 0), pose_at(simulation, frame.t_ns, 1)};
    for (const FeatureObservation& feature : frame.features) {
      auto found = begun.find(feature.id);
      if (found == begun.end()) {
        const Eigen::Vector3d direction_W = T_WC[0].linear() * feature.left.homogeneous().normalized();
        const auto hit = simulation.scene().cast(T_WC[0].translation(), direction_W);
        if (!hit) continue;
        const Eigen::Vector3d p_W = T_WC[0].translation() + hit->range * direction_W;
        found =
            begun.emplace(feature.id, Begun{frame.t_ns, p_W, hit->panel == simulator::kGround, tracks.size()}).first;
        tracks.emplace_back();
      }
      if (moving && !moves) continue;
      const auto error = [&](std::size_t camera, const Eigen::Vector2d& seen) -> Eigen::Vector2d {
        const Eigen::Vector3d p_C = T_WC[camera].inverse(Eigen::Isometry) * found->second.p_W;
        return simulator::to_pixel(cameras[camera], seen) - simulator::to_pixel(cameras[camera], p_C.hnormalized());
      };
      Sighting sighting;
      sighting.age = seconds_between(found->second.t_ns, frame.t_ns);
      sighting.left = error(0, feature.left);
      if (feature.has_right) sighting.right = error(1, feature.right);
      sighting.range = (found->second.p_W - T_WC[0].translation()).norm();
      sighting.floor = found->second.floor;
      tracks[found->second.track].push_back(sighting);
    }
  }
  return tracks;
}

double wildest(const Track& track) {
  double largest = 0.0;
  for (const Sighting& sighting : track) {
    largest = std::max(largest, sighting.left.lpNorm<Eigen::Infinity>());
    if (sighting.right) largest = std::max(largest, sighting.right->lpNorm<Eigen::Infinity>());
  }
  return largest;
}

/// What a track is looked at for.
struct Component {
  const char* name;
  std::optional<double> (*of)(const Sighting&);
};

const std::array<Component, 5> kComponents{{
    {"left u", [](const Sighting& s) -> std::optional<double> { return s.left.x(); }},
    {"left v", [](const Sighting& s) -> std::optional<double> { return s.left.y(); }},
    {"right u",
     [](const Sighting& s) -> std::optional<double> { return s.right ? std::optional(s.right->x()) : std::nullopt; }},
    {"right v",
     [](const Sighting& s) -> std::optional<double> { return s.right ? std::optional(s.right->y()) : std::nullopt; }},
    {"disparity",
     [](const Sighting& s) -> std::optional<double> {
       return s.right ? std::optional(s.left.x() - s.right->x()) : std::nullopt;
     }},
}};

/// Sums over the pairs of sightings that are one lag apart.
struct Pairs {
  double product = 0.0, first = 0.0, second = 0.0, steps = 0.0, count = 0.0;
  void add(double a, double b) {
    product += a * b;
    first += a * a;
    second += b * b;
    steps += (a - b) * (a - b);
    count += 1.0;
  }
  [[nodiscard]] double correlation() const { return product / std::sqrt(first * second); }
};

void print_ages(const std::vector<Track>& tracks) {
  std::printf("\nmean +- standard deviation [px] by age [s]\n| |");
  const std::array<double, 7> edges{0.05, 0.25, 0.5, 1.0, 2.0, 4.0, 1e9};
  std::printf(" first |");
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) std::printf(" from %.2g |", edges[i]);
  std::printf("\n");
  for (const bool floor : {false, true}) {
    for (const Component& component : kComponents) {
      std::printf("| %s, %s |", component.name, floor ? "ground" : "walls");
      for (std::size_t i = 0; i < edges.size(); ++i) {
        const double from = i == 0 ? -1.0 : edges[i - 1];
        double sum = 0.0, squares = 0.0, count = 0.0;
        for (const Track& track : tracks) {
          for (const Sighting& s : track) {
            const auto value = component.of(s);
            if (s.floor != floor || !value || s.age < from || s.age >= edges[i]) continue;
            sum += *value;
            squares += *value * *value;
            count += 1.0;
          }
        }
        const double mean = sum / count;
        std::printf(" %+.4f +- %.4f |", mean, std::sqrt(squares / count - mean * mean));
      }
      std::printf("\n");
    }
  }
}

/// Against the truth, and against the mean of the track: what a point that is estimated leaves.
void print_lags(const std::vector<Track>& tracks) {
  for (const bool about_mean : {false, true}) {
    std::printf("\ncorrelation over lags [s], %s; and half the mean squared step, as sigma [px]\n| | sigma |",
                about_mean ? "about each track's mean" : "against the truth, first sighting left out");
    const std::array<double, 8> lags{0.1, 0.2, 0.4, 0.6, 1.0, 2.0, 4.0, 8.0};
    for (const double lag : lags) std::printf(" %.1f |", lag);
    std::printf("\n");
    for (const Component& component : kComponents) {
      std::array<Pairs, lags.size()> pairs;
      Pairs all;
      for (const Track& track : tracks) {
        double mean = 0.0, count = 0.0;
        for (const Sighting& s : track) {
          const auto value = component.of(s);
          if (!value || s.age < 0.05) continue;
          mean += *value;
          count += 1.0;
        }
        mean = about_mean && count > 0.0 ? mean / count : 0.0;
        for (std::size_t i = 0; i < track.size(); ++i) {
          const auto a = component.of(track[i]);
          if (!a || track[i].age < 0.05) continue;
          all.add(*a - mean, *a - mean);
          std::size_t k = 0;
          for (std::size_t j = i + 1; j < track.size(); ++j) {
            const double lag = track[j].age - track[i].age;
            while (k < lags.size() && lag > lags[k] + 0.02) ++k;
            if (k == lags.size()) break;
            const auto b = component.of(track[j]);
            if (!b || std::abs(lag - lags[k]) > 0.02) continue;
            pairs[k].add(*a - mean, *b - mean);
          }
        }
      }
      std::printf("| %s | %.4f |", component.name, std::sqrt(all.product / all.count));
      for (const Pairs& lag : pairs) {
        std::printf(" %.2f (%.3f) |", lag.correlation(), std::sqrt(0.5 * lag.steps / lag.count));
      }
      std::printf("\n");
    }
  }
}

/// How features of one frame err alike: correlation of two features of the same frame would be a motion of the camera.
void print_ranges(const std::vector<Track>& tracks) {
  std::printf("\ndisparity error [px] by range [m], not first sightings: mean, sigma, of tracks' means, tracks\n");
  for (const bool floor : {false, true}) {
    const std::array<double, 7> edges{0.0, 0.7, 1.0, 1.5, 2.5, 4.0, 8.0};
    for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
      double sum = 0.0, squares = 0.0, count = 0.0, means = 0.0, number = 0.0;
      for (const Track& track : tracks) {
        double mean = 0.0, n = 0.0;
        for (const Sighting& s : track) {
          if (!s.right || s.floor != floor || s.age < 0.05 || s.range < edges[i] || s.range >= edges[i + 1]) continue;
          const double d = s.left.x() - s.right->x();
          mean += d;
          squares += d * d;
          n += 1.0;
        }
        if (n == 0.0) continue;
        sum += mean;
        count += n;
        means += mean * mean / (n * n);
        number += 1.0;
      }
      if (count == 0.0) continue;
      std::printf("%s %.1f..%.1f: %+.4f, %.4f, %.4f, %.0f\n", floor ? "ground" : "walls", edges[i], edges[i + 1],
                  sum / count, std::sqrt(squares / count), std::sqrt(means / number), number);
    }
  }
}

void track_noise(const Arguments& args) {
  cv::setNumThreads(1);
  Recording recording(args.recording);
  const calibration::Drive drive =
      calibration::recorded_drive(recording, args.recording.string(), Config{}, [](double) {});
  simulator::Options options = args.options;
  options.tracks = false;
  options.calibration_error = 0.0;
  const simulator::Simulation simulation(options);
  std::vector<Track> tracks;
  std::size_t sightings = 0, wild = 0, all = 0;
  for (Track& track : tracks_of(simulation, drive, args.moving)) {
    if (track.size() < 3) continue;
    ++all;
    if (wildest(track) > args.wild) {
      ++wild;
      continue;
    }
    sightings += track.size();
    tracks.push_back(std::move(track));
  }
  std::printf("%zu tracks of three sightings and more, %zu of them beyond %.1f px and left out; %zu sightings\n", all,
              wild, args.wild, sightings);
  print_ages(tracks);
  print_lags(tracks);
  print_ranges(tracks);
}

int parse_and_run(int argc, char** argv) {
  Arguments args;
  CLI::App app{"track_noise: features of rendered images against the truth", "track_noise"};
  app.add_option("RECORDING", args.recording, "of ear simulate, with the true calibration")->required();
  app.add_option("--sequence", args.options.sequence, "that it was made with")->required();
  app.add_option("--seed", args.options.seed, "that it was made with")->required();
  app.add_option("--duration", args.options.duration, "that it was made with");
  app.add_option("--camera-rate", args.options.camera_rate_hz, "that it was made with")->capture_default_str();
  app.add_flag("--moving", args.moving, "only frames that are taken in motion");
  app.add_option("--wild", args.wild, "[px] tracks with larger errors are left out")->capture_default_str();
  return run_program(app, argc, argv, [&] { track_noise(args); });
}

}  // namespace
}  // namespace ear::tools

int main(int argc, char** argv) { return ear::tools::run_main(ear::tools::parse_and_run, argc, argv); }
