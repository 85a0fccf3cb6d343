// The front end on public recordings that nobody on the team made. They lie beside the sources, not among them: without
// them, the tests are skipped.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/core/utility.hpp>
#include <sstream>
#include <string>

#include "frontend/frontend.h"
#include "scene.h"
#include "src/recording/recording.h"
#include "tests/support/skip.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> clip(const char* name) {
  const fs::path path = fs::path(EAR_SOURCE_DIR) / "../shared/data" / name;
  if (fs::exists(path)) return path;
  test::skip("no folder " + path.string());
  return std::nullopt;
}

struct Summary {
  int frames = 0;
  double features = 0.0;  // mean per frame
  double stereo_share = 0.0;
  double median_length = 0.0;  // frames, of all tracks
  double mean_length = 0.0;
};

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Runs the front end over the first frames of a clip. `predict` gives the motion up to a frame; `see` takes the result.
template <class Predict, class See>
Summary run(const fs::path& path, int max_frames, Predict&& predict, See&& see) {
  Recording recording(path);
  Frontend frontend({}, recording.calibration().cameras);
  std::map<std::uint64_t, double> lengths;
  Summary summary;
  double stereo = 0.0;
  while (const auto sample = recording.next()) {
    const auto* frame = std::get_if<RecordedFrame>(&*sample);
    if (frame == nullptr) continue;
    if (++summary.frames > max_frames) break;
    const FeatureFrame& features = frontend.process(*frame, predict(frame->t_ns));
    see(features);
    for (const auto& feature : features.features) {
      lengths[feature.id] += 1.0;
      stereo += feature.has_right ? 1.0 : 0.0;
    }
    summary.features += static_cast<double>(features.features.size());
  }
  summary.frames = std::min(summary.frames, max_frames);
  summary.stereo_share = stereo / std::max(1.0, summary.features);
  std::vector<double> all;
  for (const auto& [id, length] : lengths) all.push_back(length);
  summary.median_length = median(all);
  summary.mean_length = summary.features / static_cast<double>(std::max<std::size_t>(1, all.size()));
  summary.features /= std::max(1, summary.frames);
  return summary;
}

Summary run_without_prediction(const fs::path& path, int max_frames) {
  return run(
      path, max_frames, [](TimeNs) { return MotionPrediction{}; }, [](const FeatureFrame&) {});
}

// Poses of the body, interpolated.
class Truth {
 public:
  explicit Truth(const fs::path& file) {
    std::ifstream in(file);
    std::string line;
    while (std::getline(in, line)) {
      if (line.empty() || line.front() == '#') continue;
      std::replace(line.begin(), line.end(), ',', ' ');
      std::istringstream fields(line);
      TimeNs t = 0;
      double x = 0, y = 0, z = 0, qw = 0, qx = 0, qy = 0, qz = 0;
      fields >> t >> x >> y >> z >> qw >> qx >> qy >> qz;
      poses_[t] = {Eigen::Quaterniond(qw, qx, qy, qz).normalized(), {x, y, z}};
    }
  }

  [[nodiscard]] Eigen::Isometry3d at(TimeNs t) const {
    const auto after = poses_.lower_bound(t);
    REQUIRE(after != poses_.begin());
    REQUIRE(after != poses_.end());
    const auto before = std::prev(after);
    const double share = seconds_between(before->first, t) / seconds_between(before->first, after->first);
    Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
    T_WB.linear() = before->second.first.slerp(share, after->second.first).toRotationMatrix();
    T_WB.translation() = (1.0 - share) * before->second.second + share * after->second.second;
    return T_WB;
  }

 private:
  std::map<TimeNs, std::pair<Eigen::Quaterniond, Eigen::Vector3d>> poses_;
};

}  // namespace

TEST_CASE("clips: a standing EuRoC camera keeps its features") {
  const auto path = clip("micro_euroc");
  if (!path) return;
  const Summary summary = run_without_prediction(*path, 60);
  CHECK(summary.frames == 60);
  CHECK(summary.features > 140.0);
  CHECK(summary.stereo_share > 0.7);
  CHECK(summary.median_length > 50.0);
}

TEST_CASE("clips: a single EuRoC camera in motion") {
  const auto path = clip("euroc_v101_mono");
  if (!path) return;
  const Summary summary = run_without_prediction(*path, 60);
  CHECK(summary.features > 120.0);
  CHECK(summary.stereo_share == 0.0);
  CHECK(summary.mean_length > 8.0);
}

TEST_CASE("clips: a car at ten frames a second, without any prediction") {
  const auto path = clip("kitti_a");
  if (!path) return;
  const Summary summary = run_without_prediction(*path, 60);
  CHECK(summary.features > 120.0);
  CHECK(summary.stereo_share > 0.7);
  CHECK(summary.mean_length > 2.5);
}

TEST_CASE("clips: noise of the tracks against exact poses") {
  const auto path = clip("hop");
  if (!path) return;
  const Truth truth(*path / "mav0/state_groundtruth_estimate0/data.csv");
  const Calibration calibration = Recording(*path).calibration();
  const Eigen::Isometry3d T_BC0 = calibration.cameras[0].T_BC;
  const Eigen::Isometry3d T_C1C0 = calibration.cameras[1].T_BC.inverse() * T_BC0;
  const double focal = calibration.cameras[0].fu;

  constexpr std::size_t kLag = 5;
  std::vector<std::map<std::uint64_t, Eigen::Vector2d>> history;
  std::vector<Eigen::Isometry3d> poses;
  std::vector<double> temporal_px;
  std::vector<double> stereo_px;
  // Distance of a ray from the plane that a ray of the other camera spans with the baseline [px].
  const auto epipolar_px = [&](const Eigen::Isometry3d& T_10, const Eigen::Vector2d& x0, const Eigen::Vector2d& x1) {
    const Eigen::Vector3d normal = T_10.translation().cross(T_10.linear() * x0.homogeneous());
    return focal * std::abs(normal.dot(x1.homogeneous())) / normal.head<2>().norm();
  };
  const auto predict = [&](TimeNs t) {
    poses.push_back(truth.at(t));
    return poses.size() < 2 ? MotionPrediction{} : exact_motion(poses[poses.size() - 2], poses.back());
  };
  const auto see = [&](const FeatureFrame& frame) {
    std::map<std::uint64_t, Eigen::Vector2d>& seen = history.emplace_back();
    for (const auto& feature : frame.features) {
      seen[feature.id] = feature.left;
      if (feature.has_right) stereo_px.push_back(epipolar_px(T_C1C0, feature.left, feature.right));
    }
    if (history.size() <= kLag) return;
    const std::size_t before = history.size() - 1 - kLag;
    const Eigen::Isometry3d T_10 = (poses.back() * T_BC0).inverse() * (poses[before] * T_BC0);
    if (T_10.translation().norm() < 0.05) return;
    for (const auto& [id, x1] : seen) {
      const auto x0 = history[before].find(id);
      if (x0 != history[before].end()) temporal_px.push_back(epipolar_px(T_10, x0->second, x1));
    }
  };
  const Summary summary = run(*path, 200, predict, see);
  CHECK(summary.features > 140.0);
  CHECK(summary.stereo_share > 0.9);
  REQUIRE(temporal_px.size() > 2000);
  // Robust sigma; the reference patch of a track does not drift, so five frames are not worse than one.
  CHECK(1.48 * median(temporal_px) < 0.09);
  CHECK(1.48 * median(stereo_px) < 0.06);
  const auto share_above = [](const std::vector<double>& values, double limit) {
    const auto above = std::count_if(values.begin(), values.end(), [&](double v) { return v > limit; });
    return static_cast<double>(above) / static_cast<double>(values.size());
  };
  CHECK(share_above(temporal_px, 1.0) < 0.0025);  // 0.0028 where alignment took what does not fit for noise
  CHECK(share_above(stereo_px, 1.0) < 0.02);
}

}  // namespace ear
