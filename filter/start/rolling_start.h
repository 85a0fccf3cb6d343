// Where a filter may begin on a vehicle that already rolls: attitude, velocity and biases that explain what gyroscope,
// accelerometer and wheels read over the last second or two. docs/filter.md, "Starts".
#pragma once

#include "ear/filter_config.h"
#include "ear/health.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/ingest/ring.h"
#include "filter/ingest/wheel_increment.h"
#include "filter/start/start_fit.h"

namespace ear {

/// A state at the start of the first of `turns`. Least squares over the velocity v and gravity g of that moment, in the
/// body as it then was (B), and the biases:
///   R_Bk u_k = v + g t_k + integral of R f,      u_k: the body's velocity that the wheels measure, along the
///   odometer's x
/// It is a point to linearize at, not an estimate: the samples may be used again. It lacks wheels_contradict if the
/// turns contradict the inertial samples, as they do in the air or on slipping wheels. They must be all that
/// lacking_for_rolling_start() asks for. `stamp_sigma` [s]: of one reading of the wheels, as stated; `shown_noise` [m]:
/// of one turn, as they show it.
[[nodiscard]] StartAttempt rolling_start(const ImuBuffer& imu, const Ring<WheelIncrement>& turns,
                                         const OdometerState& odometer, const StartFit::Vector& prior_sigma,
                                         double stamp_sigma, double shown_noise);

/// What the readings lack for a rolling start: Reason::none if the turns follow each other up to `now_ns` or shortly
/// before, span `min_duration` [s], and the inertial samples reach back to the first.
[[nodiscard]] Reason lacking_for_rolling_start(const ImuBuffer& imu, const Ring<WheelIncrement>& turns, TimeNs now_ns,
                                               double min_duration);

}  // namespace ear
