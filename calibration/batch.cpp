#include "calibration/batch.h"

#include <ceres/normal_prior.h>
#include <ceres/ordered_groups.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>

#include "calibration/grounded.h"
#include "calibration/noise_estimate.h"
#include "smoother/imu_factor.h"

namespace ear::calibration {
namespace {

constexpr double kPixelHuber = 2.5;  // [sigma]
constexpr double kRollHuber = 4.0;
constexpr double kBeamHuber = 3.0;
constexpr double kGyroBias = 0.1;   // [rad/s] where nothing is stated
constexpr double kAccelBias = 0.5;  // [m/s^2]
constexpr double kWildPixel = 8.0;  // [sigma] of both coordinates: the feature is used no more
constexpr double kConverged = 1e-8;
constexpr double kRegion =
    1e14;  // nearly Gauss-Newton: damping would hold the scale, which is shown weakly, where it is

Pose to_pose(const Eigen::Isometry3d& T) { return {T.linear(), T.translation()}; }

GivenCameras given_cameras(const Calibration& given) {
  GivenCameras cameras;
  for (std::size_t i = 0; i < given.cameras.size(); ++i) cameras.lens[i] = given.cameras[i];
  if (!given.cameras.empty()) cameras.poses.T_BC0 = to_pose(given.cameras[0].T_BC);
  if (given.cameras.size() > 1) {
    cameras.poses.T_C0C1 = to_pose(given.cameras[0].T_BC.inverse(Eigen::Isometry) * given.cameras[1].T_BC);
  }
  return cameras;
}

class ProgressCallback final : public ceres::IterationCallback {
 public:
  explicit ProgressCallback(const Batch::Progress& progress) : progress_(progress) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (progress_) progress_(summary.iteration, summary.cost);
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const Batch::Progress& progress_;
};

}  // namespace

Batch::Batch(const Calibration& given, const Priors& priors, const Parameters& start, const Noise& noise)
    : given_(given),
      noise_(noise),
      cameras_(given_cameras(given)),
      parameters_(start),
      blocks_(blocks_of(parameters_, given, priors)),
      manifold_(std::make_unique<smoother::PoseManifold>()) {}

void Batch::add(const Drive& drive, const FirstGuess& guess) {
  segments_.push_back(make_segment(drive, guess, given_, PointChoice{}));
  if (given_.lasers) mark_ground(segments_.back(), *given_.lasers);
  if (given_.encoder) guess_ground(segments_.back(), odometer_of(*applied(given_, parameters_).encoder));
}

CameraState Batch::cameras_now() const {
  CameraState now;
  now.T_BC0 = with_error(cameras_.poses.T_BC0, parameters_.camera.data());
  now.T_C0C1 = with_error(cameras_.poses.T_C0C1, parameters_.stereo.data());
  now.time_offset = parameters_.camera_time[0];
  return now;
}

ceres::ResidualBlockId Batch::add_term(TermBlock term, ceres::CostFunction* cost, ceres::LossFunction* loss,
                                       const std::vector<double*>& blocks) {
  term.id = problem_->AddResidualBlock(cost, loss, blocks);
  terms_.push_back(term);
  return term.id;
}

void Batch::build(double gate) {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  problem_ = std::make_unique<ceres::Problem>(options);
  terms_.clear();
  for (Segment& segment : segments_) {
    renew_paths(segment);
    if (!given_.cameras.empty()) place_points(segment, cameras_now());
  }
  add_blocks();
  add_priors();
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    add_inertial(i);
    if (given_.encoder) add_rolls(i);
    if (given_.encoder) add_ground(i);
    if (given_.encoder && given_.lasers) add_beams(i, gate);
    if (!given_.cameras.empty()) add_points(i);
    if (!segments_[i].drive->reference.empty()) add_reference(i);
  }
}

void Batch::add_blocks() {
  for (Segment& segment : segments_) {
    for (Keyframe& keyframe : segment.keyframes) {
      problem_->AddParameterBlock(keyframe.pose.data(), 7, manifold_.get());
      problem_->AddParameterBlock(keyframe.motion.data(), 9);
      if (given_.encoder) problem_->AddParameterBlock(keyframe.ground.data(), 3);
    }
    for (Point& point : segment.points) {
      if (point.used) problem_->AddParameterBlock(point.block.data(), 3);
    }
    if (!segment.drive->reference.empty()) problem_->AddParameterBlock(segment.reference.data(), 4);
  }
  for (const ParameterBlock& block : blocks_) {
    problem_->AddParameterBlock(block.data, static_cast<int>(block.entries.size()));
  }
}

void Batch::add_priors() {
  for (const ParameterBlock& block : blocks_) {
    const auto n = static_cast<Eigen::Index>(block.entries.size());
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index k = 0; k < n; ++k) A(k, k) = 1.0 / block.entries[static_cast<std::size_t>(k)].prior;
    add_term({}, new ceres::NormalPrior(A, Eigen::VectorXd::Zero(n)), nullptr, {block.data});
  }
  for (Segment& segment : segments_) {
    Keyframe& first = segment.keyframes.front();
    const NavState state = state_of(first);
    add_term({}, new OriginFactor(OriginModel{{state.q_WB.toRotationMatrix(), state.p_WB}}), nullptr,
             {first.pose.data()});
    const BiasModel bias{given_.imu.gyro_bias_sigma.value_or(kGyroBias),
                         given_.imu.accel_bias_sigma.value_or(kAccelBias)};
    add_term({}, new BiasFactor(bias), nullptr, {first.motion.data()});
  }
}

void Batch::add_inertial(std::size_t s) {
  std::deque<Keyframe>& keyframes = segments_[s].keyframes;
  for (std::size_t i = 0; i + 1 < keyframes.size(); ++i) {
    Keyframe& a = keyframes[i];
    Keyframe& b = keyframes[i + 1];
    const auto measured = preintegrated(a.since, state_of(a), given_.imu);
    add_term({Term::inertial, nullptr, s, i, 0, a.t_ns}, new smoother::ImuFactor(measured), nullptr,
             {a.pose.data(), a.motion.data(), b.pose.data(), b.motion.data()});
  }
}

void Batch::add_rolls(std::size_t s) {
  Segment& segment = segments_[s];
  const Calibration now = applied(given_, parameters_);
  const RollSetting setting{*given_.encoder, given_.imu, odometer_of(*given_.encoder), odometer_of(*now.encoder),
                            noise_.roll};
  const WheelAngles angles(*given_.encoder, segment.drive->encoders);
  for (std::size_t i = 0; i + 1 < segment.keyframes.size(); ++i) {
    Keyframe& a = segment.keyframes[i];
    Keyframe& b = segment.keyframes[i + 1];
    if (!a.on_ground) continue;
    const Eigen::Vector3d n_W(-a.ground[1], -a.ground[2], 1.0);
    const NavState state = state_of(a);
    const Eigen::Vector3d n_k = state.q_WB.conjugate() * n_W.normalized();
    const auto roll = roll_along(a.path, state.b_g, n_k, angles, setting);
    if (!roll) continue;
    add_term({Term::roll, nullptr, s, i, 0, a.t_ns}, new RollFactor(*roll), new ceres::HuberLoss(kRollHuber),
             {a.pose.data(), b.pose.data(), a.motion.data(), parameters_.wheels.data(), parameters_.axle.data(),
              parameters_.encoder_time.data()});
  }
}

void Batch::add_ground(std::size_t s) {
  std::deque<Keyframe>& keyframes = segments_[s].keyframes;
  const OdometerState given = odometer_of(*given_.encoder);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    Keyframe& a = keyframes[i];
    if (a.on_ground) {
      add_term({Term::stand, nullptr, s, i, 0, a.t_ns}, new StandFactor(StandModel{given, a.centre, noise_.stand}),
               new ceres::HuberLoss(kBeamHuber),
               {a.pose.data(), a.ground.data(), parameters_.wheels.data(), parameters_.axle.data()});
    }
    if (i + 1 == keyframes.size()) continue;
    Keyframe& b = keyframes[i + 1];
    const double way = std::sqrt(std::hypot(b.centre.x - a.centre.x, b.centre.y - a.centre.y) + 1e-4);
    add_term({Term::ground, nullptr, s, i, 0, a.t_ns},
             new GroundFactor(GroundModel{a.centre, b.centre, noise_.ground_height * way, noise_.ground_slope * way}),
             nullptr, {a.ground.data(), b.ground.data()});
  }
}

void Batch::add_beams(std::size_t s, double gate) {
  Segment& segment = segments_[s];
  const LaserCalibration& lasers = *given_.lasers;
  std::size_t i = 0;
  for (const LaserSample& sample : segment.drive->lasers) {
    while (i + 2 < segment.keyframes.size() && segment.keyframes[i + 1].t_ns <= sample.t_ns) ++i;
    Keyframe& keyframe = segment.keyframes[i];
    if (sample.t_ns < keyframe.t_ns || keyframe.path.empty() || sample.t_ns > keyframe.path.back().t_ns) continue;
    const PathNode node = at(keyframe.path, sample.t_ns);
    for (std::size_t k = 0; k < lasers.beams.size() && k < sample.range.size(); ++k) {
      const double range = sample.range[k];
      if (!(range >= lasers.range_min && range <= lasers.range_max)) continue;
      const LaserBeam& beam = lasers.beams[k];
      auto cost =
          std::make_unique<BeamFactor>(BeamModel{beam.p_BL, beam.d_B, tangent_basis(-beam.d_B), keyframe.centre,
                                                 node.R_kt, node.p_kt, node.v_kt, node.rate_B, range, noise_.beam});
      const std::vector<double*> blocks{keyframe.pose.data(), keyframe.ground.data(), parameters_.beams[k].data(),
                                        parameters_.laser_time.data()};
      double residual = 0.0;
      cost->Evaluate(blocks.data(), &residual, nullptr);
      if (!std::isfinite(residual) || (gate > 0.0 && std::abs(residual) > gate)) continue;
      add_term({Term::beam, nullptr, s, i, k, sample.t_ns}, cost.release(), new ceres::HuberLoss(kBeamHuber), blocks);
    }
  }
}

void Batch::add_points(std::size_t s) {
  Segment& segment = segments_[s];
  for (std::size_t p = 0; p < segment.points.size(); ++p) {
    Point& point = segment.points[p];
    if (!point.used) continue;
    for (const Seen& seen : point.seen) {
      Keyframe& keyframe = segment.keyframes[seen.keyframe];
      const Eigen::Vector3d v_W = Eigen::Map<const Eigen::Vector3d>(keyframe.motion.data());
      const Eigen::Vector3d v_B = smoother::to_pose(keyframe.pose.data()).R.transpose() * v_W;
      PixelObservation observation{seen.left_px, noise_.pixel, keyframe.late, keyframe.rate_B, v_B};
      const TermBlock term{Term::pixel, nullptr, s, p, 0, keyframe.t_ns};
      add_term(term, new LeftPixel(observation, cameras_, point.anchor), new ceres::HuberLoss(kPixelHuber),
               {keyframe.pose.data(), parameters_.camera.data(), parameters_.lens[0].data(),
                parameters_.camera_time.data(), point.block.data()});
      if (!seen.has_right) continue;
      observation.px = seen.right_px;
      add_term(term, new RightPixel(observation, cameras_, point.anchor), new ceres::HuberLoss(kPixelHuber),
               {keyframe.pose.data(), parameters_.camera.data(), parameters_.stereo.data(), parameters_.lens[1].data(),
                parameters_.camera_time.data(), point.block.data()});
    }
  }
}

void Batch::add_reference(std::size_t s) {
  Segment& segment = segments_[s];
  std::size_t i = 0;
  for (const ReferencePosition& position : segment.drive->reference) {
    while (i + 2 < segment.keyframes.size() && segment.keyframes[i + 1].t_ns <= position.t_ns) ++i;
    Keyframe& keyframe = segment.keyframes[i];
    if (position.t_ns < keyframe.t_ns || keyframe.path.empty() || position.t_ns > keyframe.path.back().t_ns) continue;
    const ReferenceModel model{position.p, at(keyframe.path, position.t_ns).p_kt, segment.drive->reference_sigma};
    add_term({Term::reference, nullptr, s, i, 0, position.t_ns}, new ReferenceFactor(model), new ceres::HuberLoss(3.0),
             {keyframe.pose.data(), segment.reference.data()});
  }
}

void Batch::learn_noise() {
  learn_from_pixels();
  learn_from_beams();
  if (!given_.encoder) return;
  const RollSetting setting{*given_.encoder, given_.imu, odometer_of(*given_.encoder),
                            odometer_of(*applied(given_, parameters_).encoder), noise_.roll};
  double slip = 0.0;
  for (Segment& segment : segments_) {
    renew_paths(segment);
    slip = std::max(slip, slip_of(segment, setting).value_or(0.0));
  }
  if (slip > 0.0) noise_.roll = {slip, 2.0 * slip};
}

void Batch::learn_from_pixels() {
  std::vector<double> residuals;
  std::array<double, 2> residual{};
  double used = 0.0;  // rows that place the points
  const TermBlock* before = nullptr;
  for (const TermBlock& term : terms_) {
    if (term.kind != Term::pixel) continue;
    const bool same = before != nullptr && before->keyframe == term.keyframe && before->segment == term.segment;
    if (!same) used += 3.0;
    before = &term;
    problem_->EvaluateResidualBlock(term.id, false, nullptr, residual.data(), nullptr);
    if (std::hypot(residual[0], residual[1]) > kWildPixel) {
      segments_[term.segment].points[term.keyframe].seen.clear();
    }
    residuals.insert(residuals.end(), residual.begin(), residual.end());
  }
  if (residuals.empty()) return;
  const auto rows = static_cast<double>(residuals.size());
  noise_.pixel *= robust_sigma(residuals) * std::sqrt(rows / std::max(1.0, rows - used));
}

void Batch::learn_from_beams() {
  std::vector<double> residuals;
  for (const TermBlock& term : terms_) {
    if (term.kind != Term::beam) continue;
    double residual = 0.0;
    problem_->EvaluateResidualBlock(term.id, false, nullptr, &residual, nullptr);
    residuals.push_back(residual);
  }
  if (!residuals.empty()) noise_.beam = std::max(0.5 * given_.lasers->noise, noise_.beam * robust_sigma(residuals));
}

bool Batch::solve(int iterations, int threads, const Progress& progress) {
  ceres::Solver::Options options;
  auto order = std::make_shared<ceres::ParameterBlockOrdering>();
  bool points = false;
  for (double* block : elimination_order()) order->AddElementToGroup(block, 1);
  for (Segment& segment : segments_) {
    for (Point& point : segment.points) {
      if (point.used) order->AddElementToGroup(point.block.data(), 0);
      points = points || point.used;
    }
  }
  options.linear_solver_type = points ? ceres::SPARSE_SCHUR : ceres::SPARSE_NORMAL_CHOLESKY;
  if (points) options.linear_solver_ordering = order;
  options.max_num_iterations = iterations;
  options.function_tolerance = kConverged;
  options.initial_trust_region_radius = kRegion;
  options.max_trust_region_radius = 1e6 * kRegion;
  options.num_threads = threads;
  options.logging_type = ceres::SILENT;
  ProgressCallback callback(progress);
  options.callbacks.push_back(&callback);
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem_.get(), &summary);
  return summary.IsSolutionUsable() && std::isfinite(summary.final_cost);
}

std::vector<double*> Batch::elimination_order() {
  std::vector<double*> order;
  for (Segment& segment : segments_) {
    for (Point& point : segment.points) {
      if (point.used) order.push_back(point.block.data());
    }
  }
  for (Segment& segment : segments_) {
    for (Keyframe& keyframe : segment.keyframes) {
      order.push_back(keyframe.pose.data());
      order.push_back(keyframe.motion.data());
      if (given_.encoder) order.push_back(keyframe.ground.data());
    }
    if (!segment.drive->reference.empty()) order.push_back(segment.reference.data());
  }
  for (const ParameterBlock& block : blocks_) order.push_back(block.data);
  return order;
}

}  // namespace ear::calibration
