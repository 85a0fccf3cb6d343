// Samples in strictly growing time: those whose stamps cannot be are left out and counted.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "ear/types.h"
#include "src/recording/input_error.h"
#include "src/recording/warnings.h"

namespace ear {

/// Stamps that repeat, run backward, or jump ahead of the sample that follows are left out. `Sample` has a member t_ns.
template <typename Sample>
class SampleOrder {
 public:
  /// A sample, and its line in the file; 0 if it has none.
  struct Numbered {
    Sample sample;
    std::size_t line = 0;
  };
  /// `name` ("imu0") begins the kind of every warning; `file` is where the samples are.
  SampleOrder(std::filesystem::path file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}

  /// The next good sample of those that `read` gives: std::optional<Numbered>(Warnings&), nothing at the end. Throws
  /// what it throws.
  template <typename Reader>
  [[nodiscard]] std::optional<Sample> next(Reader&& read, Warnings& warnings) {
    if (!ahead_) ahead_ = read(warnings);
    while (ahead_) {
      Numbered current = std::move(*ahead_);
      ahead_ = read(warnings);
      if (!in_order(current, warnings)) continue;
      last_ns_ = current.sample.t_ns;
      return std::move(current.sample);
    }
    return std::nullopt;
  }

 private:
  bool in_order(const Numbered& current, Warnings& warnings) const {
    const TimeNs t = current.sample.t_ns;
    const auto drop = [&](const char* kind, const std::string& message) {
      warnings.add(name_ + ": " + kind, located(file_, current.line, "timestamp", message));
      return false;
    };
    if (last_ns_ && t == *last_ns_) return drop("duplicate stamp", "the same as in the row before");
    if (last_ns_ && t < *last_ns_) return drop("backward stamp", "earlier than the row before");
    // One stamp that is far too late must not make all that follow it look late: believe the rows on both its sides.
    const bool ahead_fits = ahead_ && (!last_ns_ || ahead_->sample.t_ns > *last_ns_);
    if (ahead_fits && ahead_->sample.t_ns < t) return drop("backward stamp", "later than the row after it");
    return true;
  }

  std::filesystem::path file_;
  std::string name_;
  std::optional<Numbered> ahead_;
  std::optional<TimeNs> last_ns_;
};

}  // namespace ear
