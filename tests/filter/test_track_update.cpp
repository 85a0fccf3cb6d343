// What tracks show of the state: features of one camera the less, the less it is known how far it moved.
#include "filter/sources/cameras/track_update.h"

#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

#include "filter/ekf/so3.h"
#include "tests/support/about.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using ear::test::about;
using ear::test::invariant_difference;
using ear::test::random_pose;
using ear::test::random_vector;

namespace {

constexpr TimeNs kStart = 1'000'000'000;
constexpr TimeNs kPeriod = 5'000'000;
constexpr TimeNs kFrame = 50'000'000;
constexpr double kFocal = 400.0;
constexpr double kSpeed = 1.0;  // [m/s] sideways, along x of a camera that looks along z

struct Uncertain {
  double velocity = 0.0;  ///< [m/s] standard deviation
  double heading = 1e-4;  ///< [rad]
  double position = 0.01;
  Eigen::Vector3d missed = Eigen::Vector3d::Zero();  ///< [m/s] by which the vehicle is faster than it thinks
};

/// A vehicle at constant speed far from its origin, and what it saw of points 3 m away from five places.
struct Passage {
  FilterConfig config;
  Eigen::Vector3d missed;
  Ekf ekf;
  TrackTable tracks{64, 16};
  TrackUpdate update{config, kFocal};
  Records records;

  explicit Passage(const Uncertain& sigma, std::size_t cameras = 1) : missed(sigma.missed), ekf(config, rig(cameras)) {
    ImuState x;
    x.t_ns = kStart;
    x.v_W = {kSpeed, 0.0, 0.0};
    x.p_WB = {100.0, 50.0, 2.0};
    Eigen::VectorXd sigmas = Eigen::VectorXd::Constant(err::clones, 1e-6);
    sigmas.segment<3>(err::theta) << 1e-4, 1e-4, sigma.heading;
    sigmas.segment<3>(err::nu).setConstant(sigma.velocity);
    sigmas.segment<3>(err::rho).setConstant(sigma.position);
    ekf.start(x, sigmas);
    ImuBuffer imu(512);
    for (TimeNs t_ns = kStart; t_ns <= kStart + 6 * kFrame; t_ns += kPeriod)
      imu.push({t_ns, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.80665}});
    for (int i = 0; i < 6; ++i) {
      ekf.propagate(imu, kStart + i * kFrame, ImuNoiseFactors{1e-3, 1e-3}, 0.0);
      ekf.clone(1.0);
      if (i < 5) see(cameras > 1);
    }
  }
  static Calibration rig(std::size_t cameras) {
    Calibration calibration;
    calibration.cameras.resize(cameras);
    if (cameras > 1) calibration.cameras[1].T_BC.translation() = Eigen::Vector3d(0.1, 0.0, 0.0);
    return calibration;
  }
  void see(bool by_both) {
    const State& x = ekf.state();
    Pose T_WC0 = x.clones.back().T_WB * x.camera.T_BC0;
    T_WC0.p += missed * seconds_between(kStart, x.imu.t_ns);
    const Pose& T_C0C1 = x.camera.T_C0C1;
    std::vector<FeatureObservation> features;
    for (std::uint64_t id = 0; id < 20; ++id) {
      const Eigen::Vector3d f_W = Eigen::Vector3d{99.0 + 0.1 * static_cast<double>(id), 50.0, 5.0};
      FeatureObservation seen;
      seen.id = id;
      const Eigen::Vector3d f_C = T_WC0.R.transpose() * (f_W - T_WC0.p);
      seen.left = f_C.hnormalized();
      seen.has_right = by_both;
      if (by_both) seen.right = (T_C0C1.R.transpose() * (f_C - T_C0C1.p)).hnormalized();
      features.push_back(seen);
    }
    tracks.add(x.clones.back().frame, features);
  }
  void run() { update.update(UsedTracks::ended, CameraUpdate::considered, tracks, ekf, records); }
  [[nodiscard]] double velocity_sigma(int axis) const {
    return std::sqrt(ekf.covariance().matrix()(err::nu + axis, err::nu + axis));
  }
};

/// Two images of both cameras, and between them a motion of which the state knows little.
struct Gap {
  static constexpr double kSigma = 0.6 / kFocal;

  FilterConfig config;
  Ekf ekf{config, Passage::rig(2)};
  TrackTable tracks{64, 16};
  TrackUpdate update{config, kFocal};
  Records records;
  Pose T_WB1;  ///< the true pose at the second image
  std::vector<Eigen::Vector3d> points_W;
  std::mt19937_64 random;

  /// Points that are `near` to `far` [m] away; `turn` [rad] and `shift` [m]: standard deviations, each axis.
  Gap(std::uint64_t seed, double near, double far, double turn, double shift) : random(seed) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int i = 0; i < 20; ++i) {
      const double depth = 0.5 * (near + far) + 0.5 * (far - near) * uniform(random);
      points_W.emplace_back(0.4 * depth * uniform(random), 0.3 * depth * uniform(random), depth);
    }
    ImuState x;
    x.t_ns = kStart;
    ekf.start(x, Eigen::VectorXd::Constant(err::clones, 1e-6));
    ekf.clone(1.0);
    see(Pose{});
    T_WB1 = random_pose(random, turn, shift);
    ekf.inflate_motion(turn, 1.0, shift);
    ekf.clone(1.0);
    see(T_WB1);
  }
  void see(const Pose& T_WB) {
    const Eigen::Vector3d p_C0C1 = ekf.state().camera.T_C0C1.p;
    std::vector<FeatureObservation> features;
    for (std::size_t id = 0; id < points_W.size(); ++id) {
      const Eigen::Vector3d f_C = T_WB.R.transpose() * (points_W[id] - T_WB.p);
      FeatureObservation seen;
      seen.id = id;
      seen.left = f_C.hnormalized() + random_vector(random, kSigma).head<2>();
      seen.has_right = true;
      seen.right = (f_C - p_C0C1).hnormalized() + random_vector(random, kSigma).head<2>();
      features.push_back(seen);
    }
    tracks.add(ekf.state().clones.back().frame, features);
  }
  /// Of the pose at the second image; 6 where the covariance is right.
  [[nodiscard]] double nees() const {
    const Eigen::Matrix<double, 6, 1> e = invariant_difference(T_WB1, ekf.state().clones.back().T_WB);
    const Eigen::Matrix<double, 6, 6> P = ekf.covariance().matrix().block<6, 6>(err::clone(1), err::clone(1));
    return e.dot(P.ldlt().solve(e));
  }
};

}  // namespace

TEST_CASE("track update: after a gap all tracks count together, where they show the motion to have been") {
  double sum = 0.0, first_step = 0.0;
  constexpr int kDraws = 60;
  for (int seed = 0; seed < kDraws; ++seed) {
    Gap gap(static_cast<std::uint64_t>(seed), 3.0, 7.0, 0.15, 0.3);
    gap.update.update(UsedTracks::ended, CameraUpdate::considered, gap.tracks, gap.ekf, gap.records);
    CHECK(gap.records.statistics.features_used == 0);  // they go on
    gap.update.update(UsedTracks::all, CameraUpdate::considered, gap.tracks, gap.ekf, gap.records);
    CHECK(gap.records.statistics.features_used >= 18);
    CHECK(gap.tracks.size() == 0);
    sum += gap.nees();

    Gap again(static_cast<std::uint64_t>(seed), 3.0, 7.0, 0.15, 0.3);  // the same by the first order alone
    again.update.update(UsedTracks::oldest_too, CameraUpdate::considered, again.tracks, again.ekf, again.records);
    first_step += again.nees();
  }
  MESSAGE("NEES ", sum / kDraws, ", by the first order alone ", first_step / kDraws);
  CHECK(sum / kDraws < 9.0);
  CHECK(sum / kDraws > 4.0);
  CHECK(first_step > 3.0 * sum);
}

TEST_CASE("track update: after a gap what is not known of the depths of far features is noise") {
  double sum = 0.0;
  constexpr int kDraws = 60;
  for (int seed = 0; seed < kDraws; ++seed) {
    Gap gap(static_cast<std::uint64_t>(seed), 12.0, 25.0, 0.05, 1.0);
    gap.update.update(UsedTracks::all, CameraUpdate::considered, gap.tracks, gap.ekf, gap.records);
    CHECK(gap.records.statistics.features_used >= 18);
    sum += gap.nees();
  }
  MESSAGE("NEES ", sum / kDraws);
  CHECK(sum / kDraws > 2.0);  // 34 without
  CHECK(sum / kDraws < 9.0);
}

TEST_CASE("track update: features of one camera show the less, the less it is known how far it moved") {
  double before = 0.0;
  for (const double velocity : {0.01 * kSpeed, 0.1 * kSpeed, 0.3 * kSpeed, 1.0 * kSpeed}) {
    CAPTURE(velocity);
    Passage passage({velocity});
    passage.run();
    CHECK(passage.records.statistics.features_used == 20);
    CHECK(passage.velocity_sigma(0) > 0.9 * velocity);  // one camera shows no length
    CHECK(passage.velocity_sigma(1) < velocity);
    CHECK(passage.velocity_sigma(1) > before);
    before = passage.velocity_sigma(1);
    CHECK(passage.tracks.size() == 0);
  }
}

TEST_CASE("track update: what the first order leaves out is noise of the features") {
  // The way of 0.2 m is known to 0.2 m times the velocity's share, and seen from 3 m away.
  const auto shown = [](double velocity) {
    Passage passage({velocity});
    passage.run();
    return 1.0 / std::pow(passage.velocity_sigma(1), 2) - 1.0 / (velocity * velocity);  // information added
  };
  const double exact = shown(0.02 * kSpeed);
  const double share = 0.5 * 0.5;
  const double parallax = 0.2 / 3.0;
  const double left_out = 2.0 * share * parallax / (FilterConfig{}.feature_sigma_px / kFocal);
  CHECK(shown(0.5 * kSpeed) == about(exact / (1.0 + left_out * left_out), 0.1));
}

TEST_CASE("track update: where the vehicle is in the world does not matter, nor where it heads") {
  Passage here({0.3 * kSpeed}), elsewhere({0.3 * kSpeed, 0.1, 10.0});
  here.run();
  elsewhere.run();
  CHECK(elsewhere.records.statistics.features_used == 20);
  CHECK(elsewhere.velocity_sigma(1) == about(here.velocity_sigma(1), 0.05));
}

TEST_CASE("track update: two cameras are as far apart as they are") {
  Passage passage({3.0 * kSpeed}, 2);
  passage.run();
  CHECK(passage.records.statistics.features_used == 20);
  CHECK(passage.velocity_sigma(0) < 0.1 * kSpeed);
}

TEST_CASE("track update: where one camera shows another way than was thought, the state ends nearest to it") {
  const Eigen::Vector3d missed{0.0, 0.6 * kSpeed, 0.0};
  Passage passage({0.2 * kSpeed, 1e-4, 0.01, missed});
  passage.run();
  CHECK(passage.records.statistics.features_used == 20);
  // The images show the direction and no length: of all velocities along it the nearest to the one before, as all
  // directions were known equally well. The first step alone leaves the speed along x as it was.
  const Eigen::Vector3d before{kSpeed, 0.0, 0.0};
  const Eigen::Vector3d along = (before + missed).normalized();
  CHECK((passage.ekf.state().imu.v_W - along * along.dot(before)).norm() < 0.02 * kSpeed);
}
