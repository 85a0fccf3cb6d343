// A vehicle with ROS 2 that shares no code with what it tests: plays a recording in real time as topics by eProsima's
// Fast DDS, and writes down the odometry that comes back.
//
//   fast_dds_player RECORDING DOMAIN reliable|best_effort ODOMETRY.csv [SECONDS]
//
// Types are written out here, byte by byte as Fast CDR lays them. Everything stays on the loopback interface.
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "src/recording/recording.h"

namespace {

using namespace eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;
using Bytes = std::vector<std::uint8_t>;
using SteadyClock = std::chrono::steady_clock;

/// Any type: its data are bytes that are serialised already.
class BytesType final : public TopicDataType {
 public:
  explicit BytesType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1U << 20U;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<const Bytes*>(data);
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void* /*data*/, eprosima::fastrtps::rtps::InstanceHandle_t* /*handle*/, bool /*force_md5*/) override {
    return false;
  }
};

/// The bytes of a message, which `fill` lays.
template <typename Fill>
Bytes lay(std::size_t capacity, const Fill& fill) {
  Bytes bytes(capacity);
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
  Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  fill(cdr);
  bytes.resize(cdr.getSerializedDataLength());
  return bytes;
}

void header(Cdr& cdr, std::int64_t t_ns, const char* frame) {
  cdr << static_cast<std::int32_t>(t_ns / 1'000'000'000) << static_cast<std::uint32_t>(t_ns % 1'000'000'000);
  cdr << std::string(frame);
}

void nothing(Cdr& cdr, int count) {
  for (int i = 0; i < count; ++i) cdr << 0.0;
}

Bytes imu(const ear::ImuSample& sample) {
  return lay(512, [&](Cdr& cdr) {
    header(cdr, sample.t_ns, "imu0");
    nothing(cdr, 3 + 1 + 9);  // orientation: not known
    for (int i = 0; i < 3; ++i) cdr << sample.gyro_B[i];
    nothing(cdr, 9);
    for (int i = 0; i < 3; ++i) cdr << sample.accel_B[i];
    nothing(cdr, 9);
  });
}

Bytes joints(const ear::EncoderSample& sample, double resolution) {
  const std::vector<std::string> names{"left_wheel", "right_wheel"};
  const std::vector<double> angles{2.0 * M_PI * static_cast<double>(sample.left_count) / resolution,
                                   2.0 * M_PI * static_cast<double>(sample.right_count) / resolution};
  return lay(512, [&](Cdr& cdr) {
    header(cdr, sample.t_ns, "");
    cdr << names << angles << std::vector<double>{} << std::vector<double>{};
  });
}

Bytes range(std::int64_t t_ns, double metres) {
  return lay(256, [&](Cdr& cdr) {
    header(cdr, t_ns, "laser");
    cdr << std::uint8_t{1} << 0.01F << 0.02F << 4.0F;
    cdr << (std::isnan(metres) ? INFINITY : static_cast<float>(metres));
  });
}

Bytes image(std::int64_t t_ns, const ear::ImageView& view) {
  std::vector<std::uint8_t> pixels;
  for (int row = 0; row < view.height; ++row) {
    const std::uint8_t* const from = view.data + row * view.stride;
    pixels.insert(pixels.end(), from, from + view.width);
  }
  return lay(pixels.size() + 256, [&](Cdr& cdr) {
    header(cdr, t_ns, "camera");
    cdr << static_cast<std::uint32_t>(view.height) << static_cast<std::uint32_t>(view.width) << std::string("mono8");
    cdr << std::uint8_t{0} << static_cast<std::uint32_t>(view.width) << pixels;
  });
}

/// Writes each odometry message as a row: stamp [ns], position [m], when it came since the start [ns].
class OdometryLog final : public DataReaderListener {
 public:
  OdometryLog(const std::string& file, SteadyClock::time_point start) : out_(file), start_(start) {
    out_.precision(17);
  }
  void on_data_available(DataReader* reader) override {
    Bytes bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
      Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
      cdr.read_encapsulation();
      std::int32_t seconds = 0;
      std::uint32_t nanoseconds = 0;
      std::string frame, child;
      double x = 0.0, y = 0.0, z = 0.0;
      cdr >> seconds >> nanoseconds >> frame >> child >> x >> y >> z;
      const std::lock_guard lock(mutex_);
      out_ << std::int64_t{seconds} * 1'000'000'000 + nanoseconds << "," << x << "," << y << "," << z << ","
           << std::chrono::nanoseconds(SteadyClock::now() - start_).count() << "," << frame << "," << child
           << std::endl;
    }
  }

 private:
  std::mutex mutex_;
  std::ofstream out_;
  SteadyClock::time_point start_;
};

class Vehicle {
 public:
  Vehicle(int domain, bool reliable) : reliable_(reliable) {
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.emplace_back("127.0.0.1");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    for (std::uint32_t port = 0; port < 4; ++port) {  // metatraffic of the first participants
      eprosima::fastrtps::rtps::Locator_t peer;
      eprosima::fastrtps::rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
      peer.port = 7400 + 250 * static_cast<std::uint32_t>(domain) + 10 + 2 * port;
      qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    }
    participant_ = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    publisher_ = participant_->create_publisher(PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  }

  void publish(const std::string& topic, const std::string& type) {
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = reliable_ ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = topic.find("image") == std::string::npos ? 400 : 8;
    qos.publish_mode().kind = SYNCHRONOUS_PUBLISH_MODE;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    writers_[topic] = publisher_->create_datawriter(make_topic(topic, type), qos);
  }

  void subscribe(const std::string& topic, const std::string& type, DataReaderListener& listener) {
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 100;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    subscriber_->create_datareader(make_topic(topic, type), qos, &listener);
  }

  /// Are all topics read by somebody?
  [[nodiscard]] bool is_heard() const {
    return std::all_of(writers_.begin(), writers_.end(), [](const auto& writer) {
      PublicationMatchedStatus status;
      writer.second->get_publication_matched_status(status);
      return status.current_count > 0;
    });
  }

  void write(const std::string& topic, Bytes bytes) { writers_.at(topic)->write(&bytes); }
  void leave() {
    participant_->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

 private:
  Topic* make_topic(const std::string& topic, const std::string& type) {
    const TypeSupport support(new BytesType(type));
    support.register_type(participant_);
    return participant_->create_topic("rt" + topic, type, TOPIC_QOS_DEFAULT);
  }

  bool reliable_;
  DomainParticipant* participant_ = nullptr;
  Publisher* publisher_ = nullptr;
  Subscriber* subscriber_ = nullptr;
  std::map<std::string, DataWriter*> writers_;
};

int play(const std::string& folder, int domain, bool reliable, const std::string& log, double seconds) {
  ear::Recording recording(folder);
  const ear::Calibration& calibration = recording.calibration();
  Vehicle vehicle(domain, reliable);
  vehicle.publish("/imu0", "sensor_msgs::msg::dds_::Imu_");
  if (calibration.encoder) vehicle.publish("/wheels", "sensor_msgs::msg::dds_::JointState_");
  const std::size_t beams = calibration.lasers ? calibration.lasers->beams.size() : 0;
  for (std::size_t i = 0; i < beams; ++i) {
    vehicle.publish("/laser/" + std::to_string(i), "sensor_msgs::msg::dds_::Range_");
  }
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    vehicle.publish("/cam" + std::to_string(i) + "/image_raw", "sensor_msgs::msg::dds_::Image_");
  }
  const SteadyClock::time_point began = SteadyClock::now();
  while (!vehicle.is_heard()) {
    if (SteadyClock::now() - began > std::chrono::seconds(30)) {
      std::cerr << "nobody reads the topics\n";
      return EXIT_FAILURE;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // the other side is done with discovery, too

  const SteadyClock::time_point start = SteadyClock::now();
  OdometryLog odometry(log, start);
  vehicle.subscribe("/ear/odometry", "nav_msgs::msg::dds_::Odometry_", odometry);
  const std::int64_t first_ns = recording.span().first_ns;
  const double resolution = calibration.encoder ? static_cast<double>(calibration.encoder->resolution) : 1.0;
  std::uint64_t inertial = 0;
  while (const auto sample = recording.next()) {
    const std::int64_t t_ns = ear::time_of(*sample) - first_ns;
    if (seconds > 0.0 && 1e-9 * static_cast<double>(t_ns) > seconds) break;
    std::this_thread::sleep_until(start + std::chrono::nanoseconds(t_ns));
    std::visit(ear::Overloaded{[&](const ear::ImuSample& s) {
                                 vehicle.write("/imu0", imu(s));
                                 ++inertial;
                               },
                               [&](const ear::EncoderSample& s) { vehicle.write("/wheels", joints(s, resolution)); },
                               [&](const ear::LaserSample& s) {
                                 for (std::size_t i = 0; i < s.range.size(); ++i) {
                                   vehicle.write("/laser/" + std::to_string(i), range(s.t_ns, s.range[i]));
                                 }
                               },
                               [&](const ear::RecordedFrame& s) {
                                 vehicle.write("/cam0/image_raw", image(s.t_ns, s.left));
                                 if (!s.right.empty()) vehicle.write("/cam1/image_raw", image(s.t_ns, s.right));
                               }},
               *sample);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // the last estimates
  std::cout << inertial << " inertial samples\n";
  vehicle.leave();
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::cerr << "fast_dds_player RECORDING DOMAIN reliable|best_effort ODOMETRY.csv [SECONDS]\n";
    return EXIT_FAILURE;
  }
  try {
    return play(argv[1], std::atoi(argv[2]), std::string(argv[3]) == "reliable", argv[4],
                argc > 5 ? std::atof(argv[5]) : 0.0);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return EXIT_FAILURE;
  }
}
