// Which images belong together: the rows of one or two cameras, associated by time.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "src/recording/frame_images.h"
#include "src/recording/rows.h"
#include "src/recording/sample_stream.h"
#include "src/recording/warnings.h"

namespace ear {

/// The image files of one instant.
struct FrameFiles {
  TimeNs t_ns = 0;
  TimeNs arrival_ns = 0;  ///< the stamp, unless cam0/arrival.csv says otherwise
  std::filesystem::path left;
  std::filesystem::path right;  ///< empty: no right image at this time
};

/// Reads the rows of cam0 and, for stereo, of cam1, and pairs those of equal time. A left image without a partner
/// stays, a right one is left out; both are counted.
class FrameList {
 public:
  /// `camera_rate_hz` 0 keeps all frames. Throws InputError.
  FrameList(const std::filesystem::path& mav0, bool stereo, double camera_rate_hz);

  /// The next frame to use, or nothing at the end. Throws InputError.
  [[nodiscard]] std::optional<FrameFiles> next(Warnings& warnings);

 private:
  [[nodiscard]] std::optional<FrameFiles> next_pair(Warnings& warnings);
  [[nodiscard]] std::filesystem::path matching_right(TimeNs t_ns, Warnings& warnings);
  [[nodiscard]] TimeNs arrival_of(TimeNs t_ns, Warnings& warnings);

  std::filesystem::path mav0_;
  SampleStream<ImageRow> left_;
  std::unique_ptr<SampleStream<ImageRow>> right_;
  std::optional<ImageRow> right_ahead_;
  std::unique_ptr<SampleStream<ArrivalRow>> arrivals_;
  std::optional<ArrivalRow> arrival_ahead_;
  FrameRate rate_;
};

}  // namespace ear
