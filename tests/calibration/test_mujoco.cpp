// A vehicle of an independent physics: what `ear calibrate` makes of wheels, IMU and beams that this project's
// simulator has no part in. The vehicle is vehicle.xml; here is who drives it.
#include <mujoco/mujoco.h>

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "calibration/calibrate.h"
#include "filter/ekf/so3.h"
#include "tests/smoother/support.h"
#include "tests/support/about.h"
#include "tools/calibration/simulated_drive.h"

using namespace ear;
using namespace ear::calibration;
using ear::test::about;

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr std::array kBeams{"front_left", "front_right", "rear"};

/// What the vehicle is to do for a while.
struct Leg {
  double duration = 1.0;                            ///< [s]
  double speed = 0.0, rate = 0.0;                   ///< at its end [m/s], [rad/s]
  double pitch = 0.0, roll = 0.0, frequency = 0.0;  ///< amplitudes [rad] and [Hz]; the roll in the air only
  double height = 0.0;                              ///< of the hop that the leg is [m]
};

/// The recommended drive, for a vehicle that hops for seconds only: nothing shows it where it is while it flies.
std::vector<Leg> recommended() {
  std::vector<Leg> legs{{3.0}, {10.0, 0.0, 0.0, 10.0 * kDegree, 0.0, 0.7}};
  for (const double side : {1.0, -1.0}) {
    legs.insert(legs.end(), {{1.0, 0.0, side}, {12.0, 0.0, side}, {1.0}});
  }
  for (const double side : {1.0, -1.0, 1.0, -1.0}) {
    legs.insert(legs.end(), {{1.5, 1.0, side, 4.0 * kDegree, 0.0, 0.6}, {5.0, 1.0, side, 4.0 * kDegree, 0.0, 0.6}});
  }
  legs.push_back({1.0});
  for (int i = 0; i < 8; ++i) {
    legs.insert(legs.end(), {{0.8, 1.5}, {0.5, 1.5}, {0.8}, {0.3}, {0.8, -1.5}, {0.5, -1.5}, {0.8}, {0.3}});
  }
  for (int i = 0; i < 10; ++i) {  // low and high, tilting to all sides
    const double tilt = (i % 4 < 2 ? 30.0 : -30.0) * kDegree;
    legs.push_back({5.0, 0.0, 0.0, tilt, i % 2 == 0 ? tilt : -tilt, 0.6, i % 3 == 0 ? 2.0 : 0.6});
    legs.push_back({2.5});  // without a camera the estimate begins anew after each hop, at rest
  }
  legs.push_back({3.0});
  return legs;
}

double smooth(double x) { return x * x * (3.0 - 2.0 * x); }

/// MuJoCo's vehicle, its pilot, and its sensors with noise.
class Vehicle {
 public:
  explicit Vehicle(std::uint64_t seed) : rng_(seed) {
    std::array<char, 500> error{};
    const std::string file = std::string(EAR_SOURCE_DIR) + "/tests/calibration/vehicle.xml";
    model_.reset(mj_loadXML(file.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
    if (!model_) throw std::runtime_error(error.data());
    data_.reset(mj_makeData(model_.get()));
    body_ = mj_name2id(model_.get(), mjOBJ_BODY, "body");
    gyro_bias_ = vector(0.005);
    accel_bias_ = vector(0.05);
  }

  [[nodiscard]] Calibration true_calibration() const {
    Calibration truth;
    const mjModel& m = *model_;
    EncoderCalibration encoder;
    const int left = mj_name2id(&m, mjOBJ_BODY, "left");
    const int right = mj_name2id(&m, mjOBJ_BODY, "right");
    const Eigen::Vector3d p_left = Eigen::Map<const Eigen::Vector3d>(m.body_pos + 3 * left);
    const Eigen::Vector3d p_right = Eigen::Map<const Eigen::Vector3d>(m.body_pos + 3 * right);
    encoder.T_BO.translation() = 0.5 * (p_left + p_right);
    encoder.track_width = (p_left - p_right).norm();
    encoder.wheel_radius = {m.geom_size[3 * m.body_geomadr[left]], m.geom_size[3 * m.body_geomadr[right]]};
    truth.encoder = encoder;
    LaserCalibration lasers;
    lasers.range_max = 4.0;
    for (const char* name : kBeams) {
      const int site = mj_name2id(&m, mjOBJ_SITE, name);
      const Eigen::Map<const Eigen::Vector4d> q(m.site_quat + 4 * site);
      lasers.beams.push_back({name, Eigen::Map<const Eigen::Vector3d>(m.site_pos + 3 * site),
                              Eigen::Quaterniond(q(0), q(1), q(2), q(3)) * Eigen::Vector3d::UnitZ()});
    }
    truth.lasers = lasers;
    return truth;
  }

  Drive drive(const std::vector<Leg>& legs) {
    Drive result;
    result.name = "MuJoCo";
    for (const Leg& leg : legs) {
      const double begin = data_->time;
      const double speed = speed_, rate = rate_;
      while (data_->time < begin + leg.duration) {
        const double share = (data_->time - begin) / leg.duration;
        speed_ = speed + smooth(share) * (leg.speed - speed);
        rate_ = rate + smooth(share) * (leg.rate - rate);
        steer(leg, share);
        const double t = data_->time;
        mj_step(model_.get(), data_.get());
        sample(t, result);
      }
      speed_ = leg.speed;
      rate_ = leg.rate;
    }
    return result;
  }

 private:
  struct Delete {
    void operator()(mjModel* model) const { mj_deleteModel(model); }
    void operator()(mjData* data) const { mj_deleteData(data); }
  };

  double normal(double sigma) { return sigma * std::normal_distribution<double>()(rng_); }
  Eigen::Vector3d vector(double sigma) { return {normal(sigma), normal(sigma), normal(sigma)}; }
  [[nodiscard]] Eigen::Vector3d reading3(const char* name) const {
    return Eigen::Map<const Eigen::Vector3d>(reading(name));
  }
  [[nodiscard]] const double* reading(const char* name) const {
    return data_->sensordata + model_->sensor_adr[mj_name2id(model_.get(), mjOBJ_SENSOR, name)];
  }

  /// Force and torque on the body, as rotors give them: speed, pitch and turn on the ground, all in the air.
  void steer(const Leg& leg, double share) {
    const double* q = data_->qpos;
    const double* v = data_->qvel;
    const Eigen::Matrix3d R_WB = Eigen::Quaterniond(q[3], q[4], q[5], q[6]).toRotationMatrix();
    const Eigen::Vector3d omega_B(v[3], v[4], v[5]);
    const double yaw = std::atan2(R_WB(1, 0), R_WB(0, 0));
    const double gently = smooth(std::min(1.0, 4.0 * share)) * smooth(std::min(1.0, 4.0 * (1.0 - share)));
    const double phase = 2.0 * M_PI * leg.frequency * share * leg.duration;
    const double swing = std::sin(phase) * gently;
    const double swing_aside = std::sin(0.6 * phase) * gently;
    constexpr double kMass = 2.56;
    const bool flies = leg.height > 0.0;
    if (!flies || share <= 0.0) start_ = {q[0], q[1], q[2], yaw};
    const double heading = flies ? start_(3) : yaw;
    const Eigen::Matrix3d R_WH = exp_so3({0.0, 0.0, heading});
    const Eigen::Matrix3d wanted = R_WH * exp_so3({flies ? leg.roll * swing_aside : 0.0, leg.pitch * swing, 0.0});
    const Eigen::Vector3d turn_B = log_so3(R_WB.transpose() * wanted);
    Eigen::Vector3d torque_B = 8.0 * turn_B - 0.8 * omega_B;
    Eigen::Vector3d force_W = Eigen::Vector3d::Zero();
    const Eigen::Vector3d v_W(v[0], v[1], v[2]);
    if (flies) {
      const double up = leg.height * smooth(std::min(1.0, 3.0 * share)) * smooth(std::min(1.0, 3.0 * (1.0 - share)));
      const Eigen::Vector3d p_wanted(start_(0), start_(1), start_(2) + up - 0.002 * share);
      force_W = kMass * (25.0 * (p_wanted - Eigen::Vector3d(q[0], q[1], q[2])) - 9.0 * v_W);
      force_W.z() += kMass * 9.81;
    } else {
      const Eigen::Vector3d ahead = R_WH.col(0);
      force_W = kMass * 8.0 * (speed_ - ahead.dot(v_W)) * ahead;
      torque_B.x() = 0.0;
      torque_B.z() = 1.5 * (rate_ - omega_B.z());
    }
    double* applied = data_->xfrc_applied + 6 * body_;
    Eigen::Map<Eigen::Vector3d>{applied} = force_W;
    Eigen::Map<Eigen::Vector3d>{applied + 3} = R_WB * torque_B;
  }

  /// `t`: of the sensors' readings, which a step leaves behind. IMU: the mean over 5 ms.
  void sample(double t, Drive& drive) {
    constexpr int kSteps = 10;
    const ImuCalibration noise;
    gyro_sum_ += reading3("gyro") / kSteps;
    accel_sum_ += reading3("accelerometer") / kSteps;
    if (step_ % 20 == 0) {
      const auto count = [&](const char* name) {
        return std::llround(*reading(name) / (2.0 * M_PI) * 262144.0 + normal(2.0));
      };
      drive.encoders.push_back({stamp(t), count("left_angle"), count("right_angle")});
    }
    if (step_ % 40 == 0) {
      LaserSample lasers{stamp(t), {}};
      for (const char* name : kBeams) {
        const double range = *reading(name);
        lasers.range.push_back(range < 0.0 ? std::nan("") : range + normal(0.004));
      }
      drive.lasers.push_back(lasers);
    }
    if (++step_ % kSteps != 0) return;
    const double rate = std::sqrt(200.0);
    drive.imu.push_back({stamp(t - 0.00225), gyro_sum_ + gyro_bias_ + vector(noise.gyro_noise * rate),
                         accel_sum_ + accel_bias_ + vector(noise.accel_noise * rate)});
    gyro_sum_.setZero();
    accel_sum_.setZero();
  }

  static TimeNs stamp(double t) { return 1'000'000'000 + std::llround(1e9 * t); }

  std::unique_ptr<mjModel, Delete> model_;
  std::unique_ptr<mjData, Delete> data_;
  std::mt19937_64 rng_;
  Eigen::Vector3d gyro_bias_, accel_bias_;
  Eigen::Vector3d gyro_sum_ = Eigen::Vector3d::Zero(), accel_sum_ = Eigen::Vector3d::Zero();
  Eigen::Vector4d start_ = Eigen::Vector4d::Zero();  // of a hop: position and heading
  double speed_ = 0.0, rate_ = 0.0;
  long step_ = 0;
  int body_ = 0;
};

/// Wrong by what a sketch is.
Calibration sketch_of(const Calibration& truth) {
  Calibration sketch = truth;
  for (double& radius : sketch.encoder->wheel_radius) radius = 0.0735;
  sketch.encoder->track_width = 0.4;
  sketch.encoder->T_BO.translation() += Eigen::Vector3d(0.01, -0.003, 0.008);
  sketch.encoder->wraps = false;
  const std::array<Eigen::Vector3d, 3> turns{{{3, -6, 2}, {-5, 4, 1}, {2, 6, -3}}};
  for (std::size_t i = 0; i < sketch.lasers->beams.size(); ++i) {
    LaserBeam& beam = sketch.lasers->beams[i];
    beam.d_B = exp_so3(kDegree * turns[i]) * beam.d_B;
    beam.p_BL += 2e-3 * turns[i];
  }
  return sketch;
}

}  // namespace

TEST_CASE("calibrate: wheels and beams of a vehicle of another physics") {
  double squares = 0.0, count = 0.0;
  for (const unsigned seed : {5U, 6U, 7U}) {
    CAPTURE(seed);
    Vehicle vehicle(seed);
    Calibration truth = vehicle.true_calibration();
    truth.encoder->wraps = false;
    const Drive drive = vehicle.drive(recommended());
    const Calibration sketch = sketch_of(truth);
    const Priors priors = priors_of(sketch);
    const Result result = calibrate(sketch, priors, {drive}, Settings{});

    const std::vector<double> errors = errors_left(result, sketch, truth, priors);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const Finding& found = result.findings[i];
      CAPTURE(found.name);
      CHECK(found.shown);
      CHECK(std::abs(errors[i]) < 5.0 * found.posterior);
      squares += std::pow(errors[i] / found.posterior, 2);
      count += 1.0;
    }
    CHECK(result.left_out < 5.0);  // the hops are in it
    CHECK(result.findings.size() == 34);
    const EncoderCalibration& encoder = *result.calibration.encoder;
    for (std::size_t side = 0; side < 2; ++side) {
      CHECK(encoder.wheel_radius[side] == about(truth.encoder->wheel_radius[side], 0.003));
    }
    CHECK(encoder.track_width == about(truth.encoder->track_width, 0.005));
    for (std::size_t k = 0; k < kBeams.size(); ++k) {
      const Eigen::Vector3d& found = result.calibration.lasers->beams[k].d_B;
      CHECK(std::asin(found.cross(truth.lasers->beams[k].d_B).norm()) < 0.25 * kDegree);
    }
  }
  MESSAGE("mean squared normalized error: " << squares / count);
  CHECK(squares / count < 2.0);  // of 34, correlated
}
