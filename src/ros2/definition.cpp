#include "src/ros2/definition.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "src/ros2/messages.h"

namespace ear::ros2 {
namespace {

template <typename T>
constexpr const char* kName = "";
template <>
constexpr const char* kName<bool> = "bool";
template <>
constexpr const char* kName<std::uint8_t> = "uint8";
template <>
constexpr const char* kName<std::int32_t> = "int32";
template <>
constexpr const char* kName<std::uint32_t> = "uint32";
template <>
constexpr const char* kName<float> = "float32";
template <>
constexpr const char* kName<double> = "float64";
template <>
constexpr const char* kName<std::string> = "string";
template <>
constexpr const char* kName<Octet> = "byte";

/// "sensor_msgs/Imu" for "sensor_msgs/msg/Imu", as definitions name a type.
std::string short_name(const char* type) {
  std::string name = type;
  return name.erase(name.find("/msg"), 4);
}

/// Lists the fields of one type, and keeps what types they have.
class Lister {
 public:
  template <typename T>
  void operator()(const char* name, const T& value) {
    text_ += type_of(value) + " " + name + "\n";
  }

  /// The whole text of a type.
  template <typename Message>
  static std::string of() {
    Lister lister;
    lister.list<Message>();
    std::string text = lister.text_;
    while (!lister.below_.empty()) {
      const auto [name, list] = lister.below_.front();
      lister.below_.erase(lister.below_.begin());
      lister.text_.clear();
      list(lister);
      text += std::string(80, '=') + "\nMSG: " + name + "\n" + lister.text_;
    }
    return text;
  }

 private:
  template <typename Message>
  void list() {
    const Message message;
    Message::visit(message, *this);
  }

  template <typename T>
  std::string type_of(const T& /*value*/) {
    if constexpr (*kName<T> != '\0') {
      return kName<T>;
    } else {
      const std::string name = short_name(T::kType);
      if (std::find(seen_.begin(), seen_.end(), name) == seen_.end()) {
        seen_.push_back(name);
        below_.emplace_back(name, [](Lister& lister) { lister.list<T>(); });
      }
      return name;
    }
  }
  template <typename T>
  std::string type_of(const std::vector<T>& /*value*/) {
    return type_of(T{}) + "[]";
  }
  template <typename T, std::size_t N>
  std::string type_of(const std::array<T, N>& /*value*/) {
    return type_of(T{}) + "[" + std::to_string(N) + "]";
  }

  std::string text_;
  std::vector<std::string> seen_;
  std::vector<std::pair<std::string, std::function<void(Lister&)>>> below_;
};

template <typename... Messages>
std::string find(const std::string& type) {
  std::string text;
  const auto try_one = [&](const char* name, std::string (*list)()) {
    if (type == name) text = list();
  };
  (try_one(Messages::kType, &Lister::of<Messages>), ...);
  return text;
}

}  // namespace

std::string definition_of(const std::string& type) {
  return find<Header, Image, CompressedImage, CameraInfo, Imu, JointState, Range, LaserScan, TfMessage, Odometry, Path,
              PoseStamped, DiagnosticArray, Text>(type);
}

}  // namespace ear::ros2
