// Where the samples of a recording come from: a folder, or a bag.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "src/recording/frame_queue.h"
#include "src/recording/warnings.h"

namespace ear {

/// First and last stamp of the IMU.
struct TimeSpan {
  TimeNs first_ns = 0;
  TimeNs last_ns = 0;
};

struct RecordingOptions {
  std::vector<std::filesystem::path> calibration_files;  ///< Kalibr's camchain and imu.yaml; see load_calibration()
  double camera_rate_hz = 0.0;                           ///< frames are left out to reach this lower rate; 0: all
  bool mono = false;                                     ///< ignore the right camera
  bool accept_bad_calibration = false;  ///< read on although the calibration cannot be right, to report on the rest
};

/// One stream per sensor, each in strictly growing time, read independently of the others: none must be held in memory
/// while another is read. Every function throws InputError for what cannot be used.
class SampleSource {
 public:
  virtual ~SampleSource() = default;

  /// What messages name.
  [[nodiscard]] virtual std::filesystem::path path() const = 0;
  /// The sensors that are there and wanted. Called once, first; what it returns is what open() is given.
  [[nodiscard]] virtual Calibration calibration(Warnings& warnings) = 0;
  /// Makes the streams of these sensors ready.
  virtual void open(const Calibration& calibration) = 0;
  [[nodiscard]] virtual TimeSpan span() = 0;

  /// The next sample of each sensor; nothing at the end, and from a sensor that is not there.
  [[nodiscard]] virtual std::optional<ImuSample> next_imu(Warnings& warnings) = 0;
  [[nodiscard]] virtual std::optional<EncoderSample> next_encoder(Warnings& warnings) = 0;
  [[nodiscard]] virtual std::optional<LaserSample> next_laser(Warnings& warnings) = 0;
  /// Called on a thread of its own, beside the others.
  [[nodiscard]] virtual DecodedFrame next_frame() = 0;
};

}  // namespace ear
