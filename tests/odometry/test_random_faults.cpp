// Anything may go wrong at any time: faults of the simulator, and on top of them numbers and stamps that cannot be. The
// estimate stays finite, its covariance positive, its time goes on, and nothing throws. Each run is one seed, which a
// failure prints.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "filter/filter.h"
#include "tests/support/tapped_run.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kDuration = 40.0;  // [s] of each run
#ifdef EAR_EXTENDED
constexpr std::uint64_t kRuns = 90;  // an hour
#else
constexpr std::uint64_t kRuns = 5;
#endif

/// Draws that do not depend on the standard library's distributions.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}
  double uniform(double from, double to) { return from + (to - from) * 0x1p-53 * static_cast<double>(engine_() >> 11); }
  bool happens(double probability) { return uniform(0.0, 1.0) < probability; }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }
  template <typename T>
  const T& pick(const std::vector<T>& from) {
    return from[below(from.size())];
  }

 private:
  std::mt19937_64 engine_;
};

double absurd(Chance& chance) {
  static const std::vector<double> kValues{std::numeric_limits<double>::quiet_NaN(),
                                           std::numeric_limits<double>::infinity(),
                                           -std::numeric_limits<double>::infinity(),
                                           std::numeric_limits<double>::max(),
                                           std::numeric_limits<double>::denorm_min(),
                                           1e12,
                                           -1e6,
                                           900.0,
                                           -90.0,
                                           9.0,
                                           0.0};
  return chance.pick(kValues);
}

/// A stamp that is off by anything from a microsecond to three centuries.
TimeNs false_stamp(TimeNs t_ns, Chance& chance) {
  static const std::vector<TimeNs> kExtremes{std::numeric_limits<TimeNs>::max(), std::numeric_limits<TimeNs>::min(), 0,
                                             -1};
  if (chance.happens(0.1)) return chance.pick(kExtremes);
  const double size = std::pow(10.0, chance.uniform(3.0, 18.0));
  return t_ns + static_cast<TimeNs>(chance.happens(0.5) ? size : -size);
}

void spoil(ImuSample& s, Chance& chance) {
  const auto axis = static_cast<Eigen::Index>(chance.below(3));
  (chance.happens(0.5) ? s.gyro_B : s.accel_B)(axis) = absurd(chance);
}

void spoil(EncoderSample& s, Chance& chance) {
  static const std::vector<std::int64_t> kCounts{std::numeric_limits<std::int64_t>::max(),
                                                 std::numeric_limits<std::int64_t>::min(), 0, 1 << 20, -4096};
  (chance.happens(0.5) ? s.left_count : s.right_count) = chance.pick(kCounts);
}

void spoil(LaserSample& s, Chance& chance) {
  if (chance.happens(0.2) || s.range.empty()) {
    s.range.resize(chance.below(9), 0.1);
  } else {
    s.range[chance.below(s.range.size())] = absurd(chance);
  }
}

void spoil(FeatureFrame& f, Chance& chance) {
  if (f.features.empty()) return;
  const std::size_t count = 1 + chance.below(f.features.size());
  for (std::size_t i = 0; i < count; ++i) {
    FeatureObservation& feature = f.features[chance.below(f.features.size())];
    Eigen::Vector2d& uv = chance.happens(0.5) ? feature.left : feature.right;
    switch (chance.below(5)) {
      case 0:
        uv(static_cast<Eigen::Index>(chance.below(2))) = absurd(chance);
        break;
      case 1:
        uv += Eigen::Vector2d(chance.uniform(-0.5, 0.5), chance.uniform(-0.5, 0.5));
        break;
      case 2:
        feature.id = chance.pick(f.features).id;
        break;
      case 3:
        feature.has_right = !feature.has_right;
        break;
      default:
        std::swap(feature.left, feature.right);
        break;
    }
  }
}

/// Spells of trouble of one stream, and what it does to each sample meanwhile.
class Trouble {
 public:
  Trouble(Chance& chance, double duration) : chance_(chance) {
    for (std::size_t n = chance.below(4); n > 0; --n) {
      const double from = chance.uniform(0.0, duration);
      const double length = std::pow(10.0, chance.uniform(-2.0, 0.8));
      spells_.push_back({from, from + length, chance.below(6), std::pow(10.0, chance.uniform(-3.0, 0.0))});
    }
  }

  template <typename Sample>
  int operator()(double t, Sample& sample) {
    int times = 1;
    for (const Spell& spell : spells_) {
      if (t < spell.from || t > spell.to || !chance_.happens(spell.probability)) continue;
      switch (spell.kind) {
        case 0:
          times = 0;
          break;
        case 1:
          times = 2;
          break;
        case 2:
          sample.t_ns = false_stamp(sample.t_ns, chance_);
          break;
        default:
          spoil(sample, chance_);
          break;
      }
    }
    return times;
  }

 private:
  struct Spell {
    double from, to;
    std::size_t kind;
    double probability;
  };
  Chance& chance_;
  std::vector<Spell> spells_;
};

simulator::Simulation simulate(std::uint64_t seed, Chance& chance) {
  static const std::vector<std::string> kSequences{"flat1", "flat3", "wave1", "fly1", "sway1", "occlusion1"};
  static const std::vector<std::string> kFaults{"encoder_frozen",     "encoder_frozen.left", "wheel_slipping",
                                                "wheel_idle_spin",    "wheel_lifted",        "laser_stuck",
                                                "laser_biased.rear",  "laser_no_return.all", "people",
                                                "camera_covered",     "camera_covered.left", "camera_dark.right",
                                                "camera_overexposed", "camera_frozen",       "camera_swapped",
                                                "camera_dropped",     "camera_late",         "imu_spikes",
                                                "imu_saturated",      "imu_bias_jump",       "imu_gap",
                                                "clock_jump.all",     "clock_jump.imu",      "clock_jump.camera",
                                                "clock_jump.encoder"};
  simulator::Options options;
  options.sequence = chance.pick(kSequences);
  options.seed = seed;
  options.duration = kDuration;
  for (std::size_t n = 1 + chance.below(4); n > 0; --n) {
    std::string name = chance.pick(kFaults);
    const bool clock = name.rfind("clock_jump", 0) == 0;
    name += '@' + std::to_string(chance.uniform(0.5, 30.0)) + '+' + std::to_string(chance.uniform(0.1, 9.0));
    if (clock) name += '=' + std::to_string(std::pow(10.0, chance.uniform(-2.0, 2.0)) * (chance.happens(0.5) ? 1 : -1));
    options.faults.push_back(simulator::parse_fault(name));
  }
  return simulator::Simulation(options);
}

/// Can the matrix be a covariance? Its correlations, up to rounding.
bool positive(const Eigen::MatrixXd& P) {
  if (!P.allFinite() || P.diagonal().minCoeff() < 0.0) return false;
  const Eigen::VectorXd scale = P.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd correlation = scale.asDiagonal() * P * scale.asDiagonal();
  correlation.diagonal().array() += 1e-6;
  return Eigen::LLT<Eigen::MatrixXd>(correlation).info() == Eigen::Success;
}

}  // namespace

TEST_CASE("random faults: nothing that comes in makes an estimate that cannot be") {
  std::size_t estimates = 0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    CAPTURE(seed);
    Chance chance(seed);
    const simulator::Simulation simulation = simulate(seed, chance);
    Trouble imu(chance, kDuration), encoder(chance, kDuration), laser(chance, kDuration), frame(chance, kDuration);
    Taps taps;
    taps.imu = [&](double t, ImuSample& s) { return imu(t, s); };
    taps.encoder = [&](double t, EncoderSample& s) { return encoder(t, s); };
    taps.laser = [&](double t, LaserSample& s) { return laser(t, s); };
    taps.frame = [&](double t, FeatureFrame& f) { return frame(t, f); };

    Filter filter(FilterConfig{}, simulation.calibration());
    TimeNs last_ns = std::numeric_limits<TimeNs>::min();
    std::uint8_t resets = 0;
    run_tapped(simulation, filter, taps, [&](double t, const std::optional<Estimate>& result) {
      if (!result) return;
      CAPTURE(t);
      ++estimates;
      const NavState& x = result->state;
      REQUIRE(x.p_WB.allFinite());
      REQUIRE(x.v_W.allFinite());
      REQUIRE(x.b_g.allFinite());
      REQUIRE(x.b_a.allFinite());
      REQUIRE(std::abs(x.q_WB.norm() - 1.0) < 1e-9);
      REQUIRE(positive(result->covariance));
      REQUIRE(positive(filter.ekf().covariance().matrix()));
      if (result->health.reset_counter == resets) REQUIRE(x.t_ns > last_ns);  // a restart may set the clock back
      resets = result->health.reset_counter;
      REQUIRE(std::isfinite(result->health.horizontal_sigma));
      REQUIRE(std::isfinite(result->health.vertical_sigma));
      last_ns = x.t_ns;
      const std::optional<NavState> ahead = filter.predict(x.t_ns + 20'000'000);
      if (ahead) REQUIRE(ahead->p_WB.allFinite());
    });
  }
  CHECK(estimates > kRuns * 500);  // of 1200 each
}
