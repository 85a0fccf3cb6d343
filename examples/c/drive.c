/* The estimator from a program in C: one thread per sensor adds samples, the main thread takes estimates out.
 *
 * There is no vehicle here, so the program makes its own: it stands before a patterned wall, then swings sideways. At
 * the end it compares the estimated position with the true one, and fails if they differ. */
#define _POSIX_C_SOURCE 200809L /* NOLINT(bugprone-reserved-identifier): its name in POSIX */

#include <ear/ear_c.h>
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define WIDTH 640
#define HEIGHT 480
#define MARGIN 240 /* [px] how much more of the wall there is than one image shows */
#define FOCAL 400.0
#define BASELINE 0.1     /* [m] between the cameras */
#define WALL 1.0         /* [m] before the cameras */
#define STANDING 1.5     /* [s] before it moves */
#define SWING 0.15       /* [m] amplitude */
#define SWING_RATE 3.0   /* [rad/s] */
#define IMU_PERIOD 0.005 /* [s] */
#define STEPS 810        /* of that period */
#define CAMERA_STEPS 10  /* of them between two images */
#define TOLERANCE 0.02   /* [m] at the end */

/* -- the vehicle and its world: x to the wall, y to the left, z up -- */

static uint8_t wall[HEIGHT][WIDTH + 2 * MARGIN];

static void paint_wall(void) {
  uint32_t random = 1;
  for (int row = 0; row < HEIGHT; row += 10) {
    for (int column = 0; column < WIDTH + 2 * MARGIN; column += 10) {
      random = random * 1664525u + 1013904223u;
      for (int y = row; y < row + 10; ++y) {
        for (int x = column; x < column + 10; ++x) wall[y][x] = (uint8_t)(40u + (random >> 24) * 3u / 4u);
      }
    }
  }
}

static double true_y(double t) { return t < STANDING ? 0.0 : SWING * (1.0 - cos(SWING_RATE * (t - STANDING))); }

static double true_acceleration(double t) {
  return t < STANDING ? 0.0 : SWING * SWING_RATE * SWING_RATE * cos(SWING_RATE * (t - STANDING));
}

/* What a camera sees from y, which is across the wall [m]. */
static void take_picture(double y, uint8_t picture[HEIGHT][WIDTH]) {
  const double shift = MARGIN - y * FOCAL / WALL;
  const int whole = (int)floor(shift);
  const double part = shift - whole;
  for (int row = 0; row < HEIGHT; ++row) {
    for (int column = 0; column < WIDTH; ++column) {
      const uint8_t* const at = &wall[row][column + whole];
      picture[row][column] = (uint8_t)((1.0 - part) * at[0] + part * at[1] + 0.5);
    }
  }
}

static ear_calibration describe_vehicle(void) {
  ear_calibration calibration;
  ear_default_calibration(&calibration);
  calibration.imu_rate_hz = 1.0 / IMU_PERIOD;
  calibration.camera_count = 2;
  for (int i = 0; i < 2; ++i) {
    /* The camera looks along the body's x: its x is the body's -y, its y the body's -z. */
    const double T_BC[16] = {0.0,  0.0,  1.0, 0.0,           /**/
                             -1.0, 0.0,  0.0, -BASELINE * i, /**/
                             0.0,  -1.0, 0.0, 0.0,           /**/
                             0.0,  0.0,  0.0, 1.0};
    ear_camera* const camera = &calibration.cameras[i];
    for (int k = 0; k < 16; ++k) camera->T_BC[k] = T_BC[k];
    camera->width = WIDTH;
    camera->height = HEIGHT;
    camera->fu = camera->fv = FOCAL;
    camera->cu = 0.5 * (WIDTH - 1);
    camera->cv = 0.5 * (HEIGHT - 1);
    camera->rate_hz = 1.0 / (CAMERA_STEPS * IMU_PERIOD);
  }
  return calibration;
}

/* -- the drivers: each waits for its sample, as if a device gave it --
 *
 * The vehicle's time goes on in steps, when all three threads have done their part of the step before: a machine that
 * is busy with other things makes the vehicle slower. Real devices do not wait; then the queues report what was lost.
 */

typedef struct {
  ear_odometry* odometry;
  struct timespec start;
  pthread_barrier_t step_done;
} drivers;

static void sleep_until(struct timespec start, double seconds) {
  const int64_t nanoseconds = (int64_t)start.tv_nsec + (int64_t)(seconds * 1e9);
  struct timespec time = start;
  time.tv_sec += (time_t)(nanoseconds / 1000000000);
  time.tv_nsec = (long)(nanoseconds % 1000000000);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, NULL) != 0) continue;
}

/* The end of step number `step`, which lasts one period of the IMU. */
static void end_step(drivers* all, int step) {
  pthread_barrier_wait(&all->step_done);
  sleep_until(all->start, (step + 1) * IMU_PERIOD);
}

static int64_t stamp(double seconds) { return 1000000000 + llround(seconds * 1e9); }

static void* imu_driver(void* argument) {
  drivers* const all = argument;
  for (int step = 0; step < STEPS; ++step) {
    const double t = step * IMU_PERIOD;
    const ear_imu_sample sample = {stamp(t), {0.0, 0.0, 0.0}, {0.0, true_acceleration(t), 9.81}};
    if (ear_add_imu(all->odometry, &sample) != EAR_OK) fprintf(stderr, "IMU sample lost\n");
    end_step(all, step);
  }
  return NULL;
}

static void* camera_driver(void* argument) {
  static uint8_t left[HEIGHT][WIDTH];
  static uint8_t right[HEIGHT][WIDTH];
  drivers* const all = argument;
  for (int step = 0; step < STEPS; ++step) {
    const double t = step * IMU_PERIOD;
    const ear_stereo_frame frame = {stamp(t), left[0], right[0], WIDTH};
    if (step % CAMERA_STEPS == 0) {
      take_picture(true_y(t), left);
      take_picture(true_y(t) - BASELINE, right);
      if (ear_add_stereo(all->odometry, &frame) != EAR_OK) fprintf(stderr, "frame lost\n");
    }
    end_step(all, step);
  }
  return NULL;
}

/* -- the consumer -- */

static int run(drivers* all) {
  pthread_t imu;
  pthread_t camera;
  ear_estimate estimate;
  double error = INFINITY;
  int estimates = 0;

  clock_gettime(CLOCK_MONOTONIC, &all->start);
  if (pthread_barrier_init(&all->step_done, NULL, 3) != 0) return EXIT_FAILURE;
  if (pthread_create(&imu, NULL, imu_driver, all) != 0) abort();
  if (pthread_create(&camera, NULL, camera_driver, all) != 0) abort();

  for (int step = 0; step < STEPS; ++step) {
    ear_result result;
    end_step(all, step);
    while ((result = ear_process(all->odometry, &estimate)) != EAR_NOTHING) {
      if (result < 0) fprintf(stderr, "%s\n", ear_result_text(result));
      if (result != EAR_OK) continue; /* before the start */
      const double seconds = 1e-9 * (double)(estimate.state.t_ns - stamp(0.0));
      error = hypot(hypot(estimate.state.p_WB[0], estimate.state.p_WB[1] - true_y(seconds)), estimate.state.p_WB[2]);
      if (++estimates % 10 == 0) {
        printf("%.1f s: y = %6.3f +- %.3f m, %.4f m off\n", seconds, estimate.state.p_WB[1],
               sqrt(estimate.covariance[7][7]), error);
      }
    }
  }
  pthread_join(imu, NULL);
  pthread_join(camera, NULL);
  pthread_barrier_destroy(&all->step_done);
  return error < TOLERANCE ? EXIT_SUCCESS : EXIT_FAILURE;
}

int main(void) {
  const ear_calibration calibration = describe_vehicle();
  drivers all;
  char reason[200];

  paint_wall();
  if (ear_create(&calibration, NULL, &all.odometry, reason, sizeof reason) != EAR_OK) {
    fprintf(stderr, "%s\n", reason);
    return EXIT_FAILURE;
  }
  const int exit_code = run(&all);
  ear_destroy(all.odometry);
  return exit_code;
}
