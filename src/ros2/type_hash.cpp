#include "src/ros2/type_hash.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <map>
#include <vector>

#include "src/ros2/messages.h"
#include "src/ros2/sha256.h"

namespace ear::ros2 {
namespace {

// FieldType.msg of type_description_interfaces.
constexpr int kNested = 1, kArray = 48, kSequence = 144;
template <typename T>
constexpr int kTypeId = kNested;
template <>
constexpr int kTypeId<std::uint8_t> = 3;
template <>
constexpr int kTypeId<std::int32_t> = 6;
template <>
constexpr int kTypeId<std::uint32_t> = 7;
template <>
[[maybe_unused]] constexpr int kTypeId<float> = 10;
template <>
constexpr int kTypeId<double> = 11;
template <>
constexpr int kTypeId<Octet> = 16;
template <>
constexpr int kTypeId<std::string> = 17;

/// The description of a type and of all within it, as the text that is hashed: JSON with a blank behind : and ,.
class Describer {
 public:
  /// One field of the type that is being described.
  template <typename T>
  void operator()(const char* name, const T& value) {
    fields_ += fields_.empty() ? "" : ", ";
    fields_ += std::string("{\"name\": \"") + name + "\", \"type\": " + type(value) + "}";
  }

  template <typename Message>
  static std::string of() {
    Describer describer;
    const std::string own = describer.describe<Message>();
    std::string within;
    for (const auto& [name, text] : describer.within_) within += (within.empty() ? "" : ", ") + text;
    return "{\"type_description\": " + own + ", \"referenced_type_descriptions\": [" + within + "]}";
  }

 private:
  template <typename Message>
  std::string describe() {
    std::string outer;
    outer.swap(fields_);
    const Message message;
    Message::visit(message, *this);
    fields_.swap(outer);
    return std::string("{\"type_name\": \"") + Message::kType + "\", \"fields\": [" + outer + "]}";
  }

  template <typename T>
  std::string type(const T& /*value*/, int kind = 0, std::size_t capacity = 0) {
    std::string nested;
    if constexpr (kTypeId<T> == kNested) {
      nested = T::kType;
      if (within_.find(nested) == within_.end()) {
        std::string text = describe<T>();
        within_[nested] = std::move(text);
      }
    }
    return "{\"type_id\": " + std::to_string(kTypeId<T> + kind) + ", \"capacity\": " + std::to_string(capacity) +
           ", \"string_capacity\": 0, \"nested_type_name\": \"" + nested + "\"}";
  }
  template <typename T>
  std::string type(const std::vector<T>& /*value*/) {
    return type(T{}, kSequence);
  }
  template <typename T, std::size_t N>
  std::string type(const std::array<T, N>& /*value*/) {
    return type(T{}, kArray, N);
  }

  std::string fields_;
  std::map<std::string, std::string> within_;  ///< by name, which is their order
};

template <typename... Messages>
std::string describe(const std::string& type) {
  std::string text;
  const auto try_one = [&](const char* name, std::string (*describe_it)()) {
    if (type == name) text = describe_it();
  };
  (try_one(Messages::kType, &Describer::of<Messages>), ...);
  return text;
}

}  // namespace

std::string type_hash_of(const std::string& type) {
  const std::string description = describe<Odometry, Path, TfMessage, DiagnosticArray, Image, Imu, PoseStamped>(type);
  if (description.empty()) return "";
  std::string hash = "RIHS01_";
  for (const std::uint8_t byte : sha256(description)) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", byte);
    hash += digits.data();
  }
  return hash;
}

}  // namespace ear::ros2
