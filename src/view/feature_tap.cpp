#include "src/view/feature_tap.h"

#include <algorithm>
#include <utility>

namespace ear::view {
namespace {

class Tapped final : public Estimator {
 public:
  Tapped(std::unique_ptr<Estimator> inner, std::shared_ptr<FeatureTap> tap)
      : inner_(std::move(inner)), tap_(std::move(tap)) {}

  void start_at(const GivenStart& start) override { inner_->start_at(start); }
  void add_imu(const ImuSample& sample) override { inner_->add_imu(sample); }
  void add_encoder(const EncoderSample& sample) override { inner_->add_encoder(sample); }
  void add_laser(const LaserSample& sample) override { inner_->add_laser(sample); }
  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const override { return inner_->motion_to(t_ns); }
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs stamp_ns) override { return inner_->common_stamp(stamp_ns); }
  std::optional<Estimate> process(const FeatureFrame& frame) override {
    tap_->take(frame);
    return inner_->process(frame);
  }
  std::optional<Estimate> process_without_image(TimeNs t_ns) override { return inner_->process_without_image(t_ns); }
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const override { return inner_->predict(t_ns); }
  [[nodiscard]] Status status() const override { return inner_->status(); }
  [[nodiscard]] const Health& health() const override { return inner_->health(); }
  void refuse_frame() override { inner_->refuse_frame(); }
  void set_window(int clones) override { inner_->set_window(clones); }
  [[nodiscard]] InputCounts input_counts() const override { return inner_->input_counts(); }
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override { return inner_->check_stamp(t_ns); }
  [[nodiscard]] TimeNs camera_time(TimeNs imu_time_ns) const override { return inner_->camera_time(imu_time_ns); }
  [[nodiscard]] CalibrationState calibration() const override { return inner_->calibration(); }

 private:
  std::unique_ptr<Estimator> inner_;
  std::shared_ptr<FeatureTap> tap_;
};

bool by_id(const SeenFeature& a, const SeenFeature& b) { return a.id < b.id; }

}  // namespace

void FeatureTap::take(const FeatureFrame& frame) {
  std::swap(before_, features_);
  features_.clear();
  for (const FeatureObservation& seen : frame.features)
    features_.push_back({seen.id, seen.left, seen.right, 0, seen.has_right});
  std::sort(features_.begin(), features_.end(), by_id);
  for (SeenFeature& feature : features_) {
    const auto old = std::lower_bound(before_.begin(), before_.end(), feature, by_id);
    if (old != before_.end() && old->id == feature.id) feature.age = old->age + 1;
  }
}

MakeEstimator tapped(MakeEstimator make, std::shared_ptr<FeatureTap> tap) {
  return [make = std::move(make), tap = std::move(tap)](const FilterConfig& config, const Calibration& calibration) {
    return std::make_unique<Tapped>(make(config, calibration), tap);
  };
}

}  // namespace ear::view
