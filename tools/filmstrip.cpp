#include "tools/filmstrip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "src/jpeg.h"
#include "src/recording/csv.h"
#include "src/recording/frame_list.h"
#include "src/recording/image_file.h"
#include "src/recording/rows.h"
#include "src/recording/sample_stream.h"
#include "src/recording/warnings.h"

namespace ear::tools {
namespace {

namespace fs = std::filesystem;
using evaluation::Moment;
using evaluation::MomentKind;

constexpr std::size_t kMost = 20;           // moments: 20 kB each
constexpr int kWidth = 400;                 // [px] of an image at most
constexpr TimeNs kFarthest = 500'000'000;   // of an image, and of a strike after a landing
constexpr TimeNs kBefore = 300'000'000;     // a strike is felt before the landing is known
constexpr double kGravity = 9.81;           // [m/s^2]
constexpr double kStrike = 0.7 * kGravity;  // [m/s^2] chosen: what driving over ground does not reach

/// RECORDING/mav0 or RECORDING; empty: it is no folder of a recording.
fs::path mav0_of(const fs::path& recording) {
  for (const fs::path& folder : {recording / "mav0", recording}) {
    if (fs::is_directory(folder / "imu0") || fs::is_directory(folder / "cam0")) return folder;
  }
  return {};
}

/// The hardest inertial sample around each landing.
std::vector<Moment> strikes(const std::vector<Moment>& moments, const fs::path& imu_file) {
  struct Peak {
    TimeNs landing_ns = 0, t_ns = 0;
    double excess = 0.0;  ///< of the specific force over gravity [m/s^2]
  };
  std::vector<Peak> peaks;
  for (const Moment& moment : moments) {
    if (moment.kind == MomentKind::landing) peaks.push_back({moment.t_ns, 0, 0.0});
  }
  if (peaks.empty() || !fs::is_regular_file(imu_file)) return {};
  SampleStream<ImuSample> samples(imu_file, "imu0", parse_imu_row);
  Warnings warnings;
  while (const std::optional<ImuSample> sample = samples.next(warnings)) {
    const double excess = std::abs(sample->accel_B.norm() - kGravity);
    for (Peak& peak : peaks) {
      const bool near = sample->t_ns >= peak.landing_ns - kBefore && sample->t_ns <= peak.landing_ns + kFarthest;
      if (near && excess > peak.excess) peak = {peak.landing_ns, sample->t_ns, excess};
    }
  }
  std::vector<Moment> found;
  for (const Peak& peak : peaks) {
    std::array<char, 60> words{};
    std::snprintf(words.data(), words.size(), "strike: %.0f m/s\u00b2 beyond gravity", peak.excess);
    if (peak.excess > kStrike) found.push_back({peak.t_ns, MomentKind::strike, words.data()});
  }
  return found;
}

void add_images(std::vector<Moment>& moments, const fs::path& mav0) {
  FrameList list(mav0, false, 0.0);
  Warnings warnings;
  std::vector<FrameFiles> nearest(moments.size());
  const auto off = [](const Moment& moment, const FrameFiles& files) { return std::abs(files.t_ns - moment.t_ns); };
  while (const std::optional<FrameFiles> files = list.next(warnings)) {
    for (std::size_t i = 0; i < moments.size(); ++i) {
      if (nearest[i].left.empty() || off(moments[i], *files) < off(moments[i], nearest[i])) nearest[i] = *files;
    }
  }
  for (std::size_t i = 0; i < moments.size(); ++i) {
    if (nearest[i].left.empty() || off(moments[i], nearest[i]) > kFarthest) continue;
    const cv::Mat image = read_image(nearest[i].left, "cam0", warnings);
    if (!image.empty())
      moments[i].jpeg = jpeg({image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)}, kWidth);
  }
}

}  // namespace

std::vector<Moment> film(std::vector<Moment> moments, const fs::path& recording) {
  const fs::path mav0 = mav0_of(recording);
  if (mav0.empty()) return evaluation::foremost(std::move(moments), kMost);
  const std::vector<Moment> felt = strikes(moments, mav0 / "imu0" / "data.csv");
  moments.insert(moments.end(), felt.begin(), felt.end());
  moments = evaluation::foremost(std::move(moments), kMost);
  if (fs::is_regular_file(mav0 / "cam0" / "data.csv")) add_images(moments, mav0);
  return moments;
}

}  // namespace ear::tools
