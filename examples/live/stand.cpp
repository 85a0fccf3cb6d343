// What `ear live` is made of, with sensors of one's own: samples go in from any thread, estimates come out on another.
// There is no vehicle here; the samples are those of one that stands.
#include <src/live/live_estimator.h>

#include <cstdlib>
#include <iostream>

int main() {
  ear::Calibration calibration;  // from your files; here wheels and an IMU
  calibration.encoder.emplace();

  int estimates = 0;
  ear::live::LiveListeners listeners;
  listeners.on_frame = [&](const ear::live::LiveFrame& frame, const ear::Odometry&) {
    if (frame.estimate) ++estimates;
  };
  ear::live::LiveEstimator estimator(ear::Config{}, calibration, {}, listeners);

  ear::ImuSample sample;  // as a driver gives them
  sample.accel_B = {0.0, 0.0, 9.81};
  for (sample.t_ns = 1'000'000'000; sample.t_ns < 2'800'000'000; sample.t_ns += 5'000'000) {
    estimator.add_encoder({sample.t_ns, 0, 0});
    estimator.add_imu(sample);
  }
  estimator.stop();
  std::cout << estimates << " estimates, " << estimator.overflows().imu << " samples lost\n";
  return estimates > 10 && estimator.overflows().imu == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
