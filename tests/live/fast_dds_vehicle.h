// A vehicle with ROS 2 that shares no code with what it tests: its topics by eProsima's Fast DDS, its messages written
// out byte by byte as Fast CDR lays them. Everything stays on the loopback interface.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ear/types.h"

namespace fast_dds {

using Bytes = std::vector<std::uint8_t>;

// Messages, with the four bytes of the representation.
Bytes imu(const ear::ImuSample& sample);
Bytes joints(const ear::EncoderSample& sample, double resolution);
Bytes range(std::int64_t t_ns, double metres);
Bytes image(std::int64_t t_ns, const ear::ImageView& view);

/// What a received nav_msgs/Odometry says.
struct Odometry {
  std::int64_t t_ns = 0;
  std::string frame, child;
  double x = 0.0, y = 0.0, z = 0.0;
};
Odometry odometry(Bytes bytes);

/// Quality of service of a writer.
struct Offer {
  bool reliable = true;
  bool transient_local = false;
  bool exclusive = false;  ///< ownership, which no reader of ROS asks for
  int depth = 400;
};

class Vehicle {
 public:
  explicit Vehicle(int domain);
  ~Vehicle();  ///< leaves, as a process does that ends
  Vehicle(const Vehicle&) = delete;
  Vehicle& operator=(const Vehicle&) = delete;
  Vehicle(Vehicle&&) = delete;
  Vehicle& operator=(Vehicle&&) = delete;

  /// `type`: "Imu" of sensor_msgs, or a whole name as on the wire.
  void publish(const std::string& topic, const std::string& type, const Offer& offer = {});
  /// `take` gets each message, by a thread of Fast DDS.
  void subscribe(const std::string& topic, const std::string& type, std::function<void(Bytes)> take);
  void write(const std::string& topic, Bytes bytes);
  /// Are all topics read by somebody?
  [[nodiscard]] bool is_heard() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fast_dds
