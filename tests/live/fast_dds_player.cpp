// Plays a recording in real time as topics of ROS 2, by another implementation of DDS than the one that it tests, and
// writes down the odometry that comes back.
//
//   fast_dds_player RECORDING DOMAIN reliable|best_effort ODOMETRY.csv [SECONDS]
//
// After so many seconds it ends; a recording that is shorter goes on as that of a vehicle that stands.
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "src/recording/recording.h"
#include "tests/live/fast_dds_vehicle.h"

namespace {

using SteadyClock = std::chrono::steady_clock;

/// Writes each odometry message as a row: stamp [ns], position [m], how long after its image went out [ns],
/// frames.
class OdometryLog {
 public:
  explicit OdometryLog(const std::string& file) : out_(file) { out_.precision(17); }

  /// A left image goes out now.
  void sends(std::int64_t t_ns) {
    const std::lock_guard lock(mutex_);
    sent_[t_ns] = SteadyClock::now();
  }
  void take(const fast_dds::Odometry& message) {
    const SteadyClock::time_point now = SteadyClock::now();
    const std::lock_guard lock(mutex_);
    // The state's stamp is the image's, moved by what was learned of the camera's clock.
    auto sent = sent_.lower_bound(message.t_ns - kClock);
    if (sent != sent_.end() && sent->first > message.t_ns + kClock) sent = sent_.end();
    const std::chrono::nanoseconds delay = sent == sent_.end() ? std::chrono::nanoseconds(-1) : now - sent->second;
    out_ << message.t_ns << "," << message.x << "," << message.y << "," << message.z << "," << delay.count() << ","
         << message.frame << "," << message.child << std::endl;
    if (sent != sent_.end()) sent_.erase(sent_.begin(), std::next(sent));
  }

 private:
  static constexpr std::int64_t kClock = 15'000'000;

  std::mutex mutex_;
  std::ofstream out_;
  std::map<std::int64_t, SteadyClock::time_point> sent_;
};

/// The topics of a recording's sensors.
class Topics {
 public:
  Topics(int domain, bool reliable, const ear::Calibration& calibration, OdometryLog& odometry)
      : vehicle_(domain), odometry_(odometry), resolution_(calibration.encoder ? calibration.encoder->resolution : 1) {
    const fast_dds::Offer samples{reliable}, images{reliable, false, false, 8};
    vehicle_.publish("/imu0", "Imu", samples);
    if (calibration.encoder) vehicle_.publish("/wheels", "JointState", samples);
    const std::size_t beams = calibration.lasers ? calibration.lasers->beams.size() : 0;
    for (std::size_t i = 0; i < beams; ++i) vehicle_.publish("/laser/" + std::to_string(i), "Range", samples);
    for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
      vehicle_.publish("/cam" + std::to_string(i) + "/image_raw", "Image", images);
    }
  }

  /// False: nobody reads them within 30 s.
  bool wait_for_readers() {
    const SteadyClock::time_point began = SteadyClock::now();
    while (!vehicle_.is_heard()) {
      if (SteadyClock::now() - began > std::chrono::seconds(30)) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));  // the other side is done with discovery, too
    vehicle_.subscribe("/ear/odometry", "nav_msgs::msg::dds_::Odometry_",
                       [this](fast_dds::Bytes bytes) { odometry_.take(fast_dds::odometry(std::move(bytes))); });
    return true;
  }

  void send(const ear::ImuSample& s) {
    vehicle_.write("/imu0", fast_dds::imu(s));
    ++inertial_;
  }
  void send(const ear::EncoderSample& s) {
    vehicle_.write("/wheels", fast_dds::joints(s, static_cast<double>(resolution_)));
  }
  void send(const ear::LaserSample& s) {
    for (std::size_t i = 0; i < s.range.size(); ++i) {
      vehicle_.write("/laser/" + std::to_string(i), fast_dds::range(s.t_ns, s.range[i]));
    }
  }
  void send(const ear::StereoFrame& s) {
    odometry_.sends(s.t_ns);
    vehicle_.write("/cam0/image_raw", fast_dds::image(s.t_ns, s.left));
    if (!s.right.empty()) vehicle_.write("/cam1/image_raw", fast_dds::image(s.t_ns, s.right));
  }
  [[nodiscard]] std::uint64_t inertial() const { return inertial_; }

 private:
  fast_dds::Vehicle vehicle_;
  OdometryLog& odometry_;
  std::int64_t resolution_;
  std::uint64_t inertial_ = 0;
};

/// What a vehicle's sensors go on to say when it stands: the last of each, anew, with other noise in the images.
class Standing {
 public:
  explicit Standing(const ear::Calibration& calibration) : calibration_(calibration) {}

  void saw(const ear::ImuSample& s) { imu_ = s; }
  void saw(const ear::EncoderSample& s) { wheels_ = s; }
  void saw(const ear::LaserSample& s) { ranges_ = s; }
  void saw(const ear::RecordedFrame& s) { frame_ = s; }

  /// Sends each sensor's reading that is due by `until_ns`, in the order of time.
  template <typename Wait>
  void go_on(std::int64_t until_ns, Topics& topics, const Wait& wait) {
    const auto period = [](double rate_hz) { return static_cast<std::int64_t>(1e9 / rate_hz); };
    const std::int64_t imu = period(calibration_.imu.rate_hz), camera = period(calibration_.cameras.front().rate_hz);
    const std::int64_t wheels = calibration_.encoder ? period(calibration_.encoder->rate_hz) : 0;
    const std::int64_t lasers = calibration_.lasers ? period(calibration_.lasers->rate_hz) : 0;
    while (imu_.t_ns + imu < until_ns) {
      imu_.t_ns += imu;
      wait(imu_.t_ns);
      if (wheels > 0 && wheels_.t_ns + wheels <= imu_.t_ns) {
        wheels_.t_ns += wheels;
        topics.send(wheels_);
      }
      if (lasers > 0 && ranges_.t_ns + lasers <= imu_.t_ns) {
        ranges_.t_ns += lasers;
        topics.send(ranges_);
      }
      topics.send(imu_);
      if (frame_.t_ns + camera > imu_.t_ns) continue;
      frame_.t_ns += camera;
      topics.send(with_noise(frame_));
    }
  }

 private:
  ear::StereoFrame with_noise(const ear::RecordedFrame& frame) {
    ear::StereoFrame noisy{frame.t_ns, frame.left, frame.right};
    std::size_t camera = 0;
    for (ear::ImageView* const view : {&noisy.left, &noisy.right}) {
      std::vector<std::uint8_t>& pixels = pixels_[camera++];
      pixels.assign(view->data, view->data + view->stride * view->height);
      for (std::size_t i = rng_() % 7; i < pixels.size(); i += 1 + rng_() % 7) {
        if (pixels[i] < 250) pixels[i] = static_cast<std::uint8_t>(pixels[i] + rng_() % 3);
      }
      view->data = pixels.data();
    }
    return noisy;
  }

  const ear::Calibration& calibration_;
  ear::ImuSample imu_;
  ear::EncoderSample wheels_;
  ear::LaserSample ranges_;
  ear::RecordedFrame frame_;
  std::array<std::vector<std::uint8_t>, 2> pixels_;
  std::minstd_rand rng_{1};
};

int play(const std::string& folder, int domain, bool reliable, const std::string& log, double seconds) {
  ear::Recording recording(folder);
  OdometryLog odometry(log);
  Topics topics(domain, reliable, recording.calibration(), odometry);
  Standing standing(recording.calibration());
  if (!topics.wait_for_readers()) {
    std::cerr << "nobody reads the topics\n";
    return EXIT_FAILURE;
  }
  const SteadyClock::time_point start = SteadyClock::now();
  const std::int64_t first_ns = recording.span().first_ns;
  const auto wait = [&](std::int64_t t_ns) {
    std::this_thread::sleep_until(start + std::chrono::nanoseconds(t_ns - first_ns));
  };
  const std::int64_t end_ns =
      seconds > 0.0 ? first_ns + static_cast<std::int64_t>(1e9 * seconds) : std::numeric_limits<std::int64_t>::max();
  while (const auto sample = recording.next()) {
    const std::int64_t t_ns = ear::time_of(*sample);
    if (t_ns > end_ns) break;
    wait(t_ns);
    std::visit(
        [&](const auto& s) {
          standing.saw(s);
          topics.send(s);
        },
        *sample);
  }
  if (seconds > 0.0) standing.go_on(end_ns, topics, wait);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // the last estimates
  std::cout << topics.inertial() << " inertial samples\n";
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::cerr << "fast_dds_player RECORDING DOMAIN reliable|best_effort ODOMETRY.csv [SECONDS]\n";
    return EXIT_FAILURE;
  }
  try {
    return play(argv[1], std::atoi(argv[2]), std::string(argv[3]) == "reliable", argv[4],
                argc > 5 ? std::atof(argv[5]) : 0.0);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return EXIT_FAILURE;
  }
}
