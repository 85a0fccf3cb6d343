#include "src/view/feature_tap.h"

#include <algorithm>
#include <utility>

namespace ear::view {
namespace {

class Tapped final : public Estimator {
 public:
  Tapped(std::unique_ptr<Estimator> inner, std::shared_ptr<FeatureTap> tap, int most_outcomes)
      : inner_(std::move(inner)), tap_(std::move(tap)) {
    outcomes_.reserve(static_cast<std::size_t>(most_outcomes));  // the estimator is not to ask for memory
    inner_->report_tracks(&outcomes_);
  }

  void start_at(const GivenStart& start) override { inner_->start_at(start); }
  void add_imu(const ImuSample& sample) override { inner_->add_imu(sample); }
  void add_encoder(const EncoderSample& sample) override { inner_->add_encoder(sample); }
  void add_laser(const LaserSample& sample) override {
    tap_->take(sample);
    inner_->add_laser(sample);
  }
  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const override { return inner_->motion_to(t_ns); }
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs stamp_ns) override { return inner_->common_stamp(stamp_ns); }
  std::optional<Estimate> process(const FeatureFrame& frame) override {
    outcomes_.clear();  // a frame that is refused has none
    std::optional<Estimate> estimate = inner_->process(frame);
    tap_->take(frame, outcomes_);
    return estimate;
  }
  std::optional<Estimate> process_without_image(TimeNs t_ns) override { return inner_->process_without_image(t_ns); }
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const override { return inner_->predict(t_ns); }
  [[nodiscard]] Status status() const override { return inner_->status(); }
  [[nodiscard]] const Health& health() const override { return inner_->health(); }
  void refuse_frame() override { inner_->refuse_frame(); }
  void set_window(int clones) override { inner_->set_window(clones); }
  [[nodiscard]] InputCounts input_counts() const override { return inner_->input_counts(); }
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override { return inner_->check_stamp(t_ns); }
  [[nodiscard]] CalibrationState calibration() const override { return inner_->calibration(); }

 private:
  std::unique_ptr<Estimator> inner_;
  std::shared_ptr<FeatureTap> tap_;
  std::vector<TrackOutcome> outcomes_;
};

bool by_id(const SeenFeature& a, const SeenFeature& b) { return a.id < b.id; }

/// Among the first `count`, which are in the order of their ids; null: it is not there.
SeenFeature* find(std::vector<SeenFeature>& features, std::size_t count, std::uint64_t id) {
  SeenFeature wanted;
  wanted.id = id;
  const auto end = features.begin() + static_cast<std::ptrdiff_t>(count);
  const auto found = std::lower_bound(features.begin(), end, wanted, by_id);
  return found != end && found->id == id ? &*found : nullptr;
}

}  // namespace

void FeatureTap::take(const FeatureFrame& frame, const std::vector<TrackOutcome>& outcomes) {
  std::swap(before_, features_);
  before_.resize(visible_);
  features_.clear();
  for (const FeatureObservation& seen : frame.features)
    features_.push_back({seen.id, seen.left, seen.right, 0, seen.has_right});
  std::sort(features_.begin(), features_.end(), by_id);
  visible_ = features_.size();
  for (SeenFeature& feature : features_) {
    const SeenFeature* const old = find(before_, before_.size(), feature.id);
    if (old == nullptr) continue;
    feature.age = old->age + 1;
    feature.use = old->use;
  }
  for (const TrackOutcome& outcome : outcomes) {
    SeenFeature* feature = find(features_, visible_, outcome.id);
    if (feature == nullptr) {
      const SeenFeature* const old = find(before_, before_.size(), outcome.id);
      if (old == nullptr) continue;  // it was seen some frames ago, and nobody knows where
      feature = &features_.emplace_back(*old);
      feature->ended = true;
    }
    feature->use = outcome.used ? FeatureUse::used : FeatureUse::refused;
  }
}

MakeEstimator tapped(MakeEstimator make, std::shared_ptr<FeatureTap> tap) {
  return [make = std::move(make), tap = std::move(tap)](const FilterConfig& config, const Calibration& calibration) {
    return std::make_unique<Tapped>(make(config, calibration), tap, config.max_track_updates);
  };
}

}  // namespace ear::view
