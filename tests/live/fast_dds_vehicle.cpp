#include "tests/live/fast_dds_vehicle.h"

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
#include <cmath>
#include <map>
#include <utility>

namespace fast_dds {
namespace {

using namespace eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;

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

/// Hands messages over as they come.
class Listener final : public DataReaderListener {
 public:
  explicit Listener(std::function<void(Bytes)> take) : take_(std::move(take)) {}
  void on_data_available(DataReader* reader) override {
    Bytes bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) take_(bytes);
    }
  }

 private:
  std::function<void(Bytes)> take_;
};

}  // namespace

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

Odometry odometry(Bytes bytes) {
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
  Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  cdr.read_encapsulation();
  std::int32_t seconds = 0;
  std::uint32_t nanoseconds = 0;
  Odometry message;
  cdr >> seconds >> nanoseconds >> message.frame >> message.child >> message.x >> message.y >> message.z;
  message.t_ns = std::int64_t{seconds} * 1'000'000'000 + nanoseconds;
  return message;
}

class Vehicle::Impl {
 public:
  explicit Impl(int domain) {
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
    participant_ =
        DomainParticipantFactory::get_instance()->create_participant(static_cast<std::uint32_t>(domain), qos);
    publisher_ = participant_->create_publisher(PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  }
  ~Impl() {
    participant_->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  void publish(const std::string& topic, const std::string& type, const Offer& offer) {
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = offer.reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = offer.transient_local ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.ownership().kind = offer.exclusive ? EXCLUSIVE_OWNERSHIP_QOS : SHARED_OWNERSHIP_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = offer.depth;
    qos.publish_mode().kind = SYNCHRONOUS_PUBLISH_MODE;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    writers_[topic] = publisher_->create_datawriter(make_topic(topic, type), qos);
  }

  void subscribe(const std::string& topic, const std::string& type, std::function<void(Bytes)> take) {
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 100;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    listeners_.push_back(std::make_unique<Listener>(std::move(take)));
    subscriber_->create_datareader(make_topic(topic, type), qos, listeners_.back().get());
  }

  [[nodiscard]] bool is_heard() const {
    return std::all_of(writers_.begin(), writers_.end(), [](const auto& writer) {
      PublicationMatchedStatus status;
      writer.second->get_publication_matched_status(status);
      return status.current_count > 0;
    });
  }

  void write(const std::string& topic, Bytes bytes) { writers_.at(topic)->write(&bytes); }

 private:
  Topic* make_topic(const std::string& topic, const std::string& type) {
    const std::string name = type.find(':') == std::string::npos ? "sensor_msgs::msg::dds_::" + type + "_" : type;
    const TypeSupport support(new BytesType(name));
    support.register_type(participant_);
    return participant_->create_topic("rt" + topic, name, TOPIC_QOS_DEFAULT);
  }

  DomainParticipant* participant_ = nullptr;
  Publisher* publisher_ = nullptr;
  Subscriber* subscriber_ = nullptr;
  std::map<std::string, DataWriter*> writers_;
  std::vector<std::unique_ptr<Listener>> listeners_;
};

Vehicle::Vehicle(int domain) : impl_(std::make_unique<Impl>(domain)) {}
Vehicle::~Vehicle() = default;
void Vehicle::publish(const std::string& topic, const std::string& type, const Offer& offer) {
  impl_->publish(topic, type, offer);
}
void Vehicle::subscribe(const std::string& topic, const std::string& type, std::function<void(Bytes)> take) {
  impl_->subscribe(topic, type, std::move(take));
}
void Vehicle::write(const std::string& topic, Bytes bytes) { impl_->write(topic, std::move(bytes)); }
bool Vehicle::is_heard() const { return impl_->is_heard(); }

}  // namespace fast_dds
