#include "src/recording/recording_check.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "src/recording/recording.h"
#include "src/recording/standing_watch.h"

namespace ear {
namespace {

constexpr double kRateTolerance = 0.1;   // of the nominal rate
constexpr double kLeastCoverage = 0.99;  // of a stream's time, by the IMU
constexpr double kNoiseFactor = 3.0;     // measured against stated noise
constexpr double kRepeatedShare = 0.01;  // of all IMU samples

std::string short_text(double value) {
  std::ostringstream stream;
  stream.precision(3);
  stream << value;
  return stream.str();
}

class Check {
 public:
  RecordingReport run(const std::function<Recording(const RecordingOptions&)>& open,
                      const std::vector<std::filesystem::path>& files) {
    try {
      RecordingOptions options;
      options.calibration_files = files;
      options.accept_bad_calibration = true;
      Recording recording = open(options);
      report_.calibration = recording.calibration();
      report_.findings = check_calibration(recording.calibration());
      if (const auto missing = check_sensors(recording.calibration())) report_.findings.push_back(*missing);
      read(recording);
      describe_streams(recording.calibration());
      judge_imu(recording.calibration().imu);
      report_.warnings = recording.warnings();
    } catch (const InputError& error) {
      report_.findings.push_back({Severity::error, "recording", error.what()});
    }
    return report_;
  }

 private:
  void read(Recording& recording) {
    const Calibration& calibration = recording.calibration();
    const std::vector<CameraCalibration>& cameras = calibration.cameras;
    const auto sort = Overloaded{[&](const ImuSample& s) {
                                   imu_timing_.add(s.t_ns);
                                   imu_.add(s);
                                 },
                                 [&](const EncoderSample& s) {
                                   encoder_timing_.add(s.t_ns);
                                   const TimeNs t_ns = later_by(calibration.encoder->time_offset, s.t_ns);
                                   standing_.add({t_ns, s.left_count, s.right_count}, *calibration.encoder);
                                 },
                                 [&](const LaserSample& s) { laser_timing_.add(s.t_ns); },
                                 [&](const RecordedFrame& s) {
                                   camera_timing_.add(s.t_ns);
                                   standing_.add(later_by(calibration.camera_time_offset, s.t_ns), s.left);
                                   judge_size("cam0", s.left, cameras.front(), left_seen_);
                                   judge_size("cam1", s.right, cameras.back(), right_seen_);
                                 }};
    while (const auto sample = recording.next()) std::visit(sort, *sample);
  }

  // A camera whose first image does not fit cannot be used; single ones later on are among the warnings.
  void judge_size(const std::string& name, const ImageView& image, const CameraCalibration& camera, bool& seen) {
    if (image.empty() || std::exchange(seen, true)) return;
    if (image.width == camera.width && image.height == camera.height) return;
    std::ostringstream message;
    message << "images of " << image.width << "x" << image.height << " px, but the calibration says " << camera.width
            << "x" << camera.height;
    report_.findings.push_back({Severity::error, name + ": resolution", message.str()});
  }

  void describe_streams(const Calibration& calibration) {
    add_stream("imu0", calibration.imu.rate_hz, imu_timing_);
    if (const auto& encoder = calibration.encoder) {
      add_stream("encoder0", encoder->rate_hz, encoder_timing_, encoder->time_offset);
    }
    if (const auto& lasers = calibration.lasers) {
      add_stream("laser0", lasers->rate_hz, laser_timing_, lasers->time_offset);
    }
    if (!calibration.cameras.empty()) {
      add_stream(calibration.cameras.size() == 2 ? "cam0+cam1" : "cam0", calibration.cameras[0].rate_hz, camera_timing_,
                 calibration.camera_time_offset);
    }
  }

  void add_stream(const std::string& name, double nominal_rate_hz, const StreamTiming& timing,
                  double time_offset = 0.0) {
    StreamReport stream{name, nominal_rate_hz, timing.report(), 0.0};
    TimingReport by_imu = stream.timing;
    by_imu.first_ns = later_by(time_offset, by_imu.first_ns);
    by_imu.last_ns = later_by(time_offset, by_imu.last_ns);
    stream.covered_by_imu = coverage(by_imu, imu_timing_.report());
    judge_stream(stream);
    report_.streams.push_back(stream);
  }

  static double coverage(const TimingReport& stream, const TimingReport& imu) {
    if (stream.count == 0 || imu.count == 0) return 0.0;
    const TimeNs first = std::max(stream.first_ns, imu.first_ns);
    const TimeNs last = std::min(stream.last_ns, imu.last_ns);
    if (first > last) return 0.0;
    const double whole = seconds_between(stream.first_ns, stream.last_ns);
    return whole > 0.0 ? seconds_between(first, last) / whole : 1.0;
  }

  void judge_stream(const StreamReport& stream) {
    const TimingReport& timing = stream.timing;
    if (timing.count == 0) {
      warn(stream.name, "no samples");
      return;
    }
    if (stream.covered_by_imu == 0.0) {
      report_.findings.push_back({Severity::error, stream.name, "at no time at which there are inertial samples"});
    } else if (stream.covered_by_imu < kLeastCoverage) {
      warn(stream.name, "inertial samples during " + short_text(100.0 * stream.covered_by_imu) + " % of its time only");
    }
    if (timing.gaps > 0) {
      warn(stream.name, std::to_string(timing.gaps) + " gaps, the longest " + short_text(timing.longest_gap) + " s");
    }
    const double off = std::abs(timing.rate_hz - stream.nominal_rate_hz);
    if (timing.count > 1 && stream.nominal_rate_hz > 0.0 && off > kRateTolerance * stream.nominal_rate_hz) {
      warn(stream.name,
           short_text(timing.rate_hz) + " Hz, but its calibration says " + short_text(stream.nominal_rate_hz) + " Hz");
    }
  }

  void judge_imu(const ImuCalibration& stated) {
    report_.imu = imu_.report([this](TimeNs begin_ns, TimeNs end_ns) { return standing_.stood(begin_ns, end_ns); });
    if (report_.imu.clipped > 0) warn("imu0", std::to_string(report_.imu.clipped) + " clipped samples");
    const auto count = static_cast<double>(imu_timing_.report().count);
    if (static_cast<double>(report_.imu.repeated) > kRepeatedShare * count) {
      warn("imu0", std::to_string(report_.imu.repeated) + " samples repeat the one before");
    }
    if (!report_.imu.standing_noise) return;
    judge_noise("gyroscope_noise_density", report_.imu.standing_noise->gyro, stated.gyro_noise);
    judge_noise("accelerometer_noise_density", report_.imu.standing_noise->accel, stated.accel_noise);
  }

  void judge_noise(const std::string& key, double measured, double stated) {
    if (measured <= kNoiseFactor * stated) return;
    warn("imu0: " + key, "at rest it is " + short_text(measured) + ", but the calibration says " + short_text(stated));
  }

  void warn(const std::string& where, const std::string& message) {
    report_.findings.push_back({Severity::warning, where, message});
  }

  RecordingReport report_;
  StreamTiming imu_timing_;
  StreamTiming encoder_timing_;
  StreamTiming laser_timing_;
  StreamTiming camera_timing_;
  ImuCheck imu_;
  StandingWatch standing_;
  bool left_seen_ = false;
  bool right_seen_ = false;
};

}  // namespace

bool RecordingReport::usable() const {
  return std::none_of(findings.begin(), findings.end(),
                      [](const Finding& finding) { return finding.severity == Severity::error; });
}

RecordingReport check_recording(const std::filesystem::path& folder,
                                const std::vector<std::filesystem::path>& calibration_files) {
  return check_recording([&](const RecordingOptions& options) { return Recording(folder, options); },
                         calibration_files);
}

RecordingReport check_recording(const std::function<Recording(const RecordingOptions&)>& open,
                                const std::vector<std::filesystem::path>& calibration_files) {
  return Check().run(open, calibration_files);
}

}  // namespace ear
