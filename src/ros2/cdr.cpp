#include "src/ros2/cdr.h"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>

#include <limits>
#include <type_traits>

namespace ear::ros2 {
namespace {

namespace cdr = eprosima::fastcdr;

constexpr std::size_t kHeader = 4;  // representation and options

/// The fewest bytes that a value takes on the wire: what a sequence of them must leave room for.
class LeastSize {
 public:
  template <typename T>
  void operator()(const char* /*name*/, const T& value) {
    add(value);
  }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  template <typename T>
  void add(const T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      size_ += sizeof(T);
    } else {
      T::visit(value, *this);
    }
  }
  void add(const Octet& /*octet*/) { size_ += 1; }
  void add(const std::string& /*text*/) { size_ += sizeof(std::uint32_t); }
  template <typename T>
  void add(const std::vector<T>& /*sequence*/) {
    size_ += sizeof(std::uint32_t);
  }
  template <typename T, std::size_t N>
  void add(const std::array<T, N>& /*array*/) {
    size_ += N * sizeof(T);
  }

  std::size_t size_ = 0;
};

template <typename T>
std::size_t least_size() {
  LeastSize least;
  least("", T{});
  return least.size();
}

class Writer {
 public:
  explicit Writer(cdr::Cdr& cdr) : cdr_(cdr) {}

  template <typename T>
  void operator()(const char* /*name*/, const T& value) {
    put(value);
  }

 private:
  template <typename T>
  void put(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
      cdr_.serialize(value);
    } else {
      T::visit(value, *this);
    }
  }
  void put(const Octet& octet) { cdr_.serialize(octet.value); }
  template <typename T, std::size_t N>
  void put(const std::array<T, N>& values) {
    cdr_.serializeArray(values.data(), N);
  }
  template <typename T>
  void put(const std::vector<T>& values) {
    cdr_.serialize(static_cast<std::uint32_t>(values.size()));
    if constexpr (std::is_arithmetic_v<T>) {
      if (!values.empty()) cdr_.serializeArray(values.data(), values.size());
    } else {
      for (const T& value : values) put(value);
    }
  }

  cdr::Cdr& cdr_;
};

class Reader {
 public:
  Reader(cdr::Cdr& cdr, std::size_t size) : cdr_(cdr), size_(size) {}

  template <typename T>
  void operator()(const char* name, T& value) {
    path_.push_back(name);
    get(value);
    path_.pop_back();
  }
  /// The field that is being read, "header.stamp.sec".
  [[nodiscard]] std::string field() const {
    std::string joined;
    for (const char* name : path_) joined += (joined.empty() ? "" : ".") + std::string(name);
    return joined.empty() ? "header" : joined;
  }

 private:
  template <typename T>
  void get(T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
      cdr_.deserialize(value);
    } else {
      T::visit(value, *this);
    }
  }
  void get(Octet& octet) { cdr_.deserialize(octet.value); }
  template <typename T, std::size_t N>
  void get(std::array<T, N>& values) {
    cdr_.deserializeArray(values.data(), N);
  }
  template <typename T>
  void get(std::vector<T>& values) {
    std::uint32_t length = 0;
    cdr_.deserialize(length);
    const std::size_t left = size_ - cdr_.getSerializedDataLength();
    if (length > left / least_size<T>()) {
      throw InputError("says " + std::to_string(length) + " elements, but " + std::to_string(left) + " bytes are left");
    }
    values.resize(length);
    if constexpr (std::is_arithmetic_v<T>) {
      if (length > 0) cdr_.deserializeArray(values.data(), length);
    } else {
      for (T& value : values) get(value);
    }
  }

  cdr::Cdr& cdr_;
  std::size_t size_;
  std::vector<const char*> path_;
};

CdrError wrong(const char* type, const std::string& field, const std::string& what) {
  return CdrError(std::string(type) + ": " + field + ": " + what);
}

void check_header(const char* type, Bytes bytes) {
  if (bytes.size < kHeader) {
    throw wrong(type, "header", "a message has at least 4 bytes, not " + std::to_string(bytes.size));
  }
  if (bytes.data[0] == 0 && bytes.data[1] <= 1) return;  // CDR_BE, CDR_LE
  throw wrong(type, "header",
              "representation " + std::to_string(256 * bytes.data[0] + bytes.data[1]) + " is neither 0 nor 1 (XCDR1)");
}

}  // namespace

template <typename Message>
std::vector<std::uint8_t> encode(const Message& message, ByteOrder order) {
  cdr::FastBuffer buffer;
  cdr::Cdr cdr(buffer, order == ByteOrder::little ? cdr::Cdr::LITTLE_ENDIANNESS : cdr::Cdr::BIG_ENDIANNESS,
               cdr::Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  Writer writer(cdr);
  Message::visit(message, writer);
  const auto* const begin = reinterpret_cast<const std::uint8_t*>(buffer.getBuffer());
  return {begin, begin + cdr.getSerializedDataLength()};
}

template <typename Message>
Message decode(Bytes bytes) {
  check_header(Message::kType, bytes);
  // The library takes no pointer to const, but changes nothing.
  auto* const data = reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data));  // NOLINT
  cdr::FastBuffer buffer(data, bytes.size);
  cdr::Cdr cdr(buffer, cdr::Cdr::DEFAULT_ENDIAN, cdr::Cdr::DDS_CDR);
  Reader reader(cdr, bytes.size);
  Message message;
  try {
    cdr.read_encapsulation();
    Message::visit(message, reader);
  } catch (const InputError& error) {
    throw wrong(Message::kType, reader.field(), error.what());
  } catch (const cdr::exception::Exception& error) {
    throw wrong(Message::kType, reader.field(),
                "ends early or has no such value, in " + std::to_string(bytes.size) + " bytes (" + error.what() + ")");
  }
  return message;
}

std::string canonical_type(const std::string& name) {
  std::string type = name;
  for (std::size_t at = type.find("::"); at != std::string::npos; at = type.find("::")) type.replace(at, 2, "/");
  const std::size_t dds = type.find("/dds_/");
  if (dds != std::string::npos) {
    type.erase(dds, 5);
    if (!type.empty() && type.back() == '_') type.pop_back();
  }
  const std::size_t slash = type.find('/');
  if (slash != std::string::npos && type.find('/', slash + 1) == std::string::npos) type.insert(slash, "/msg");
  return type;
}

// NOLINTBEGIN: one line per topic's type
#define EAR_ROS2_TYPE(Message)                                                   \
  template std::vector<std::uint8_t> encode<Message>(const Message&, ByteOrder); \
  template Message decode<Message>(Bytes);
EAR_ROS2_TYPE(Header)
EAR_ROS2_TYPE(Image)
EAR_ROS2_TYPE(CompressedImage)
EAR_ROS2_TYPE(CameraInfo)
EAR_ROS2_TYPE(Imu)
EAR_ROS2_TYPE(JointState)
EAR_ROS2_TYPE(Range)
EAR_ROS2_TYPE(LaserScan)
EAR_ROS2_TYPE(TfMessage)
EAR_ROS2_TYPE(Odometry)
EAR_ROS2_TYPE(Path)
EAR_ROS2_TYPE(PoseStamped)
EAR_ROS2_TYPE(DiagnosticArray)
EAR_ROS2_TYPE(Text)
#undef EAR_ROS2_TYPE
// NOLINTEND

}  // namespace ear::ros2
