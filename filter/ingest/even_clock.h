// Wheel readings that are taken at even intervals and stamped when they arrive. A driver that is held up stamps several
// of them late, then many in a burst: the counts go on evenly, the stamps do not. docs/ingest.md, "Stamps of arrival".
#pragma once

#include <Eigen/Core>

#include "filter/ingest/wheel_increment.h"

namespace ear {

class EvenClock {
 public:
  /// Moves both ends of an increment to when its readings were taken, where the counts show even intervals; never later
  /// than they arrived. Increments stay in order and without gaps.
  void correct(WheelIncrement& increment);

  /// Do the counts show even intervals?
  [[nodiscard]] bool is_even() const;

 private:
  [[nodiscard]] double intervals_in(const WheelIncrement& increment) const;
  void compare(const WheelIncrement& increment, double intervals);
  void follow(const WheelIncrement& increment, double intervals);

  /// Sums over what turned while an interval seemed longer by x, in angles at the recent speed, and was more by y.
  struct Regression {
    double xx = 0.0, xy = 0.0, yy = 0.0, count = 0.0;
  };
  Regression regression_;
  Eigen::Vector2d angle_ = Eigen::Vector2d::Zero();  ///< recent sum [rad], in so many intervals:
  double intervals_ = 0.0;
  double interval_ = 0.0;    ///< mean [s]
  double count_ = 0.0;       ///< of what it is the mean
  TimeNs stamp_ns_ = 0;      ///< the last reading's
  TimeNs even_ns_ = 0;       ///< when it was taken, by even intervals
  TimeNs given_ns_ = 0;      ///< what was made of it
  TimeNs window_ns_ = 0;     ///< since when the least delay is looked for
  double least_late_ = 0.0;  ///< [s]
  bool on_time_ = false;     ///< some reading of the last such window came within an interval of its time
};

}  // namespace ear
