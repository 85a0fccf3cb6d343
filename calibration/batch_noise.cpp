// How exact the sensors are, by the residuals of a solution.
#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/batch.h"
#include "calibration/common_slip.h"
#include "calibration/noise_estimate.h"

namespace ear::calibration {
namespace {

constexpr double kWildPixel = 8.0;    // [sigma] of both coordinates: the feature is used no more
constexpr double kFlattest = 2e-4;    // [m/sqrt(m)] no ground is known to change less
constexpr double kLeastAside = 2e-4;  // [m/sqrt(m)] of slip along the axle, which no difference of the wheels shows
constexpr double kSmoothest = 1e-3;   // [rad/sqrt(m)]

}  // namespace

void Batch::learn_noise() {
  learn_from_pixels();
  learn_from_beams();
  if (!given_.encoder) return;
  learn_from_ground();
  const RollSetting setting{*given_.encoder, given_.imu, odometer_of(*given_.encoder),
                            odometer_of(*applied(given_, parameters_).encoder), noise_.roll};
  std::optional<double> slip;
  noise_.roll.common = 0.0;
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    renew_paths(segments_[i], parameters_.gyro, given_.imu.gyro_noise);
    slip = std::max(slip, slip_of(segments_[i], setting));  // nothing is less than any
    noise_.roll.common = std::max(noise_.roll.common, common_slip(*this, i, setting).value_or(0.0));
  }
  if (slip) noise_.roll = {*slip, std::max(kLeastAside, 2.0 * *slip), noise_.roll.common};
}

void Batch::learn_from_pixels() {
  std::vector<double> residuals;
  std::array<double, 2> residual{};
  double used = 0.0;  // rows that place the points
  const TermBlock* before = nullptr;
  for (const TermBlock& term : terms_) {
    if (term.kind != Term::pixel) continue;
    const bool same = before != nullptr && before->keyframe == term.keyframe && before->segment == term.segment;
    if (!same) used += 3.0;
    before = &term;
    problem_->EvaluateResidualBlock(term.id, false, nullptr, residual.data(), nullptr);
    if (std::hypot(residual[0], residual[1]) > kWildPixel) {
      segments_[term.segment].points[term.keyframe].seen.clear();
    }
    residuals.insert(residuals.end(), residual.begin(), residual.end());
  }
  if (residuals.empty()) return;
  const auto rows = static_cast<double>(residuals.size());
  noise_.pixel *= robust_sigma(residuals) * std::sqrt(rows / std::max(1.0, rows - used));
}

void Batch::learn_from_beams() {
  std::vector<double> residuals;
  for (const TermBlock& term : terms_) {
    if (term.kind != Term::beam) continue;
    double residual = 0.0;
    problem_->EvaluateResidualBlock(term.id, false, nullptr, &residual, nullptr);
    residuals.push_back(residual);
  }
  if (!residuals.empty()) noise_.beam = std::max(0.5 * given_.lasers->noise, noise_.beam * robust_sigma(residuals));
}

void Batch::learn_from_ground() {
  // Where the wheels stand, five rows per keyframe (three of the ground, two of the wheels) serve three unknowns.
  constexpr double kFree = 2.0 / 5.0;
  double height = 0.0, slope = 0.0, count = 0.0;
  std::array<double, 3> residual{};
  for (const TermBlock& term : terms_) {
    const std::deque<Keyframe>& keyframes = segments_[term.segment].keyframes;
    if (term.kind != Term::ground || !keyframes[term.keyframe].on_ground || !keyframes[term.keyframe + 1].on_ground) {
      continue;
    }
    problem_->EvaluateResidualBlock(term.id, false, nullptr, residual.data(), nullptr);
    height += residual[0] * residual[0];
    slope += 0.5 * (residual[1] * residual[1] + residual[2] * residual[2]);
    count += 1.0;
  }
  if (count < 30.0) return;
  noise_.ground_height = std::max(kFlattest, noise_.ground_height * std::sqrt(height / count / kFree));
  noise_.ground_slope = std::max(kSmoothest, noise_.ground_slope * std::sqrt(slope / count / kFree));
}

}  // namespace ear::calibration
