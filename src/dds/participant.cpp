#include "src/dds/participant.h"

#include <dds/dds.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <stdexcept>
#include <utility>

namespace ear::dds {
namespace {

constexpr int kMostDomain = 232;
constexpr std::size_t kMostPublications = 1024;  // that are looked at
constexpr dds_duration_t kAtOnce = 0;

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

Qos make_qos(bool reliable, bool transient_local, int depth) {
  Qos qos(dds_create_qos(), &dds_delete_qos);
  dds_qset_reliability(qos.get(), reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kAtOnce);
  dds_qset_durability(qos.get(), transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  return qos;
}

dds_entity_t checked(dds_entity_t entity, const std::string& what) {
  if (entity < 0) throw std::runtime_error("ROS 2: " + what + ": " + dds_strretcode(-entity));
  return entity;
}

/// A topic of ROS; `used` gets the type that Cyclone uses for it.
dds_entity_t make_topic(const Participant& participant, const std::string& topic, const std::string& type,
                        const ddsi_sertype** used) {
  ddsi_sertype* sertype = make_raw_type(wire_type(type));
  const std::string name = wire_topic(topic);
  const dds_entity_t entity =
      dds_create_topic_sertype(participant.entity(), name.c_str(), &sertype, nullptr, nullptr, nullptr);
  if (used != nullptr) *used = sertype;
  return checked(entity, topic);
}

Publication describe(const dds_builtintopic_endpoint_t& endpoint) {
  Publication publication;
  publication.topic = std::string(endpoint.topic_name).substr(2);  // without "rt"
  publication.type = ros_type(endpoint.type_name);
  dds_reliability_kind_t reliability = DDS_RELIABILITY_BEST_EFFORT;
  dds_duration_t blocking = 0;
  dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
  if (dds_qget_reliability(endpoint.qos, &reliability, &blocking)) {
    publication.reliable = reliability == DDS_RELIABILITY_RELIABLE;
  }
  void* user_data = nullptr;
  std::size_t user_data_size = 0;
  if (dds_qget_userdata(endpoint.qos, &user_data, &user_data_size) && user_data != nullptr) {
    publication.user_data.assign(static_cast<const char*>(user_data), user_data_size);
    dds_free(user_data);
  }
  if (dds_qget_durability(endpoint.qos, &durability)) {
    publication.transient_local = durability != DDS_DURABILITY_VOLATILE;
  }
  return publication;
}

const char* name_of_policy(std::uint32_t id) {
  switch (id) {
    case DDS_RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    case DDS_DURABILITY_QOS_POLICY_ID:
      return "durability";
    case DDS_DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case DDS_LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    case DDS_OWNERSHIP_QOS_POLICY_ID:
      return "ownership";
    default:
      return "another policy";
  }
}

}  // namespace

int domain_of_environment() {
  const char* const text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == '\0') return 0;
  char* end = nullptr;
  const long domain = std::strtol(text, &end, 10);
  if (*end != '\0' || domain < 0 || domain > kMostDomain) {
    throw std::invalid_argument("ROS_DOMAIN_ID: '" + std::string(text) + "' is no number from 0 to 232");
  }
  return static_cast<int>(domain);
}

Participant::Participant(int domain) {
  entity_ = checked(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr), "no participant");
  discovery_ = checked(dds_create_reader(entity_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr), "discovery");
}

Participant::~Participant() { dds_delete(entity_); }

std::vector<Publication> Participant::publications() const {
  std::vector<void*> samples(kMostPublications, nullptr);
  std::vector<dds_sample_info_t> infos(kMostPublications);
  const dds_return_t count = dds_read(discovery_, samples.data(), infos.data(), kMostPublications,
                                      static_cast<std::uint32_t>(kMostPublications));
  std::vector<Publication> all;
  dds_guid_t self{};
  dds_get_guid(entity_, &self);
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(count, 0)); ++i) {
    if (!infos[i].valid_data || infos[i].instance_state != DDS_ALIVE_INSTANCE_STATE) continue;
    const auto& endpoint = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
    const bool own = std::equal(std::begin(self.v), std::end(self.v), std::begin(endpoint.participant_key.v));
    if (!own && std::string(endpoint.topic_name).rfind("rt/", 0) == 0) all.push_back(describe(endpoint));
  }
  if (count > 0) dds_return_loan(discovery_, samples.data(), count);
  return all;
}

Writer::Writer(const Participant& participant, const std::string& topic, const std::string& type,
               const Options& options) {
  const dds_entity_t on = make_topic(participant, topic, type, &type_);
  const Qos qos = make_qos(options.reliable, options.transient_local, options.depth);
  if (!options.user_data.empty()) dds_qset_userdata(qos.get(), options.user_data.data(), options.user_data.size());
  entity_ = checked(dds_create_writer(participant.entity(), on, qos.get(), nullptr), topic);
}

bool Writer::write(const std::vector<std::uint8_t>& cdr) {
  ddsi_serdata* const data = make_raw_data(type_, cdr);
  return dds_writecdr(entity_, data) == DDS_RETCODE_OK;
}

bool Writer::is_read() const {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(entity_, &status) == DDS_RETCODE_OK && status.current_count > 0;
}

struct Subscription::Reader {
  Wanted wanted;
  dds_entity_t topic = 0;
  dds_entity_t reader = 0;  ///< 0: nobody writes the topic
  bool reliable = false, transient_local = false;
  std::size_t publishers = 0;
  std::string wrong_type;
  std::uint32_t incompatible = 0;
};

Subscription::Subscription(const Participant& participant, std::vector<Wanted> wanted,
                           std::function<void(const Received&)> take)
    : participant_(participant), take_(std::move(take)) {
  waitset_ = checked(dds_create_waitset(participant.entity()), "no waitset");
  for (Wanted& one : wanted) {
    auto reader = std::make_unique<Reader>();
    reader->topic = make_topic(participant, one.topic, one.type, nullptr);
    reader->wanted = std::move(one);
    readers_.push_back(std::move(reader));
  }
  thread_ = std::thread([this] { run(); });
}

Subscription::~Subscription() {
  stop_ = true;
  thread_.join();
  for (const auto& reader : readers_) {
    if (reader->reader > 0) dds_delete(reader->reader);
    dds_delete(reader->topic);
  }
  dds_delete(waitset_);
}

void Subscription::run() {
  constexpr dds_duration_t kPatience = DDS_MSECS(50);
  constexpr dds_duration_t kInterval = DDS_MSECS(200);  // between two looks at who writes
  dds_time_t next = 0;
  while (!stop_) {
    if (dds_time() >= next) {
      adapt();
      next = dds_time() + kInterval;
    }
    bool more = false;
    for (const auto& reader : readers_) more = (reader->reader > 0 && read(*reader)) || more;
    if (more) continue;
    std::array<dds_attach_t, 16> ready{};
    dds_waitset_wait(waitset_, ready.data(), ready.size(), kPatience);
  }
}

/// A few samples of one topic; true: there may be more. What waits of several topics is read in turns, since whoever
/// puts their samples together takes a topic that falls far behind the others for silent.
bool Subscription::read(Reader& reader) {
  constexpr std::uint32_t kAtATime = 4;
  std::array<ddsi_serdata*, kAtATime> data{};
  std::array<dds_sample_info_t, kAtATime> infos{};
  const dds_return_t count = dds_takecdr(reader.reader, data.data(), kAtATime, infos.data(), DDS_ANY_STATE);
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(count, 0)); ++i) {
    if (infos[i].valid_data) take_({reader.wanted, bytes_of(data[i])});
    give_back(data[i]);
  }
  return count == static_cast<dds_return_t>(kAtATime);
}

/// Readers as publishers are.
void Subscription::adapt() {
  const std::vector<Publication> all = participant_.publications();
  std::vector<std::string> words;
  for (const auto& reader : readers_) {
    const Wanted& wanted = reader->wanted;
    std::size_t publishers = 0;
    bool reliable = true, transient_local = true;
    std::string wrong_type;
    for (const Publication& one : all) {
      if (one.topic != wanted.topic) continue;
      if (one.type != wanted.type) {
        wrong_type = one.type;
        continue;
      }
      ++publishers;
      reliable = reliable && one.reliable;
      transient_local = transient_local && one.transient_local;
    }
    if (!wrong_type.empty() && wrong_type != reader->wrong_type) {
      words.push_back(wanted.topic + ": is published as " + wrong_type + ", not as " + wanted.type);
    }
    reader->wrong_type = wrong_type;
    if (publishers > 0 && reader->publishers == 0) words.push_back(wanted.topic + ": has a publisher");
    if (publishers == 0 && reader->publishers > 0) words.push_back(wanted.topic + ": its publisher is gone");
    reader->publishers = publishers;
    if (publishers == 0) continue;

    const bool fits = reader->reader > 0 && reader->reliable == reliable && reader->transient_local == transient_local;
    if (!fits) {
      if (reader->reader > 0) dds_delete(reader->reader);
      const Qos qos = make_qos(reliable, transient_local, wanted.depth);
      reader->reader = dds_create_reader(participant_.entity(), reader->topic, qos.get(), nullptr);
      reader->reliable = reliable;
      reader->transient_local = transient_local;
      dds_set_status_mask(reader->reader, DDS_DATA_AVAILABLE_STATUS);
      dds_waitset_attach(waitset_, reader->reader, 0);
    }
    dds_requested_incompatible_qos_status_t status{};
    dds_get_requested_incompatible_qos_status(reader->reader, &status);
    if (status.total_count > reader->incompatible) {
      words.push_back(wanted.topic +
                      ": its publisher's quality of service does not fit: " + name_of_policy(status.last_policy_id));
    }
    reader->incompatible = status.total_count;
  }
  const std::lock_guard lock(mutex_);
  words_.insert(words_.end(), words.begin(), words.end());
}

std::vector<std::string> Subscription::look() {
  const std::lock_guard lock(mutex_);
  return std::exchange(words_, {});
}

}  // namespace ear::dds
