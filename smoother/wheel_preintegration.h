// The displacement of the axle's middle O between two instants i and j, from wheels, gyroscope and the ground's normal:
// the paper's pre-integration, (9)-(11). Derivation: docs/smoother.md, "Pre-integration".
//
//   alpha = sum over encoder intervals k of R_BiBk f_k s_k dt
//   s_k dt = mean over both wheels of radius * (turn relative to the body + turn of the body about the axle)
//   f_k = unit(y_B x n_Bk)
//
// On uneven ground the wheels climb unlike each other; what the middle goes less than their mean follows from the roll.
#pragma once

#include <Eigen/Core>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/state.h"

namespace ear::smoother {

/// Two wheels on one axle, as (9) sees them.
struct WheelModel {
  Eigen::Vector2d radius = Eigen::Vector2d::Ones();  ///< left, right [m]
  double track_width = 0.0;                          ///< [m]
  Eigen::Vector3d y_B = Eigen::Vector3d::UnitY();    ///< direction of the axle, to the left; unit
};

/// Standard deviations. What slips or bumps is white in the distance that the wheels roll.
struct WheelNoise {
  double gyro = 0.0;         ///< white noise [rad/s/sqrt(Hz)]
  double reading = 0.0;      ///< one reading of one encoder [rad]
  double slip = 0.0;         ///< along the track [m/sqrt(m)]
  double side_slip = 0.0;    ///< along the axle [m/sqrt(m)]
  double roughness = 0.0;    ///< through the ground [m/sqrt(m)]
  double normal_walk = 0.0;  ///< how the ground's normal turns, each axis [rad/sqrt(m)]
};

/// The wheels as the estimator knows them.
[[nodiscard]] WheelModel wheel_model(const OdometerState& odometer);

/// The wheels' noise by the settings and the calibration.
[[nodiscard]] WheelNoise wheel_noise(const OdometerConfig& odometer, const EncoderCalibration& encoder,
                                     const ImuCalibration& imu);

/// The displacement with its covariance, what it was computed with, and its derivatives by that. Vectors are in B_i.
struct WheelDisplacement {
  Eigen::Vector3d alpha_Bi = Eigen::Vector3d::Zero();                            ///< of O from i to j [m]
  Eigen::Matrix3d R_BiBj = Eigen::Matrix3d::Identity();                          ///< of the gyroscope
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< of (alpha, xi) [m], [rad]
  double duration = 0.0;                                                         ///< [s]
  double distance = 0.0;                                                         ///< that the wheels rolled [m]
  bool usable = true;  ///< false if the axle ever stood steeply on the ground: the vehicle lies on its side

  Eigen::Vector3d b_g = Eigen::Vector3d::Zero();
  Eigen::Vector3d n_Bi = Eigen::Vector3d::UnitZ();  ///< at the start
  WheelModel wheels;
  Eigen::Matrix3d J_alpha_bias = Eigen::Matrix3d::Zero();                            ///< by b_g [m/(rad/s)]
  Eigen::Matrix3d J_alpha_normal = Eigen::Matrix3d::Zero();                          ///< by n_Bi [m]
  Eigen::Matrix<double, 3, 2> J_alpha_radius = Eigen::Matrix<double, 3, 2>::Zero();  ///< by relative radii [m]
  Eigen::Vector3d J_alpha_track_width = Eigen::Vector3d::Zero();  ///< by the relative track width [m]
  Eigen::Matrix3d J_alpha_axle = Eigen::Matrix3d::Zero();         ///< by y_B [m]
  Eigen::Matrix3d J_xi_bias = Eigen::Matrix3d::Zero();            ///< of R_BiBj = Exp(xi) R^ by b_g [rad/(rad/s)]
};

class WheelPreintegration {
 public:
  /// `wheels` are taken as known; what is not is left to the derivatives.
  WheelPreintegration(const WheelModel& wheels, const WheelNoise& noise) : wheels_(wheels), noise_(noise) {}

  /// Begins at an instant i: unit normal of the ground in the body, and the gyroscope's bias [rad/s] from here on. The
  /// normal's own uncertainty is not in the covariance; J_alpha_normal carries it.
  void start(const Eigen::Vector3d& n_Bi, const Eigen::Vector3d& b_g);

  /// The normal as seen now, in the body as it is now, with its standard deviation [rad]: from here on it takes the
  /// place of the one before. The paper takes R_oIk anew from the lasers at every k.
  void set_normal(const Eigen::Vector3d& n_Bk, double sigma);

  /// One interval of `dt` > 0 seconds: mean rate as measured [rad/s], and how far the wheels turned relative to the
  /// body (left, right, forward positive) [rad]. Intervals follow each other without gaps, and each starts with the
  /// readings that ended the one before. `gyro_factor`: on the gyroscope's noise meanwhile.
  void add_interval(const Eigen::Vector3d& gyro_B, double dt, const Eigen::Vector2d& turn, double gyro_factor = 1.0);

  [[nodiscard]] WheelDisplacement result() const;

 private:
  // Error of (alpha, xi, n): R = Exp(xi) R^, the others additive; all in B_i.
  static constexpr int kAlpha = 0, kXi = 3, kNormal = 6, kErrors = 9;
  // Parameters: n_Bi at the start, b_g, relative radii and track width, y_B.
  static constexpr int kStartNormal = 0, kBias = 3, kRadius = 6, kTrackWidth = 8, kAxle = 9, kParameters = 12;

  WheelModel wheels_;
  WheelNoise noise_;
  Eigen::Vector3d b_g_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d alpha_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d n_Bi_ = Eigen::Vector3d::UnitZ();        // as last taken
  Eigen::Vector3d n_Bi_start_ = Eigen::Vector3d::UnitZ();  // as taken at the start
  Eigen::Matrix3d R_BiBk_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, kErrors, kErrors> Q_ = Eigen::Matrix<double, kErrors, kErrors>::Zero();
  Eigen::Matrix<double, kErrors, kParameters> J_ = Eigen::Matrix<double, kErrors, kParameters>::Zero();
  Eigen::Matrix<double, 3, 2> reading_weight_ = Eigen::Matrix<double, 3, 2>::Zero();  // of the newest readings in alpha
  Eigen::Matrix3d reading_squares_ = Eigen::Matrix3d::Zero();  // sum of the squared weights of all readings before
  double duration_ = 0.0;
  double distance_ = 0.0;
  bool usable_ = true;
};

}  // namespace ear::smoother
