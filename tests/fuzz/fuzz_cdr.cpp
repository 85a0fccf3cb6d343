// Messages of ROS 2. First byte: which type. All that may happen is a message, which is then the same when it is
// written and read again, or an InputError; and what sensors make of it.
#include "src/ros2/cdr.h"

#include <vector>

#include "src/ros2/calibration_messages.h"
#include "src/ros2/image_messages.h"
#include "src/ros2/imu_messages.h"
#include "src/ros2/laser_messages.h"
#include "src/ros2/wheel_messages.h"
#include "tests/fuzz/support.h"

namespace {

using namespace ear;
using namespace ear::ros2;

template <typename Message>
void read_again(Bytes bytes) {
  const std::vector<std::uint8_t> once = encode(decode<Message>(bytes));
  const std::vector<std::uint8_t> twice = encode(decode<Message>({once.data(), once.size()}));
  fuzz::require(once == twice, "what is written is read");
  fuzz::require(once.size() < 16 * bytes.size + 64, "a message does not grow");
}

void convert(const char* topic, const char* type, Bytes bytes) {
  SensorTopics topics = default_topics();
  topics.beams[1] = "";
  const RawMessage message{topic, type, 1, bytes};
  Warnings warnings;
  std::vector<ImuSample> imu;
  std::vector<LaserSample> ranges;
  LaserCalibration lasers;
  lasers.beams.resize(1);
  if (message.type == Imu::kType) ImuMessages(topics).take(message, imu, warnings);
  if (message.type == JointState::kType) static_cast<void>(WheelMessages(topics, 4096).take(message));
  if (topics.beams[0] == topic) LaserMessages(topics, lasers).take(message, ranges);
  if (topics.left == topic) static_cast<void>(grey_image(message, "cam0", warnings));
  CalibrationMessages calibration(topics);
  calibration.take(message);
  if (calibration.missing_for_cameras().empty()) static_cast<void>(calibration.cameras());
}

void read(std::uint8_t which, Bytes bytes) {
  switch (which % 12) {
    case 0:
      convert("/imu0", Imu::kType, bytes);
      return read_again<Imu>(bytes);
    case 1:
      convert("/wheels", JointState::kType, bytes);
      return read_again<JointState>(bytes);
    case 2:
      convert("/laser/0", Range::kType, bytes);
      return read_again<Range>(bytes);
    case 3:
      convert("/laser/0", LaserScan::kType, bytes);
      return read_again<LaserScan>(bytes);
    case 4:
      convert("/cam0/image_raw", Image::kType, bytes);
      return read_again<Image>(bytes);
    case 5:
      convert("/cam0/image_raw", CompressedImage::kType, bytes);
      return read_again<CompressedImage>(bytes);
    case 6:
      convert("/cam0/camera_info", CameraInfo::kType, bytes);
      return read_again<CameraInfo>(bytes);
    case 7:
      convert("/tf_static", TfMessage::kType, bytes);
      return read_again<TfMessage>(bytes);
    case 8:
      return read_again<ros2::Odometry>(bytes);
    case 9:
      return read_again<Path>(bytes);
    case 10:
      return read_again<DiagnosticArray>(bytes);
    default:
      return read_again<PoseStamped>(bytes);
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  try {
    read(data[0], {data + 1, size - 1});
  } catch (const InputError&) {
  }
  return 0;
}
