// The last minutes of a run as text and images, of bounded size: written by one thread, read by those of the server.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace ear::view {

/// Shared with those who are sending it, so that nobody waits for them.
using Text = std::shared_ptr<const std::string>;

/// One moment, ready to be sent.
struct Entry {
  std::uint64_t number = 0;  ///< from 1 on, without gaps
  Text summary;              ///< JSON without the features
  Text features;             ///< JSON
  Text image, right;         ///< JPEG of the left and of the right camera; null where there is none
};

/// The whole path in a bounded number of points: when there are too many, every second one is left out from then on.
class Path {
 public:
  static constexpr std::size_t kMostPoints = 4000;

  struct Point {
    Eigen::Vector3d estimate;
    std::optional<Eigen::Vector3d> truth;
  };

  void add(const Point& point);
  [[nodiscard]] const std::vector<Point>& points() const { return points_; }

 private:
  std::vector<Point> points_;
  std::size_t every_ = 1;
  std::size_t skipped_ = 0;
};

class History {
 public:
  static constexpr std::size_t kMostEntries = 3000;      ///< five minutes at 10 Hz
  static constexpr std::size_t kMostBytes = 64'000'000;  ///< of text and images
  static constexpr std::size_t kMostPerAnswer = 100;

  /// Numbers the entry and keeps it; the oldest ones make room. `where`: nothing without an estimate.
  void add(Entry entry, const std::optional<Path::Point>& where);

  /// A JSON list of summaries after `number`, at most kMostPerAnswer, oldest first.
  [[nodiscard]] std::string summaries_after(std::uint64_t number) const;
  /// One moment; nothing if it is not there (any more).
  [[nodiscard]] std::optional<Entry> find(std::uint64_t number) const;
  /// A JSON list of [x, y, z] or [x, y, z, true x, true y, true z].
  [[nodiscard]] std::string path() const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  mutable std::mutex mutex_;
  std::deque<Entry> entries_;
  std::uint64_t last_number_ = 0;
  std::size_t bytes_ = 0;
  Path path_;
};

}  // namespace ear::view
