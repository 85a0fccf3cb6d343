// A recording in the layout of docs/recordings.md, as one stream of samples in time order.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "src/recording/frame_queue.h"
#include "src/recording/input_error.h"
#include "src/recording/sample_source.h"
#include "src/recording/warnings.h"

namespace ear {

/// What a recording holds. A RecordedFrame is a StereoFrame that owns its images.
using Sample = std::variant<ImuSample, EncoderSample, LaserSample, RecordedFrame>;

/// For std::visit: one lambda per alternative.
template <typename... Lambdas>
struct Overloaded : Lambdas... {
  using Lambdas::operator()...;
};
template <typename... Lambdas>
Overloaded(Lambdas...) -> Overloaded<Lambdas...>;

/// Streams a recording from disk in constant memory; images are decoded ahead on one background thread. The output does
/// not depend on the timing of that thread.
class Recording {
 public:
  /// `folder` is RECORDING or RECORDING/mav0. Throws InputError if there is no IMU, or a file that is there cannot be
  /// used. Whatever the recording survives is counted in warnings().
  explicit Recording(const std::filesystem::path& folder, const RecordingOptions& options = {});
  /// Of another source, a bag for example.
  Recording(std::unique_ptr<SampleSource> source, const RecordingOptions& options);
  ~Recording();
  Recording(Recording&&) noexcept;
  Recording& operator=(Recording&&) noexcept;

  /// The sensors that are read: no more cameras than have images and are wanted.
  [[nodiscard]] const Calibration& calibration() const;

  /// The next sample of all sensors in time order, late frames by their arrival; of equal times IMU, encoder, laser,
  /// images. Nothing at the end.
  /// Throws InputError.
  [[nodiscard]] std::optional<Sample> next();

  /// What went wrong up to now, counted by kind, in the order of first appearance.
  [[nodiscard]] const std::vector<Warning>& warnings() const;

  /// How long the recording is, known before it is read.
  [[nodiscard]] TimeSpan span() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// The time of any sample.
[[nodiscard]] TimeNs time_of(const Sample& sample);

/// RECORDING/mav0, or RECORDING itself where it is that folder. Throws InputError if neither holds an imu0.
[[nodiscard]] std::filesystem::path find_mav0(const std::filesystem::path& folder);

}  // namespace ear
