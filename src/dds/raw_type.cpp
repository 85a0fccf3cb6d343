#include "src/dds/raw_type.h"

#include <dds/dds.h>
#include <dds/ddsi/ddsi_keyhash.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstring>

namespace ear::dds {
namespace {

constexpr const char* kMiddle = "::msg::dds_::";

/// Cyclone sees the first member, and hands it back.
struct RawData {
  ddsi_serdata base;
  std::vector<std::uint8_t> bytes;  ///< with zeros up to a multiple of four, which the wire may take
  std::size_t size = 0;
};

const RawData& raw(const ddsi_serdata* data) { return *reinterpret_cast<const RawData*>(data); }

RawData* make(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) {
  auto* const data = new RawData;
  ddsi_serdata_init(&data->base, type, kind);
  data->base.hash = type->serdata_basehash;
  data->bytes.resize((size + 3) / 4 * 4);
  data->size = size;
  return data;
}

// -- what Cyclone asks of a sample; topics of ROS have no key, so that all samples are of one instance --

bool have_equal_keys(const ddsi_serdata* /*a*/, const ddsi_serdata* /*b*/) { return true; }
std::uint32_t size_of(const ddsi_serdata* data) { return static_cast<std::uint32_t>(raw(data).size); }
void free_data(ddsi_serdata* data) { delete reinterpret_cast<RawData*>(data); }

ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment,
                             std::size_t size) {
  RawData* const data = make(type, kind, size);
  std::uint32_t end = 0;  // bytes that are there; fragments may overlap
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= end || fragment->min > end) continue;
    const unsigned char* const payload = NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    const std::size_t last = std::min<std::size_t>(fragment->maxp1, size);
    if (last > end) std::copy_n(payload + (end - fragment->min), last - end, data->bytes.begin() + end);
    end = fragment->maxp1;
  }
  return &data->base;
}

ddsi_serdata* from_pieces(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                          const ddsrt_iovec_t* pieces, std::size_t size) {
  RawData* const data = make(type, kind, size);
  std::size_t at = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < count && at < size; ++i) {
    const std::size_t length = std::min<std::size_t>(pieces[i].iov_len, size - at);
    std::memcpy(data->bytes.data() + at, pieces[i].iov_base, length);
    at += length;
  }
  return &data->base;
}

ddsi_serdata* from_keyhash(const ddsi_sertype* type, const ddsi_keyhash* /*hash*/) {
  return &make(type, SDK_KEY, 0)->base;
}

ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* sample) {
  const auto& bytes = *static_cast<const std::vector<std::uint8_t>*>(sample);
  RawData* const data = make(type, kind, bytes.size());
  std::copy(bytes.begin(), bytes.end(), data->bytes.begin());
  return &data->base;
}

ddsi_serdata* to_untyped(const ddsi_serdata* data) { return &make(data->type, SDK_KEY, 0)->base; }

void to_bytes(const ddsi_serdata* data, std::size_t offset, std::size_t size, void* to) {
  std::memcpy(to, raw(data).bytes.data() + offset, size);
}

ddsi_serdata* lend_bytes(const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* to) {
  to->iov_base = const_cast<std::uint8_t*>(raw(data).bytes.data() + offset);  // NOLINT: Cyclone only reads
  to->iov_len = size;
  return ddsi_serdata_ref(data);
}
void take_back_bytes(ddsi_serdata* data, const ddsrt_iovec_t* /*lent*/) { ddsi_serdata_unref(data); }

bool to_sample(const ddsi_serdata* data, void* sample, void** /*buffer*/, void* /*limit*/) {
  *static_cast<std::vector<std::uint8_t>*>(sample) = raw(data).bytes;
  return true;
}
bool untyped_to_sample(const ddsi_sertype* /*type*/, const ddsi_serdata* /*data*/, void* /*sample*/, void** /*buffer*/,
                       void* /*limit*/) {
  return true;
}

std::size_t print(const ddsi_sertype* /*type*/, const ddsi_serdata* /*data*/, char* text, std::size_t size) {
  if (size > 0) text[0] = '\0';
  return 0;
}
void get_keyhash(const ddsi_serdata* /*data*/, ddsi_keyhash* hash, bool /*force_md5*/) {
  std::memset(hash->value, 0, sizeof(hash->value));
}

ddsi_serdata_ops data_operations() {
  ddsi_serdata_ops ops{};
  ops.eqkey = have_equal_keys;
  ops.get_size = size_of;
  ops.from_ser = from_fragments;
  ops.from_ser_iov = from_pieces;
  ops.from_keyhash = from_keyhash;
  ops.from_sample = from_sample;
  ops.to_ser = to_bytes;
  ops.to_ser_ref = lend_bytes;
  ops.to_ser_unref = take_back_bytes;
  ops.to_sample = to_sample;
  ops.to_untyped = to_untyped;
  ops.untyped_to_sample = untyped_to_sample;
  ops.free = free_data;
  ops.print = print;
  ops.get_keyhash = get_keyhash;
  return ops;
}

// -- what it asks of a type --

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete type;
}
bool are_equal(const ddsi_sertype* /*a*/, const ddsi_sertype* /*b*/) { return true; }  // their names are
std::uint32_t hash_of(const ddsi_sertype* /*type*/) { return 0; }

// Loans of samples, which are not used here.
void zero_samples(const ddsi_sertype* /*type*/, void* /*samples*/, std::size_t /*count*/) {}
void realloc_samples(void** /*pointers*/, const ddsi_sertype* /*type*/, void* /*old*/, std::size_t /*old_count*/,
                     std::size_t /*count*/) {}
void free_samples(const ddsi_sertype* /*type*/, void** /*pointers*/, std::size_t /*count*/, dds_free_op_t /*op*/) {}

ddsi_sertype_ops type_operations() {
  ddsi_sertype_ops ops{};
  ops.version = ddsi_sertype_v0;
  ops.free = free_type;
  ops.zero_samples = zero_samples;
  ops.realloc_samples = realloc_samples;
  ops.free_samples = free_samples;
  ops.equal = are_equal;
  ops.hash = hash_of;
  return ops;
}

const ddsi_serdata_ops kDataOperations = data_operations();
const ddsi_sertype_ops kTypeOperations = type_operations();

}  // namespace

std::string wire_type(const std::string& type) {
  const std::size_t first = type.find('/');
  const std::size_t last = type.rfind('/');
  if (first == std::string::npos) return type;
  return type.substr(0, first) + kMiddle + type.substr(last + 1) + "_";
}

std::string ros_type(const std::string& wire_type) {
  const std::size_t at = wire_type.find(kMiddle);
  if (at == std::string::npos || wire_type.back() != '_') return wire_type;
  const std::size_t name = at + std::strlen(kMiddle);
  return wire_type.substr(0, at) + "/msg/" + wire_type.substr(name, wire_type.size() - name - 1);
}

std::string wire_topic(const std::string& topic) { return (topic.front() == '/' ? "rt" : "rt/") + topic; }

ddsi_sertype* make_raw_type(const std::string& wire_type) {
  auto* const type = new ddsi_sertype{};
  ddsi_sertype_init(type, wire_type.c_str(), &kTypeOperations, &kDataOperations, true);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  return type;
}

ddsi_serdata* make_raw_data(const ddsi_sertype* type, const std::vector<std::uint8_t>& bytes) {
  return from_sample(type, SDK_DATA, &bytes);
}

RawBytes bytes_of(const ddsi_serdata* data) { return {raw(data).bytes.data(), raw(data).size}; }
void give_back(ddsi_serdata* data) { ddsi_serdata_unref(data); }

}  // namespace ear::dds
