// When did the vehicle of a recording stand? An IMU alone does not show it: at constant speed it is as quiet as at
// rest.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"

namespace ear {

/// Follows wheels and images: it stood while the wheels did not turn and the images did not change. What nobody saw
/// is not taken for standing.
class StandingWatch {
 public:
  /// Samples of each kind come in time order.
  void add(const EncoderSample& sample, const EncoderCalibration& wheels);
  /// `t_ns`: the frame's time by the IMU's clock. `image`: 8-bit grey.
  void add(TimeNs t_ns, const ImageView& image);

  /// From begin to end, by all that there was to see then.
  [[nodiscard]] bool stood(TimeNs begin_ns, TimeNs end_ns) const;

 private:
  struct Interval {
    TimeNs begin_ns = 0;
    TimeNs end_ns = 0;
  };

  // One sensor's times: all that it saw, and the parts without a change.
  struct Witness {
    std::vector<Interval> rests;  // the last one goes on
    std::optional<Interval> whole;
    std::vector<Interval> gaps;  // where it saw nothing

    void see(TimeNs t_ns, bool changed);
    [[nodiscard]] bool saw(TimeNs begin_ns, TimeNs end_ns) const;
    [[nodiscard]] bool rested(TimeNs begin_ns, TimeNs end_ns) const;
  };

  Witness wheels_;
  Witness images_;
  std::optional<EncoderSample> still_;  // where the wheels have stood since the last rest began
  std::vector<float> reference_;        // the image then, as means of its blocks
  std::vector<float> blocks_;
  std::vector<float> changes_;
  std::vector<float> sorted_;
};

}  // namespace ear
