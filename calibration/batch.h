// All drives as one least-squares problem: parameters of the vehicle, and the keyframes, ground and features of each
// drive. docs/calibration.md.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <functional>
#include <string>
#include <vector>

#include "calibration/parameters.h"
#include "calibration/roll.h"
#include "calibration/segment.h"

namespace ear::calibration {

/// How exact the sensors are: first guesses, which the residuals of the first solution replace.
struct Noise {
  double pixel = 0.6;    ///< of features' residuals [px]
  double lasting = 1.0;  ///< features count with so many times that: their errors last (information.h)
  RollNoise roll;
  double beam = 0.004;          ///< [m]
  double stand = 1e-3;          ///< [m] of the wheels' lowest points from the plane
  double ground_height = 3e-3;  ///< how the ground's plane changes [m/sqrt(m)]
  double ground_slope = 0.02;   ///< [rad/sqrt(m)]
};

/// What kind of term a residual block belongs to.
enum class Term : std::uint8_t { prior, inertial, roll, stand, beam, ground, pixel, reference };

struct TermBlock {
  Term kind = Term::prior;
  ceres::ResidualBlockId id = nullptr;
  std::size_t segment = 0;
  std::size_t keyframe = 0;  ///< of features: the point
  std::size_t beam = 0;      ///< of features: the camera
  TimeNs t_ns = 0;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< of features: in the image [px]; of beams: the hit in the world [m]
};

class Batch {
 public:
  /// `start`: of the iteration.
  Batch(const Calibration& given, const Priors& priors, const Parameters& start, const Noise& noise);
  /// `drive` must outlive this. Throws std::invalid_argument where it cannot be used.
  void add(const Drive& drive, const FirstGuess& guess);

  Batch(const Batch&) = delete;  // blocks do not move
  Batch& operator=(const Batch&) = delete;

  /// Terms around the present values; `gate`: what of wheels and beams is further off than this many
  /// sigmas is left out (0: none): wheels that spin as they lift off, a beam that meets a passer-by.
  void build(double gate);
  /// Moves everything to the minimum. False if that comes to nothing. `progress` is told the iteration and the cost.
  using Progress = std::function<void(int, double)>;
  [[nodiscard]] bool solve(int iterations, int threads, const Progress& progress);
  /// Noise by the residuals of the present solution; features that do not fit are used no more.
  void learn_noise();
  /// From the next build() on, features count with `lasting` times the noise that they count with now.
  void weigh_pixels(double lasting) { noise_.lasting *= lasting; }

  [[nodiscard]] const std::vector<CalibrationBlock>& parameter_blocks() const { return blocks_; }
  [[nodiscard]] const Parameters& parameters() const { return parameters_; }
  [[nodiscard]] Parameters& parameters() { return parameters_; }
  [[nodiscard]] const Calibration& given() const { return given_; }
  [[nodiscard]] const Noise& noise() const { return noise_; }
  [[nodiscard]] const std::vector<Segment>& segments() const { return segments_; }
  [[nodiscard]] const std::vector<TermBlock>& terms() const { return terms_; }
  [[nodiscard]] ceres::Problem& problem() { return *problem_; }
  [[nodiscard]] const ceres::Problem& problem() const { return *problem_; }
  /// Blocks in the order of elimination: points, then frames in the order of time, then parameters.
  [[nodiscard]] std::vector<double*> elimination_order();

 private:
  void add_blocks();
  void add_priors();
  void add_inertial(std::size_t segment);
  void add_rolls(std::size_t segment, double gate);
  void add_ground(std::size_t segment, double gate);
  void add_beams(std::size_t segment, double gate);
  void add_points(std::size_t segment);
  void add_reference(std::size_t segment);
  ceres::ResidualBlockId add_term(TermBlock term, ceres::CostFunction* cost, ceres::LossFunction* loss,
                                  const std::vector<double*>& blocks);
  void learn_from_pixels();
  void learn_from_beams();
  void learn_from_ground();
  [[nodiscard]] CameraState cameras_now() const;

  Calibration given_;
  Noise noise_;
  GivenCameras cameras_;
  Parameters parameters_;
  std::vector<CalibrationBlock> blocks_;
  std::vector<Segment> segments_;
  std::vector<TermBlock> terms_;
  std::unique_ptr<ceres::Problem> problem_;
  std::unique_ptr<smoother::PoseManifold> manifold_;
};

}  // namespace ear::calibration
