// Problems that a recording survives: counted by kind, with the place of the first one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace ear {

/// One kind of problem.
struct Warning {
  std::string kind;       ///< "imu0: duplicate stamp"
  std::size_t count = 0;  ///< how often
  std::string first;      ///< where and what the first one was: "file:line: field: message"
};

/// All problems met so far, in the order in which their kinds first appeared.
class Warnings {
 public:
  /// Counts one more problem of this kind; `where` is kept if it is the first.
  void add(const std::string& kind, const std::string& where, std::size_t count = 1) {
    const auto same = std::find_if(list_.begin(), list_.end(), [&](const Warning& w) { return w.kind == kind; });
    if (same == list_.end()) {
      list_.push_back({kind, count, where});
    } else {
      same->count += count;
    }
  }

  /// Adds all problems of another list.
  void add(const Warnings& others) {
    for (const Warning& w : others.list_) add(w.kind, w.first, w.count);
  }

  [[nodiscard]] const std::vector<Warning>& list() const { return list_; }
  [[nodiscard]] bool empty() const { return list_.empty(); }

 private:
  std::vector<Warning> list_;
};

}  // namespace ear
