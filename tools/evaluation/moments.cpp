#include "tools/evaluation/moments.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace ear::evaluation {
namespace {

constexpr double kLoss = 0.5;    // [s] without an estimate
constexpr double kRecurs = 5.0;  // [s] the same within this time is not news

class Moments {
 public:
  void add(TimeNs t_ns, MomentKind kind, std::string words) {
    const auto same = std::find_if(moments_.rbegin(), moments_.rend(), [&](const Moment& moment) {
      return moment.kind == kind && moment.words == words && seconds_between(moment.t_ns, t_ns) < kRecurs;
    });
    if (same == moments_.rend()) moments_.push_back({t_ns, kind, std::move(words)});
  }
  [[nodiscard]] std::vector<Moment> take() { return std::move(moments_); }

 private:
  std::vector<Moment> moments_;
};

std::string without_estimate(double duration) {
  std::array<char, 60> words{};
  std::snprintf(words.data(), words.size(), "lost: no estimate for %.1f s", duration);
  return words.data();
}

/// A health without what carries it: "degraded: without camera_left".
std::string fault_in(const std::string& health) {
  return health.rfind("degraded", 0) == 0 ? health.substr(0, health.find(';')) : "";
}

}  // namespace

std::vector<Moment> moments_of(const Estimate& estimate) {
  const auto flies = [&](std::size_t i) { return estimate.mode[i] == "free"; };
  const bool has_wheels = std::find(estimate.mode.begin(), estimate.mode.end(), "rolling") != estimate.mode.end();
  Moments moments;
  moments.add(estimate.poses.front().t_ns, MomentKind::end, "start");
  for (std::size_t i = 1; i < estimate.poses.size(); ++i) {
    const TimeNs before_ns = estimate.poses[i - 1].t_ns, t_ns = estimate.poses[i].t_ns;
    if (const double gap = seconds_between(before_ns, t_ns); gap > kLoss) {
      moments.add(before_ns, MomentKind::lost, without_estimate(gap));
      moments.add(t_ns, MomentKind::found, "found again");
    }
    if (has_wheels && flies(i) && !flies(i - 1)) moments.add(t_ns, MomentKind::take_off, "take-off");
    if (has_wheels && !flies(i) && flies(i - 1)) moments.add(t_ns, MomentKind::landing, "landing");
    if (!estimate.health.empty()) {
      const std::string fault = fault_in(estimate.health[i]);
      if (!fault.empty() && fault != fault_in(estimate.health[i - 1])) moments.add(t_ns, MomentKind::fault, fault);
    }
    if (!estimate.anomalous.empty() && !estimate.anomalous[i].empty() &&
        estimate.anomalous[i] != estimate.anomalous[i - 1]) {
      moments.add(t_ns, MomentKind::fault, "at fault: " + estimate.anomalous[i]);
    }
  }
  moments.add(estimate.poses.back().t_ns, MomentKind::end, "end");
  return moments.take();
}

std::vector<Moment> foremost(std::vector<Moment> moments, std::size_t most) {
  const auto by_time = [](const Moment& a, const Moment& b) { return a.t_ns < b.t_ns; };
  if (moments.size() > most) {
    std::stable_sort(moments.begin(), moments.end(), [](const Moment& a, const Moment& b) { return a.kind < b.kind; });
    moments.resize(most);
  }
  std::stable_sort(moments.begin(), moments.end(), by_time);
  return moments;
}

}  // namespace ear::evaluation
