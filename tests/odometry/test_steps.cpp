// Steps between images: the images of a simulated drive, with and without steps between them.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ear/odometry.h"
#include "filter/filter.h"
#include "src/odometry_factory.h"
#include "tests/support/simulated_run.h"
#include "tools/experiments/sample_feed.h"
#include "tools/simulator/film.h"
#include "tools/simulator/simulation.h"

namespace ear {
namespace {

using simulator::Film;
using simulator::Simulation;
using simulator::Truth;

/// What the filter is asked and what it answers, as seen from Odometry.
struct Seen {
  std::vector<double> prediction_off;  ///< [m] of the motion from image to image, against the truth
  std::vector<double> prediction;      ///< [m] its length
  int empty_frames = 0;                ///< images without features
};

/// The filter, and somebody who looks on.
class WatchedFilter final : public Estimator {
 public:
  WatchedFilter(const FilterConfig& config, const Calibration& calibration, const Simulation& simulation, Seen& seen)
      : filter_(config, calibration), simulation_(simulation), seen_(seen) {}

  void start_at(const GivenStart& start) override { filter_.start_at(start); }
  void add_imu(const ImuSample& sample) override { filter_.add_imu(sample); }
  void add_encoder(const EncoderSample& sample) override { filter_.add_encoder(sample); }
  void add_laser(const LaserSample& sample) override { filter_.add_laser(sample); }
  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const override {
    const std::optional<RelativeMotion> motion = filter_.motion_to(t_ns);
    if (motion && motion->translation_known && image_ns_ && filter_.status() == Status::tracking) {
      const Truth before = simulation_.truth(*image_ns_);
      const Truth now = simulation_.truth(t_ns);
      const Eigen::Vector3d p_B0B1 = before.R_WB.transpose() * (now.p_WB - before.p_WB);
      seen_.prediction_off.push_back((motion->p_B0B1 - p_B0B1).norm());
      seen_.prediction.push_back(p_B0B1.norm());
    }
    return motion;
  }
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs stamp_ns) override { return filter_.common_stamp(stamp_ns); }
  std::optional<Estimate> process(const FeatureFrame& frame) override {
    seen_.empty_frames += frame.features.empty() ? 1 : 0;
    if (!frame.features.empty()) image_ns_ = frame.t_ns;
    return filter_.process(frame);
  }
  std::optional<Estimate> process_without_image(TimeNs t_ns) override { return filter_.process_without_image(t_ns); }
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const override { return filter_.predict(t_ns); }
  [[nodiscard]] Status status() const override { return filter_.status(); }
  [[nodiscard]] const Health& health() const override { return filter_.health(); }
  void refuse_frame() override { filter_.refuse_frame(); }
  void set_window(int clones) override { filter_.set_window(clones); }
  [[nodiscard]] InputCounts input_counts() const override { return filter_.input_counts(); }
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override { return filter_.check_stamp(t_ns); }
  [[nodiscard]] CalibrationState calibration() const override { return filter_.calibration(); }

 private:
  Filter filter_;
  const Simulation& simulation_;
  Seen& seen_;
  std::optional<TimeNs> image_ns_;  ///< the last image's stamp
};

struct Drive {
  Seen seen;
  int images = 0, steps = 0;  ///< with an estimate
  int used_by_steps = 0;      ///< features
  int used_by_images = 0;
  int aided_by_cameras = 0;  ///< estimates of steps
  double rms = 0.0;          ///< [m] of the estimates at images
  double end_off = 0.0;      ///< [m]
};

constexpr std::uint64_t kSeed = 12;

const Film& film(std::uint64_t seed) {
  static std::map<std::uint64_t, Film> films;
  simulator::Options options;
  options.seed = seed;
  options.duration = 16.0;
  options.camera_rate_hz = 10.0;
  return films.try_emplace(seed, options).first->second;
}

/// Drives along the film; images of some times may be missing, and `steps` are made after each image [s].
template <typename Missing>
Drive drive(const std::vector<double>& steps, const Missing& missing, std::uint64_t seed = kSeed) {
  const Simulation& simulation = film(seed).simulation;
  Drive result;
  Odometry odometry = OdometryFactory::make(
      Config{}, simulation.calibration(),
      [&](const FilterConfig& config, const Calibration& calibration) {
        return std::make_unique<WatchedFilter>(config, calibration, simulation, result.seen);
      },
      Clock{});
  std::optional<test::WorldAlignment> world;
  const TimeNs first_ns = simulation.frame_times().front();
  double image_at = 0.0;
  std::size_t next_step = 0;
  double squares = 0.0;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    experiments::hand_over(simulation, delivery, odometry);
    if (delivery.stream == simulator::SensorStream::imu) {
      const TimeNs t_ns = simulation.imu()[delivery.index].t_ns;
      const double t = seconds_between(first_ns, t_ns);
      if (result.images < 20) continue;  // it has started
      if (next_step >= steps.size() || t < image_at + steps[next_step]) continue;
      ++next_step;
      const std::optional<Estimate> estimate = odometry.step(t_ns);
      if (!estimate) continue;
      ++result.steps;
      result.used_by_steps += estimate->frame.features_used;
      result.aided_by_cameras += estimate->health.aiding == Aiding::cameras_and_wheels ? 1 : 0;
    }
    if (delivery.stream != simulator::SensorStream::camera) continue;
    const StereoFrame frame = film(seed).frame(delivery.index);
    const double t = seconds_between(first_ns, frame.t_ns);
    if (missing(t)) continue;
    const std::optional<Estimate> estimate = odometry.add_stereo(frame);
    image_at = t;
    next_step = 0;
    if (!estimate) continue;
    ++result.images;
    result.used_by_images += estimate->frame.features_used;
    const NavState& x = estimate->state;
    const Truth truth = simulation.truth(x.t_ns);
    if (!world) world.emplace(x, truth);
    result.end_off = (world->R * truth.p_WB + world->p - x.p_WB).norm();
    squares += result.end_off * result.end_off;
  }
  REQUIRE(result.images > 50);
  result.rms = std::sqrt(squares / result.images);
  return result;
}

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

bool never(double /*t*/) { return false; }

TEST_CASE("steps between images: tracks go on, the next image is predicted from the last, and nothing is lost") {
  const Drive without = drive({}, never);
  const Drive with = drive({0.03, 0.06, 0.09}, never);
  MESSAGE("rms without steps " << without.rms << ", with " << with.rms << "; features used " << without.used_by_images
                               << ", " << with.used_by_images << "; prediction off by up to "
                               << largest(without.seen.prediction_off) << ", " << largest(with.seen.prediction_off));
  CHECK(without.steps == 0);
  CHECK(with.steps > 2 * with.images);
  CHECK(with.images == without.images);
  CHECK(with.seen.empty_frames == 0);
  CHECK(with.used_by_steps == 0);
  CHECK(with.used_by_images > 0.95 * without.used_by_images);
  // 10 images a second at up to 1 m/s.
  REQUIRE(with.seen.prediction.size() > 50);
  CHECK(largest(with.seen.prediction) > 0.06);
  CHECK(largest(with.seen.prediction_off) < 0.003);
  CHECK(with.rms < 1.15 * without.rms);  // seeds 12 to 14: 1.04, 0.95, 0.99
  CHECK(with.aided_by_cameras > 0.5 * with.steps);
}

TEST_CASE("steps while images are missing: better than to wait for the next image") {
  const auto missing = [](double t) { return t > 6.0 && std::fmod(t, 3.0) < 0.45; };
  double ratios = 1.0, predictions = 1.0;  // one seed scatters by 10 %
  constexpr std::uint64_t kSeeds = 5;
  for (std::uint64_t seed = kSeed; seed < kSeed + kSeeds; ++seed) {
    CAPTURE(seed);
    const Drive without = drive({}, missing, seed);
    const Drive with = drive({0.15, 0.2, 0.25, 0.3, 0.35, 0.4}, missing, seed);
    MESSAGE("rms without steps " << without.rms << ", with " << with.rms << "; features used " << without.used_by_images
                                 << ", " << with.used_by_images << "; prediction off by up to "
                                 << largest(without.seen.prediction_off) << ", " << largest(with.seen.prediction_off));
    CHECK(with.steps >= 15);
    CHECK(with.used_by_steps == 0);
    CHECK(largest(with.seen.prediction) > 0.2);
    const double better = largest(with.seen.prediction_off) / largest(without.seen.prediction_off);
    CHECK(better < 0.7);
    predictions *= better;
    ratios *= with.rms / without.rms;
  }
  CHECK(std::pow(ratios, 1.0 / kSeeds) < 1.02);
  CHECK(std::pow(predictions, 1.0 / kSeeds) < 0.55);  // 0.44
}

/// By wheels and inertial samples alone, a step every 50 ms.
struct BlindDrive {
  int steps = 0, missing = 0;  ///< since the first estimate: with one and without
  double largest_off = 0.0;    ///< [m]
  double heading_sigma = 0.0;  ///< the last one [rad]
};

BlindDrive drive_blind(const std::string& fault) {
  simulator::Options options;
  options.seed = 1;
  options.tracks = false;
  if (!fault.empty()) options.faults = {simulator::parse_fault(fault)};
  const Simulation simulation(options);
  Calibration calibration = simulation.calibration();
  calibration.cameras.clear();
  calibration.lasers.reset();
  Odometry odometry(Config{}, calibration);
  std::optional<test::WorldAlignment> world;
  BlindDrive result;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    experiments::hand_over(simulation, delivery, odometry);
    if (delivery.stream != simulator::SensorStream::imu || delivery.index % 10 != 0) continue;
    const std::optional<Estimate> estimate = odometry.step(simulation.imu()[delivery.index].t_ns);
    if (!estimate) {
      result.missing += world ? 1 : 0;
      continue;
    }
    ++result.steps;
    const NavState& x = estimate->state;
    const Truth truth = simulation.truth(x.t_ns);
    if (!world) world.emplace(x, truth);
    result.largest_off = std::max(result.largest_off, (world->R * truth.p_WB + world->p - x.p_WB).norm());
    result.heading_sigma = std::sqrt(estimate->covariance(estimate_error::rotation + 2, estimate_error::rotation + 2));
  }
  MESSAGE(fault << ": largest error " << result.largest_off << " m, heading known to " << result.heading_sigma);
  REQUIRE(world);
  return result;
}

TEST_CASE("steps of a vehicle without cameras: a small jump of a bias loses nothing") {
  const BlindDrive drive = drive_blind("imu_bias_jump.gyro@20+20=0.01");
  CHECK(drive.missing == 0);
  CHECK(drive.largest_off < 0.9);  // wheels alone do not show the jump; one of 0.02 rad/s is lost: docs/decisions/0039
}

TEST_CASE("steps of a vehicle without cameras: they wait for the end of a spike, which then costs nothing") {
  const BlindDrive sound = drive_blind("");
  CHECK(sound.missing == 0);
  for (const std::string fault : {"imu_spikes:1@5+30", "imu_spikes:3@5+30", "imu_spikes:5@5+30"}) {
    CAPTURE(fault);
    const BlindDrive drive = drive_blind(fault);
    CHECK(drive.missing > 0);
    CHECK(drive.missing < 0.1 * drive.steps);
    CHECK(drive.largest_off < 1.3 * sound.largest_off);
    CHECK(drive.heading_sigma < 1.05 * sound.heading_sigma);
  }
}

}  // namespace
}  // namespace ear
