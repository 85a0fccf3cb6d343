#include "frontend/frontend.h"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "frontend/detector.h"
#include "frontend/flow_check.h"
#include "frontend/image_pyramid.h"
#include "frontend/lens.h"
#include "frontend/reference_patch.h"
#include "frontend/stereo_matcher.h"
#include "frontend/surface_patch.h"

namespace ear {
namespace {

constexpr float kEdgePx = 8.0F;              // features closer to the image's edge are dropped
constexpr float kMinTrackDistancePx = 5.0F;  // two tracks closer than this have become one
constexpr double kFlowTolerancePx = 1.0;
constexpr double kDisparitySigmaPx = 1.0;  // for the depth's part of that tolerance
constexpr int kLevelMeasured = 0;          // where to begin: with depth and a motion measured in this frame,
constexpr int kLevelPredicted = 2;         // with a predicted rotation,
constexpr int kLevelUnknown = ImagePyramid::kMaxLevels - 1;  // and without
constexpr float kFar = 1e3F;                                 // [px] of a prediction: nothing is known of its error
constexpr double kInverseDepthChange = 0.1;                  // chosen [1/m]: of a depth by motion, until the next frame
constexpr std::size_t kProbes = 24;                          // features that measure the motion for the others
constexpr float kRefreshStretch = 1.3F;  // a feature that has grown or shrunk this much gets a new patch

struct Track {
  std::uint64_t id = 0;
  int age = 0;            // frames since detection
  std::size_t patch = 0;  // index into the store
  Warp left;              // of the reference patch
  Eigen::Vector2d left_ray = Eigen::Vector2d::Zero();
  bool has_depth = false;  // by the right camera, in this or an earlier frame
  SurfacePatch surface;    // in the left camera of this frame; without depth at infinity, or where the motion shows it
  bool has_right = false;  // seen by the right camera in this frame
  Eigen::Vector2d right_ray = Eigen::Vector2d::Zero();
  float surprise = 0.0F;  // in the left image, distance from where the motion put it [px]
};

// Seconds since the last call.
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

void check_size(const ImageView& image, const CameraCalibration& camera, const char* name) {
  const bool readable = image.data != nullptr && image.stride >= image.width;
  if (!readable) throw std::invalid_argument(std::string(name) + " image has no pixels, or rows that overlap");
  if (image.width == camera.width && image.height == camera.height) return;
  throw std::invalid_argument(std::string(name) + " image is " + std::to_string(image.width) + "x" +
                              std::to_string(image.height) + ", its calibration says " + std::to_string(camera.width) +
                              "x" + std::to_string(camera.height));
}

const CameraCalibration& first_of(const std::vector<CameraCalibration>& cameras) {
  if (cameras.empty()) throw std::invalid_argument("the front end needs at least one camera");
  return cameras.front();
}

}  // namespace

class Frontend::Impl {
 public:
  Impl(const FrontendConfig& config, std::vector<CameraCalibration> cameras);

  const FeatureFrame& process(const StereoFrame& frame, const MotionPrediction& prediction);
  void reset();
  void set_limits(int max_features, bool use_right) {
    max_features_ = static_cast<std::size_t>(std::clamp(max_features, 1, config_.max_features));
    use_right_ = use_right;
  }

  FrontendTiming timing;

 private:
  void track(const MotionPrediction& prediction);
  [[nodiscard]] MotionGuess track_probes(const MotionGuess& guess);
  [[nodiscard]] bool track_one(Track& track, const Transfer& motion, int level) const;
  [[nodiscard]] int probe_level(const MotionGuess& guess) const;
  [[nodiscard]] int level_without_depth(const Transfer& measured) const;
  [[nodiscard]] Flow flow(std::size_t track) const;
  void reject();
  void find_depths();
  void match_stereo();
  void match_stereo(Track& track, bool had_right);
  void detect();
  void refresh_patches();
  void drop(const std::vector<std::uint8_t>& keep);
  [[nodiscard]] MotionGuess camera_motion(const MotionPrediction& prediction) const;
  void allocate();
  void write_output(TimeNs t_ns);

  FrontendConfig config_;
  std::vector<CameraCalibration> cameras_;
  Lens lens_;
  std::optional<StereoMatcher> stereo_;
  Detector detector_;
  FlowCheck flow_check_;

  ImagePyramid left_;
  ImagePyramid right_;
  std::size_t max_features_ = 0;  // for now
  bool use_right_ = true;
  bool right_present_ = false;
  MotionGuess motion_;                // of the left camera, last frame to this one
  float surprise_ = kFar;             // largest of the last frame's probes [px]
  double usual_inverse_depth_ = 0.0;  // where the right camera shows none: the median [1/m]
  std::vector<Track> tracks_;
  std::vector<Track> previous_;  // the same tracks, index by index, before this frame
  std::vector<ReferencePatch> patches_;
  std::vector<std::size_t> free_patches_;
  std::uint64_t next_id_ = 0;
  FeatureFrame output_;
  // Kept for their memory: after the first frames, process() asks for none.
  std::vector<std::uint8_t> keep_;
  std::vector<std::size_t> candidates_, probes_;
  std::vector<Flow> flows_;
  std::vector<Eigen::Vector2f> pixels_;
  std::vector<double> inverse_depths_;
};

Frontend::Impl::Impl(const FrontendConfig& config, std::vector<CameraCalibration> cameras)
    : config_(config),
      cameras_(std::move(cameras)),
      lens_(first_of(cameras_)),
      detector_(cameras_.front().width, cameras_.front().height, std::max(config.max_features, 1)),
      flow_check_(kFlowTolerancePx / lens_.focal_px()),
      left_(image_kernels(config.kernels)),
      right_(image_kernels(config.kernels), StereoMatcher::kLevels) {
  if (config_.max_features < 1) throw std::invalid_argument("frontend: max_features must be positive");
  if (!(config_.nearest_depth > 0.0)) throw std::invalid_argument("frontend: nearest_depth must be positive");
  if (cameras_.size() > 1) stereo_.emplace(cameras_[0], cameras_[1], config_.nearest_depth);
  allocate();
  set_limits(config_.max_features, true);
  reset();
}

void Frontend::Impl::allocate() {
  const auto most = static_cast<std::size_t>(config_.max_features);
  patches_.resize(most);
  tracks_.reserve(most);
  previous_.reserve(most);
  free_patches_.reserve(most);
  output_.features.reserve(most);
  keep_.reserve(most);
  candidates_.reserve(most);
  probes_.reserve(most);
  flows_.reserve(most);
  pixels_.reserve(most);
  inverse_depths_.reserve(most);
  flow_check_.reserve(most);
}

void Frontend::Impl::reset() {
  tracks_.clear();
  surprise_ = kFar;
  usual_inverse_depth_ = 0.0;
  left_.clear();
  free_patches_.clear();
  for (std::size_t i = 0; i < patches_.size(); ++i) free_patches_.push_back(i);
}

const FeatureFrame& Frontend::Impl::process(const StereoFrame& frame, const MotionPrediction& prediction) {
  check_size(frame.left, cameras_.front(), "left");
  right_present_ = stereo_ && !frame.right.empty();
  if (right_present_) check_size(frame.right, cameras_[1], "right");
  output_.right_skipped = right_present_ && !use_right_;
  right_present_ = right_present_ && use_right_;

  output_.repeated = left_.shows(frame.left);  // no two exposures are equal
  if (output_.repeated) {
    timing = {};
    output_.t_ns = frame.t_ns;
    return output_;
  }
  Stopwatch watch;
  left_.build(frame.left);
  if (right_present_) right_.build(frame.right);
  timing.pyramid = watch.lap();
  track(prediction);
  timing.track = watch.lap();
  reject();
  if (!right_present_) find_depths();
  timing.reject = watch.lap();
  match_stereo();
  timing.stereo = watch.lap();
  refresh_patches();
  detect();
  timing.detect = watch.lap();

  write_output(frame.t_ns);
  return output_;
}

MotionGuess Frontend::Impl::camera_motion(const MotionPrediction& prediction) const {
  MotionGuess guess;
  guess.rotation_known = prediction.rotation_known;
  guess.translation_known = prediction.rotation_known && prediction.translation_known;
  Eigen::Isometry3d T_B1B0 = Eigen::Isometry3d::Identity();
  T_B1B0.linear() = prediction.R_B1B0;
  if (guess.translation_known) T_B1B0.translation() = -(prediction.R_B1B0 * prediction.p_B0B1);
  const Eigen::Isometry3d& T_BC = cameras_.front().T_BC;
  const Eigen::Isometry3d T_C1C0 = T_BC.inverse() * T_B1B0 * T_BC;
  guess.motion = {T_C1C0.linear(), T_C1C0.translation()};
  return guess;
}

void Frontend::Impl::track(const MotionPrediction& prediction) {
  previous_ = tracks_;
  if (tracks_.size() > max_features_) {  // there were more: older ones come first
    keep_.assign(tracks_.size(), 0);
    std::fill_n(keep_.begin(), max_features_, std::uint8_t{1});
    drop(keep_);
  }
  std::vector<std::uint8_t>& keep = keep_;
  keep.assign(tracks_.size(), 0);
  motion_ = track_probes(camera_motion(prediction));
  const int known = motion_.rotation_known ? kLevelPredicted : kLevelUnknown;
  const int without_depth = surprise_ < kFar ? level_without_depth(motion_.motion) : known;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (keep[i]) continue;
    const bool predictable = motion_.translation_known && tracks_[i].has_depth;
    const int first = predictable ? kLevelMeasured : without_depth;
    keep[i] =
        (first < known && track_one(tracks_[i], motion_.motion, first)) || track_one(tracks_[i], motion_.motion, known);
  }
  // Of two tracks that have run into each other, the younger goes. Older ones come first.
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    for (std::size_t j = 0; j < i && keep[i]; ++j) {
      const Eigen::Vector2f apart = tracks_[i].left.centre - tracks_[j].left.centre;
      if (keep[j] && apart.squaredNorm() < kMinTrackDistancePx * kMinTrackDistancePx) keep[i] = 0;
    }
  }
  drop(keep);
}

// A level is coarse enough if twice the largest error of the last prediction lies within two of its pixels, from where
// alignment finds the way. Errors that have grown since then show: the probe fails and is tried again.
int Frontend::Impl::probe_level(const MotionGuess& guess) const {
  if (!guess.rotation_known) return kLevelUnknown;
  if (!guess.translation_known) return kLevelPredicted;
  int level = 0;
  while (level < kLevelPredicted && surprise_ > static_cast<float>(1 << level)) ++level;
  return level;
}

// The same for features without depth, in a motion that was measured: none is taken to be nearer than all that have
// one.
int Frontend::Impl::level_without_depth(const Transfer& measured) const {
  double nearest = 0.0;
  for (const Track& track : previous_) {
    if (track.has_depth) nearest = std::max(nearest, track.surface.inverse_depth(track.left_ray));
  }
  const double farthest_px = lens_.focal_px() * measured.p_10.norm() * nearest;
  int level = 0;
  while (level < kLevelPredicted && farthest_px > static_cast<double>(1 << level)) ++level;
  return level;
}

// Follows a few features from coarse to fine. If they agree on a motion, it is better than any prediction, and all
// others are found at once on the finest level.
MotionGuess Frontend::Impl::track_probes(const MotionGuess& guess) {
  candidates_.clear();
  probes_.clear();
  flows_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (tracks_[i].has_depth) candidates_.push_back(i);
  }
  const std::size_t stride = std::max<std::size_t>(1, candidates_.size() / kProbes);
  const int level = probe_level(guess);
  for (std::size_t k = 0; k < candidates_.size(); k += stride) {
    const std::size_t i = candidates_[k];
    Track& track = tracks_[i];
    if (!track_one(track, guess.motion, level) && !track_one(track, guess.motion, kLevelUnknown)) {
      continue;
    }
    probes_.push_back(i);
    flows_.push_back(flow(i));
  }
  const Consensus& consensus = flow_check_.find(flows_, guess);
  for (std::size_t k = 0; k < probes_.size(); ++k) {
    keep_[probes_[k]] = consensus.inliers[k];
    if (!consensus.inliers[k]) tracks_[probes_[k]] = previous_[probes_[k]];  // to be tried again like the others
  }
  surprise_ = kFar;
  if (!consensus.metric) return guess;
  surprise_ = 0.0F;
  for (std::size_t k = 0; k < probes_.size(); ++k) {
    if (consensus.inliers[k]) surprise_ = std::max(surprise_, tracks_[probes_[k]].surprise);
  }
  return {consensus.motion, true, true};
}

bool Frontend::Impl::track_one(Track& track, const Transfer& motion, int level) const {
  const auto start = carry_over(track.left, track.left_ray, track.surface, motion, lens_, lens_);
  if (!start) return false;
  const auto match = patches_[track.patch].align(left_, *start, level);
  if (!match) return false;
  const Eigen::Vector2f& found = match->warp.centre;
  const GreyLevel& image = left_.level(0);
  const auto in = [](float value, int size) {
    return value >= kEdgePx && value <= static_cast<float>(size - 1) - kEdgePx;
  };
  if (!in(found.x(), image.width) || !in(found.y(), image.height)) return false;
  const auto ray = lens_.to_normalized(found.cast<double>());
  if (!ray) return false;
  track.surface = track.surface.seen_after(motion, track.left_ray, *ray);
  track.surprise = (found - start->centre).norm();
  track.left = match->warp;
  track.left_ray = *ray;
  track.has_right = false;
  ++track.age;
  return true;
}

Flow Frontend::Impl::flow(std::size_t track) const {
  const Track& before = previous_[track];
  const double sigma = stereo_ ? kDisparitySigmaPx * stereo_->inverse_depth_per_pixel() : 0.0;
  return {before.left_ray, tracks_[track].left_ray, before.surface.inverse_depth(before.left_ray), sigma,
          before.has_depth};
}

void Frontend::Impl::reject() {
  flows_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) flows_.push_back(flow(i));
  drop(flow_check_.find(flows_, motion_).inliers);
}

// Where the right camera shows no depths, a motion of known length does, by how far a feature moved along its epipolar
// line: least squares with what was thought of it before. New features get the median of all. They say where to search
// in the next frame; flows are not judged by them, as the length is the prediction's.
void Frontend::Impl::find_depths() {
  usual_inverse_depth_ = 0.0;
  if (!motion_.translation_known || tracks_.empty()) return;
  const Transfer& motion = motion_.motion;
  const double weight = std::pow(1.0 / (lens_.focal_px() * kInverseDepthChange), 2);  // against a pixel
  inverse_depths_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    const Track& before = previous_[i];
    if (!track.has_depth) {
      const DepthPrior thought{before.surface.inverse_depth(before.left_ray), weight};
      const auto point = intersect(motion, before.left_ray, track.left_ray, thought);
      const double inverse_depth = point ? std::max(0.0, point->inverse_depth) : 0.0;
      const double ratio = motion.scaled_point(before.left_ray, inverse_depth).z();
      track.surface = SurfacePatch::through(track.left_ray, ratio > 0.0 ? inverse_depth / ratio : 0.0);
    }
    inverse_depths_.push_back(track.surface.inverse_depth(track.left_ray));
  }
  const auto middle = inverse_depths_.begin() + static_cast<std::ptrdiff_t>(inverse_depths_.size() / 2);
  std::nth_element(inverse_depths_.begin(), middle, inverse_depths_.end());
  usual_inverse_depth_ = *middle;
}

void Frontend::Impl::match_stereo() {
  if (!right_present_) return;
  for (std::size_t i = 0; i < tracks_.size(); ++i) match_stereo(tracks_[i], previous_[i].has_right);
}

void Frontend::Impl::match_stereo(Track& track, bool had_right) {
  const ReferencePatch& patch = patches_[track.patch];
  std::optional<StereoMatch> match;
  if (track.has_depth) {
    match = stereo_->follow(right_, patch, track.left, track.left_ray, track.surface);
  }
  // The search is expensive, and mostly fails where it has failed before: try again at ages 0, 1, 2, 4, 8, ...
  const bool due = (track.age & (track.age - 1)) == 0;
  if (!match && (had_right || due)) match = stereo_->search(right_, patch, track.left, track.left_ray);
  track.has_right = match.has_value();
  if (!match) return;
  track.has_depth = true;
  track.surface = match->surface;
  track.right_ray = match->right;
}

void Frontend::Impl::refresh_patches() {
  for (Track& track : tracks_) {
    const float area = track.left.affine.determinant();
    const bool stretched = area > kRefreshStretch * kRefreshStretch || area * kRefreshStretch * kRefreshStretch < 1.0F;
    if (!stretched) continue;
    if (patches_[track.patch].capture(left_, track.left.centre)) track.left = {track.left.centre};
  }
}

void Frontend::Impl::detect() {
  const int wanted = static_cast<int>(max_features_) - static_cast<int>(tracks_.size());
  pixels_.clear();
  for (const Track& track : tracks_) pixels_.push_back(track.left.centre);
  for (const Corner& corner : detector_.detect(left_, pixels_, wanted)) {
    const auto ray = lens_.to_normalized(corner.pixel.cast<double>());
    if (!ray) continue;
    Track track;
    track.patch = free_patches_.back();
    if (!patches_[track.patch].capture(left_, corner.pixel)) continue;
    free_patches_.pop_back();
    track.id = next_id_++;
    track.left.centre = corner.pixel;
    track.left_ray = *ray;
    if (right_present_) {
      match_stereo(track, false);
    } else {
      track.surface = SurfacePatch::through(track.left_ray, usual_inverse_depth_);
    }
    tracks_.push_back(track);
  }
}

void Frontend::Impl::drop(const std::vector<std::uint8_t>& keep) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (!keep[i]) {
      free_patches_.push_back(tracks_[i].patch);
      continue;
    }
    tracks_[kept] = tracks_[i];
    previous_[kept] = previous_[i];
    ++kept;
  }
  tracks_.resize(kept);
  previous_.resize(kept);
}

void Frontend::Impl::write_output(TimeNs t_ns) {
  output_.t_ns = t_ns;
  output_.features.clear();
  for (const Track& track : tracks_) {
    output_.features.push_back({track.id, track.left_ray, track.right_ray, track.has_right});
  }
}

Frontend::Frontend(const FrontendConfig& config, std::vector<CameraCalibration> cameras)
    : impl_(std::make_unique<Impl>(config, std::move(cameras))) {}
Frontend::~Frontend() = default;
Frontend::Frontend(Frontend&&) noexcept = default;
Frontend& Frontend::operator=(Frontend&&) noexcept = default;

const FeatureFrame& Frontend::process(const StereoFrame& frame, const MotionPrediction& prediction) {
  return impl_->process(frame, prediction);
}
const FrontendTiming& Frontend::timing() const { return impl_->timing; }
void Frontend::set_limits(int max_features, bool use_right) { impl_->set_limits(max_features, use_right); }
void Frontend::reset() { impl_->reset(); }

}  // namespace ear
