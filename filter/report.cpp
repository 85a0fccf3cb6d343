#include "filter/report.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/propagation.h"
#include "filter/sources/ground/ground_rows.h"

namespace ear {

Records records_for(const FeatureFrame& frame, const Records& before, bool on_ground) {
  Records records = before;
  records.log.start_frame();
  if (records.outcomes != nullptr) records.outcomes->clear();
  records.statistics = FrameStatistics{};
  records.statistics.tracks = static_cast<int>(frame.features.size());
  records.statistics.stereo = static_cast<int>(std::count_if(frame.features.begin(), frame.features.end(),
                                                             [](const FeatureObservation& f) { return f.has_right; }));
  records.statistics.on_ground = on_ground;
  return records;
}

Estimate make_estimate(const Ekf& ekf, bool ground_known, const MapAlignment& alignment, double scale_sigma,
                       const Records& records, const Consistency& consistency) {
  const State& x = ekf.state();
  Estimate estimate;
  const NavState here = nav_state(x.imu);
  estimate.state = alignment.to_world(here);
  estimate.covariance = alignment.to_world(ekf.ordinary_covariance(scale_sigma), here);
  estimate.frame = records.statistics;
  estimate.consistency = consistency;
  if (ground_known) {
    const Slope seen = slope(x.imu.R_WB * x.odometer.T_BO.R.col(1), x.ground.n_W);  // (4)
    const std::array<int, 5> entries = {err::theta, err::theta + 1, err::theta + 2, err::normal, err::normal + 1};
    const Eigen::Matrix<double, 5, 5> P = ekf.covariance().matrix()(entries, entries);
    const Eigen::Matrix2d P_slope = seen.J * P * seen.J.transpose();
    estimate.terrain = {true, seen.along, seen.across, std::sqrt(P_slope(0, 0)), std::sqrt(P_slope(1, 1))};
  }
  return estimate;
}

std::optional<RelativeMotion> motion_since_image(TimeNs t_ns, const Ekf& ekf, const Sources& sources,
                                                 const Start& start, const Ingest& ingest) {
  const std::optional<LastImage>& last = sources.cameras().last_image();
  if (!is_time(t_ns) || !last || ingest.imu().empty() || t_ns <= last->t_ns) return std::nullopt;
  const CameraState& camera = ekf.state().camera;
  const TimeNs to_ns = imu_time(t_ns, camera);
  if (ekf.running()) {
    return motion_between(sources.cameras().image_pose(ekf.state()),
                          nav_state(integrate_to(to_ns, ekf.state().imu, ingest.imu())));
  }
  RelativeMotion motion;
  if (const std::optional<Eigen::Vector3d> path = start.path_to(to_ns)) {
    motion.p_B0B1 = *path;
    motion.translation_known = true;
  }
  const TimeNs from_ns = imu_time(last->t_ns, camera);
  motion.R_B1B0 = gyro_rotation(from_ns, to_ns, Eigen::Vector3d::Zero(), ingest.imu()).transpose();
  return motion;
}

HealthMonitor::Frame health_frame(TimeNs t_ns, const Ekf& ekf, const Sources& sources, const FrameAgreement& agreement,
                                  const Records& records, const std::optional<Estimate>& estimate) {
  HealthMonitor::Frame frame;
  frame.t_ns = t_ns;
  frame.running = ekf.running();
  frame.agreement = agreement;
  frame.statistics = records.statistics;
  frame.lifted = sources.wheels() && sources.wheels()->lifting(t_ns);
  if (frame.running) frame.possible = ekf.possible();
  if (frame.possible && estimate) {
    const auto variance = estimate->covariance.diagonal().cwiseMax(0.0);
    frame.speed = ekf.state().imu.v_W.norm();
    // As the vehicle sees it, without that of the heading.
    frame.velocity_sigma = std::sqrt(ekf.covariance().matrix().diagonal().segment<3>(err::nu).cwiseMax(0.0).maxCoeff());
    frame.horizontal_sigma = std::sqrt(variance.segment<2>(estimate_error::position).maxCoeff());
    frame.vertical_sigma = std::sqrt(variance(estimate_error::position + 2));
  }
  return frame;
}

}  // namespace ear
