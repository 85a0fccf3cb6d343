// Faults of the cameras and of what they see, on feature tracks: what they change, when, and that nothing else changes.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/support/about.h"
#include "tools/simulator/constants.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/simulation.h"

namespace ear::simulator {
namespace {

using test::about;

constexpr double kBegin = 4.0;  // [s] of every fault here that says nothing else
constexpr double kEnd = 6.0;

Options tracked(const std::string& sequence, double duration) {
  Options options;
  options.sequence = sequence;
  options.seed = 52;
  options.duration = duration;
  return options;
}

Simulation with_fault(Options options, const std::string& fault) {
  options.faults.push_back(parse_fault(fault));
  return Simulation(options);
}

double taken(const Simulation& simulation, std::size_t frame) {
  return motion_time(simulation.frames()[frame].taken_ns);
}

bool within(double t) { return t > kBegin - 1e-9 && t < kEnd - 1e-9; }

bool same_place(const FeatureObservation& a, const FeatureObservation& b) {
  return a.left == b.left && a.has_right == b.has_right && a.right == b.right;
}

bool same_places(const FeatureFrame& a, const FeatureFrame& b) {
  return a.t_ns == b.t_ns &&
         std::equal(a.features.begin(), a.features.end(), b.features.begin(), b.features.end(), same_place);
}

std::set<std::uint64_t> ids_of(const FeatureFrame& frame) {
  std::set<std::uint64_t> ids;
  for (const FeatureObservation& seen : frame.features) ids.insert(seen.id);
  return ids;
}

const FeatureObservation* find(const FeatureFrame& frame, std::uint64_t id) {
  for (const FeatureObservation& seen : frame.features) {
    if (seen.id == id) return &seen;
  }
  return nullptr;
}

// The index of the last frame taken before `t`.
std::size_t last_before(const Simulation& simulation, double t) {
  std::size_t last = 0;
  for (std::size_t i = 0; i < simulation.frames().size(); ++i) {
    if (taken(simulation, i) < t - 1e-9) last = i;
  }
  return last;
}

// Outside of [kBegin, kEnd) all frames are there and show the same, before it even under the same ids; no id comes back
// after a frame without it; the other sensors do not notice.
void check_clean_outside(const Simulation& clean, const Simulation& faulty) {
  std::map<std::size_t, std::size_t> by_exposure;  // index of faulty's frame
  for (std::size_t i = 0; i < faulty.frames().size(); ++i) by_exposure[faulty.frames()[i].exposure] = i;
  std::map<std::uint64_t, std::size_t> last_seen;
  for (std::size_t i = 0; i < faulty.frames().size(); ++i) {
    CHECK(faulty.tracks(i).t_ns == faulty.frame_times()[i]);
    for (const FeatureObservation& seen : faulty.tracks(i).features) {
      const auto before = last_seen.find(seen.id);
      if (before != last_seen.end()) CHECK(before->second + 1 == i);
      last_seen[seen.id] = i;
    }
    CHECK(ids_of(faulty.tracks(i)).size() == faulty.tracks(i).features.size());
  }
  for (std::size_t i = 0; i < clean.frames().size(); ++i) {
    if (within(taken(clean, i))) continue;
    REQUIRE(by_exposure.count(i) == 1);
    const FeatureFrame& frame = faulty.tracks(by_exposure[i]);
    CHECK(same_places(clean.tracks(i), frame));
    if (taken(clean, i) < kBegin) CHECK(ids_of(clean.tracks(i)) == ids_of(frame));
  }
  REQUIRE(clean.imu().size() == faulty.imu().size());
  for (std::size_t i = 0; i < clean.imu().size(); ++i) CHECK(clean.imu()[i].accel_B == faulty.imu()[i].accel_B);
  for (std::size_t i = 0; i < clean.lasers().size(); ++i) CHECK(clean.lasers()[i].t_ns == faulty.lasers()[i].t_ns);
}

// Distance in pixels of the left camera.
double pixels_apart(const Simulation& simulation, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const ear::CameraCalibration& left = simulation.true_calibration().cameras[0];
  return (to_pixel(left, a) - to_pixel(left, b)).norm();
}

Eigen::Isometry3d pose_WC(const Truth& truth, const ear::CameraCalibration& camera) {
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
  T_WB.linear() = truth.R_WB;
  T_WB.translation() = truth.p_WB;
  return T_WB * camera.T_BC;
}

}  // namespace

TEST_CASE("camera faults: a covered lens sees nothing") {
  const Simulation clean(tracked("flat1", 8.0));
  SUBCASE("both") {
    const Simulation faulty = with_fault(tracked("flat1", 8.0), "camera_covered@4+2");
    check_clean_outside(clean, faulty);
    for (std::size_t i = 0; i < clean.frames().size(); ++i) {
      if (within(taken(clean, i))) CHECK(faulty.tracks(i).features.empty());
    }
    const std::size_t last = last_before(clean, kBegin);
    const std::set<std::uint64_t> before = ids_of(faulty.tracks(last));
    for (const std::uint64_t id : ids_of(faulty.tracks(last + 61))) CHECK(before.count(id) == 0);
  }
  SUBCASE("left") {
    const Simulation faulty = with_fault(tracked("flat1", 8.0), "camera_covered.left@4+2");
    check_clean_outside(clean, faulty);
    CHECK(faulty.tracks(last_before(clean, kEnd)).features.empty());
  }
  SUBCASE("right") {
    const Simulation faulty = with_fault(tracked("flat1", 8.0), "camera_covered.right@4+2");
    check_clean_outside(clean, faulty);
    for (std::size_t i = 0; i < clean.frames().size(); ++i) {
      CHECK(ids_of(faulty.tracks(i)) == ids_of(clean.tracks(i)));
      if (!within(taken(clean, i))) continue;
      for (const FeatureObservation& seen : faulty.tracks(i).features) CHECK_FALSE(seen.has_right);
      CHECK(faulty.tracks(i).features.front().left == clean.tracks(i).features.front().left);
    }
  }
}

TEST_CASE("camera faults: in bad light few tracks are left, and they are noisier") {
  struct Case {
    const char* fault;
    double share, noise;  // of the tracks; in units of the usual one
  };
  const Simulation clean(tracked("flat1", 8.0));
  for (const Case& bad : {Case{"camera_dark@4+2", 0.2, 4.0}, Case{"camera_dark@4+2=0.1", 0.4, 2.0},
                          Case{"camera_overexposed@4+2", 0.25, 2.0}}) {
    CAPTURE(bad.fault);
    const Simulation faulty = with_fault(tracked("flat1", 8.0), bad.fault);
    check_clean_outside(clean, faulty);
    double kept = 0.0, all = 0.0, squares = 0.0, coordinates = 0.0, continued = 0.0, could = 0.0;
    for (std::size_t i = 0; i < clean.frames().size(); ++i) {
      if (!within(taken(clean, i))) continue;
      all += static_cast<double>(clean.tracks(i).features.size());
      kept += static_cast<double>(faulty.tracks(i).features.size());
      for (const FeatureObservation& seen : faulty.tracks(i).features) {
        const FeatureObservation* original = find(clean.tracks(i), seen.id);
        REQUIRE(original != nullptr);
        squares += std::pow(pixels_apart(clean, seen.left, original->left), 2);
        coordinates += 2.0;
        if (find(clean.tracks(i + 1), seen.id) == nullptr || !within(taken(clean, i + 1))) continue;
        could += 1.0;
        continued += find(faulty.tracks(i + 1), seen.id) != nullptr ? 1.0 : 0.0;
      }
    }
    CHECK(kept / all == about(bad.share, 0.3));
    CHECK(std::sqrt(squares / coordinates) == about(0.5 * std::sqrt(bad.noise * bad.noise - 1.0), 0.05));
    CHECK(continued == could);
  }
}

TEST_CASE("camera faults: a frozen image shows the same again and again") {
  const Options options = tracked("flat1", 8.0);
  const Simulation clean(options);
  const std::size_t last = last_before(clean, kBegin);
  SUBCASE("both") {
    const Simulation faulty = with_fault(options, "camera_frozen@4+2");
    check_clean_outside(clean, faulty);
    const std::set<std::uint64_t> before = ids_of(clean.tracks(last));
    for (std::size_t i = last; within(taken(clean, i + 1)); ++i) {
      CHECK(faulty.tracks(i + 1).t_ns == clean.frame_times()[i + 1]);
      CHECK(std::equal(faulty.tracks(i + 1).features.begin(), faulty.tracks(i + 1).features.end(),
                       clean.tracks(last).features.begin(), clean.tracks(last).features.end(), same_place));
      CHECK(ids_of(faulty.tracks(i + 1)) == before);
    }
    // Nobody follows a feature over two seconds without a new image.
    for (const std::uint64_t id : ids_of(faulty.tracks(last + 61))) CHECK(before.count(id) == 0);
    for (std::size_t i = 0; i < faulty.frames().size(); ++i) {
      CHECK(faulty.tracks(i).repeated == within(taken(faulty, i)));
      CHECK_FALSE(clean.tracks(i).repeated);
    }
  }
  SUBCASE("left alone: with its features it is repeated, though not in the right image") {
    const Simulation faulty = with_fault(options, "camera_frozen.left@4+2");
    check_clean_outside(clean, faulty);
    for (std::size_t i = 0; i < faulty.frames().size(); ++i) {
      CHECK(faulty.tracks(i).repeated == within(taken(faulty, i)));
    }
  }
  SUBCASE("with frames that do not arrive, and exchanged") {
    Options both = options;
    both.faults = {parse_fault("camera_frozen@4+2"), parse_fault("camera_dropped@4+1")};
    const Simulation dropped(both);
    for (std::size_t i = 0; i < dropped.frames().size(); ++i) {  // the image before the fault did arrive
      CHECK(dropped.tracks(i).repeated == within(taken(dropped, i)));
    }
    both.faults = {parse_fault("camera_frozen@4+2"), parse_fault("camera_swapped@5+1")};
    const Simulation swapped(both);
    // At 5 s the right image takes the place of the left one: it was not there before.
    for (std::size_t i = last + 1; i < last + 61; ++i) {
      const bool first_swapped = !(taken(swapped, i - 1) >= 5.0 - 1e-6) && taken(swapped, i) >= 5.0 - 1e-6;
      CHECK(swapped.tracks(i).repeated == !first_swapped);
    }
  }
  SUBCASE("for a moment: tracks go on") {
    const Simulation faulty = with_fault(options, "camera_frozen@4+0.1");
    CHECK(ids_of(faulty.tracks(last + 1)) == ids_of(clean.tracks(last)));
    CHECK(ids_of(faulty.tracks(last + 6)) == ids_of(clean.tracks(last + 6)));
  }
  SUBCASE("right alone") {
    const Simulation faulty = with_fault(options, "camera_frozen.right@4+2");
    check_clean_outside(clean, faulty);
    int pairs = 0;
    for (const FeatureObservation& seen : faulty.tracks(last + 20).features) {
      CHECK(seen.left == find(clean.tracks(last + 20), seen.id)->left);
      if (!seen.has_right) continue;
      ++pairs;
      CHECK(seen.right == find(clean.tracks(last), seen.id)->right);
    }
    for (std::size_t i = 0; i < faulty.frames().size(); ++i) CHECK_FALSE(faulty.tracks(i).repeated);
    CHECK(pairs > 30);
  }
}

TEST_CASE("camera faults: swapped images exchange left and right") {
  const Options options = tracked("flat1", 8.0);
  const Simulation clean(options);
  const Simulation faulty = with_fault(options, "camera_swapped@4+2");
  check_clean_outside(clean, faulty);
  const auto& cameras = clean.true_calibration().cameras;
  for (std::size_t i = 0; i < clean.frames().size(); ++i) {
    if (!within(taken(clean, i))) continue;
    const auto& features = clean.tracks(i).features;
    CHECK(faulty.tracks(i).features.size() ==
          static_cast<std::size_t>(std::count_if(features.begin(), features.end(),
                                                 [](const FeatureObservation& seen) { return seen.has_right; })));
    for (const FeatureObservation& seen : faulty.tracks(i).features) {
      const FeatureObservation* original = find(clean.tracks(i), seen.id);
      if (original == nullptr) continue;  // renamed: it was not in the other picture
      REQUIRE(seen.has_right);
      CHECK((to_pixel(cameras[0], seen.left) - to_pixel(cameras[1], original->right)).norm() < 1e-6);
      CHECK((to_pixel(cameras[1], seen.right) - to_pixel(cameras[0], original->left)).norm() < 1e-6);
    }
  }
}

TEST_CASE("camera faults: frames are dropped, all or some, the first at once") {
  const Options options = tracked("flat1", 8.0);
  const Simulation clean(options);
  const Simulation none = with_fault(options, "camera_dropped@4+2");
  check_clean_outside(clean, none);
  CHECK(none.frames().size() == clean.frames().size() - 60);
  for (std::size_t i = 0; i < none.frames().size(); ++i) CHECK_FALSE(within(taken(none, i)));
  CHECK(none.exposures() == clean.frame_times());
  const std::size_t last = last_before(none, kBegin);
  const std::set<std::uint64_t> before = ids_of(none.tracks(last));
  for (const std::uint64_t id : ids_of(none.tracks(last + 1))) CHECK(before.count(id) == 0);

  const Simulation half = with_fault(options, "camera_dropped@4+2=0.5");
  check_clean_outside(clean, half);
  CHECK(half.frames().size() < clean.frames().size() - 18);
  CHECK(half.frames().size() > clean.frames().size() - 42);
  CHECK(half.frames()[last + 1].exposure > half.frames()[last].exposure + 1);
  CHECK(ids_of(half.tracks(last)) != ids_of(half.tracks(last + 1)));
  std::size_t common = 0;
  for (const std::uint64_t id : ids_of(half.tracks(last + 1))) common += ids_of(half.tracks(last)).count(id);
  CHECK(common > 100);
}

TEST_CASE("camera faults: late frames have their stamps, come later, and none overtakes") {
  const Options options = tracked("flat1", 8.0);
  const Simulation clean(options);
  const Simulation faulty = with_fault(options, "camera_late@4+2=0.25");
  check_clean_outside(clean, faulty);
  CHECK(faulty.frame_times() == clean.frame_times());
  TimeNs previous = 0;
  for (std::size_t i = 0; i < faulty.frames().size(); ++i) {
    const Frame& frame = faulty.frames()[i];
    CHECK(same_places(faulty.tracks(i), clean.tracks(i)));
    const TimeNs delay = frame.arrival_ns - frame.taken_ns;
    CHECK(clean.frames()[i].arrival_ns - clean.frames()[i].taken_ns == 10'000'000);
    if (within(taken(faulty, i))) CHECK(delay == 260'000'000);
    if (taken(faulty, i) < kBegin || taken(faulty, i) > kEnd + 0.3) CHECK(delay == 10'000'000);
    CHECK(frame.arrival_ns >= previous);
    previous = frame.arrival_ns;
  }
  // In the order of arrival, a late frame comes after the IMU samples of the next quarter of a second.
  TimeNs imu_ns = 0;
  bool late = false;
  for (const Delivery& delivery : faulty.deliveries()) {
    if (delivery.stream == SensorStream::imu) imu_ns = faulty.imu()[delivery.index].t_ns;
    if (delivery.stream != SensorStream::camera) continue;
    const Frame& frame = faulty.frames()[delivery.index];
    CHECK(imu_ns <= frame.arrival_ns);
    CHECK(imu_ns > frame.arrival_ns - 6'000'000);
    late = late || imu_ns > frame.t_ns + 240'000'000;
  }
  CHECK(late);
}

TEST_CASE("deliveries: every sample once, in the order of true time, whatever the clocks say") {
  Options options = tracked("flat1", 6.0);
  options.faults = {parse_fault("clock_jump.all@2+2=-0.3"), parse_fault("imu_gap@3+0.1")};
  const Simulation simulation(options);
  std::map<SensorStream, std::size_t> next;
  TimeNs previous = 0;
  for (const Delivery& delivery : simulation.deliveries()) {
    CHECK(delivery.arrival_ns >= previous);
    previous = delivery.arrival_ns;
    CHECK(delivery.index == next[delivery.stream]++);
  }
  CHECK(next[SensorStream::imu] == simulation.imu().size());
  CHECK(next[SensorStream::encoder] == simulation.encoders().size());
  CHECK(next[SensorStream::laser] == simulation.lasers().size());
  CHECK(next[SensorStream::camera] == simulation.frames().size());
}

TEST_CASE("people: they hide what is behind them, and move as one") {
  const Options options = tracked("flat1", 8.0);
  const Simulation clean(options);
  const Simulation faulty = with_fault(options, "people@4+2");
  check_clean_outside(clean, faulty);
  REQUIRE(faulty.passersby().size() == 1);
  const Passerby& people = faulty.passersby().front();
  CHECK(people.distance() <= 1.5);
  const ear::CameraCalibration& left = faulty.true_calibration().cameras[0];
  const ear::CameraCalibration& right = faulty.true_calibration().cameras[1];
  double most_hidden = 0.0;
  double most_on_people = 0.0;
  std::map<std::uint64_t, Eigen::Vector2d> places;  // of features on the people
  for (std::size_t i = 0; i < clean.frames().size(); ++i) {
    if (!within(taken(clean, i))) continue;
    const double t = taken(clean, i);
    const Panel panel = people.panel(t);
    const Truth truth = faulty.truth(clean.frame_times()[i]);
    const Eigen::Isometry3d T_WC0 = pose_WC(truth, left);
    const Eigen::Isometry3d T_WC1 = pose_WC(truth, right);
    double hidden = static_cast<double>(clean.tracks(i).features.size());
    double on_people = 0.0;
    for (const FeatureObservation& seen : faulty.tracks(i).features) {
      const auto& features = clean.tracks(i).features;
      const bool original = std::any_of(features.begin(), features.end(),
                                        [&](const FeatureObservation& feature) { return feature.left == seen.left; });
      // Where the ray meets the people's plane.
      const Eigen::Vector3d direction_W = T_WC0.linear() * seen.left.homogeneous();
      const double range = (panel.offset - panel.normal_W.dot(T_WC0.translation())) / panel.normal_W.dot(direction_W);
      const Eigen::Vector3d p_W = T_WC0.translation() + range * direction_W;
      const Eigen::Vector2d passed((p_W - panel.corner_W).dot(panel.u_W), (p_W - panel.corner_W).dot(panel.v_W));
      if (original) {
        hidden -= 1.0;
        const bool inside = passed.x() > 0.02 && passed.x() < panel.width - 0.02 &&  // but for noise at the edge
                            passed.y() > 0.02 && passed.y() < panel.height - 0.02;
        CHECK_FALSE((inside && range > 0.0));
        continue;
      }
      on_people += 1.0;
      CHECK(passed.x() > -0.02);
      CHECK(passed.x() < panel.width + 0.02);
      if (places.count(seen.id) != 0) CHECK((places[seen.id] - passed).norm() < 0.03);
      places[seen.id] = passed;
      if (!seen.has_right) continue;
      const Eigen::Vector2d expected = (T_WC1.inverse() * p_W).hnormalized();
      CHECK((to_pixel(right, seen.right) - to_pixel(right, expected)).norm() < 5.0);
    }
    most_hidden = std::max(most_hidden, hidden);
    most_on_people = std::max(most_on_people, on_people);
  }
  MESSAGE(people.distance() << " m away, up to " << most_hidden << " of 150 hidden, " << most_on_people
                            << " on people");
  CHECK(most_hidden > 25.0);
  CHECK(most_on_people > 15.0);
}

TEST_CASE("people: they start and end outside of the view") {
  const Simulation faulty = with_fault(tracked("flat1", 14.0), "people@3+10=2");
  const Passerby& people = faulty.passersby().front();
  const ear::CameraCalibration& left = faulty.true_calibration().cameras[0];
  const auto seen = [&](double t) {
    const Panel panel = people.panel(t);
    const Truth truth = faulty.truth(1'600'000'000'000'000'000 + std::llround(1e9 * t));
    const Eigen::Vector3d middle_W = panel.corner_W + 0.5 * panel.width * panel.u_W + 0.4 * panel.v_W;
    return project(left, pose_WC(truth, left).inverse() * middle_W).has_value();
  };
  CHECK_FALSE(seen(3.0));
  CHECK(seen(5.5));
  CHECK_FALSE(seen(8.0));  // twice across in 10 s
  CHECK(seen(10.5));
  CHECK_FALSE(seen(12.99));
}

TEST_CASE("hard landing: a stronger strike, clipped by the IMU; all else of the motion stays") {
  Options options = tracked("fly1", 40.0);
  const Simulation clean(options);
  REQUIRE(clean.plan().touchdowns.size() >= 1);
  const double touchdown = clean.plan().touchdowns.front();
  const std::string at = "@" + std::to_string(touchdown - 1.0) + "+2";
  const Simulation hard = with_fault(options, "hard_landing" + at + "=8");

  double strongest = 0.0;  // specific force of the truth
  double read = 0.0;       // of the IMU
  for (double t = touchdown - 0.01; t < touchdown + 0.2; t += 0.0005) {
    const Eigen::Vector3d a_W = hard.plan().trajectory.at(t).a_W + Eigen::Vector3d(0.0, 0.0, kGravity);
    strongest = std::max(strongest, a_W.z() / kGravity);
  }
  for (const ImuSample& sample : hard.imu()) {
    if (std::abs(motion_time(sample.t_ns) - touchdown) < 1.0) {
      read = std::max(read, sample.accel_B.cwiseAbs().maxCoeff() / kGravity);
    }
  }
  CHECK(strongest == about(8.0, 0.1));
  CHECK(read == doctest::Approx(4.0));

  const auto striking = [&](double t) { return t > touchdown - 0.02 && t < touchdown + 0.2; };
  for (std::size_t i = 0; i < clean.imu().size(); ++i) {
    const double t = motion_time(clean.imu()[i].t_ns);
    if (std::abs(t - touchdown) < 1.0) continue;  // there it is clipped
    CHECK(clean.imu()[i].accel_B == hard.imu()[i].accel_B);
    CHECK(clean.imu()[i].gyro_B == hard.imu()[i].gyro_B);
  }
  for (std::size_t i = 0; i < clean.lasers().size(); ++i) {
    if (!striking(motion_time(clean.lasers()[i].t_ns))) CHECK(clean.lasers()[i].range[0] == hard.lasers()[i].range[0]);
  }
  int moved = 0;
  for (std::size_t i = 0; i < clean.frames().size(); ++i) {
    const double t = taken(clean, i);
    const Truth truth = hard.truth(clean.frame_times()[i]);
    const double aside = (truth.p_WB - clean.truth(clean.frame_times()[i]).p_WB).norm();
    CHECK(aside < (striking(t) ? 5e-3 : 1e-12));
    if (!striking(t)) {
      CHECK(same_places(clean.tracks(i), hard.tracks(i)));
      continue;
    }
    // 1 mm at 1 m is 0.4 px, and the noise is that of the clean run.
    for (const FeatureObservation& seen : hard.tracks(i).features) {
      const FeatureObservation* original = find(clean.tracks(i), seen.id);
      REQUIRE(original != nullptr);
      const double pixels = pixels_apart(clean, seen.left, original->left);
      CHECK(pixels < 4.0);
      moved += pixels > 0.05 ? 1 : 0;
    }
  }
  CHECK(moved > 50);
  CHECK_THROWS_WITH_AS(with_fault(tracked("flat1", 8.0), "hard_landing@4"), doctest::Contains("touchdowns: none"),
                       std::invalid_argument);
}

}  // namespace ear::simulator
