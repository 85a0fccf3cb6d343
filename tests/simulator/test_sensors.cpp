// The simulated sensors against hand-made cases, truth and their own claims.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "tests/simulator/support.h"
#include "tests/support/about.h"
#include "tools/simulator/constants.h"
#include "tools/simulator/sensors.h"
#include "tools/simulator/simulation.h"
#include "tools/simulator/vehicle.h"
#include "tools/simulator/wheel_motion.h"

namespace ear::simulator {
namespace {

using test::about;

ear::Calibration vehicle() { return make_vehicle(30.0, ear::LensModel::radial_tangential); }

// Counts from one reading to the next, through the wrap.
double count_difference(std::int64_t from, std::int64_t to, std::int64_t resolution) {
  std::int64_t difference = (to - from) % resolution;
  if (difference > resolution / 2) difference -= resolution;
  if (difference < -resolution / 2) difference += resolution;
  return static_cast<double>(difference);
}

// A motion of the axle with one constant rate per state, long enough for the spline's ends not to matter.
MotionPlan constant_rates(const AxleState& start, const AxleState& rates, const ear::EncoderCalibration& axle) {
  constexpr double kPeriod = 0.0025;
  Eigen::Matrix<double, 6, Eigen::Dynamic> states(6, 801);
  for (Eigen::Index i = 0; i < states.cols(); ++i) states.col(i) = start + kPeriod * static_cast<double>(i) * rates;
  return {Trajectory(kPeriod, states, axle.T_BO), std::vector<Mode>(801, Mode::ground), {}};
}

double turned(const WheelMotion& wheels, std::size_t wheel) {
  return wheels.angles(1.5)[wheel] - wheels.angles(0.5)[wheel];
}

struct Moments {
  double mean = 0.0, sigma = 0.0;
};

Moments moments(const std::vector<double>& values) {
  Moments m;
  const auto n = static_cast<double>(values.size());
  for (const double value : values) m.mean += value / n;
  for (const double value : values) m.sigma += (value - m.mean) * (value - m.mean) / (n - 1.0);
  m.sigma = std::sqrt(m.sigma);
  return m;
}

}  // namespace

TEST_CASE("encoders: signs and sizes of hand-made motions") {
  const ear::EncoderCalibration axle = *vehicle().encoder;
  AxleState start;
  start << 3.0, 2.0, 0.075, 0.0, 0.0, 0.0;
  const auto with = [](int row, double rate) {
    AxleState rates = AxleState::Zero();
    rates(row) = rate;
    return rates;
  };
  SUBCASE("rolling forward turns both wheels forward by distance over radius") {
    const WheelMotion wheels(constant_rates(start, with(0, 0.6), axle), Terrain(), axle);
    CHECK(turned(wheels, 0) == doctest::Approx(0.6 / 0.075).epsilon(1e-9));
    CHECK(turned(wheels, 1) == doctest::Approx(0.6 / 0.075).epsilon(1e-9));
  }
  SUBCASE("turning left on the spot turns the right wheel forward, the left one back") {
    const WheelMotion wheels(constant_rates(start, with(3, 0.5), axle), Terrain(), axle);
    CHECK(turned(wheels, 0) == doctest::Approx(-0.5 * 0.2 / 0.075).epsilon(1e-9));
    CHECK(turned(wheels, 1) == doctest::Approx(0.5 * 0.2 / 0.075).epsilon(1e-9));
  }
  SUBCASE("a nose that drops on standing wheels turns them back by the same angle") {
    const WheelMotion wheels(constant_rates(start, with(5, 0.3), axle), Terrain(), axle);
    CHECK(turned(wheels, 0) == doctest::Approx(-0.3).epsilon(1e-9));
    CHECK(turned(wheels, 1) == doctest::Approx(-0.3).epsilon(1e-9));
  }
  SUBCASE("pitch is about the axle: nose-down is positive") {
    AxleState nose_down = start;
    nose_down(5) = 0.2;
    const MotionPlan plan = constant_rates(nose_down, AxleState::Zero(), axle);
    CHECK(plan.trajectory.at(1.0).R_WO.col(0).z() == doctest::Approx(-std::sin(0.2)));
  }
}

TEST_CASE("encoders: readings give the true axle speed, < 1 mm/s, once the pitch rate is added") {
  for (const std::string name : {"flat1", "fly1", "wave2", "lawn"}) {
    CAPTURE(name);
    const Simulation simulation(ideal(name, 11));
    const ear::EncoderCalibration& axle = *simulation.true_calibration().encoder;
    const Trajectory& trajectory = simulation.plan().trajectory;
    const double dt = 1.0 / axle.rate_hz;
    double worst = 0.0;
    double fastest = 0.0;
    double drift = 0.0;  // distance by the encoders beyond that of the axle
    for (std::size_t i = 1; i < simulation.encoders().size(); ++i) {
      const ear::EncoderSample& a = simulation.encoders()[i - 1];
      const ear::EncoderSample& b = simulation.encoders()[i];
      const TimeNs middle = (a.t_ns + b.t_ns) / 2;
      bool in_contact = true;  // since a while: after a landing the wheels must first be spun up
      for (const double touchdown : simulation.plan().touchdowns) {
        in_contact = in_contact && std::abs(motion_time(middle) - touchdown) > 0.4;
      }
      if (!in_contact || simulation.truth(middle).mode == Mode::air) continue;
      const double turned = 0.5 *
                            (count_difference(a.left_count, b.left_count, axle.resolution) +
                             count_difference(a.right_count, b.right_count, axle.resolution)) *
                            2.0 * kPi / static_cast<double>(axle.resolution);
      // Means over the interval, as the counts are: Simpson's rule on the truth.
      double pitched = 0.0;
      double travelled = 0.0;
      double slip = 0.0;
      const std::array<double, 3> weights{1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0};
      const std::array<TimeNs, 3> times{a.t_ns, middle, b.t_ns};
      for (std::size_t k = 0; k < 3; ++k) {
        const Kinematics motion = trajectory.at(motion_time(times[k]));
        pitched += weights[k] * motion.omega_O.y();
        const Truth truth = simulation.truth(times[k]);
        // On a wave the axle moves along its own tangent, and its middle is a radius above it: on the flat both agree.
        travelled += weights[k] * truth.axle_speed;
        slip += weights[k] * truth.slip;
      }
      const double speed = axle.wheel_radius[0] * (turned / dt + pitched) - slip;
      drift += dt * (speed - travelled);
      worst = std::max(worst, std::abs(speed - travelled));
      fastest = std::max(fastest, std::abs(travelled));
    }
    MESSAGE(name << ": " << worst << " m/s of " << fastest << ", " << drift << " m");
    // Off the flat each wheel stands on a slope of its own: the speeds along these are not quite that of the middle.
    const bool flat = simulation.scene().terrain.flat();
    CHECK(worst < (flat ? 1e-3 : name == "lawn" ? 2e-2 : 4e-3));
    CHECK(std::abs(drift) < (flat ? 1e-3 : 0.1));
    CHECK(fastest > 0.5);
  }
}

TEST_CASE("encoders: wheels that spin idly turn, and the truth says how fast, but nothing moves") {
  const Simulation simulation(ideal("sway3", 12));
  const ear::EncoderCalibration& axle = *simulation.true_calibration().encoder;
  double forward = 0.0;  // travel of the rims [m]
  double backward = 0.0;
  double given = 0.0;
  for (std::size_t i = 1; i < simulation.encoders().size(); ++i) {
    const ear::EncoderSample& a = simulation.encoders()[i - 1];
    const ear::EncoderSample& b = simulation.encoders()[i];
    const Kinematics motion = simulation.plan().trajectory.at(motion_time((a.t_ns + b.t_ns) / 2));
    CHECK(motion.v_O_W.norm() < 1e-9);
    const double turned = 0.5 *
                          (count_difference(a.left_count, b.left_count, axle.resolution) +
                           count_difference(a.right_count, b.right_count, axle.resolution)) *
                          2.0 * kPi / static_cast<double>(axle.resolution);
    const double travel = axle.wheel_radius[0] * (turned + 0.01 * motion.omega_O.y());
    (travel > 0.0 ? forward : backward) += travel;
    given += 0.01 * simulation.truth((a.t_ns + b.t_ns) / 2).slip;
  }
  CHECK(forward > 0.6);    // 4 s at 0.275 m/s, 30 % more or less
  CHECK(backward < -0.4);  // 3 s at -0.25 m/s
  CHECK(forward + backward == about(given, 0.002));
  CHECK(simulation.truth(simulation.imu().back().t_ns).slip == 0.0);
}

TEST_CASE("encoders: slip comes and goes on the waves, and flat floors know none") {
  const auto share_slipping = [](const std::string& name) {
    const Simulation simulation(ideal(name, 12));
    double slipping = 0.0;
    for (const ear::ImuSample& sample : simulation.imu()) {
      slipping += std::abs(simulation.truth(sample.t_ns).slip) > 0.03 ? 1.0 : 0.0;
    }
    return slipping / static_cast<double>(simulation.imu().size());
  };
  CHECK(share_slipping("flat2") == 0.0);
  const double share = share_slipping("wave3");
  CHECK(share > 0.01);
  CHECK(share < 0.10);
}

TEST_CASE("encoders: a body that swings on standing wheels turns the readings, not the axle") {
  const Simulation simulation(ideal("sway1", 12));
  const ear::EncoderCalibration& axle = *simulation.true_calibration().encoder;
  double most = 0.0;
  double sum = 0.0;
  for (std::size_t i = 1; i < simulation.encoders().size(); ++i) {
    sum +=
        count_difference(simulation.encoders()[i - 1].left_count, simulation.encoders()[i].left_count, axle.resolution);
    most = std::max(most, std::abs(sum));
    const Kinematics motion = simulation.plan().trajectory.at(motion_time(simulation.encoders()[i].t_ns));
    CHECK(motion.v_O_W.norm() < 1e-9);
  }
  CHECK(most > 4.0 / 360.0 * static_cast<double>(axle.resolution));
}

TEST_CASE("encoders: counts stay within one turn and pass through the wrap") {
  const Simulation simulation(ideal("flat1", 13));
  int wraps = 0;
  for (std::size_t i = 1; i < simulation.encoders().size(); ++i) {
    const std::int64_t before = simulation.encoders()[i - 1].left_count;
    const std::int64_t now = simulation.encoders()[i].left_count;
    CHECK(now >= 0);
    CHECK(now < 262144);
    if (std::abs(now - before) > 131072) ++wraps;
  }
  CHECK(wraps > 80);  // 46 m are 97 turns
}

TEST_CASE("lasers: ranges on a flat floor by hand") {
  // Straight above the floor, level: range = height / cos(angle from the vertical).
  const ear::Calibration calibration = vehicle();
  Eigen::Matrix<double, 6, Eigen::Dynamic> states(6, 100);
  const double height = 0.9;
  states.colwise() = (AxleState() << 3.0, 2.0, height, 0.7, 0.0, 0.0).finished();
  ear::EncoderCalibration axle = *calibration.encoder;
  axle.T_BO.setIdentity();  // body and axle are one
  const Trajectory trajectory(0.0025, states, axle.T_BO);
  ear::LaserCalibration lasers;
  lasers.noise = 0.0;
  lasers.beams = {{"down", {0.1, 0.2, 0.05}, -Eigen::Vector3d::UnitZ()},
                  {"tilted", {0.0, 0.0, -0.1}, Eigen::Vector3d(0.6, 0.0, -0.8)},
                  {"up", {0.0, 0.0, 0.0}, Eigen::Vector3d::UnitZ()},
                  {"too far", {0.0, 0.0, 0.0}, Eigen::Vector3d(std::sin(1.4), 0.0, -std::cos(1.4))}};
  Rng rng = make_rng(1, Stream::laser);
  const auto samples = read_lasers(trajectory, Terrain(), lasers, {kStart + 100'000'000}, rng);
  REQUIRE(samples.size() == 1);
  CHECK(samples[0].range[0] == doctest::Approx(height + 0.05));
  CHECK(samples[0].range[1] == doctest::Approx((height - 0.1) / 0.8));
  CHECK(std::isnan(samples[0].range[2]));
  CHECK(std::isnan(samples[0].range[3]));
}

TEST_CASE("lasers: a hit lies on the ground, whatever its shape") {
  for (const std::string name : {"fly1", "slope"}) {
    CAPTURE(name);
    const Simulation simulation(ideal(name, 14));
    const Terrain& terrain = simulation.scene().terrain;
    double worst = 0.0;
    double seen = 0.0;
    for (const ear::LaserSample& sample : simulation.lasers()) {
      const Kinematics motion = simulation.plan().trajectory.at(motion_time(sample.t_ns));
      const auto& beams = simulation.true_calibration().lasers->beams;
      for (std::size_t i = 0; i < beams.size(); ++i) {
        if (!std::isfinite(sample.range[i])) continue;  // a beam's origin may come close to a steep ground
        seen += 1.0;
        const Eigen::Vector3d hit_W = motion.p_WB + motion.R_WB * (beams[i].p_BL + sample.range[i] * beams[i].d_B);
        worst = std::max(worst, std::abs(hit_W.z() - terrain.height(hit_W.x(), hit_W.y())));
      }
    }
    CHECK(worst < 1e-6);
    CHECK(seen > 0.95 * 3.0 * static_cast<double>(simulation.lasers().size()));
  }
}

TEST_CASE("lasers: as many readings are lost and wrong as the faults say; without faults none changes") {
  const ear::LaserCalibration lasers = *vehicle().lasers;
  std::vector<LaserSample> samples;
  for (int i = 0; i < 20000; ++i) samples.push_back({kStart + i * 20'000'000LL, {0.5, 0.5, 0.5}});
  const auto count = [](const std::vector<LaserSample>& readings, const auto& what) {
    double n = 0.0;
    for (const LaserSample& sample : readings) {
      for (const double range : sample.range) n += what(range) ? 1.0 : 0.0;
    }
    return n / (3.0 * static_cast<double>(readings.size()));
  };
  const auto lost = [](double range) { return std::isnan(range); };
  const auto nearer = [](double range) { return range < 0.45; };
  const auto farther = [](double range) { return range > 0.54; };
  const auto with = [&](const LaserFaults& faults) {
    std::vector<LaserSample> readings = samples;
    Rng rng = make_rng(1, Stream::laser_faults);
    corrupt_lasers(readings, lasers, faults, rng);
    return readings;
  };
  CHECK(count(with({}), [](double range) { return range != 0.5; }) == 0.0);
  CHECK(count(with({0.03, 0.0, 0.0}), lost) == about(0.03, 0.1));
  const std::vector<LaserSample> wrong = with({0.0, 0.04, 0.0});
  CHECK(count(wrong, lost) == 0.0);
  CHECK(count(wrong, nearer) == about(0.03, 0.1));
  CHECK(count(wrong, farther) == about(0.01, 0.2));
  // 0.05 fades per second of 0.6 s in the mean: 3 % of the time, in runs.
  CHECK(count(with({0.0, 0.0, 0.05}), lost) == about(0.03, 0.4));
}

TEST_CASE("lasers: a sequence with faults has them, the flat floor none") {
  const auto share_lost = [](const std::string& name) {
    Options options = ideal(name, 14);
    options.sensor_noise = true;
    const Simulation simulation(options);
    double lost = 0.0;
    for (const ear::LaserSample& sample : simulation.lasers()) {
      for (const double range : sample.range) lost += std::isnan(range) ? 1.0 : 0.0;
    }
    return lost / (3.0 * static_cast<double>(simulation.lasers().size()));
  };
  CHECK(share_lost("flat2") == 0.0);
  const double share = share_lost("fly2");
  CHECK(share > 0.007);
  CHECK(share < 0.03);
}

TEST_CASE("noise: every sensor is as noisy as its calibration says") {
  Options options;
  options.sequence = "fly1";
  options.seed = 15;
  options.tracks = false;
  const Simulation noisy(options);
  options.sensor_noise = false;
  const Simulation clean(options);
  const ear::Calibration& calibration = noisy.true_calibration();
  const auto check_sigma = [](const std::vector<double>& errors, double sigma) {
    const Moments m = moments(errors);
    const auto n = static_cast<double>(errors.size());
    CHECK(std::abs(m.mean) < 4.0 * sigma / std::sqrt(n));
    CHECK(std::abs(m.sigma - sigma) < 4.0 * sigma / std::sqrt(2.0 * n));
  };

  SUBCASE("IMU, white: density times the root of the rate") {
    for (int axis = 0; axis < 3; ++axis) {
      CAPTURE(axis);
      std::vector<double> gyro, accel;
      for (std::size_t i = 0; i < noisy.imu().size(); ++i) {
        const Truth truth = noisy.truth(noisy.imu()[i].t_ns);
        gyro.push_back((noisy.imu()[i].gyro_B - clean.imu()[i].gyro_B - truth.b_g)(axis));
        accel.push_back((noisy.imu()[i].accel_B - clean.imu()[i].accel_B - truth.b_a)(axis));
      }
      check_sigma(gyro, calibration.imu.gyro_noise * std::sqrt(200.0));
      check_sigma(accel, calibration.imu.accel_noise * std::sqrt(200.0));
    }
  }
  SUBCASE("IMU, biases: steps of walk times the root of the period") {
    std::vector<double> gyro, accel;
    for (std::size_t i = 1; i < noisy.imu().size(); ++i) {
      const Truth before = noisy.truth(noisy.imu()[i - 1].t_ns);
      const Truth now = noisy.truth(noisy.imu()[i].t_ns);
      for (int axis = 0; axis < 3; ++axis) {
        gyro.push_back((now.b_g - before.b_g)(axis));
        accel.push_back((now.b_a - before.b_a)(axis));
      }
    }
    check_sigma(gyro, calibration.imu.gyro_random_walk * std::sqrt(0.005));
    check_sigma(accel, calibration.imu.accel_random_walk * std::sqrt(0.005));
  }
  SUBCASE("encoders, with the rounding to whole counts") {
    std::vector<double> left, right;
    for (std::size_t i = 0; i < noisy.encoders().size(); ++i) {
      left.push_back(count_difference(clean.encoders()[i].left_count, noisy.encoders()[i].left_count, 262144));
      right.push_back(count_difference(clean.encoders()[i].right_count, noisy.encoders()[i].right_count, 262144));
    }
    check_sigma(left, std::sqrt(4.0 + 1.0 / 6.0));
    check_sigma(right, std::sqrt(4.0 + 1.0 / 6.0));
  }
  SUBCASE("lasers") {
    std::vector<double> errors;
    for (std::size_t i = 0; i < noisy.lasers().size(); ++i) {
      for (std::size_t beam = 0; beam < 3; ++beam) {
        const double error = noisy.lasers()[i].range[beam] - clean.lasers()[i].range[beam];
        if (std::isfinite(error)) errors.push_back(error);
      }
    }
    check_sigma(errors, calibration.lasers->noise);
  }
}

TEST_CASE("simulation: initial biases are of the promised size") {
  std::vector<double> gyro, accel;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Rng rng = make_rng(seed, Stream::imu);
    const ImuBias bias = draw_imu_biases(ear::ImuCalibration{}, 1, rng).front();
    gyro.push_back(bias.gyro.norm());
    accel.push_back(bias.accel.norm());
  }
  CHECK(moments(gyro).mean == about(5e-3, 0.1));
  CHECK(moments(accel).mean == about(0.05, 0.1));
}

TEST_CASE("simulation: the same seed gives the same data, another seed other data") {
  Options options;
  options.sequence = "fly1";
  options.seed = 16;
  options.duration = 10.0;
  const Simulation first(options);
  const Simulation again(options);
  options.seed = 17;
  const Simulation other(options);
  REQUIRE(first.imu().size() == again.imu().size());
  for (std::size_t i = 0; i < first.imu().size(); ++i) {
    CHECK(first.imu()[i].gyro_B == again.imu()[i].gyro_B);
    CHECK(first.imu()[i].accel_B == again.imu()[i].accel_B);
  }
  CHECK(first.encoders()[700].left_count == again.encoders()[700].left_count);
  CHECK(first.lasers()[300].range == again.lasers()[300].range);
  CHECK(first.tracks(250).features[40].left == again.tracks(250).features[40].left);
  CHECK(first.imu()[100].gyro_B != other.imu()[100].gyro_B);
  CHECK(first.truth(first.imu()[1500].t_ns).p_WB != other.truth(first.imu()[1500].t_ns).p_WB);
}

TEST_CASE("simulation: what does not exist is said by name") {
  Options options;
  options.sequence = "flat9";
  CHECK_THROWS_WITH_AS(Simulation{options}, doctest::Contains("flat9"), std::invalid_argument);
  options.sequence = "static";
  options.duration = -1.0;
  CHECK_THROWS_WITH_AS(Simulation{options}, doctest::Contains("duration"), std::invalid_argument);
  options.duration.reset();
  options.camera_rate_hz = 0.0;
  CHECK_THROWS_WITH_AS(Simulation{options}, doctest::Contains("camera rate"), std::invalid_argument);
}

}  // namespace ear::simulator
