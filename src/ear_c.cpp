// The C interface: converts the plain structs, and turns every exception into a result.
#include "ear/ear_c.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>

#include "src/health_text.h"
#include "src/queued_odometry.h"

struct ear_odometry {  // NOLINT(readability-identifier-naming): named by the C header
  ear::QueuedOdometry queued;
};

namespace {

static_assert(EAR_MAX_BEAMS == ear::QueuedOdometry::kMaxBeams);

/// Nothing is thrown across the interface; `message` gets the reason.
template <typename Function>
ear_result guarded(const Function& function, char* message = nullptr, std::size_t message_size = 0) noexcept {
  const auto fail = [&](ear_result result, const char* reason) {
    if (message != nullptr && message_size > 0) {
      const std::size_t length = std::min(std::strlen(reason), message_size - 1);
      std::copy_n(reason, length, message);
      message[length] = '\0';
    }
    return result;
  };
  try {
    return function();
  } catch (const std::invalid_argument& error) {
    return fail(EAR_INVALID_ARGUMENT, error.what());
  } catch (const std::bad_alloc&) {
    return fail(EAR_OUT_OF_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return fail(EAR_INTERNAL_ERROR, error.what());
  } catch (...) {
    return fail(EAR_INTERNAL_ERROR, "unknown error");
  }
}

// NOLINTBEGIN(modernize-avoid-c-arrays): they are those of the C interface
Eigen::Vector3d vector_of(const double (&values)[3]) { return Eigen::Vector3d::Map(values); }

Eigen::Isometry3d isometry_of(const double (&rows)[16]) {
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(rows);
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = matrix.topLeftCorner<3, 3>();
  result.translation() = matrix.topRightCorner<3, 1>();
  return result;
}

void write_isometry(const Eigen::Isometry3d& T, double (&rows)[16]) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{rows} = T.matrix();
}
// NOLINTEND(modernize-avoid-c-arrays)

/// The value of an enumeration, which in C can hold anything: it is read as the number that it is there.
template <typename E, typename Given>
E choice(const Given& given, int count, const char* field) {
  static_assert(sizeof(Given) == sizeof(int));
  int value = 0;
  std::memcpy(&value, &given, sizeof(value));
  if (value < 0 || value >= count) throw std::invalid_argument(std::string(field) + ": no such choice");
  return static_cast<E>(value);
}

void require_count(int value, int maximum, const char* field) {
  if (value >= 0 && value <= maximum) return;
  throw std::invalid_argument(std::string(field) + ": 0 to " + std::to_string(maximum));
}

/// 0 is not known.
std::optional<double> sigma_of(double from) { return from == 0.0 ? std::nullopt : std::optional(from); }

std::optional<ear::PoseSigma> pose_sigma_of(double rotation, double position) {
  if (rotation == 0.0 && position == 0.0) return std::nullopt;
  return ear::PoseSigma{rotation, position};
}

ear::CameraCalibration camera_of(const ear_camera& from) {
  ear::CameraCalibration camera;
  camera.T_BC = isometry_of(from.T_BC);
  camera.width = from.width;
  camera.height = from.height;
  camera.fu = from.fu;
  camera.fv = from.fv;
  camera.cu = from.cu;
  camera.cv = from.cv;
  camera.lens = choice<ear::LensModel>(from.lens, 2, "lens");
  std::copy_n(from.distortion, camera.distortion.size(), camera.distortion.begin());
  camera.rate_hz = from.rate_hz;
  camera.pose_sigma = pose_sigma_of(from.rotation_sigma, from.position_sigma);
  if (from.focal_length_sigma != 0.0 || from.principal_point_sigma != 0.0) {
    camera.intrinsics_sigma = ear::IntrinsicsSigma{from.focal_length_sigma, from.principal_point_sigma};
  }
  return camera;
}

ear::EncoderCalibration encoder_of(const ear_calibration& from) {
  ear::EncoderCalibration encoder;
  encoder.T_BO = isometry_of(from.T_BO);
  encoder.rate_hz = from.encoder_rate_hz;
  encoder.resolution = from.counts_per_turn;
  encoder.wraps = from.counts_wrap != 0;
  encoder.wheel_radius = {from.wheel_radius[0], from.wheel_radius[1]};
  encoder.track_width = from.track_width;
  encoder.noise_counts = from.encoder_noise_counts;
  encoder.stamp_sigma = from.encoder_stamp_sigma;
  encoder.time_offset = from.encoder_time_offset;
  encoder.T_BO_sigma = pose_sigma_of(from.odometer_rotation_sigma, from.odometer_position_sigma);
  encoder.wheel_radius_sigma = sigma_of(from.wheel_radius_sigma);
  encoder.wheel_radius_difference_sigma = sigma_of(from.wheel_radius_difference_sigma);
  encoder.track_width_sigma = sigma_of(from.track_width_sigma);
  encoder.time_offset_sigma = sigma_of(from.encoder_time_offset_sigma);
  return encoder;
}

ear::LaserCalibration lasers_of(const ear_calibration& from) {
  ear::LaserCalibration lasers;
  for (int i = 0; i < from.beam_count; ++i) {
    lasers.beams.push_back({"beam" + std::to_string(i), vector_of(from.beams[i].p_BL), vector_of(from.beams[i].d_B)});
  }
  lasers.rate_hz = from.laser_rate_hz;
  lasers.range_min = from.range_min;
  lasers.range_max = from.range_max;
  lasers.noise = from.laser_noise;
  lasers.time_offset = from.laser_time_offset;
  lasers.offset_sigma = sigma_of(from.beam_offset_sigma);
  return lasers;
}

ear::Calibration calibration_of(const ear_calibration& from) {
  require_count(from.camera_count, EAR_MAX_CAMERAS, "camera_count");
  require_count(from.beam_count, EAR_MAX_BEAMS, "beam_count");
  ear::Calibration calibration;
  for (int i = 0; i < from.camera_count; ++i) calibration.cameras.push_back(camera_of(from.cameras[i]));
  calibration.camera_time_offset = from.camera_time_offset;
  calibration.imu = {from.imu_rate_hz,
                     from.gyro_noise,
                     from.gyro_random_walk,
                     from.accel_noise,
                     from.accel_random_walk,
                     sigma_of(from.gyro_bias_sigma),
                     sigma_of(from.accel_bias_sigma),
                     sigma_of(from.gyro_scale_sigma),
                     sigma_of(from.accel_scale_sigma)};
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> M(from.gyro_matrix);
  if (!M.isZero(0.0)) calibration.imu.gyro_matrix = M;
  calibration.camera_time_offset_sigma = sigma_of(from.camera_time_offset_sigma);
  if (from.has_encoder != 0) calibration.encoder = encoder_of(from);
  if (from.beam_count > 0) calibration.lasers = lasers_of(from);
  return calibration;
}

ear::Config config_of(const ear_settings& from) {
  ear::Config config;
  config.frontend.max_features = from.max_features;
  config.filter.window = from.window;
  config.filter.max_track_updates = from.max_track_updates;
  config.filter.odometer.model = choice<ear::OdometerModel>(from.odometer, 4, "odometer");
  config.filter.impact.accel_range = from.accel_range;
  config.filter.impact.gyro_range = from.gyro_range;
  config.performance.budget_ms = from.budget_ms;
  return config;
}

ear::QueueCapacity capacity_of(const ear_settings& from) {
  return {from.queue_seconds, static_cast<std::size_t>(std::max(from.frame_slots, 0))};
}

void write_state(const ear::NavState& from, ear_state& to) {
  to.t_ns = from.t_ns;
  to.q_WB[0] = from.q_WB.w();
  to.q_WB[1] = from.q_WB.x();
  to.q_WB[2] = from.q_WB.y();
  to.q_WB[3] = from.q_WB.z();
  Eigen::Vector3d::Map(to.p_WB) = from.p_WB;
  Eigen::Vector3d::Map(to.v_W) = from.v_W;
  Eigen::Vector3d::Map(to.b_g) = from.b_g;
  Eigen::Vector3d::Map(to.b_a) = from.b_a;
}

void write_estimate(const ear::Estimate& from, ear_estimate& to) {
  write_state(from.state, to.state);
  for (int row = 0; row < ear::estimate_error::size; ++row) {
    for (int column = 0; column < ear::estimate_error::size; ++column) {
      to.covariance[row][column] = from.covariance(row, column);
    }
  }
  to.terrain_known = from.terrain.known ? 1 : 0;
  to.slope_along = from.terrain.slope_along;
  to.slope_across = from.terrain.slope_across;
  to.sigma_along = from.terrain.sigma_along;
  to.sigma_across = from.terrain.sigma_across;
  to.tracks = from.frame.tracks;
  to.features_used = from.frame.features_used;
  to.standing = from.frame.standing ? 1 : 0;
  to.on_ground = from.frame.on_ground ? 1 : 0;
}

static_assert(EAR_SOURCE_COUNT == ear::kSourceCount);
static_assert(EAR_SOURCE_ACCELEROMETER == static_cast<int>(ear::Source::accelerometer));
static_assert(EAR_AIDING_CAMERAS_AND_WHEELS == static_cast<int>(ear::Aiding::cameras_and_wheels));
static_assert(EAR_HEALTH_LOST == static_cast<int>(ear::HealthStatus::lost));

void write_health(const ear::Health& from, ear_health& to) {
  to = {};
  to.status = static_cast<ear_health_status>(from.status);
  to.reason = static_cast<ear_reason>(from.reason);
  to.since_ns = from.since_ns;
  to.faulty = static_cast<std::uint32_t>(from.faulty.to_ulong());
  std::copy(from.onset_ns.begin(), from.onset_ns.end(), to.onset_ns);
  to.aiding = static_cast<ear_aiding>(from.aiding);
  to.quality = from.quality;
  to.horizontal_sigma = from.horizontal_sigma;
  to.vertical_sigma = from.vertical_sigma;
  to.reset_counter = from.reset_counter;
  to.load_step = from.load_step;
  to.imprecise = from.imprecise ? 1 : 0;
  to.misaligned = from.misaligned ? 1 : 0;
  for (std::size_t i = 0; i < ear::kSourceCount; ++i) to.score[i] = from.sources[i].score;
}

ear::GivenStart start_of(const ear_start& from) {
  ear::GivenStart start;
  start.state.t_ns = from.state.t_ns;
  start.state.q_WB = Eigen::Quaterniond(from.state.q_WB[0], from.state.q_WB[1], from.state.q_WB[2], from.state.q_WB[3]);
  start.state.p_WB = vector_of(from.state.p_WB);
  start.state.v_W = vector_of(from.state.v_W);
  start.state.b_g = vector_of(from.state.b_g);
  start.state.b_a = vector_of(from.state.b_a);
  start.tilt_sigma = from.tilt_sigma;
  start.yaw_sigma = from.yaw_sigma;
  start.position_sigma = from.position_sigma;
  start.velocity_sigma = from.velocity_sigma;
  start.gyro_bias_sigma = sigma_of(from.gyro_bias_sigma);
  start.accel_bias_sigma = sigma_of(from.accel_bias_sigma);
  return start;
}

ear_result result_of(bool queued) { return queued ? EAR_OK : EAR_QUEUE_FULL; }

ear::ImageView view_of(const std::uint8_t* data, const ear::CameraCalibration& camera, std::ptrdiff_t stride) {
  return {data, camera.width, camera.height, stride};
}

}  // namespace

extern "C" {

const char* ear_result_text(ear_result result) {
  switch (result) {
    case EAR_OK:
      return "success";
    case EAR_NOTHING:
      return "no frame is complete yet";
    case EAR_NO_ESTIMATE:
      return "there is no estimate";
    case EAR_QUEUE_FULL:
      return "the queue is full";
    case EAR_INVALID_ARGUMENT:
      return "invalid argument";
    case EAR_OUT_OF_MEMORY:
      return "out of memory";
    case EAR_INTERNAL_ERROR:
      return "internal error";
  }
  return "unknown result";
}

void ear_default_calibration(ear_calibration* calibration) {
  if (calibration == nullptr) return;
  *calibration = {};
  for (ear_camera& camera : calibration->cameras) write_isometry(Eigen::Isometry3d::Identity(), camera.T_BC);
  const ear::ImuCalibration imu;
  calibration->imu_rate_hz = imu.rate_hz;
  calibration->gyro_noise = imu.gyro_noise;
  calibration->gyro_random_walk = imu.gyro_random_walk;
  calibration->accel_noise = imu.accel_noise;
  calibration->accel_random_walk = imu.accel_random_walk;
  const ear::EncoderCalibration encoder;
  write_isometry(encoder.T_BO, calibration->T_BO);
  calibration->encoder_rate_hz = encoder.rate_hz;
  calibration->counts_per_turn = encoder.resolution;
  calibration->counts_wrap = encoder.wraps ? 1 : 0;
  std::copy_n(encoder.wheel_radius.begin(), 2, calibration->wheel_radius);
  calibration->track_width = encoder.track_width;
  calibration->encoder_noise_counts = encoder.noise_counts;
  for (ear_beam& beam : calibration->beams) Eigen::Vector3d::Map(beam.d_B) = ear::LaserBeam{}.d_B;
  const ear::LaserCalibration lasers;
  calibration->laser_rate_hz = lasers.rate_hz;
  calibration->range_min = lasers.range_min;
  calibration->range_max = lasers.range_max;
  calibration->laser_noise = lasers.noise;
}

void ear_default_settings(ear_settings* settings) {
  if (settings == nullptr) return;
  const ear::Config config;
  const ear::QueueCapacity capacity;
  *settings = {};
  settings->max_features = config.frontend.max_features;
  settings->window = config.filter.window;
  settings->max_track_updates = config.filter.max_track_updates;
  settings->odometer = static_cast<ear_odometer_model>(config.filter.odometer.model);
  settings->accel_range = config.filter.impact.accel_range;
  settings->gyro_range = config.filter.impact.gyro_range;
  settings->budget_ms = config.performance.budget_ms;
  settings->queue_seconds = capacity.seconds;
  settings->frame_slots = static_cast<std::int32_t>(capacity.frame_slots);
}

ear_result ear_create(const ear_calibration* calibration, const ear_settings* settings, ear_odometry** odometry,
                      char* message, size_t message_size) {
  if (odometry != nullptr) *odometry = nullptr;
  const auto create = [&] {
    if (calibration == nullptr || odometry == nullptr) throw std::invalid_argument("a pointer is null");
    ear_settings used;
    ear_default_settings(&used);
    if (settings != nullptr) used = *settings;
    *odometry = new ear_odometry{{config_of(used), calibration_of(*calibration), capacity_of(used)}};
    return EAR_OK;
  };
  return guarded(create, message, message_size);
}

void ear_destroy(ear_odometry* odometry) { delete odometry; }

ear_result ear_add_imu(ear_odometry* odometry, const ear_imu_sample* sample) {
  if (odometry == nullptr || sample == nullptr) return EAR_INVALID_ARGUMENT;
  return result_of(odometry->queued.add_imu({sample->t_ns, vector_of(sample->gyro_B), vector_of(sample->accel_B)}));
}

ear_result ear_add_encoder(ear_odometry* odometry, const ear_encoder_sample* sample) {
  if (odometry == nullptr || sample == nullptr) return EAR_INVALID_ARGUMENT;
  return result_of(odometry->queued.add_encoder({sample->t_ns, sample->left_count, sample->right_count}));
}

ear_result ear_add_laser(ear_odometry* odometry, const ear_laser_sample* sample) {
  if (odometry == nullptr || sample == nullptr) return EAR_INVALID_ARGUMENT;
  ear::QueuedOdometry::Ranges ranges;
  ranges.t_ns = sample->t_ns;
  std::copy_n(sample->range, EAR_MAX_BEAMS, ranges.range.begin());
  return result_of(odometry->queued.add_laser(ranges));
}

ear_result ear_add_stereo(ear_odometry* odometry, const ear_stereo_frame* frame) {
  if (odometry == nullptr || frame == nullptr || frame->left == nullptr) return EAR_INVALID_ARGUMENT;
  const std::vector<ear::CameraCalibration>& cameras = odometry->queued.cameras();
  if (cameras.empty() || std::abs(frame->stride) < cameras.front().width) return EAR_INVALID_ARGUMENT;
  ear::StereoFrame view;
  view.t_ns = frame->t_ns;
  view.left = view_of(frame->left, cameras.front(), frame->stride);
  if (cameras.size() > 1 && frame->right != nullptr) view.right = view_of(frame->right, cameras[1], frame->stride);
  return result_of(odometry->queued.add_stereo(view));
}

void ear_default_start(ear_start* start) {
  if (start == nullptr) return;
  const ear::GivenStart defaults;
  *start = {};
  write_state(defaults.state, start->state);
  start->tilt_sigma = defaults.tilt_sigma;
  start->velocity_sigma = defaults.velocity_sigma;
}

ear_result ear_start_at(ear_odometry* odometry, const ear_start* start, char* message, size_t message_size) {
  const auto give = [&] {
    if (odometry == nullptr || start == nullptr) throw std::invalid_argument("a pointer is null");
    odometry->queued.start_at(start_of(*start));
    return EAR_OK;
  };
  return guarded(give, message, message_size);
}

ear_result ear_process(ear_odometry* odometry, ear_estimate* estimate) {
  return guarded([&] {
    if (odometry == nullptr || estimate == nullptr) return EAR_INVALID_ARGUMENT;
    std::optional<ear::Estimate> answer;
    switch (odometry->queued.process(answer)) {
      case ear::Progress::no_frame:
        return EAR_NOTHING;
      case ear::Progress::taken:
        return EAR_NO_ESTIMATE;
      case ear::Progress::estimated:
        break;
    }
    write_estimate(*answer, *estimate);
    return EAR_OK;
  });
}

ear_result ear_step(ear_odometry* odometry, int64_t t_ns, ear_estimate* estimate) {
  return guarded([&] {
    if (odometry == nullptr || estimate == nullptr) return EAR_INVALID_ARGUMENT;
    const std::optional<ear::Estimate> answer = odometry->queued.step(t_ns);
    if (!answer) return EAR_NO_ESTIMATE;
    write_estimate(*answer, *estimate);
    return EAR_OK;
  });
}

ear_result ear_predict(const ear_odometry* odometry, int64_t t_ns, ear_state* state) {
  return guarded([&] {
    if (odometry == nullptr || state == nullptr) return EAR_INVALID_ARGUMENT;
    const std::optional<ear::NavState> answer = odometry->queued.odometry().predict(t_ns);
    if (!answer) return EAR_NO_ESTIMATE;
    write_state(*answer, *state);
    return EAR_OK;
  });
}

ear_result ear_live_state(const ear_odometry* odometry, ear_state* state) {
  return guarded([&] {
    if (odometry == nullptr || state == nullptr) return EAR_INVALID_ARGUMENT;
    const std::optional<ear::NavState> answer = odometry->queued.live();
    if (!answer) return EAR_NO_ESTIMATE;
    write_state(*answer, *state);
    return EAR_OK;
  });
}

ear_status ear_status_of(const ear_odometry* odometry) {
  if (odometry == nullptr) return EAR_WAITING_FOR_IMU;
  switch (odometry->queued.odometry().status()) {
    case ear::Status::waiting_for_imu:
      return EAR_WAITING_FOR_IMU;
    case ear::Status::waiting_for_standstill:
      return EAR_WAITING_FOR_STANDSTILL;
    case ear::Status::tracking:
      return EAR_TRACKING;
    case ear::Status::lost:
      return EAR_LOST;
  }
  return EAR_WAITING_FOR_IMU;
}

ear_result ear_health_of(const ear_odometry* odometry, ear_health* health) {
  return guarded([&] {
    if (odometry == nullptr || health == nullptr) return EAR_INVALID_ARGUMENT;
    write_health(odometry->queued.odometry().health(), *health);
    return EAR_OK;
  });
}

const char* ear_reason_text(ear_reason reason) {
  return reason < 0 || reason > static_cast<ear_reason>(ear::Reason::proving)
             ? "unknown reason"
             : ear::to_text(static_cast<ear::Reason>(reason));
}

const char* ear_source_text(ear_source source) {
  const auto i = static_cast<std::size_t>(source);
  return i < ear::kSourceCount ? ear::kSourceNames[i] : "unknown source";
}

ear_result ear_counts_of(const ear_odometry* odometry, ear_counts* counts) {
  return guarded([&] {
    if (odometry == nullptr || counts == nullptr) return EAR_INVALID_ARGUMENT;
    const ear::Overflows overflows = odometry->queued.overflows();
    const ear::InputCounts inputs = odometry->queued.odometry().input_counts();
    *counts = {};
    counts->imu_overflow = overflows.imu;
    counts->encoder_overflow = overflows.encoder;
    counts->laser_overflow = overflows.laser;
    counts->frame_overflow = overflows.frames;
    counts->imu_rejected = inputs.imu.rejected();
    counts->encoder_rejected = inputs.encoder.rejected();
    counts->laser_rejected = inputs.laser.rejected();
    counts->imu_spikes = inputs.imu_spikes;
    counts->imu_gaps = inputs.imu.gaps;
    counts->clock_jumps = inputs.clock_jumps;
    counts->frames_rejected = inputs.camera.rejected() - inputs.camera.far_ahead;
    counts->frames_without_imu = inputs.camera.far_ahead;
    return EAR_OK;
  });
}

ear_result ear_reset(ear_odometry* odometry) {
  return guarded([&] {
    if (odometry == nullptr) return EAR_INVALID_ARGUMENT;
    odometry->queued.reset();
    return EAR_OK;
  });
}

}  // extern "C"
