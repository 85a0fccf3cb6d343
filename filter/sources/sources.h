// All that updates the filter: wheels, ground, cameras and standstill, each at its own time. docs/filter.md.
#pragma once

#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/advice.h"
#include "filter/ekf/displacement.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/records.h"
#include "filter/ingest/ingest.h"
#include "filter/sources/cameras/cameras.h"
#include "filter/sources/ground/ground.h"
#include "filter/sources/imu_score.h"
#include "filter/sources/standstill/standstill.h"
#include "filter/sources/wheels/wheels.h"

namespace ear {

class Sources {
 public:
  Sources(const FilterConfig& config, const Calibration& calibration);

  /// Every sample, in time order: do the wheels leave the ground, or meet it? A take-off is noticed some centimetres
  /// above the ground, and until then the wheels held the vehicle there.
  template <typename Sample>
  ContactEvent watch_contact(const Sample& sample, Ekf& ekf) {
    const ContactEvent event = wheels_ ? ground_.add(sample) : ContactEvent::none;
    if (event == ContactEvent::takeoff && ekf.running()) inflate_after_takeoff(ekf);
    return event;
  }

  /// Every increment, in time order: do the wheels rest, and how noisy are their readings?
  void watch_wheels(const WheelIncrement& increment) {
    standstill_.add(increment);
    if (rolls_at(increment.from_ns)) wheels_->watch(increment);
  }

  /// Does the image repeat the one before, of a vehicle that moves? It shows nothing of now then, and is none: so a
  /// driver makes a faster camera of a slow one. One that is stuck the health notices by its silence.
  [[nodiscard]] bool shows_nothing(const FeatureFrame& frame, const Ekf& ekf) const {
    return frame.repeated && ekf.running() && !standstill_.stands();
  }
  /// A frame at `t_ns` (IMU time), before anything is done with it: how exact it is, and whether the vehicle stands.
  void look_at(const FeatureFrame& frame, TimeNs t_ns, const Ingest& ingest, Ekf& ekf);
  /// p^I, p^o and p^c of (13), from the state to `t_ns`, each by one sensor alone. `ground_known`: the state's normal
  /// is one that the lasers have seen.
  [[nodiscard]] Displacements displacements(const FeatureFrame& frame, TimeNs t_ns, const Ingest& ingest,
                                            const Ekf& ekf, bool ground_known);
  /// After it: how noisy the inertial sensors are by what the images show of the same motion. What noise and the
  /// state's own variances do not explain.
  ImuExcess score_imu(const FeatureFrame& frame, const Ekf& ekf, Records& records);
  /// Propagates to `t_ns`, with wheels (5)-(8) and lasers (2)-(4) in between: each at its own time, or, if the state
  /// has passed that already, where the state was then.
  void advance(TimeNs t_ns, const Advice& advice, Ingest& ingest, Ekf& ekf, Records& records);
  /// The same without wheels and lasers.
  void propagate(TimeNs t_ns, const Advice& advice, Ingest& ingest, Ekf& ekf) const;
  /// With the state, if there is one, at the frame's time: does the frame show the motion that the others predict?
  [[nodiscard]] FrameAgreement check(const FeatureFrame& frame, Ingest& ingest, Ekf& ekf);
  /// At a frame's time, with its features or without. `stands`: the vehicle does, and is held where it is.
  void update(const FeatureFrame* image, bool stands, const Advice& advice, Ekf& ekf, Records& records);

  /// The state begins anew. What was seen of contact and standing stays.
  void reset();

  [[nodiscard]] bool uses_wheels() const { return wheels_.has_value(); }
  [[nodiscard]] bool on_ground() const { return wheels_ && ground_.carries(); }
  [[nodiscard]] const std::optional<Wheels>& wheels() const { return wheels_; }
  [[nodiscard]] Ground& ground() { return ground_; }
  [[nodiscard]] const Ground& ground() const { return ground_; }
  [[nodiscard]] Cameras& cameras() { return cameras_; }
  [[nodiscard]] const Cameras& cameras() const { return cameras_; }
  [[nodiscard]] Standstill& standstill() { return standstill_; }
  [[nodiscard]] ImuScore& imu_score() { return imu_score_; }

 private:
  void inflate_after_takeoff(Ekf& ekf) const;
  /// Do wheels carry the vehicle, and for long enough that readings count?
  [[nodiscard]] bool rolls_at(TimeNs t_ns) const { return wheels_ && ground_.rolls_at(t_ns); }
  [[nodiscard]] ImuNoiseFactors imu_noise(const Advice& advice) const;
  void hold(Ekf& ekf, Records& records);

  ImuCalibration imu_;
  double normal_walk_ = 0.0;  ///< [rad/sqrt(m)]; 0 without wheels
  ImuScore imu_score_;
  ImuMotion motion_;  ///< from the state to the frame at hand
  std::optional<Wheels> wheels_;
  Ground ground_;
  Cameras cameras_;
  Standstill standstill_;
  bool clone_is_here_ = false;  ///< the newest clone was made where the vehicle stands
  /// Standing and bridges show nothing of the cameras' calibration, images that are sound do.
  CameraUpdate camera_update_ = CameraUpdate::considered;
};

}  // namespace ear
