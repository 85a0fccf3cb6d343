#include "calibration/board.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/crs_matrix.h>
#include <ceres/loss_function.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <stdexcept>

#include "calibration/board_motion.h"
#include "calibration/degree.h"
#include "calibration/lens.h"
#include "calibration/noise_estimate.h"
#include "calibration/stated.h"
#include "filter/ekf/so3.h"

namespace ear::calibration {
namespace {

constexpr double kHuber = 2.0;        // [sigma]
constexpr double kGate = 5.0;         // [sigma] further off is another corner
constexpr double kBadView = 4.0;      // times the usual error
constexpr double kFirstSigma = 1.0;   // [px]
constexpr double kLeastSigma = 0.01;  // [px]
constexpr double kFit = 5.0;          // [px] a board that fits no better is none, or another
constexpr std::size_t kFewestCorners = 6;
constexpr int kRounds = 3;

// How far the start may be off. Weak: they hold what no view shows.
constexpr double kFocal = 0.3;            // of itself
constexpr double kPrincipalPoint = 0.08;  // of the width
constexpr double kRadial = 0.5;
constexpr double kTangential = 0.02;
constexpr double kStereoRotation = 10.0 * kDegree;
constexpr double kStereoPosition = 0.1;  // [m]
constexpr double kShownBelow = 0.1;      // of these

constexpr int kLens = 8;
constexpr int kPose = 6;
using LensBlock = std::array<double, kLens>;  ///< errors of fu, fv, cu, cv [px], and of four of the distortion
using PoseError = std::array<double, kPose>;  ///< R = Exp(phi) R^, p = p^ + dp

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

template <typename T>
Vector3<T> moved(const Pose& pose, const T* error, const Vector3<T>& point) {
  const Vector3<T> turned = pose.R.cast<T>() * point;
  Vector3<T> result;
  ceres::AngleAxisRotatePoint(error, turned.data(), result.data());
  return result + pose.p.cast<T>() + Eigen::Map<const Vector3<T>>(error + 3);
}

/// The point of a frame whose pose is moved like that, by its coordinates outside of it.
template <typename T>
Vector3<T> moved_back(const Pose& pose, const T* error, const Vector3<T>& point) {
  const Vector3<T> from = point - pose.p.cast<T>() - Eigen::Map<const Vector3<T>>(error + 3);
  const std::array<T, 3> back{-error[0], -error[1], -error[2]};
  Vector3<T> turned;
  ceres::AngleAxisRotatePoint(back.data(), from.data(), turned.data());
  return pose.R.transpose().cast<T>() * turned;
}

/// What both cameras' functors share.
struct CornerModel {
  CameraCalibration camera;
  Eigen::Vector2d px;
  double sigma;

  template <typename T>
  void residual(const Vector3<T>& p_C, const T* lens, T* result) const {
    const auto& k = camera.distortion;
    const Eigen::Matrix<T, 2, 1> xy = p_C.template head<2>() / p_C.z();
    const std::array<T, 3> rest{k[2] + lens[6], k[3] + lens[7], T(k[4])};
    const Eigen::Matrix<T, 2, 1> b = bent<T>(camera.lens, k[0] + lens[4], k[1] + lens[5], rest, xy);
    result[0] = (px.x() - (camera.fu + lens[0]) * b.x() - (camera.cu + lens[2])) / sigma;
    result[1] = (px.y() - (camera.fv + lens[1]) * b.y() - (camera.cv + lens[3])) / sigma;
  }
};

struct LeftCorner : CornerModel {
  Eigen::Vector3d p_P;
  Pose T_C0P;
  template <typename T>
  bool operator()(const T* view, const T* lens, T* result) const {
    residual<T>(moved<T>(T_C0P, view, p_P.cast<T>()), lens, result);
    return true;
  }
};

struct RightCorner : CornerModel {
  Eigen::Vector3d p_P;
  Pose T_C0P;
  Pose T_C0C1;
  template <typename T>
  bool operator()(const T* view, const T* stereo, const T* lens, T* result) const {
    const Vector3<T> p_C0 = moved<T>(T_C0P, view, p_P.cast<T>());
    residual<T>(moved_back<T>(T_C0C1, stereo, p_C0), lens, result);
    return true;
  }
};

struct CornerTerm {
  ceres::ResidualBlockId id = nullptr;
  std::size_t view = 0;
  std::size_t camera = 0;
  const SeenCorner* seen = nullptr;
  double sigma = kFirstSigma;
};

Pose stereo_of(const Calibration& calibration) {
  if (calibration.cameras.size() < 2) return {Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  const Eigen::Isometry3d T = calibration.cameras[0].T_BC.inverse(Eigen::Isometry) * calibration.cameras[1].T_BC;
  return {T.linear(), T.translation()};
}

/// The views as one least-squares problem.
class Views {
 public:
  Views(const Calibration& start, const BoardShape& board, const std::vector<BoardView>& views)
      : start_(start), T_C0C1_(stereo_of(start)), board_(board), views_(views), errors_(views.size()) {}

  /// With the noise that was learned.
  void build();
  void solve();
  /// Noise by the residuals; corners and views that do not fit are dropped.
  void learn();

  [[nodiscard]] std::vector<Entry> entries();
  /// Of the entries.
  [[nodiscard]] Covariances covariances();
  [[nodiscard]] Calibration calibration() const;
  [[nodiscard]] std::vector<Residual> residuals() const;
  /// Those in use, where they lie by the solution.
  [[nodiscard]] std::vector<BoardView> used() const;
  [[nodiscard]] double sigma() const { return sigma_; }
  /// Of the corners' errors, in pixels.
  [[nodiscard]] double root_mean_square() const;

 private:
  void add_corner(std::size_t view, std::size_t camera, const SeenCorner& seen);
  void add_prior(double* block, const std::vector<double>& sigmas);
  [[nodiscard]] std::vector<double> errors() const;  ///< of all terms, both coordinates, in sigmas, before the loss

  Calibration start_;
  Pose T_C0C1_;
  BoardShape board_;
  std::vector<BoardView> views_;
  std::deque<PoseError> errors_;
  std::array<LensBlock, 2> lens_{};
  PoseError stereo_{};
  double sigma_ = kFirstSigma;
  std::vector<CornerTerm> terms_;
  std::unique_ptr<ceres::Problem> problem_;
};

std::vector<double> lens_priors(const CameraCalibration& camera) {
  const double c = kPrincipalPoint * camera.width;
  const bool radial = camera.lens == LensModel::radial_tangential;
  const double rest = radial ? kTangential : kRadial;
  return {kFocal * camera.fu, kFocal * camera.fv, c, c, kRadial, kRadial, rest, rest};
}

std::vector<double> stereo_priors() {
  std::vector<double> sigmas(3, kStereoRotation);
  sigmas.insert(sigmas.end(), 3, kStereoPosition);
  return sigmas;
}

void Views::add_prior(double* block, const std::vector<double>& sigmas) {
  const auto n = static_cast<Eigen::Index>(sigmas.size());
  const Eigen::VectorXd weights = Eigen::Map<const Eigen::VectorXd>(sigmas.data(), n).cwiseInverse();
  problem_->AddResidualBlock(new ceres::NormalPrior(weights.asDiagonal(), Eigen::VectorXd::Zero(n)), nullptr, block);
}

void Views::add_corner(std::size_t view, std::size_t camera, const SeenCorner& seen) {
  Eigen::Vector3d p_P = Eigen::Vector3d::Zero();
  p_P.head<2>() = board_.at(seen.corner);
  const CornerModel model{start_.cameras[camera], seen.px, sigma_};
  CornerTerm term{nullptr, view, camera, &seen, sigma_};
  auto* loss = new ceres::HuberLoss(kHuber);
  if (camera == 0) {
    auto* cost =
        new ceres::AutoDiffCostFunction<LeftCorner, 2, kPose, kLens>(new LeftCorner{model, p_P, views_[view].T_C0P});
    term.id = problem_->AddResidualBlock(cost, loss, errors_[view].data(), lens_[0].data());
  } else {
    auto* cost = new ceres::AutoDiffCostFunction<RightCorner, 2, kPose, kPose, kLens>(
        new RightCorner{model, p_P, views_[view].T_C0P, T_C0C1_});
    term.id = problem_->AddResidualBlock(cost, loss, errors_[view].data(), stereo_.data(), lens_[1].data());
  }
  terms_.push_back(term);
}

void Views::build() {
  problem_ = std::make_unique<ceres::Problem>();
  terms_.clear();
  for (std::size_t i = 0; i < start_.cameras.size(); ++i) add_prior(lens_[i].data(), lens_priors(start_.cameras[i]));
  if (start_.cameras.size() > 1) add_prior(stereo_.data(), stereo_priors());
  for (std::size_t v = 0; v < views_.size(); ++v) {
    for (std::size_t camera = 0; camera < start_.cameras.size(); ++camera) {
      for (const SeenCorner& seen : views_[v].seen[camera]) add_corner(v, camera, seen);
    }
  }
}

void Views::solve() {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 60;
  options.logging_type = ceres::SILENT;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (PoseError& error : errors_) {
    if (problem_->HasParameterBlock(error.data())) ordering->AddElementToGroup(error.data(), 0);
  }
  for (std::size_t i = 0; i < start_.cameras.size(); ++i) ordering->AddElementToGroup(lens_[i].data(), 1);
  if (start_.cameras.size() > 1) ordering->AddElementToGroup(stereo_.data(), 1);
  options.linear_solver_ordering = ordering;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem_.get(), &summary);
  if (!summary.IsSolutionUsable()) throw std::invalid_argument("no cameras explain where the board's corners are");
}

std::vector<double> Views::errors() const {
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  for (const CornerTerm& term : terms_) options.residual_blocks.push_back(term.id);
  std::vector<double> errors;
  problem_->Evaluate(options, nullptr, &errors, nullptr, nullptr);
  return errors;
}

double Views::root_mean_square() const {
  double sum = 0.0;
  const std::vector<double> all = errors();
  for (const double error : all) sum += error * error;
  return sigma_ * std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, all.size())));
}

void Views::learn() {
  std::vector<double> px = errors();
  for (double& error : px) error *= sigma_;
  const double usual = std::max(kLeastSigma, robust_sigma(px));
  std::map<std::size_t, std::vector<double>> by_view;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    by_view[terms_[i].view].insert(by_view[terms_[i].view].end(), {px[2 * i], px[2 * i + 1]});
  }
  std::vector<BoardView> kept;
  std::deque<PoseError> errors;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (robust_sigma(by_view[v]) > kBadView * usual) continue;  // blurred, bent, or found the wrong way round
    BoardView view = views_[v];
    std::array<std::vector<SeenCorner>, 2> seen;
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      if (terms_[i].view != v || std::hypot(px[2 * i], px[2 * i + 1]) > kGate * usual) continue;
      seen[terms_[i].camera].push_back(*terms_[i].seen);
    }
    for (std::vector<SeenCorner>& corners : seen) {
      if (corners.size() < kFewestCorners) corners.clear();
    }
    if (seen[0].empty() && seen[1].empty()) continue;
    view.seen = std::move(seen);
    kept.push_back(std::move(view));
    errors.push_back(errors_[v]);
  }
  problem_.reset();  // before what it points at
  terms_.clear();
  views_ = std::move(kept);
  errors_ = std::move(errors);
  sigma_ = usual;
}

std::vector<Entry> Views::entries() {
  std::vector<Entry> entries;
  for (std::size_t i = 0; i < start_.cameras.size(); ++i) {
    const CameraCalibration& camera = start_.cameras[i];
    const std::string name = "cam" + std::to_string(i) + ": ";
    const bool radial = camera.lens == LensModel::radial_tangential;
    const std::array<const char*, kLens> names{"focal length u",
                                               "focal length v",
                                               "principal point u",
                                               "principal point v",
                                               "distortion k1",
                                               "distortion k2",
                                               radial ? "distortion p1" : "distortion k3",
                                               radial ? "distortion p2" : "distortion k4"};
    const std::array<double, kLens> given{camera.fu,
                                          camera.fv,
                                          camera.cu,
                                          camera.cv,
                                          camera.distortion[0],
                                          camera.distortion[1],
                                          camera.distortion[2],
                                          camera.distortion[3]};
    const std::vector<double> priors = lens_priors(camera);
    for (std::size_t k = 0; k < kLens; ++k) {
      entries.push_back({name + names[k], k < 4 ? "px" : "", 1.0, given[k], priors[k], &lens_[i][k]});
    }
  }
  if (start_.cameras.size() < 2) return entries;
  const std::vector<double> priors = stereo_priors();
  const std::array<const char*, 3> axes{"x", "y", "z"};
  for (std::size_t k = 0; k < kPose; ++k) {
    const bool turn = k < 3;
    const std::string name = std::string("cam1: ") + (turn ? "rotation in cam0 about " : "position in cam0 ");
    const double given = turn ? 0.0 : 1e3 * T_C0C1_.p(static_cast<Eigen::Index>(k - 3));
    entries.push_back(
        {name + axes[k % 3], turn ? "deg" : "mm", turn ? 1.0 / kDegree : 1e3, given, priors[k], &stereo_[k]});
  }
  return entries;
}

Covariances Views::covariances() {
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = true;
  for (const CornerTerm& term : terms_) options.residual_blocks.push_back(term.id);
  Eigen::Index n = 0;
  std::vector<double> priors;
  for (std::size_t i = 0; i < start_.cameras.size(); ++i) {
    options.parameter_blocks.push_back(lens_[i].data());
    const std::vector<double> sigmas = lens_priors(start_.cameras[i]);
    priors.insert(priors.end(), sigmas.begin(), sigmas.end());
  }
  if (start_.cameras.size() > 1) {
    options.parameter_blocks.push_back(stereo_.data());
    const std::vector<double> sigmas = stereo_priors();
    priors.insert(priors.end(), sigmas.begin(), sigmas.end());
  }
  n = static_cast<Eigen::Index>(priors.size());
  for (PoseError& error : errors_) options.parameter_blocks.push_back(error.data());
  std::vector<double> residuals;
  ceres::CRSMatrix crs;
  problem_->Evaluate(options, nullptr, &residuals, nullptr, &crs);
  const Eigen::SparseMatrix<double, Eigen::RowMajor> J = Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
      crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()), crs.rows.data(), crs.cols.data(),
      crs.values.data());
  Eigen::MatrixXd H = Eigen::MatrixXd(Eigen::SparseMatrix<double>(J.transpose() * J));
  for (Eigen::Index k = 0; k < n; ++k)
    H(k, k) += 1.0 / (priors[static_cast<std::size_t>(k)] * priors[static_cast<std::size_t>(k)]);
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  H = (scale.asDiagonal() * H * scale.asDiagonal()).eval();
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(H.rows(), n);
  Z.topRows(n).diagonal() = scale.head(n);
  Z = (scale.asDiagonal() * H.ldlt().solve(Z)).eval();
  const Eigen::MatrixXd white = Z.topRows(n);

  // As found, a view at a time (information.h): what bends or blurs a view moves all its corners.
  const Eigen::MatrixXd Y = J * Z;
  Eigen::MatrixXd found = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n);
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 * i);
    sum += Y.middleRows(row, 2).transpose() * Eigen::Map<const Eigen::Vector2d>(residuals.data() + row);
    if (i + 1 < terms_.size() && terms_[i + 1].view == terms_[i].view) continue;
    found += sum * sum.transpose();
    sum.setZero();
  }
  const double rows = static_cast<double>(residuals.size());
  const double free = rows - static_cast<double>(kPose * errors_.size()) - static_cast<double>(n);
  const double views = static_cast<double>(errors_.size());
  found *= rows / std::max(1.0, free) * views / std::max(1.0, views - 1.0);
  return {found, white};
}

Calibration Views::calibration() const {
  Calibration result = start_;
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    CameraCalibration& camera = result.cameras[i];
    camera.fu += lens_[i][0];
    camera.fv += lens_[i][1];
    camera.cu += lens_[i][2];
    camera.cv += lens_[i][3];
    for (std::size_t k = 0; k < 4; ++k) camera.distortion[k] += lens_[i][4 + k];
  }
  if (result.cameras.size() > 1) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = exp_so3(Eigen::Map<const Eigen::Vector3d>(stereo_.data())) * T_C0C1_.R;
    T.translation() = T_C0C1_.p + Eigen::Map<const Eigen::Vector3d>(stereo_.data() + 3);
    result.cameras[1].T_BC = result.cameras[0].T_BC * T;
  }
  return result;
}

std::vector<BoardView> Views::used() const {
  std::vector<BoardView> views = views_;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const PoseError& error = errors_[v];
    views[v].T_C0P.R = exp_so3(Eigen::Map<const Eigen::Vector3d>(error.data())) * views[v].T_C0P.R;
    views[v].T_C0P.p += Eigen::Map<const Eigen::Vector3d>(error.data() + 3);
  }
  return views;
}

std::vector<Residual> Views::residuals() const {
  const std::vector<double> all = errors();
  std::vector<Residual> residuals;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const CornerTerm& term = terms_[i];
    residuals.push_back({Term::pixel, 0, term.camera, seconds_between(views_.front().t_ns, views_[term.view].t_ns),
                         sigma_ * Eigen::Vector2d(all[2 * i], all[2 * i + 1]), term.seen->px});
  }
  return residuals;
}

void require_views(std::size_t count) {
  if (count >= kFewestViews) return;
  throw std::invalid_argument(std::to_string(count) + " views of the board that can be used; " +
                              std::to_string(kFewestViews) +
                              " at least are needed, 40 are good: move it for half a "
                              "minute, with rests, near and far, tilted to all sides");
}

/// The standard deviations in the places where the filter looks for them; the left camera's pose in the body is not
/// shown by a board.
Calibration stated(const Calibration& found, const Calibration& start, const BoardResult& shown) {
  Calibration result = with_sigmas(found, shown.findings, shown.covariance);
  result.cameras[0].pose_sigma = start.cameras[0].pose_sigma;
  result.camera_time_offset_sigma = start.camera_time_offset_sigma;
  return result;
}

}  // namespace

BoardResult calibrate_cameras(const Calibration& start, const BoardShape& board, const std::vector<BoardView>& views) {
  require_views(views.size());
  Views problem(start, board, views);
  for (int round = 0; round < kRounds; ++round) {
    problem.build();
    problem.solve();
    if (round + 1 < kRounds) problem.learn();
    require_views(problem.used().size());
  }
  if (!(problem.root_mean_square() < kFit)) {
    throw std::invalid_argument("the corners do not lie as on a flat board of " + std::to_string(board.columns) +
                                " x " + std::to_string(board.rows) + " squares: they are " +
                                std::to_string(problem.root_mean_square()) + " px off");
  }
  BoardResult result;
  Decided decided = decide(problem.entries(), problem.covariances(), kShownBelow, board_motion_that_shows);
  result.findings = std::move(decided.findings);
  result.covariance = std::move(decided.covariance);
  result.residuals = problem.residuals();
  result.sigma_px = problem.sigma();
  const std::vector<BoardView> used = problem.used();
  result.views = used.size();
  result.coverage = coverage_of(start.cameras, board, used);
  result.advice = advice_on(result.coverage, start.cameras.size(), result.views, result.findings);
  for (const Finding& finding : result.findings) {
    if (finding.shown || finding.name.find("focal length") == std::string::npos) continue;
    std::string words = "the board's motion does not show the focal length:";
    for (const std::string& line : result.advice) words += "\n  " + line;
    throw std::invalid_argument(words);
  }
  result.calibration = stated(problem.calibration(), start, result);
  return result;
}

}  // namespace ear::calibration
