// What is given away of the state: the estimate, and what the health monitor reads.
#pragma once

#include "ear/estimate.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/records.h"
#include "filter/estimator.h"
#include "filter/health/health_monitor.h"
#include "filter/ingest/ingest.h"
#include "filter/sources/sources.h"
#include "filter/start/map_alignment.h"
#include "filter/start/start.h"

namespace ear {

/// The records of a new frame: counts from zero, the last innovation of each sensor stays.
[[nodiscard]] Records records_for(const FeatureFrame& frame, const Records& before, bool on_ground);

/// `ground_known`: the lasers have seen the state's normal. `scale_sigma`: of all lengths, relative, where nothing
/// measures them; else 0.
[[nodiscard]] Estimate make_estimate(const Ekf& ekf, bool ground_known, const MapAlignment& alignment,
                                     double scale_sigma, const Records& records, const Consistency& consistency);

/// How the body moves from the last image to a frame stamped `t_ns`: Estimator::motion_to.
[[nodiscard]] std::optional<RelativeMotion> motion_since_image(TimeNs t_ns, const Ekf& ekf, const Sources& sources,
                                                               const Start& start, const Ingest& ingest);

/// What the health monitor reads after a frame at `t_ns` (IMU time); `estimate`: if there is a state.
[[nodiscard]] HealthMonitor::Frame health_frame(TimeNs t_ns, const Ekf& ekf, const Sources& sources,
                                                const FrameAgreement& agreement, const Records& records,
                                                const std::optional<Estimate>& estimate);

}  // namespace ear
