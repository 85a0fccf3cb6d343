// What one tracked feature shows of the window, with the feature itself eliminated. Derivation: docs/filter.md,
// "Features".
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "filter/ekf/gate.h"
#include "filter/ekf/state.h"
#include "filter/kernels/filter_kernels.h"
#include "filter/sources/cameras/tracks.h"
#include "filter/sources/cameras/triangulation.h"

namespace ear {

/// Position of a camera of a clone in the world; what all features of a frame share.
struct CameraPose {
  Eigen::Matrix3d R_CW;
  Eigen::Vector3d p_WC;
};

/// One observation of a feature, linearized, not yet whitened: residual = H_poses e_poses + H_lens e_lens +
/// H_clone e_clone + H_f f + n.
struct LinearizedObservation {
  int clone = 0;
  int camera = 0;
  Eigen::Vector2d residual;                           ///< measured - predicted, normalized coordinates
  Eigen::Matrix<double, 2, err::poses_size> H_poses;  ///< phi, p of camera 0 in B; phi, p of camera 1 in camera 0
  Eigen::Matrix<double, 2, err::lens_size> H_lens;    ///< of this camera
  Eigen::Matrix<double, 2, err::clone_size> H_clone;
  Eigen::Matrix<double, 2, 3> H_f;  ///< feature times its inverse depth, world axes
  double noise = 1.0;               ///< its standard deviation, times that of all observations
  double weight = 1.0;              ///< (15): the noise is divided by it once the feature fits
};

/// Poses of both cameras for every clone: index 2 * clone + camera.
void camera_poses(const State& x, std::vector<CameraPose>& poses);

/// Linearizes the observation of `point` in camera 0 or 1 of a body at T_WB.
[[nodiscard]] LinearizedObservation linearize_observation(const Pose& T_WB, const CameraState& cameras, int camera,
                                                          const InverseDepthPoint& point, const Eigen::Vector2d& uv);

/// The same, seen from clone number `clone`.
[[nodiscard]] LinearizedObservation linearize_observation(const State& x, int clone, int camera,
                                                          const InverseDepthPoint& point, const Eigen::Vector2d& uv);

/// Linear measurement with unit covariance: residual r = H e + n, cov(n) = I. The first `count` rows are valid.
struct WhitenedRows {
  Eigen::MatrixXd H_transposed;
  Eigen::VectorXd r;
  int count = 0;
};

/// All features of one frame, summed up as the information A = H^T H, b = H^T r over the camera's part of the error
/// vector (err::camera and what follows), whitened, each feature projected out. This equals the projection on the null
/// space of H_f followed by a QR compression, at a fraction of the cost: the sums have the window's size, not the
/// number of rows.
class FeatureInformation {
 public:
  FeatureInformation(int max_clones, int max_features, Kernels kernels = Kernels::best);

  /// Starts a frame. `error_size`: that of the state.
  void start(int error_size);

  /// Adds a feature. `sigma`: one observation, normalized; `huber`: the distance in sigmas from which observations
  /// weigh less. `P`: the covariance. Returns false, and adds nothing, if the feature fails the gate, in which the
  /// observations' `weight` does not count.
  bool add(const std::vector<LinearizedObservation>& observations, double sigma, double huber,
           const Eigen::Ref<const Eigen::MatrixXd>& P, const Gate& gate);

  static constexpr double kRounding = 1e-11;  // measured: tests/filter/test_feature_update.cpp

  /// Rows equivalent to all features added: residual = H e + n, cov(n) = I. Empty if there were none. Valid until
  /// start(). `negligible`: the share of what the features show of a quantity, were they known themselves, that may
  /// be left out; smaller ones come last.
  void compress(double negligible = kRounding);
  [[nodiscard]] Eigen::Ref<const Eigen::MatrixXd> H() const { return H_.topLeftCorner(rows_.count, size_); }
  /// The residuals become those of a state that this error, from err::camera on, is not corrected of yet.
  void take_back(const Eigen::Ref<const Eigen::VectorXd>& error);
  [[nodiscard]] Eigen::Ref<const Eigen::VectorXd> residual() const { return rows_.r.head(rows_.count); }

 private:
  struct Projected {
    Eigen::Vector3d Lv;          // L^-1 H_f^T r of V = H_f^T H_f = L L^T, whitened
    double residual_cost = 0.0;  // r^T r of the rows, the feature projected out
  };
  std::optional<Projected> project(const std::vector<LinearizedObservation>& observations, double sigma, double huber,
                                   bool by_score);
  [[nodiscard]] double chi_squared(const std::vector<LinearizedObservation>& observations, const Projected& own,
                                   const Eigen::Ref<const Eigen::MatrixXd>& P);
  void sum_up(const std::vector<LinearizedObservation>& observations, const Eigen::Vector3d& Lv, Eigen::MatrixXd& A,
              Eigen::VectorXd& b) const;

  FilterKernels kernels_;
  int size_ = 0;      // columns: the camera's part of the error vector
  int features_ = 0;  // in W_
  WhitenedRows rows_;
  Eigen::MatrixXd H_;      // of these rows
  Eigen::MatrixXd A_, W_;  // with rows beyond for the kernels; W_: H^T H_f V^-1/2 of each feature, 3 columns each
  Eigen::VectorXd b_, scale_, pivots_;
  std::vector<double> weights_;  // of its observations: Huber's, times the score's, over the variance
  WhitenedRows gate_rows_;
  Eigen::MatrixXd gate_A_, gate_PHt_;
  Eigen::VectorXd gate_b_;
};

}  // namespace ear
