// The filter itself: a state, its covariance, and the five things that happen to them: propagate, apply, clone,
// marginalise, inflate. It knows no sensor. docs/filter.md.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/covariance.h"
#include "filter/ekf/gate.h"
#include "filter/ekf/records.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/kernels/filter_kernels.h"

namespace ear {

/// What an update does to the calibration of the cameras, and to the gyroscope's matrix. Without a camera these are
/// always considered; and so is the matrix unless the body turns, and the time offset unless it turns or moves.
enum class CameraUpdate : std::uint8_t {
  learned,    ///< it is corrected as everything else
  considered  ///< its uncertainty counts, its value stays (Schmidt-Kalman): this measurement shows nothing of it
};

/// Rows of wheels, lasers or the ground, linearised, not whitened: residual = H e + n, n independent, std(n) = sigma.
/// Columns: ground_column().
struct GroundRows {
  static constexpr int size = 4;  ///< the most
  Eigen::Matrix<double, size, kGroundColumns> H = Eigen::Matrix<double, size, kGroundColumns>::Zero();
  Eigen::Matrix<double, size, 1> residual = Eigen::Matrix<double, size, 1>::Zero();
  Eigen::Matrix<double, size, 1> sigma = Eigen::Matrix<double, size, 1>::Ones();
  int count = 0;
};

/// Standard deviations, relative, of scales that no sensor of the vehicle measures. They correct nothing, but count in
/// the covariance of an estimate, from where the state started.
struct UnseenScales {
  double length = 0.0;  ///< of all lengths, by the wheels or by the lenses
  double turn = 0.0;    ///< of the gyroscope, about the vertical
};

class Ekf {
 public:
  /// Usable settings and calibration: checked() in ekf/initial_state.h.
  Ekf(const FilterConfig& config, const Calibration& calibration);

  /// Begins at `x`, with these standard deviations of the whole error vector. `scale_is_given`: the mean of both wheel
  /// radii is taken for known.
  void start(const ImuState& x, const Eigen::VectorXd& sigma, bool scale_is_given = false);
  /// The state is this one, whose error has covariance `P`; without clones: what another estimator found.
  void assume(const State& x, const Eigen::Ref<const Eigen::MatrixXd>& P);
  /// Nothing of the state is used any more.
  void reset();
  /// Is there a state?
  [[nodiscard]] bool running() const { return running_; }

  /// To `t_ns`, by the samples. The time of the first one, if any, that may be off by more than noise (clipped).
  /// `usual`: factors on the noise of all samples. `normal_walk`: how the ground's normal turns [rad/sqrt(m)].
  std::optional<TimeNs> propagate(const ImuBuffer& samples, TimeNs t_ns, const ImuNoiseFactors& usual,
                                  double normal_walk);

  /// Updates once with all rows, their noise divided by `weight`. They are whitened in place.
  void apply(GroundRows& z, double weight, CameraUpdate calibration);

  /// Updates by whitened rows: residual = H e(first_column ...) + n, cov(n) = I.
  void apply(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column, const Eigen::Ref<const Eigen::VectorXd>& r,
             CameraUpdate calibration);

  /// The error that apply() would correct, which is not corrected yet. Valid until the next of both.
  Eigen::Ref<const Eigen::VectorXd> correction(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                                               const Eigen::Ref<const Eigen::VectorXd>& r, CameraUpdate calibration);

  /// The body's pose now joins the window. What was seen from it has `feature_noise`, times the usual, and `weight`.
  void clone(double feature_noise, double weight = 1.0);
  void marginalise(std::size_t clone);

  /// The origin of the world is where the body is now, by definition.
  void move_origin();

  /// The vehicle may be turned, faster and elsewhere by these standard deviations [rad, m/s, m], each axis, whatever
  /// was measured so far.
  void inflate_motion(double rotation, double velocity, double position);
  /// For `duration` [s] measurements held the state back: now by these [m/s, m] times one unknown of standard deviation
  /// 1, its clones since then by less. What they did to the biases is no change of these.
  void inflate_held(const Eigen::Vector3d& v_W, const Eigen::Vector3d& p_W, double duration);
  /// The cameras' time offset may be off by this standard deviation [s] besides, and the clones by what they moved
  /// meanwhile.
  void inflate_clock(double seconds);
  /// By that of the time that passed [s]: turn and velocity by one unknown, the place by another.
  void inflate_time(double seconds);
  /// The entries from `first` on may be elsewhere by these standard deviations besides, each by itself.
  void inflate(int first, const Eigen::Ref<const Eigen::VectorXd>& sigma);
  /// The ground's normal is this one, and as little known as before anything showed it.
  void restart_normal(const Eigen::Vector3d& n_W);
  /// OdometerState::reading_error of this index is that of a new reading, with this standard deviation [m].
  void restart_reading(int index, double sigma);

  /// Since the last call.
  [[nodiscard]] BiasChanges take_bias_changes();

  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const Covariance& covariance() const { return covariance_; }
  [[nodiscard]] const Gate& gate() const { return gate_; }
  /// Are the state and its covariance numbers, no variance negative, and is the vehicle where it can be: no farther
  /// from its start than the fastest one gets, and known to as much?
  [[nodiscard]] bool possible() const;
  /// Covariance of the ordinary errors (estimate_error), with what the scales that nothing measures do to them.
  [[nodiscard]] ImuErrorMatrix ordinary_covariance(const UnseenScales& scales) const;

 private:
  Calibration calibration_;
  double normal_prior_;  ///< [rad]
  double wheel_apart_;   ///< of the difference of the wheel radii, relative
  Gate gate_;
  FilterKernels kernels_;
  bool running_ = false;
  State state_;
  Covariance covariance_;
  /// Of the last piece integrated, its means; of the moment up to it, the mean rate, and whether that is more than
  /// noise.
  struct {
    Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();       ///< [rad/s]
    Eigen::Vector3d accel_W = Eigen::Vector3d::Zero();      ///< [m/s^2]
    Eigen::Vector3d mean_rate_B = Eigen::Vector3d::Zero();  ///< [rad/s]
    /// Specific force [m/s^2]. One sample is mostly noise: what it does would be learned as errors of the matrix.
    Eigen::Vector3d mean_force_B = Eigen::Vector3d::Zero();
    bool turns = false;
  } last_;
  std::uint64_t next_frame_ = 0;
  BiasChanges bias_changes_;
  TimeNs started_ns_ = 0;
  Eigen::Vector3d started_W_ = Eigen::Vector3d::Zero();  ///< [m] here
  // Since the start: what one unit of the gyroscope's scale does to yaw [rad] and, turned by a right angle, to
  // position.
  double turned_ = 0.0;
  Eigen::Vector3d turned_path_ = Eigen::Vector3d::Zero();  ///< integral of turned_ v dt [rad m]
};

/// The gate: one row of ground columns against what the state and its own noise allow.
[[nodiscard]] inline Innovation gate_test(const Ekf& ekf, const Eigen::Matrix<double, 1, kGroundColumns>& h,
                                          double residual, double sigma) {
  const double variance = ekf.covariance().variance(h, err::nu) + sigma * sigma;
  return Innovation::of(residual, variance, ekf.gate().quantile(1));
}

/// Of its state, if there is one.
[[nodiscard]] inline std::optional<TimeNs> time_of(const Ekf& ekf) {
  return ekf.running() ? std::optional(ekf.state().imu.t_ns) : std::nullopt;
}

}  // namespace ear
