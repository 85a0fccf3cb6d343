#include "calibration/batch.h"

#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>

#include "calibration/grounded.h"
#include "calibration/inertial_factor.h"

namespace ear::calibration {
namespace {

constexpr double kPixelHuber = 2.5;  // [sigma]
constexpr double kRollHuber = 4.0;
constexpr double kBeamHuber = 3.0;
constexpr double kGyroBias = 0.1;   // [rad/s] where nothing is stated
constexpr double kAccelBias = 0.5;  // [m/s^2]
constexpr double kStill = 0.03;  // [m/s] a slower body shows nothing of the cameras' clock: it is the estimate's noise

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

/// Norm of a factor's residual at the present values.
template <typename Factor>
double residual_norm(const Factor& factor, const std::vector<double*>& blocks) {
  Eigen::VectorXd residual(factor.num_residuals());
  factor.Evaluate(blocks.data(), residual.data(), nullptr);
  return residual.norm();
}

/// Gated: beyond it a reading belongs to something else than the model.
bool fits(double norm, double gate) { return std::isfinite(norm) && (gate <= 0.0 || norm <= gate); }

Onwards onwards(const Keyframe& keyframe, const PathNode& node) {
  const NavState state = state_of(keyframe);
  Onwards result;
  result.after = seconds_between(keyframe.t_ns, node.t_ns);
  const Eigen::Vector3d coasted = state.v_W * result.after + 0.5 * result.after * result.after * kGravity_W;
  result.pushed = node.p_kt - state.q_WB.conjugate() * coasted;
  result.pushed_by_bias = node.J_p_ba;
  result.b_a = state.b_a;
  return result;
}

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
    renew_paths(segment, parameters_.gyro, given_.imu.gyro_noise);
    if (!given_.cameras.empty()) place_points(segment, cameras_now());
  }
  add_blocks();
  add_priors();
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    add_inertial(i);
    if (given_.encoder) add_rolls(i, gate);
    if (given_.encoder) add_ground(i, gate);
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
  for (const CalibrationBlock& block : blocks_) {
    problem_->AddParameterBlock(block.data, static_cast<int>(block.entries.size()));
  }
}

void Batch::add_priors() {
  for (const CalibrationBlock& block : blocks_) {
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
    const Preintegrated measured = preintegrated(a.since, state_of(a), parameters_.gyro, given_.imu);
    add_term({Term::inertial, nullptr, s, i, 0, a.t_ns}, new InertialFactor(measured), nullptr,
             {a.pose.data(), a.motion.data(), b.pose.data(), b.motion.data(), parameters_.gyro.data()});
  }
}

void Batch::add_rolls(std::size_t s, double gate) {
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
    auto cost = std::make_unique<RollFactor>(*roll);
    const std::vector<double*> blocks{a.pose.data(),           b.pose.data(),
                                      a.motion.data(),         parameters_.wheels.data(),
                                      parameters_.axle.data(), parameters_.encoder_time.data()};
    if (!fits(residual_norm(*cost, blocks), gate)) continue;
    add_term({Term::roll, nullptr, s, i, 0, a.t_ns}, cost.release(), new ceres::HuberLoss(kRollHuber), blocks);
  }
}

void Batch::add_ground(std::size_t s, double gate) {
  std::deque<Keyframe>& keyframes = segments_[s].keyframes;
  const OdometerState given = odometer_of(*given_.encoder);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    Keyframe& a = keyframes[i];
    if (a.on_ground) {
      auto cost = std::make_unique<StandFactor>(StandModel{given, a.centre, noise_.stand});
      const std::vector<double*> blocks{a.pose.data(), a.ground.data(), parameters_.wheels.data(),
                                        parameters_.axle.data()};
      if (fits(residual_norm(*cost, blocks), gate)) {
        add_term({Term::stand, nullptr, s, i, 0, a.t_ns}, cost.release(), new ceres::HuberLoss(kBeamHuber), blocks);
      }
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
    const TimeNs t_ns = later_by(lasers.time_offset, sample.t_ns);
    while (i + 2 < segment.keyframes.size() && segment.keyframes[i + 1].t_ns <= t_ns) ++i;
    Keyframe& keyframe = segment.keyframes[i];
    if (t_ns < keyframe.t_ns || keyframe.path.empty() || t_ns > keyframe.path.back().t_ns) continue;
    const PathNode node = at(keyframe.path, t_ns);
    for (std::size_t k = 0; k < lasers.beams.size() && k < sample.range.size(); ++k) {
      const double range = sample.range[k];
      if (!(range >= lasers.range_min && range <= lasers.range_max)) continue;
      const LaserBeam& beam = lasers.beams[k];
      auto cost = std::make_unique<BeamFactor>(BeamModel{beam.p_BL, beam.d_B, tangent_basis(-beam.d_B), keyframe.centre,
                                                         onwards(keyframe, node), node.R_kt, node.v_kt, node.rate_B,
                                                         range, noise_.beam});
      const std::vector<double*> blocks{keyframe.pose.data(), keyframe.motion.data(), keyframe.ground.data(),
                                        parameters_.beams[k].data(), parameters_.laser_time.data()};
      if (!fits(residual_norm(*cost, blocks), gate)) continue;
      const Pose T_Wk = smoother::to_pose(keyframe.pose.data());
      const Eigen::Vector3d hit = T_Wk.p + T_Wk.R * (node.p_kt + node.R_kt * (beam.p_BL + range * beam.d_B));
      add_term({Term::beam, nullptr, s, i, k, t_ns, hit.head<2>()}, cost.release(), new ceres::HuberLoss(kBeamHuber),
               blocks);
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
      const double still = std::max(0.0, 1.0 - kStill * kStill / std::max(1e-300, v_W.squaredNorm()));
      const Eigen::Vector3d v_B = still * (smoother::to_pose(keyframe.pose.data()).R.transpose() * v_W);
      PixelObservation observation{seen.left_px, noise_.pixel * noise_.lasting, keyframe.late, keyframe.rate_B, v_B};
      TermBlock term{Term::pixel, nullptr, s, p, 0, keyframe.t_ns, seen.left_px};
      add_term(term, new LeftPixel(observation, cameras_, point.anchor),
               new ceres::HuberLoss(kPixelHuber / noise_.lasting),
               {keyframe.pose.data(), parameters_.camera.data(), parameters_.lens[0].data(),
                parameters_.camera_time.data(), point.block.data()});
      if (!seen.has_right) continue;
      observation.px = term.at = seen.right_px;
      term.beam = 1;
      add_term(term, new RightPixel(observation, cameras_, point.anchor),
               new ceres::HuberLoss(kPixelHuber / noise_.lasting),
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
    const ReferenceModel model{position.p, onwards(keyframe, at(keyframe.path, position.t_ns)),
                               segment.drive->reference_sigma};
    add_term({Term::reference, nullptr, s, i, 0, position.t_ns}, new ReferenceFactor(model), new ceres::HuberLoss(3.0),
             {keyframe.pose.data(), keyframe.motion.data(), segment.reference.data()});
  }
}

}  // namespace ear::calibration
