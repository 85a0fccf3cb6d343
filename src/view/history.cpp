#include "src/view/history.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace ear::view {
namespace {

std::size_t size_of(const Entry& entry) {
  std::size_t size = sizeof(Entry);
  for (const Text& text : {entry.summary, entry.features, entry.image, entry.right}) size += text ? text->size() : 0;
  return size;
}

void append(std::string& text, const Eigen::Vector3d& point) {
  std::array<char, 80> numbers{};
  std::snprintf(numbers.data(), numbers.size(), "%.3f,%.3f,%.3f", point.x(), point.y(), point.z());
  text += numbers.data();
}

}  // namespace

void Path::add(const Point& point) {
  if (++skipped_ < every_) return;
  skipped_ = 0;
  points_.push_back(point);
  if (points_.size() < kMostPoints) return;
  for (std::size_t i = 0; 2 * i < points_.size(); ++i) points_[i] = points_[2 * i];
  points_.resize((points_.size() + 1) / 2);
  every_ *= 2;
}

void History::add(Entry entry, const std::optional<Path::Point>& where) {
  const std::lock_guard lock(mutex_);
  entry.number = ++last_number_;
  bytes_ += size_of(entry);
  entries_.push_back(std::move(entry));
  while (entries_.size() > kMostEntries || (bytes_ > kMostBytes && entries_.size() > 1)) {
    bytes_ -= size_of(entries_.front());
    entries_.pop_front();
  }
  if (where) path_.add(*where);
}

std::string History::summaries_after(std::uint64_t number) const {
  std::vector<std::pair<std::uint64_t, Text>> wanted;
  {
    const std::lock_guard lock(mutex_);
    const std::uint64_t first = entries_.empty() ? 0 : entries_.front().number;
    const std::size_t skip =
        number < first ? 0 : static_cast<std::size_t>(std::min<std::uint64_t>(number - first + 1, entries_.size()));
    for (std::size_t i = skip; i < entries_.size() && wanted.size() < kMostPerAnswer; ++i) {
      wanted.emplace_back(entries_[i].number, entries_[i].summary);
    }
  }
  std::string list = "[";
  for (const auto& [n, summary] : wanted) {
    if (list.size() > 1) list += ",\n";
    list += "{\"n\":" + std::to_string(n) + "," + *summary + "}";
  }
  return list + "]";
}

std::optional<Entry> History::find(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  if (entries_.empty() || number < entries_.front().number || number > entries_.back().number) return std::nullopt;
  return entries_[static_cast<std::size_t>(number - entries_.front().number)];
}

std::string History::path() const {
  std::vector<Path::Point> points;
  {
    const std::lock_guard lock(mutex_);
    points = path_.points();
  }
  std::string list = "[";
  for (const Path::Point& point : points) {
    list += list.size() > 1 ? ",[" : "[";
    append(list, point.estimate);
    if (point.truth) {
      list += ",";
      append(list, *point.truth);
    }
    list += "]";
  }
  return list + "]";
}

std::size_t History::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace ear::view
