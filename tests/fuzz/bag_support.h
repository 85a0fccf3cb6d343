// Reads any bytes as a bag: all topics, and the sensors' samples.
#pragma once

#include <string>
#include <vector>

#include "src/recording/recording.h"
#include "src/rosbag2/bag.h"
#include "src/rosbag2/rosbag2.h"
#include "tests/fuzz/support.h"

namespace ear::fuzz {

/// All that may happen are messages, samples in the order of time, warnings, or an InputError.
inline void read_bag(const std::filesystem::path& file) {
  try {
    Warnings warnings;
    const rosbag2::Bag bag(file, warnings);
    static_cast<void>(bag.attachments());
    std::size_t bytes = 0;
    for (const rosbag2::BagTopic& topic : bag.topics()) {
      static_cast<void>(bag.last(topic.name));
      rosbag2::BagPass pass = bag.pass({topic.name});
      while (const auto message = pass.next(warnings)) bytes += message->bytes.size;
    }
    require(bytes < (std::size_t{1} << 32U), "messages end");
    std::vector<std::string> notes;
    RecordingOptions options;
    options.accept_bad_calibration = true;
    Recording recording(open_ros2_bag(file, {}, options, notes), options);
    std::optional<TimeNs> last_ns;
    while (const auto sample = recording.next()) {
      const auto* const imu = std::get_if<ImuSample>(&*sample);
      if (imu == nullptr) continue;
      require(!last_ns || imu->t_ns > *last_ns, "time grows");
      last_ns = imu->t_ns;
    }
  } catch (const InputError&) {
  }
}

}  // namespace ear::fuzz
