#include "filter/start/image_start.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"
#include "filter/sources/cameras/stereo_motion.h"
#include "filter/sources/cameras/triangulation.h"
#include "filter/start/start_moments.h"

namespace ear {
namespace {

constexpr std::size_t kMoments = 12;  // chosen: frames that are used, evenly spaced
constexpr int kIterations = 20;       // chosen
constexpr double kKnownLength = 0.1;  // chosen: share of the path to which its length must be known, by one camera

struct Sight {
  std::size_t moment;
  int camera;
  Eigen::Vector2d uv;
};
struct Point {
  std::vector<Sight> sights;                        // in the order of time
  Eigen::Vector3d value = Eigen::Vector3d::Zero();  // as image_of() takes it
  bool in_front = true;
};

bool by_right(const Sight& sight) { return sight.camera == 1; }
bool by_both(const Point& point) { return std::any_of(point.sights.begin(), point.sights.end(), by_right); }

/// The points that so many of the frames see that these confirm each other; where too few of them are seen by both
/// cameras, as at a low rate, also those that both see in one frame less. Few that the right camera sees, too, may be
/// false matches, which would say how long the path is: then the left one counts alone.
std::vector<Point> points_of(const std::vector<const TimedFrame*>& frames) {
  std::map<std::uint64_t, Point> by_id;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    for (const FeatureObservation& o : frames[k]->features.features) {
      std::vector<Sight>& sights = by_id[o.id].sights;
      sights.push_back({k, 0, o.left});
      if (o.has_right) sights.push_back({k, 1, o.right});
    }
  }
  std::vector<Point> points;
  std::vector<Point> shorter;
  for (auto& [id, point] : by_id) {
    const std::size_t frames_between = point.sights.back().moment - point.sights.front().moment;
    if (frames_between >= kConfirmed) {
      points.push_back(std::move(point));
    } else if (frames_between + 1 == kConfirmed && by_both(point)) {
      shorter.push_back(std::move(point));
    }
  }
  const auto count = static_cast<std::size_t>(std::count_if(points.begin(), points.end(), by_both));
  if (count >= kToKnow) return points;
  if (count + shorter.size() >= kToKnow) {
    std::move(shorter.begin(), shorter.end(), std::back_inserter(points));
    return points;
  }
  for (Point& point : points) {
    point.sights.erase(std::remove_if(point.sights.begin(), point.sights.end(), by_right), point.sights.end());
  }
  return points;
}

/// Of a residual with this standard deviation, by Huber.
double weight_of(double residual, double sigma) { return std::min(1.0, kHuber * sigma / residual) / (sigma * sigma); }

/// Normal equations of one point, and of it with the other unknowns, up to the last that it depends on.
struct PointSums {
  Eigen::Matrix3d A;
  Eigen::Vector3d b;
  Eigen::Matrix<double, Eigen::Dynamic, 3> A_others;

  void clear(Eigen::Index others) {
    A.setZero();
    b.setZero();
    A_others.setZero(others, 3);
  }
  [[nodiscard]] Eigen::Vector3d step(const Eigen::VectorXd& others) const {
    return A.ldlt().solve(b - A_others.transpose() * others.head(A_others.rows()));
  }
};

/// Normal equations of the unknowns that the points share: the state, then the errors of the path.
struct SharedSums {
  Eigen::MatrixXd A;  ///< its lower half
  Eigen::VectorXd b;

  explicit SharedSums(Eigen::Index size) : A(Eigen::MatrixXd::Zero(size, size)), b(Eigen::VectorXd::Zero(size)) {}
  /// The point is where it fits best.
  void eliminate(PointSums& point) {
    point.A.diagonal().array() += 1e-9 * point.A.trace();  // a point at infinity has some depth
    const Eigen::LDLT<Eigen::Matrix3d> of_A(point.A);
    const Eigen::Matrix3d inverse = of_A.solve(Eigen::Matrix3d::Identity());
    const auto& others = point.A_others;
    for (Eigen::Index j = 0; j < others.rows(); ++j) {
      if (others.row(j).isZero(0.0)) continue;
      const Eigen::Vector3d weighted = inverse * others.row(j).transpose();
      const Eigen::Index rows = others.rows() - j;
      A.col(j).segment(j, rows) -= others.bottomRows(rows).lazyProduct(weighted);
      b(j) -= weighted.dot(point.b);
    }
  }
  [[nodiscard]] StartFit::Matrix of_state() const {
    return A.topLeftCorner<StartFit::size, StartFit::size>().selfadjointView<Eigen::Lower>();
  }
};

class Problem {
 public:
  Problem(const std::vector<const TimedFrame*>& frames, const ImuBuffer& imu, const CameraState& cameras,
          const StartNoise& noise)
      : imu_(imu),
        cameras_(cameras),
        noise_(noise),
        points_(points_of(frames)),
        sums_(points_.size()),
        errors_(Eigen::VectorXd::Zero(StartMoment::errors_before(frames.size()))),
        fit_(noise.prior_sigma) {
    for (const TimedFrame* frame : frames) times_.push_back(frame->t_ns);
  }

  [[nodiscard]] StartAttempt solve() {
    if (points_.size() < kToKnow) return {std::nullopt, Reason::few_frames};
    find_gyro_bias();
    guess();
    for (std::size_t i = 0; i < 2; ++i) {
      ImuCalibration one = noise_.imu;
      (i == 0 ? one.accel_noise : one.gyro_noise) = 0.0;
      stated_[i] = path_noise(times_, x_, imu_, one);
    }
    double step = HUGE_VAL;
    for (int i = 0; i < kIterations && step > kPrecise; ++i) step = iterate();
    const bool settled = step <= kPrecise;
    if (settled && !fits()) return {std::nullopt, Reason::cameras_contradict};
    if (!settled || !shows_length()) return {std::nullopt, Reason::moves_unseen};
    return {start_state(times_.front(), x_), Reason::none, fit_.motion_information(x_),
            ImuNoiseFactors{std::sqrt(noisier_[0]), std::sqrt(noisier_[1])}};
  }

 private:
  void find_gyro_bias();
  void add_turn(std::size_t k, Eigen::Matrix3d& A, Eigen::Vector3d& b) const;
  void guess();
  double iterate();
  void measure_noise(const Eigen::MatrixXd& W, const Eigen::LLT<Eigen::MatrixXd>& of_A_e,
                     const Eigen::MatrixXd& by_state, const StartFit::Matrix& covariance);
  [[nodiscard]] bool fits() const;
  [[nodiscard]] bool shows_length() const;
  void integrate();

  const ImuBuffer& imu_;
  const CameraState& cameras_;
  const StartNoise& noise_;
  std::vector<TimeNs> times_;
  std::vector<Point> points_;
  std::vector<StartMoment> moments_;
  std::vector<PointSums> sums_;
  std::vector<PointImage> images_;  ///< of the point at hand
  StartFit::Vector x_ = StartFit::Vector::Zero();
  Eigen::VectorXd errors_;                      ///< of the path, as path_noise() has them
  std::array<Eigen::MatrixXd, 2> stated_;       ///< their covariance by the stated noise: gyroscope's, accelerometer's
  std::array<double, 2> noisier_ = {1.0, 1.0};  ///< factors on these
  StartFit fit_;                                ///< of the last iteration
};

void Problem::integrate() {
  moments_ = start_moments(times_, x_, imu_);
  for (std::size_t k = 1; k < moments_.size(); ++k) {
    const auto error = errors_.segment<StartMoment::errors>(StartMoment::errors_before(k));
    moments_[k].sums.R = exp_so3(error.head<3>()) * moments_[k].sums.R;
    moments_[k].error = error.tail<3>();
  }
}

/// Two rays to a point and the way between their frames lie in one plane, however far the point is. Gauss-Newton.
void Problem::find_gyro_bias() {
  const double prior = std::pow(noise_.prior_sigma(StartFit::gyro_bias), -2);
  auto b_g = x_.segment<3>(StartFit::gyro_bias);
  for (int i = 0; i < kIterations; ++i) {
    integrate();
    Eigen::Matrix3d A = prior * Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = -prior * b_g;
    for (std::size_t k = 1; k < moments_.size(); ++k) add_turn(k, A, b);
    const Eigen::Vector3d step = A.ldlt().solve(b);
    b_g += step;
    if (step.norm() < kKnownSigma) break;
  }
}

/// Left images of frames k - 1 and k; the camera is as calibrated yet. The way is the direction most nearly
/// perpendicular to all normals.
void Problem::add_turn(std::size_t k, Eigen::Matrix3d& A, Eigen::Vector3d& b) const {
  const auto ray = [&](const Sight& sight) {
    return Eigen::Vector3d(moments_[sight.moment].sums.R * (cameras_.T_BC0.R * sight.uv.homogeneous().normalized()));
  };
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rays;
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
  for (const Point& point : points_) {
    const Sight* from = nullptr;
    for (const Sight& to : point.sights) {
      if (to.camera != 0) continue;
      if (from != nullptr && from->moment == k - 1 && to.moment == k) {
        rays.emplace_back(ray(*from), ray(to));
        const Eigen::Vector3d n = rays.back().first.cross(rays.back().second);
        normals += n * n.transpose();
      }
      from = &to;
    }
  }
  const Eigen::Vector3d way = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(normals).eigenvectors().col(0);
  const Eigen::Matrix3d turn = moments_[k].sums.R_by_b_g - moments_[k - 1].sums.R_by_b_g;
  const double sigma = std::sqrt(2.0) * noise_.feature_sigma;
  for (const auto& [from, to] : rays) {
    const double r = way.dot(from.cross(to));
    const Eigen::RowVector3d J = -way.transpose() * skew(from) * skew(to) * turn;
    const double weight = weight_of(std::abs(r), sigma);
    A += weight * J.transpose() * J;
    b -= weight * r * J.transpose();
  }
}

/// The first guess, without errors: with the gyroscope's bias known, each row times its depth is linear in all others,
/// of a point P (uv h.z - h.xy) = 0, h = R_CB (P - p - R p_BC).
void Problem::guess() {
  integrate();
  const std::array<Pose, 2> poses = {cameras_.T_BC0, cameras_.T_BC0 * cameras_.T_C0C1};
  SharedSums shared(StartFit::size);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    PointSums& sums = sums_[i];
    sums.clear(StartFit::size);
    for (const Sight& sight : points_[i].sights) {
      const StartMoment& k = moments_[sight.moment];
      const Pose& T_BC = poses[static_cast<std::size_t>(sight.camera)];
      const Eigen::Matrix3d R_CB = (k.sums.R * T_BC.R).transpose();
      const Eigen::Matrix<double, 2, 3> J = R_CB.topRows<2>() - sight.uv * R_CB.row(2);
      Eigen::Matrix<double, 2, StartFit::size> J_x = -J * k.position_by_state();
      J_x.middleCols<3>(StartFit::gyro_bias).setZero();
      const Eigen::Vector2d r = J * (k.sums.position + k.sums.R * T_BC.p);
      sums.A += J.transpose() * J;
      sums.b += J.transpose() * r;
      sums.A_others += J_x.transpose() * J;
      shared.A += J_x.transpose().lazyProduct(J_x);
      shared.b += J_x.transpose() * r;
    }
    shared.eliminate(sums);
  }
  const double weight = 1.0 / (noise_.feature_sigma * noise_.feature_sigma);
  StartFit fit(noise_.prior_sigma);
  fit.add(weight * shared.of_state(), weight * shared.b);
  const StartFit::Vector step = fit.solution();
  x_ += step;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector3d h = poses[0].R.transpose() * (sums_[i].step(step) - poses[0].p);
    points_[i].value << h.head<2>() / h.z(), 1.0 / h.z();
    points_[i].in_front = h.allFinite() && h.z() > kLeastDepth;
  }
}

/// Returns the step of the velocity, in its standard deviations.
double Problem::iterate() {
  integrate();
  constexpr Eigen::Index n = StartFit::size;
  SharedSums shared(n + errors_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point& point = points_[i];
    PointSums& sums = sums_[i];
    sums.clear(n + StartMoment::errors_before(point.sights.back().moment + 1));
    images_.clear();
    for (const Sight& sight : point.sights) {
      images_.push_back(image_of(point.value, x_, moments_[sight.moment], cameras_, sight.camera));
      point.in_front = point.in_front && images_.back().depth > kLeastDepth;
    }
    if (!point.in_front) continue;
    for (std::size_t s = 0; s < images_.size(); ++s) {
      const Sight& sight = point.sights[s];
      const PointImage& image = images_[s];
      const Eigen::Vector2d r = sight.uv - image.uv;
      const double weight = weight_of(r.norm(), noise_.feature_sigma);
      const Eigen::Matrix<double, StartFit::size, 2> by_state = weight * image.by_state.transpose();
      sums.A += weight * image.by_point.transpose() * image.by_point;
      sums.b += weight * image.by_point.transpose() * r;
      sums.A_others.topRows<n>() += by_state * image.by_point;
      shared.A.topLeftCorner<n, n>() += by_state.lazyProduct(image.by_state);
      shared.b.head<n>() += by_state * r;
      if (sight.moment == 0) continue;
      const Eigen::Index at = n + StartMoment::errors_before(sight.moment);
      Eigen::Matrix<double, 2, StartMoment::errors> by_error;
      by_error << image.by_turn, image.by_position;
      const Eigen::Matrix<double, StartMoment::errors, 2> weighted = weight * by_error.transpose();
      sums.A_others.middleRows<StartMoment::errors>(at) += weighted * image.by_point;
      shared.A.block<StartMoment::errors, n>(at, 0) += weighted.lazyProduct(image.by_state);
      shared.A.block<StartMoment::errors, StartMoment::errors>(at, at) += weighted * by_error;
      shared.b.segment<StartMoment::errors>(at) += weighted * r;
    }
    shared.eliminate(sums);
  }
  const Eigen::Index m = errors_.size();
  const Eigen::MatrixXd W = (noisier_[0] * stated_[0] + noisier_[1] * stated_[1]).inverse();
  const Eigen::MatrixXd A_e = shared.A.bottomRightCorner(m, m) + W;
  const Eigen::MatrixXd A_ex = shared.A.bottomLeftCorner(m, n);
  const Eigen::VectorXd b_e = shared.b.tail(m) - W * errors_;
  const Eigen::LLT<Eigen::MatrixXd> of_A_e(A_e);
  const Eigen::MatrixXd by_state = of_A_e.solve(A_ex);
  fit_ = StartFit(noise_.prior_sigma, x_);
  fit_.add(shared.of_state() - A_ex.transpose() * by_state, shared.b.head<n>() - A_ex.transpose() * of_A_e.solve(b_e));
  Eigen::VectorXd step(n + m);
  step.head<n>() = fit_.step(x_);
  step.tail(m) = of_A_e.solve(b_e - A_ex * step.head<n>());
  x_ += step.head<n>();
  errors_ += step.tail(m);
  for (std::size_t i = 0; i < points_.size(); ++i) points_[i].value += sums_[i].step(step);
  const StartFit::Matrix covariance = fit_.information(x_).inverse();
  measure_noise(W, of_A_e, by_state, covariance);
  const double variance = covariance.topLeftCorner<3, 3>().trace();
  return step.segment<3>(StartFit::velocity).norm() / std::sqrt(variance);
}

/// How noisy the inertial samples are, by the errors of the path. Their covariance is C = A_e^-1 + B P B^T, with that
/// of the state, P, and what they follow of it, B; W is the inverse of what it is by the noise believed so far. Of each
/// part the squares over what the images determine of them (MacKay 1992); the stated noise counts for one more.
void Problem::measure_noise(const Eigen::MatrixXd& W, const Eigen::LLT<Eigen::MatrixXd>& of_A_e,
                            const Eigen::MatrixXd& by_state, const StartFit::Matrix& covariance) {
  const Eigen::VectorXd weighted = W * errors_;
  const Eigen::MatrixXd W_B = W * by_state;
  const Eigen::MatrixXd half = of_A_e.matrixL().solve(W);
  Eigen::MatrixXd seen = W - W_B * covariance * W_B.transpose();  // W - W C W
  seen.selfadjointView<Eigen::Lower>().rankUpdate(half.transpose(), -1.0);
  seen.triangularView<Eigen::StrictlyUpper>() = seen.transpose();
  for (std::size_t i = 0; i < 2; ++i) {
    const double squares = noisier_[i] * noisier_[i] * weighted.dot(stated_[i] * weighted);
    const double determined = noisier_[i] * stated_[i].cwiseProduct(seen).sum();
    noisier_[i] = std::max(1.0, (1.0 + squares) / (1.0 + determined));
  }
}

/// The images, and what was known before. Left and right exchanged fit by points that lie behind the cameras.
bool Problem::fits() const {
  double squares = 0.0;
  double rows = 0.0;
  std::size_t fitting = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Point& point = points_[i];
    double worst = 0.0;
    for (const Sight& sight : point.sights) {
      const PointImage image = image_of(point.value, x_, moments_[sight.moment], cameras_, sight.camera);
      const double r = image.depth > kLeastDepth ? (sight.uv - image.uv).norm() / noise_.feature_sigma : HUGE_VAL;
      worst = std::max(worst, r);
      squares += std::pow(std::min(r, kClear), 2);
      rows += 2.0;
    }
    const double inverse_depth = point.value.z() * std::sqrt(sums_[i].A(2, 2));  // in its standard deviations
    fitting += worst < kClear && inverse_depth > -kClear ? 1 : 0;
  }
  if (!fit_.expected(x_, kClear) || std::max(noisier_[0], noisier_[1]) > kFarthest) return false;
  return squares <= kWorstFit * rows && fitting >= std::max<std::size_t>(kToKnow, points_.size() / 2);
}

/// Two cameras show it; one, where it is known at the farthest of the positions.
bool Problem::shows_length() const {
  if (std::any_of(points_.begin(), points_.end(), by_both)) return true;
  const auto before = [&](const StartMoment& a, const StartMoment& b) {
    return a.position(x_).norm() < b.position(x_).norm();
  };
  const StartMoment& farthest = *std::max_element(moments_.begin(), moments_.end(), before);
  const Eigen::Vector3d p = farthest.position(x_);
  const StartFit::Vector J = farthest.position_by_state().transpose() * p.normalized();
  return J.dot(fit_.information(x_).ldlt().solve(J)) < std::pow(kKnownLength * p.norm(), 2);
}

}  // namespace

StartAttempt image_start(const std::vector<TimedFrame>& frames, const ImuBuffer& imu, const CameraState& cameras,
                         const StartNoise& noise) {
  std::vector<const TimedFrame*> used;
  const std::size_t count = std::min(kMoments, frames.size());
  for (std::size_t k = 0; k < count && count > 1; ++k) used.push_back(&frames[k * (frames.size() - 1) / (count - 1)]);
  if (used.size() <= kConfirmed) return {std::nullopt, Reason::few_frames};
  return Problem(used, imu, cameras, noise).solve();
}

}  // namespace ear
