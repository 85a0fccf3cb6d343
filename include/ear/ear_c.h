/* The estimator for programs in C, and for all that can call C. docs/embedding.md explains it with an example.
 *
 * Threads: each sensor has one thread that adds its samples; the functions for that only copy into a bounded queue:
 * they neither wait, nor allocate, nor lock. One more thread, the consumer, calls everything else. A sensor's thread
 * may also be the consumer's. Capacity is fixed by ear_create().
 *
 * Frames: world W, z up, origin and yaw at the first pose; body B, the IMU; camera C, x right, y down, z forward;
 * odometer O, the middle of the axle, x forward, z up. T_AB takes coordinates from B to A. Times are integer
 * nanoseconds of one clock; all else is SI unless its comment says otherwise. */
#ifndef EAR_EAR_C_H
#define EAR_EAR_C_H

/* NOLINTBEGIN: this is C; the lints are those of C++ */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define EAR_MAX_CAMERAS 2
#define EAR_MAX_BEAMS 3

typedef struct ear_odometry ear_odometry; /* the estimator with its queues */

typedef enum {
  EAR_OK = 0,
  EAR_NOTHING = 1,           /* no frame is complete yet: not a failure */
  EAR_NO_ESTIMATE = 2,       /* a frame was taken, but there is no estimate: see ear_status_of() */
  EAR_QUEUE_FULL = -1,       /* the consumer is behind; the sample was refused and counted */
  EAR_INVALID_ARGUMENT = -2, /* null, or a value that cannot be used */
  EAR_OUT_OF_MEMORY = -3,
  EAR_INTERNAL_ERROR = -4
} ear_result;

/* What a result means, in English. */
const char* ear_result_text(ear_result result);

/* -- the vehicle -- */

typedef enum { EAR_LENS_RADIAL_TANGENTIAL = 0, EAR_LENS_EQUIDISTANT = 1 } ear_lens;

typedef struct {
  double T_BC[16];       /* row by row, as T_BS in sensor.yaml */
  int32_t width, height; /* [px] */
  double fu, fv, cu, cv; /* [px]; the centre of the first pixel is (0, 0) */
  ear_lens lens;
  double distortion[5]; /* OpenCV's order: k1 k2 p1 p2 k3, or k1 k2 k3 k4 0 */
  double rate_hz;
  double rotation_sigma, position_sigma; /* [rad, m] of T_BC; of the right camera in the left one; 0: not known */
  double focal_length_sigma, principal_point_sigma; /* [px] of fu, of cu and cv; 0: not known */
} ear_camera;

typedef struct {
  double p_BL[3]; /* where the beam starts [m] */
  double d_B[3];  /* its unit direction */
} ear_beam;

/* Standard deviations, named ..._sigma: those that are 0 are not known, and the defaults of ear/filter_config.h hold.
 */
typedef struct {
  int32_t camera_count; /* 0, 1, or 2 (left, right) */
  ear_camera cameras[EAR_MAX_CAMERAS];
  double camera_time_offset; /* [s] add it to a camera stamp to get IMU time */

  double imu_rate_hz;
  double gyro_noise;        /* [rad/s/sqrt(Hz)] */
  double gyro_random_walk;  /* [rad/s^2/sqrt(Hz)] */
  double accel_noise;       /* [m/s^2/sqrt(Hz)] */
  double accel_random_walk; /* [m/s^3/sqrt(Hz)] */

  int32_t has_encoder;
  double T_BO[16]; /* row by row */
  double encoder_rate_hz;
  int64_t counts_per_turn;
  int32_t counts_wrap;         /* counts are an angle modulo counts_per_turn, else cumulative */
  double wheel_radius[2];      /* left, right [m] */
  double track_width;          /* [m] */
  double encoder_noise_counts; /* of one reading, 1-sigma [count] */
  double encoder_stamp_sigma;  /* of the stamp of one reading [s]; 0: exact */
  double encoder_time_offset;  /* [s] add it to a stamp of the encoders to get IMU time */

  int32_t beam_count; /* 0: no lasers */
  ear_beam beams[EAR_MAX_BEAMS];
  double laser_rate_hz;
  double range_min, range_max; /* [m] */
  double laser_noise;          /* 1-sigma [m] */
  double laser_time_offset;    /* [s] add it to a stamp of the lasers to get IMU time */

  double camera_time_offset_sigma;                         /* [s] */
  double gyro_bias_sigma, accel_bias_sigma;                /* [rad/s, m/s^2] */
  double gyro_scale_sigma;                                 /* relative; also of one axis in turns about another */
  double accel_scale_sigma;                                /* relative; also of one axis in forces along another */
  double gyro_matrix[9];                                   /* row by row: rate = M measured; all 0: the identity */
  double odometer_rotation_sigma, odometer_position_sigma; /* [rad, m] of T_BO */
  double wheel_radius_sigma;                               /* of the mean of both radii [m] */
  double wheel_radius_difference_sigma;                    /* of left less right [m] */
  double track_width_sigma;                                /* [m] */
  double encoder_time_offset_sigma;                        /* [s] */
  double beam_offset_sigma;                                /* of what each beam reads too much [m] */
} ear_calibration;

/* No camera, no wheels, no lasers; noise and rates as in ear/calibration.h. */
void ear_default_calibration(ear_calibration* calibration);

/* -- settings; those that are not here keep the defaults of ear/config.h -- */

typedef enum {
  EAR_ODOMETER_NONE = 0,
  EAR_ODOMETER_DIFFERENTIAL = 1,
  EAR_ODOMETER_GYRO = 2,
  EAR_ODOMETER_TERRAIN = 3
} ear_odometer_model;

typedef struct {
  int32_t max_features;      /* tracks kept at a time */
  int32_t window;            /* clones kept */
  int32_t max_track_updates; /* features used per frame */
  ear_odometer_model odometer;
  double accel_range;   /* [m/s^2] largest value of an axis; 0: not known */
  double gyro_range;    /* [rad/s] */
  double queue_seconds; /* [s] of samples that each queue holds, at the rates of the calibration */
  int32_t frame_slots;  /* frames that wait for the consumer; their images are kept in memory */
  double budget_ms;     /* that a frame may cost in the mean before work is left out; 0: as much as it takes */
} ear_settings;

void ear_default_settings(ear_settings* settings);

/* -- construction, by any thread -- */

/* Makes an estimator in *odometry. Null settings are the defaults. On failure *odometry is null, and the reason, naming
 * the field, is in message, unless that is null; it is cut to message_size bytes, the final zero included. */
ear_result ear_create(const ear_calibration* calibration, const ear_settings* settings, ear_odometry** odometry,
                      char* message, size_t message_size);

/* No other thread may use it any more. Null is allowed. */
void ear_destroy(ear_odometry* odometry);

/* -- samples: one thread per sensor, each sensor's in the order of time -- */

typedef struct {
  int64_t t_ns;
  double gyro_B[3];  /* [rad/s] */
  double accel_B[3]; /* specific force [m/s^2] */
} ear_imu_sample;

typedef struct {
  int64_t t_ns;
  int64_t left_count, right_count; /* angle of the wheel relative to the body, growing as it rolls forward */
} ear_encoder_sample;

typedef struct {
  int64_t t_ns;
  double range[EAR_MAX_BEAMS]; /* in the order of the beams [m]; NaN without return */
} ear_laser_sample;

/* Views of 8-bit grey images of the calibrated size; they are copied before the call returns. */
typedef struct {
  int64_t t_ns;         /* the middle of the exposure */
  const uint8_t* left;  /* never null */
  const uint8_t* right; /* null without a second camera */
  ptrdiff_t stride;     /* bytes from one row to the next, in both images */
} ear_stereo_frame;

ear_result ear_add_imu(ear_odometry* odometry, const ear_imu_sample* sample);
ear_result ear_add_encoder(ear_odometry* odometry, const ear_encoder_sample* sample);
ear_result ear_add_laser(ear_odometry* odometry, const ear_laser_sample* sample);
ear_result ear_add_stereo(ear_odometry* odometry, const ear_stereo_frame* frame);

/* -- estimates: the consumer's thread -- */

typedef enum {
  EAR_WAITING_FOR_IMU = 0,
  EAR_WAITING_FOR_STANDSTILL = 1, /* it cannot start yet; ear_health.reason says why */
  EAR_TRACKING = 2,
  EAR_LOST = 3 /* there was an estimate; it may be anywhere now, and starts again as it can */
} ear_status;

typedef struct {
  int64_t t_ns;   /* IMU time */
  double q_WB[4]; /* w x y z, Hamilton */
  double p_WB[3]; /* [m] */
  double v_W[3];  /* [m/s] */
  double b_g[3];  /* gyroscope bias [rad/s] */
  double b_a[3];  /* accelerometer bias [m/s^2] */
} ear_state;

typedef struct {
  ear_state state;
  /* Of the errors, row by row: rotation (world axes), velocity, position, gyroscope bias, accelerometer bias. */
  double covariance[15][15];
  int32_t terrain_known;            /* 0 in the air, without lasers, and before they saw the ground */
  double slope_along, slope_across; /* uphill positive, in driving direction and to its left [rad] */
  double sigma_along, sigma_across; /* standard deviations [rad] */
  int32_t tracks;                   /* features seen in this frame */
  int32_t features_used;            /* of these, that updated the filter */
  int32_t standing;                 /* the vehicle was held by a standstill update */
  int32_t on_ground;                /* the wheels carry the vehicle */
} ear_estimate;

/* A state to begin with, and standard deviations of what is known of it. */
typedef struct {
  ear_state state;         /* biases are zero unless they are known */
  double tilt_sigma;       /* [rad] of roll and pitch, each */
  double yaw_sigma;        /* [rad]; zero: the world's yaw is this one's by definition */
  double position_sigma;   /* [m] each axis; zero: the same for its origin */
  double velocity_sigma;   /* [m/s] each axis */
  double gyro_bias_sigma;  /* [rad/s] each axis; 0: as for any other start */
  double accel_bias_sigma; /* [m/s^2] each axis; 0: as for any other start */
} ear_start;

/* At the origin, upright, at rest, with the defaults of ear/given_start.h. */
void ear_default_start(ear_start* start);

/* Begins at the first frame or step that is not earlier than this state, whatever the other sensors show; as
 * Odometry::start_at() of ear/odometry.h. EAR_INVALID_ARGUMENT, with the reason in message as for ear_create(). */
ear_result ear_start_at(ear_odometry* odometry, const ear_start* start, char* message, size_t message_size);

/* Hands the waiting samples to the estimator, ordered by time, and then the oldest frame, once inertial samples reach
 * its time or all slots are taken. EAR_OK: *estimate is that frame's. EAR_NO_ESTIMATE: before the start, of a frame
 * that is left out to keep ear_settings.budget_ms, and in flight of an image that repeats the one before to the byte.
 * Call it until it returns EAR_NOTHING; it never waits. */
ear_result ear_process(ear_odometry* odometry, ear_estimate* estimate);

/* The estimate at a time without an image [ns, IMU time], from all other sensors; as Odometry::step() of
 * ear/odometry.h. EAR_NO_ESTIMATE with cameras, off the ground, and while inertial samples may be a spike; see
 * ear_predict(). Waiting samples up to that time are handed over. */
ear_result ear_step(ear_odometry* odometry, int64_t t_ns, ear_estimate* estimate);

/* The newest state carried on to a time by the inertial samples that ear_process() and ear_step() took, at any rate.
 * EAR_NO_ESTIMATE before the start. */
ear_result ear_predict(const ear_odometry* odometry, int64_t t_ns, ear_state* state);

/* For the IMU's thread, after ear_add_imu(): the newest state carried on to the newest sample added. It never waits for
 * the consumer, so that output at the rate of the samples goes on however long a frame takes. EAR_NO_ESTIMATE also when
 * the consumer took no frame and no step for 2 s. */
ear_result ear_live_state(const ear_odometry* odometry, ear_state* state);

ear_status ear_status_of(const ear_odometry* odometry);

/* -- what the estimator reports of itself and of its sensors; meanings, thresholds and times: docs/health.md -- */

typedef enum {
  EAR_HEALTH_INITIALISING = 0, /* there was no estimate yet */
  EAR_HEALTH_TRACKING = 1,     /* no sensor is faulty; some may be rightly silent */
  EAR_HEALTH_DEGRADED = 2,     /* the estimate may be used, but rests on fewer sensors than it should */
  EAR_HEALTH_LOST = 3          /* it may be anywhere, and none is given */
} ear_health_status;

/* Each is bit 1 << EAR_SOURCE_... of ear_health.faulty, and has its place in the array. */
typedef enum {
  EAR_SOURCE_CAMERA_LEFT = 0,
  EAR_SOURCE_CAMERA_RIGHT = 1,
  EAR_SOURCE_WHEEL_LEFT = 2,
  EAR_SOURCE_WHEEL_RIGHT = 3,
  EAR_SOURCE_BEAM_0 = 4, /* lasers in the order of the calibration */
  EAR_SOURCE_BEAM_1 = 5,
  EAR_SOURCE_BEAM_2 = 6,
  EAR_SOURCE_GYROSCOPE = 7,
  EAR_SOURCE_ACCELEROMETER = 8,
  EAR_SOURCE_COUNT = 9
} ear_source;

/* What carries the estimate, besides the inertial sensors. */
typedef enum {
  EAR_AIDING_NONE = 0,
  EAR_AIDING_STANDING = 1,
  EAR_AIDING_WHEELS = 2,
  EAR_AIDING_CAMERAS = 3,
  EAR_AIDING_CAMERAS_AND_WHEELS = 4
} ear_aiding;

/* Why there is no estimate: meanings in ear/health.h, in its order; ear_reason_text() says it in English. */
typedef int32_t ear_reason; /* 0: there is one */

typedef struct {
  ear_health_status status;
  ear_reason reason;                  /* why there is no estimate */
  int64_t since_ns;                   /* when the status began, IMU time */
  uint32_t faulty;                    /* sources that the estimate should rest on, and does not */
  int64_t onset_ns[EAR_SOURCE_COUNT]; /* of these: since when */
  ear_aiding aiding;                  /* what is left */
  int32_t quality;                    /* 0 (lost) ... 100 */
  double horizontal_sigma;            /* [m] standard deviation of the position since the start, worst direction */
  double vertical_sigma;              /* [m] */
  uint8_t reset_counter;              /* grows when the pose goes on with a jump: after lost */
  int32_t load_step;                  /* how much work is left out to keep ear_settings.budget_ms; 0: none */
  int32_t imprecise;  /* 1: two standard deviations of the position are more than 5 % of the path and 0.1 m */
  int32_t misaligned; /* 1: sensors point elsewhere in the body than the calibration allows */
  double score[EAR_SOURCE_COUNT]; /* of each source, in (0, 1]: its noise was divided by this; ear/health.h */
} ear_health;

/* At any time, also without an estimate. The consumer's thread. */
ear_result ear_health_of(const ear_odometry* odometry, ear_health* health);

/* What a start waits for, or how the estimate was lost, in English. */
const char* ear_reason_text(ear_reason reason);

/* The name of a source, such as "wheel_left"; "unknown source" for what is none. */
const char* ear_source_text(ear_source source);

/* What was refused since the start: no sample is dropped without being counted. */
typedef struct {
  uint64_t imu_overflow, encoder_overflow, laser_overflow, frame_overflow; /* the queue was full, or too full */
  uint64_t imu_rejected, encoder_rejected, laser_rejected;                 /* not finite, out of order, too late */
  uint64_t imu_spikes, imu_gaps, clock_jumps;
  uint64_t frames_rejected, frames_without_imu;
} ear_counts;

ear_result ear_counts_of(const ear_odometry* odometry, ear_counts* counts);

/* Back to the state after ear_create(); samples that wait are dropped, those that come go on being taken. */
ear_result ear_reset(ear_odometry* odometry);

#ifdef __cplusplus
}
#endif

/* NOLINTEND */

#endif
