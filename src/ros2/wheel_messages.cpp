#include "src/ros2/wheel_messages.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>

#include "src/ros2/topics.h"

namespace ear::ros2 {
namespace {

constexpr double kTurn = 2.0 * M_PI;
constexpr double kMostCounts = 9e15;  // what a double holds exactly

std::size_t with_name(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

/// The first joint whose name has this word, before others one that also says it is a wheel.
std::size_t with_word(const std::vector<std::string>& names, const std::string& word) {
  std::size_t found = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::string lower = names[i];
    std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
    if (lower.find(word) == std::string::npos) continue;
    if (lower.find("wheel") != std::string::npos) return i;
    found = std::min(found, i);
  }
  return found;
}

}  // namespace

std::pair<std::size_t, std::size_t> WheelMessages::find(const RawMessage& message, const JointState& joints) {
  const auto pick = [&](const std::string& stated, const std::string& word, std::size_t otherwise) {
    if (!stated.empty()) {
      const std::size_t i = with_name(joints.name, stated);
      if (i < joints.name.size()) return i;
      throw InputError(message.topic + ": no joint " + stated + " among " + joined(joints.name));
    }
    const std::size_t i = with_word(joints.name, word);
    return i < joints.name.size() ? i : otherwise;
  };
  const std::size_t left = pick(topics_.left_joint, "left", 0), right = pick(topics_.right_joint, "right", 1);
  if (left == right) throw InputError(message.topic + ": left and right wheel are one joint of " + joined(joints.name));
  if (std::max(left, right) >= joints.position.size()) {
    throw InputError(message.topic + ": " + std::to_string(joints.position.size()) + " angles (position) of " +
                     std::to_string(joints.name.size()) + " joints: two wheels are needed");
  }
  return {left, right};
}

EncoderSample WheelMessages::take(const RawMessage& message) {
  const auto joints = decode<JointState>(message);
  const auto [left, right] = find(message, joints);
  if (joints_.empty()) {
    const auto name = [&](std::size_t i) { return i < joints.name.size() ? joints.name[i] : std::to_string(i); };
    joints_ = name(left) + ", " + name(right);
  }
  const auto count = [&](double angle) {
    const double counts = std::round(angle / kTurn * static_cast<double>(resolution_));
    if (!(std::abs(counts) < kMostCounts)) throw InputError(message.topic + ": position: no angle of a wheel");
    return static_cast<std::int64_t>(counts);
  };
  return {stamp_of(message, joints.header), count(joints.position[left]), count(joints.position[right])};
}

}  // namespace ear::ros2
