// What every estimator does with a sample as it comes: ingest judges it, health and contact see it, and it waits for
// the state to pass it. Used by the filter and by what is compared with it.
#pragma once

#include <optional>

#include "filter/ekf/ekf.h"
#include "filter/health/health_monitor.h"
#include "filter/ingest/ingest.h"
#include "filter/sources/sources.h"

namespace ear {

/// Parts of one estimator.
struct Intake {
  Ingest& ingest;
  HealthMonitor& health;
  Sources& sources;
  Ekf& ekf;
};

/// Inertial samples that do not wait any more. `restart(verdict, t_ns)`: all begins anew; `go_to(t_ns)`: the state
/// moves on before its samples are overwritten; `on_contact(event)`. `max_gap` [s]: FilterConfig::max_imu_gap.
template <typename Restart, typename GoTo, typename OnContact>
void take_imu(const Intake& to, double max_gap, const Restart& restart, const GoTo& go_to,
              const OnContact& on_contact) {
  while (const std::optional<ImuSample> sample = to.ingest.imu_clock().next()) {
    const ImuVerdict verdict = to.ingest.judge(*sample);
    if (!verdict.accepted) {
      to.health.add_refused_imu();
      continue;
    }
    if (verdict.begins_anew) restart(verdict, sample->t_ns);
    to.health.add_imu(*sample, max_gap);
    const std::optional<TimeNs> due_ns = to.ingest.imu_due();
    if (due_ns && to.ekf.running()) go_to(*due_ns);
    const ImuFault fault = to.ingest.store(*sample);
    to.health.report_imu_fault(fault.gyro, fault.accel, sample->t_ns);
    on_contact(to.sources.watch_contact(to.ingest.imu().newest(), to.ekf));
  }
  if (to.ingest.imu_clock().take_correction()) {
    to.health.report_imu_fault(true, true, to.ingest.imu().newest().t_ns);
  }
}

/// A reading of the encoders, after take_imu(). `go_to(t_ns)`: the state passes the oldest reading, for the queue is
/// full.
template <typename GoTo, typename OnContact>
void take_encoder(const Intake& to, const EncoderSample& sample, const GoTo& go_to, const OnContact& on_contact) {
  const Ingest::Encoders taken = to.ingest.take(sample, to.ekf.time());
  if (!to.ingest.imu().empty()) to.health.add_encoder(taken.verdict, to.ingest.imu().newest().t_ns);
  if (taken.verdict != Verdict::accepted || !taken.increment) return;
  on_contact(to.sources.watch_contact(*taken.increment, to.ekf));
  to.sources.standstill().add(*taken.increment);
  if (const auto due_ns = to.ingest.due_before(*taken.increment, to.ekf.running())) go_to(*due_ns);
  to.ingest.push(*taken.increment);
}

/// The same for a reading of the lasers.
template <typename GoTo, typename OnContact>
void take_laser(const Intake& to, const LaserSample& sample, const LaserCalibration& lasers, const GoTo& go_to,
                const OnContact& on_contact) {
  const Verdict verdict = to.ingest.judge(sample, to.ekf.time());
  if (verdict == Verdict::accepted) on_contact(to.sources.watch_contact(sample, to.ekf));
  if (!to.ingest.imu().empty()) {
    const TimeNs newest_ns = to.ingest.imu().newest().t_ns;
    to.health.add_laser(sample, verdict, lasers, to.sources.ground().stuck_beams(), newest_ns);
  }
  if (verdict != Verdict::accepted) return;
  const BeamRanges ranges(sample);
  if (const auto due_ns = to.ingest.due_before(ranges, to.ekf.running())) go_to(*due_ns);
  to.ingest.push(ranges);
}

/// A camera's stamp by the common clock, after take_imu().
inline std::optional<TimeNs> common_stamp(const Intake& to, TimeNs camera_stamp_ns) {
  if (!is_time(camera_stamp_ns)) return camera_stamp_ns;
  const std::optional<TimeNs> stamp = to.ingest.camera_stamp(camera_stamp_ns);
  if (!stamp) to.health.report_camera_fault(to.ingest.imu().newest().t_ns);
  return stamp;
}

}  // namespace ear
