// Faults by name: how they are written, and that each changes what it should, when it should, and nothing else.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/about.h"
#include "tools/simulator/constants.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/simulation.h"

namespace ear::simulator {
namespace {

using test::about;

Options short_run(const std::string& sequence, double duration) {
  Options options;
  options.sequence = sequence;
  options.seed = 51;
  options.duration = duration;
  options.tracks = false;
  return options;
}

Simulation with_faults(Options options, const std::vector<std::string>& faults) {
  for (const std::string& fault : faults) options.faults.push_back(parse_fault(fault));
  return Simulation(options);
}

bool same(const ImuSample& a, const ImuSample& b) {
  return a.t_ns == b.t_ns && a.gyro_B == b.gyro_B && a.accel_B == b.accel_B;
}
bool same(const EncoderSample& a, const EncoderSample& b) {
  return a.t_ns == b.t_ns && a.left_count == b.left_count && a.right_count == b.right_count;
}
bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }
bool same(const LaserSample& a, const LaserSample& b) {
  return a.t_ns == b.t_ns && same(a.range[0], b.range[0]) && same(a.range[1], b.range[1]) &&
         same(a.range[2], b.range[2]);
}

// How many samples differ outside [start, end) of the motion, and how many inside.
struct Changes {
  int outside = 0, inside = 0, samples_inside = 0;
};

template <typename Sample>
Changes changes(const std::vector<Sample>& clean, const std::vector<Sample>& faulty, double start, double end) {
  Changes changes;
  REQUIRE(clean.size() == faulty.size());
  for (std::size_t i = 0; i < clean.size(); ++i) {
    const double t = motion_time(clean[i].t_ns);
    const bool inside = start <= t && t < end;
    const bool changed = !same(clean[i], faulty[i]);
    changes.samples_inside += inside ? 1 : 0;
    (inside ? changes.inside : changes.outside) += changed ? 1 : 0;
  }
  return changes;
}

// Nothing differs but, perhaps, the stream named.
void check_others_alike(const Simulation& clean, const Simulation& faulty, const std::string& but) {
  if (but != "imu") CHECK(changes(clean.imu(), faulty.imu(), 0.0, 0.0).outside == 0);
  if (but != "encoder") CHECK(changes(clean.encoders(), faulty.encoders(), 0.0, 0.0).outside == 0);
  if (but != "laser") CHECK(changes(clean.lasers(), faulty.lasers(), 0.0, 0.0).outside == 0);
  if (but != "camera") CHECK(clean.frame_times() == faulty.frame_times());
}

// Counts from a reading to the other, through the wrap.
std::int64_t turned(std::int64_t from, std::int64_t to) {
  constexpr std::int64_t kResolution = 262144;
  const std::int64_t difference = ((to - from) % kResolution + kResolution) % kResolution;
  return difference > kResolution / 2 ? difference - kResolution : difference;
}

double metres(double counts) { return counts / 262144.0 * 2.0 * kPi * 0.075; }

}  // namespace

TEST_CASE("faults: text and back; what is left out is as usual") {
  const Fault biased = parse_fault("laser_biased.rear@20.5+2=-0.1");
  CHECK(biased.kind == FaultKind::laser_biased);
  CHECK(biased.target == 3);
  CHECK(biased.start == 20.5);
  CHECK(biased.duration == 2.0);
  CHECK(biased.parameter == -0.1);
  CHECK(to_string(biased) == "laser_biased.rear@20.5+2=-0.1");

  CHECK(biased.length == 0);
  CHECK(to_string(parse_fault("imu_spikes@20")) == "imu_spikes.both@20+5=60");
  CHECK(to_string(parse_fault("imu_spikes:3@20")) == "imu_spikes.both:3@20+5=40");
  CHECK(to_string(parse_fault("imu_spikes.gyro:5@20+60=12")) == "imu_spikes.gyro:5@20+60=12");
  CHECK(parse_fault(to_string(parse_fault("imu_spikes.accel:2@20"))).length == 2);
  CHECK(fault_help().find("imu_spikes:LENGTH") != std::string::npos);
  CHECK(to_string(parse_fault("encoder_frozen@20")) == "encoder_frozen.both@20+5");
  CHECK(to_string(parse_fault("wheel_lifted@3")) == "wheel_lifted.left@3+5");
  CHECK(parse_fault("imu_gap@7").duration == doctest::Approx(0.3));
  for (const FaultType& type : fault_types()) {
    CAPTURE(type.name);
    const Fault usual = parse_fault(std::string(type.name) + "@12.25");
    CHECK(usual.kind == type.kind);
    const Fault again = parse_fault(to_string(usual));
    CHECK(to_string(again) == to_string(usual));
    CHECK(fault_help().find(type.name) != std::string::npos);
  }
}

TEST_CASE("faults: what cannot be is refused, with the reason") {
  const auto refused = [](const std::string& text, const char* reason) {
    CAPTURE(text);
    CHECK_THROWS_WITH_AS((void)parse_fault(text), doctest::Contains(reason), std::invalid_argument);
    CHECK_THROWS_WITH_AS((void)parse_fault(text), doctest::Contains(text.c_str()), std::invalid_argument);
  };
  refused("encoder_melted@20+5", "encoder_melted");
  refused("encoder_melted@20+5", "wheel_slipping");  // names those that exist
  refused("encoder_frozen", "when?");
  refused("encoder_frozen+5", "when?");
  refused("encoder_frozen@soon+5", "start 'soon' is not a number");
  refused("encoder_frozen@20+", "duration '' is not a number");
  refused("encoder_frozen@20+5s", "duration '5s' is not a number");
  refused("encoder_frozen@-1+5", "start must not be negative");
  refused("encoder_frozen@nan+5", "start must not be negative");
  refused("encoder_frozen@20+0", "duration must be positive");
  refused("encoder_frozen@20+inf", "duration must be positive");
  refused("encoder_frozen.front@20+5", "both, left, right");
  refused("imu_gap.gyro@20", "imu_gap has no targets");
  refused("encoder_frozen@20+5=1", "encoder_frozen has no parameter");
  refused("imu_saturated:2@20", "imu_saturated has no length");
  refused("imu_spikes:0@20", "length '0'");
  refused("imu_spikes:6@20", "length must be within 1 to 5");
  refused("imu_spikes:1.5@20", "length '1.5'");
  refused("imu_spikes:@20", "length ''");
  refused("imu_spikes:nan@20", "length 'nan'");
  refused("imu_spikes:3.gyro@20", "length '3.gyro'");
  refused("imu_spikes:3@20=0.5", "within 1 to 1000");
  refused("wheel_slipping@20+5=-2", "within -1 to 5");
  refused("wheel_slipping@20+5=nan", "within -1 to 5");

  CHECK_THROWS_WITH_AS(with_faults(short_run("flat1", 5.0), {"imu_gap@6"}), doctest::Contains("ends at 5.1"),
                       std::invalid_argument);
  Options options = short_run("flat1", 5.0);
  options.faults.push_back({FaultKind::imu_gap, 0, -1.0, 1.0, 0.0});
  CHECK_THROWS_WITH_AS(Simulation{options}, doctest::Contains("imu_gap"), std::invalid_argument);
}

TEST_CASE("faults: targets are the vehicle's own beams") {
  const Simulation simulation(short_run("static", 1.0));
  const std::vector<std::string> targets = type_of(FaultKind::laser_stuck).targets;
  const auto& beams = simulation.true_calibration().lasers->beams;
  REQUIRE(targets.size() == beams.size() + 1);
  for (std::size_t i = 0; i < beams.size(); ++i) CHECK(targets[i + 1] == beams[i].name);
}

TEST_CASE("faults: frozen counts stay, then go on as if nothing had been") {
  const Options options = short_run("flat1", 9.0);
  const Simulation clean(options);
  for (const std::string target : {"both", "left", "right"}) {
    CAPTURE(target);
    const Simulation faulty = with_faults(options, {"encoder_frozen." + target + "@5+2"});
    check_others_alike(clean, faulty, "encoder");
    const Changes change = changes(clean.encoders(), faulty.encoders(), 5.0, 7.0);
    CHECK(change.outside == 0);
    CHECK(change.inside > 0.99 * change.samples_inside);
    std::int64_t left = 0;
    std::int64_t right = 0;
    for (const EncoderSample& sample : faulty.encoders()) {
      const double t = motion_time(sample.t_ns);
      if (t < 5.0) {
        left = sample.left_count;
        right = sample.right_count;
      } else if (t < 7.0) {
        CHECK((sample.left_count == left) == (target != "right"));
        CHECK((sample.right_count == right) == (target != "left"));
      }
    }
  }
}

TEST_CASE("faults: wheels that slip, spin or hang turn as much more as they should, and count on from there") {
  const Options options = short_run("flat1", 9.5);
  const Simulation clean(options);
  // Counts beyond those of the clean run: nothing before, a constant after, which is returned [m].
  const auto check_excess = [&](const Simulation& faulty, bool right) {
    const auto count = [right](const EncoderSample& sample) { return right ? sample.right_count : sample.left_count; };
    std::vector<std::int64_t> excess{turned(count(clean.encoders()[0]), count(faulty.encoders()[0]))};
    for (std::size_t i = 1; i < clean.encoders().size(); ++i) {
      excess.push_back(excess.back() + turned(count(faulty.encoders()[i - 1]), count(faulty.encoders()[i])) -
                       turned(count(clean.encoders()[i - 1]), count(clean.encoders()[i])));
    }
    for (std::size_t i = 0; i < excess.size(); ++i) {
      const double t = motion_time(clean.encoders()[i].t_ns);
      if (t <= 5.0) CHECK(excess[i] == 0);
      if (t >= 8.0) CHECK(excess[i] == excess.back());
    }
    return metres(static_cast<double>(excess.back()));
  };
  // Distance that the axle's middle travels meanwhile.
  double travelled = 0.0;
  for (double t = 5.0; t < 8.0; t += 0.01) travelled += 0.01 * clean.truth(kStart + std::llround(1e9 * t)).axle_speed;
  REQUIRE(travelled > 1.0);
  const auto slipped = [](const Simulation& simulation) {
    double sum = 0.0;
    for (const TimeNs t_ns : simulation.truth_times()) sum += 0.005 * simulation.truth(t_ns).slip;
    return sum;
  };
  CHECK(slipped(clean) == 0.0);

  SUBCASE("slipping: a share of the distance; the truth says so") {
    const Simulation faulty = with_faults(options, {"wheel_slipping@5+3=-0.4"});
    check_others_alike(clean, faulty, "encoder");
    const double left = check_excess(faulty, false);
    const double right = check_excess(faulty, true);
    CHECK(0.5 * (left + right) == about(-0.4 * travelled, 0.06));  // less at both ends
    CHECK(slipped(faulty) == about(0.5 * (left + right), 0.01));
    CHECK(faulty.truth(kStart + 4'900'000'000).slip == 0.0);
    CHECK(faulty.truth(kStart + 8'100'000'000).slip == 0.0);
  }
  SUBCASE("idle spin of one wheel: speed times time, also where nothing moves") {
    const Simulation faulty = with_faults(options, {"wheel_idle_spin.right@5+3=0.5"});
    CHECK(check_excess(faulty, false) == 0.0);
    CHECK(check_excess(faulty, true) == about(0.5 * 2.9, 0.01));
    CHECK(slipped(faulty) == about(0.5 * 0.5 * 2.9, 0.01));
    const Simulation standing = with_faults(short_run("static", 4.0), {"wheel_idle_spin@1+2"});
    CHECK(standing.encoders()[150].left_count != standing.encoders()[140].left_count);
    CHECK(standing.truth(kStart + 2'000'000'000).slip == doctest::Approx(0.3));
  }
  SUBCASE("a lifted wheel coasts: it no longer follows, and loses its speed") {
    const Simulation faulty = with_faults(options, {"wheel_lifted.left@5+3"});
    check_others_alike(clean, faulty, "encoder");
    CHECK(check_excess(faulty, true) == 0.0);
    check_excess(faulty, false);
    const auto speed = [&](double t) {
      const auto i = static_cast<std::size_t>((t - 0.1033) * 100.0);
      const auto& encoders = faulty.encoders();
      return metres(static_cast<double>(turned(encoders[i].left_count, encoders[i + 20].left_count))) / 0.2;
    };
    CHECK(speed(7.5) == about(speed(5.3) * std::exp(-2.2 / 2.0), 0.02));
    CHECK(slipped(faulty) == 0.0);  // it does not touch the ground
  }
}

TEST_CASE("faults: a beam sticks, is biased, or gives nothing; the others do not") {
  const Options options = short_run("flat1", 6.0);
  const Simulation clean(options);
  const auto check_beam = [&](const std::string& fault, const std::function<bool(double clean, double faulty)>& right) {
    CAPTURE(fault);
    const Simulation faulty = with_faults(options, {fault});
    check_others_alike(clean, faulty, "laser");
    const Changes change = changes(clean.lasers(), faulty.lasers(), 3.0, 5.0);
    CHECK(change.outside == 0);
    CHECK(change.inside == change.samples_inside);
    CHECK(change.samples_inside == 100);
    for (std::size_t i = 0; i < clean.lasers().size(); ++i) {
      const auto& a = clean.lasers()[i].range;
      const auto& b = faulty.lasers()[i].range;
      CHECK(a[0] == b[0]);
      CHECK(a[2] == b[2]);
      const double t = motion_time(clean.lasers()[i].t_ns);
      if (t >= 3.0 && t < 5.0) CHECK(right(a[1], b[1]));
    }
  };
  double last = 0.0;
  for (const LaserSample& sample : clean.lasers()) {
    if (motion_time(sample.t_ns) < 3.0) last = sample.range[1];
  }
  check_beam("laser_stuck.front_right@3+2", [&](double, double faulty) { return faulty == last; });
  check_beam("laser_biased.front_right@3+2=0.07", [](double a, double b) { return std::abs(b - a - 0.07) < 1e-12; });
  check_beam("laser_biased.front_right@3+2=-1", [](double, double b) { return std::isnan(b); });  // below its range
  check_beam("laser_no_return.front_right@3+2", [](double, double b) { return std::isnan(b); });

  const Simulation all = with_faults(options, {"laser_no_return.all@3+2"});
  for (const double range : all.lasers()[200].range) CHECK(std::isnan(range));
}

TEST_CASE("faults: spikes of the IMU are rare, large, and begin at once") {
  const Options options = short_run("flat1", 12.0);
  const Simulation clean(options);
  for (const std::string target : {"both", "gyro", "accel"}) {
    CAPTURE(target);
    const Simulation faulty = with_faults(options, {"imu_spikes." + target + "@2+8=50"});
    check_others_alike(clean, faulty, "imu");
    const Changes change = changes(clean.imu(), faulty.imu(), 2.0, 10.0);
    CHECK(change.outside == 0);
    CHECK(change.inside > 20);
    CHECK(change.inside < 65);
    bool first = true;
    for (std::size_t i = 0; i < clean.imu().size(); ++i) {
      const double accel = (faulty.imu()[i].accel_B - clean.imu()[i].accel_B).norm();
      const double gyro = (faulty.imu()[i].gyro_B - clean.imu()[i].gyro_B).norm();
      if (motion_time(clean.imu()[i].t_ns) >= 2.0 && first) CHECK(accel + gyro > 0.0);
      first = motion_time(clean.imu()[i].t_ns) < 2.0;
      if (accel + gyro == 0.0) continue;
      CHECK((accel > 24.9) == (target != "gyro"));
      CHECK((gyro > 2.49) == (target != "accel"));
      CHECK(accel < 50.1);
      CHECK(gyro < 5.01);
    }
  }
}

TEST_CASE("faults: spikes of a length are 20 a minute, the same over their samples, and as large as said") {
  Options options = short_run("static", 55.0);
  constexpr double kFrom = 2.0;
  constexpr double kTo = 52.0;
  constexpr int kSeeds = 8;
  for (const int length : {1, 3, 5}) {
    CAPTURE(length);
    int samples = 0;
    std::vector<double> gyro, accel;  // of each axis of each spike
    for (int seed = 0; seed < kSeeds; ++seed) {
      options.seed = 51 + static_cast<std::uint64_t>(seed);
      const Simulation clean(options);
      const Simulation faulty = with_faults(options, {"imu_spikes:" + std::to_string(length) + "@2+50"});
      check_others_alike(clean, faulty, "imu");
      const Changes change = changes(clean.imu(), faulty.imu(), kFrom, kTo);
      CHECK(change.outside == 0);
      CHECK(change.inside % length == 0);
      samples += change.inside;
      Eigen::Vector3d last = Eigen::Vector3d::Zero();
      bool first = true;
      for (std::size_t i = 0; i < clean.imu().size(); ++i) {
        const Eigen::Vector3d a = faulty.imu()[i].accel_B - clean.imu()[i].accel_B;
        const Eigen::Vector3d w = faulty.imu()[i].gyro_B - clean.imu()[i].gyro_B;
        if (first && motion_time(clean.imu()[i].t_ns) >= kFrom) {
          CHECK(a.norm() > 0.0);
          first = false;
        }
        CHECK((a.norm() > 0.0) == (w.norm() > 0.0));
        if (a.norm() > 0.0 && (a - last).norm() > 1e-9) {
          accel.insert(accel.end(), a.data(), a.data() + 3);
          gyro.insert(gyro.end(), w.data(), w.data() + 3);
        }
        last = a;
      }
    }
    const auto spikes = static_cast<int>(accel.size()) / 3;
    CHECK(samples == length * spikes);
    // One at once in each run, and 16.7 by chance: 141 in all, with a standard deviation of 12.
    CHECK(spikes > 141 - 4 * 12);
    CHECK(spikes < 141 + 4 * 12);
    const auto sigma = [](const std::vector<double>& values) {
      double sum = 0.0;
      for (const double value : values) sum += value * value;
      return std::sqrt(sum / static_cast<double>(values.size()));
    };
    // Of some 400 draws: 3.5 % is one standard deviation.
    CHECK(std::abs(sigma(accel) / 40.0 - 1.0) < 0.15);
    CHECK(std::abs(sigma(gyro) / 3.0 - 1.0) < 0.15);
  }
}

TEST_CASE("faults: spikes of a length hit what they should, by the size given, and end with the fault") {
  const Options options = short_run("flat1", 6.0);
  const Simulation clean(options);
  const Simulation gyro = with_faults(options, {"imu_spikes.gyro:4@2+2"});
  const Simulation accel = with_faults(options, {"imu_spikes.accel:4@2+2"});
  const Simulation half = with_faults(options, {"imu_spikes.accel:4@2+2=20"});
  const Simulation shorter = with_faults(options, {"imu_spikes:4@2+0.015"});
  CHECK(changes(clean.imu(), gyro.imu(), 2.0, 4.0).inside >= 4);
  CHECK(changes(clean.imu(), shorter.imu(), 2.0, 4.0).inside == 0);  // three samples: none fits
  for (std::size_t i = 0; i < clean.imu().size(); ++i) {
    CHECK(gyro.imu()[i].accel_B == clean.imu()[i].accel_B);
    CHECK(accel.imu()[i].gyro_B == clean.imu()[i].gyro_B);
    const Eigen::Vector3d whole = accel.imu()[i].accel_B - clean.imu()[i].accel_B;
    CHECK((half.imu()[i].accel_B - clean.imu()[i].accel_B - 0.5 * whole).norm() < 1e-9);
  }
}

TEST_CASE("faults: a saturated IMU is jolted beyond its range and clipped at it") {
  const Options options = short_run("flat1", 9.0);
  const Simulation clean(options);
  const Simulation faulty = with_faults(options, {"imu_saturated@2+5"});
  check_others_alike(clean, faulty, "imu");
  const Changes change = changes(clean.imu(), faulty.imu(), 2.0, 7.0);
  CHECK(change.outside == 0);
  CHECK(change.inside > 3 * 8);
  CHECK(change.inside < 3 * 40);
  int clipped = 0;
  for (const ImuSample& sample : faulty.imu()) {
    const double accel = sample.accel_B.cwiseAbs().maxCoeff();
    const double gyro = sample.gyro_B.cwiseAbs().maxCoeff();
    CHECK(accel <= 4.0 * kGravity);
    CHECK(gyro <= 500.0 * kDegree);
    clipped += accel == 4.0 * kGravity || gyro == 500.0 * kDegree ? 1 : 0;
  }
  CHECK(clipped > 8);
  // Without jolts, clipping alone changes nothing here.
  CHECK(changes(clean.imu(), with_faults(options, {"imu_saturated@2+5=0"}).imu(), 0.0, 0.0).outside == 0);
}

TEST_CASE("faults: biases jump, the truth with them, and come back") {
  const Options options = short_run("flat1", 7.0);
  const Simulation clean(options);
  const Simulation faulty = with_faults(options, {"imu_bias_jump@2+3=0.03"});
  check_others_alike(clean, faulty, "imu");
  const Changes change = changes(clean.imu(), faulty.imu(), 2.0, 5.0);
  CHECK(change.outside == 0);
  CHECK(change.inside == change.samples_inside);
  for (std::size_t i = 0; i < clean.imu().size(); ++i) {
    const TimeNs t_ns = clean.imu()[i].t_ns;
    const Eigen::Vector3d gyro = faulty.imu()[i].gyro_B - clean.imu()[i].gyro_B;
    const Eigen::Vector3d accel = faulty.imu()[i].accel_B - clean.imu()[i].accel_B;
    const bool inside = motion_time(t_ns) >= 2.0 && motion_time(t_ns) < 5.0;
    CHECK(gyro.norm() == doctest::Approx(inside ? 0.03 : 0.0));
    CHECK(accel.norm() == doctest::Approx(inside ? 0.3 : 0.0));
    CHECK((faulty.truth(t_ns).b_g - clean.truth(t_ns).b_g - gyro).norm() < 1e-9);
    CHECK((faulty.truth(t_ns).b_a - clean.truth(t_ns).b_a - accel).norm() < 1e-9);
  }
}

TEST_CASE("faults: in a gap there are no samples, but there is truth") {
  const Options options = short_run("flat1", 7.0);
  const Simulation clean(options);
  const Simulation faulty = with_faults(options, {"imu_gap@2+0.25", "imu_gap@4+0.05"});
  check_others_alike(clean, faulty, "imu");
  CHECK(faulty.imu().size() == clean.imu().size() - 50 - 10);
  CHECK(faulty.truth_times() == clean.truth_times());
  std::size_t next = 0;
  for (const ImuSample& sample : clean.imu()) {
    const double t = motion_time(sample.t_ns);
    const bool gap = (t > 2.0 - 1e-6 && t < 2.25 - 1e-6) || (t > 4.0 - 1e-6 && t < 4.05 - 1e-6);
    if (!gap) CHECK(same(sample, faulty.imu()[next++]));
    CHECK(faulty.truth(sample.t_ns).b_g == clean.truth(sample.t_ns).b_g);
  }
}

TEST_CASE("faults: one stream's stamps jump and jump back; what it measures stays") {
  const Options options = short_run("flat1", 7.0);
  const Simulation clean(options);
  for (const std::string stream : {"imu", "encoder", "laser", "camera"}) {
    CAPTURE(stream);
    const Simulation faulty = with_faults(options, {"clock_jump." + stream + "@2+3=-0.25"});
    check_others_alike(clean, faulty, stream);
    const auto check_stamp = [](TimeNs clean_ns, TimeNs faulty_ns) {
      const bool inside = motion_time(clean_ns) >= 2.0 && motion_time(clean_ns) < 5.0;
      CHECK(faulty_ns - clean_ns == (inside ? -250'000'000 : 0));
    };
    for (std::size_t i = 0; i < clean.imu().size() && stream == "imu"; ++i) {
      check_stamp(clean.imu()[i].t_ns, faulty.imu()[i].t_ns);
      CHECK(clean.imu()[i].gyro_B == faulty.imu()[i].gyro_B);
    }
    for (std::size_t i = 0; i < clean.encoders().size() && stream == "encoder"; ++i) {
      check_stamp(clean.encoders()[i].t_ns, faulty.encoders()[i].t_ns);
    }
    for (std::size_t i = 0; i < clean.lasers().size() && stream == "laser"; ++i) {
      check_stamp(clean.lasers()[i].t_ns, faulty.lasers()[i].t_ns);
    }
    for (std::size_t i = 0; i < clean.frames().size() && stream == "camera"; ++i) {
      check_stamp(clean.frames()[i].t_ns, faulty.frames()[i].t_ns);
      CHECK(faulty.frame_times()[i] == faulty.frames()[i].t_ns);
      CHECK(faulty.frames()[i].taken_ns == clean.frames()[i].t_ns);
    }
  }
  const Simulation all = with_faults(options, {"clock_jump.all@2+3"});
  CHECK(all.imu()[500].t_ns == clean.imu()[500].t_ns + 100'000'000);
  CHECK(all.lasers()[120].t_ns == clean.lasers()[120].t_ns + 100'000'000);
}

TEST_CASE("faults: two at a time do what each does alone") {
  const Options options = short_run("flat1", 7.0);
  const Simulation spikes = with_faults(options, {"imu_spikes@2+2"});
  const Simulation both = with_faults(options, {"encoder_frozen@3+2", "laser_stuck@1+2", "imu_spikes@2+2"});
  CHECK(changes(spikes.imu(), both.imu(), 0.0, 0.0).outside == 0);
  CHECK(changes(with_faults(options, {"encoder_frozen@3+2"}).encoders(), both.encoders(), 0.0, 0.0).outside == 0);
}

}  // namespace ear::simulator
