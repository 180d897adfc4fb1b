// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Subscribes to a topic of point clouds as a node of ROS 2 does, and writes each message to stdout:
// four bytes of its length, little-endian, and its CDR. Ends when its publisher has gone. Knows
// nothing of risley.
//
// Usage: risley_dds_listener DOMAIN TOPIC reliable|best_effort|deaf
//   deaf  subscribes reliably and never takes a message
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

namespace fast = eprosima::fastdds::dds;
#if RISLEY_HAS_FASTDDS < 3
namespace rtps = eprosima::fastrtps::rtps;
const auto kOk = eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
#else
namespace rtps = eprosima::fastdds::rtps;
const auto kOk = fast::RETCODE_OK;
#endif

using Bytes = std::vector<std::uint8_t>;

class AnyType final : public fast::TopicDataType {
 public:
  explicit AnyType(const std::string& name) {
#if RISLEY_HAS_FASTDDS < 3
    setName(name.c_str());
    m_typeSize = 1U << 16U;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
#else
    set_name(name);
    max_serialized_type_size = 1U << 16U;
#endif
  }
#if RISLEY_HAS_FASTDDS < 3
  bool serialize(void*, rtps::SerializedPayload_t*) override { return false; }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    return take(*payload, data);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 0U; };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
#else
  bool serialize(const void* const, rtps::SerializedPayload_t&,
                 fast::DataRepresentationId_t) override {
    return false;
  }
  bool deserialize(rtps::SerializedPayload_t& payload, void* data) override {
    return take(payload, data);
  }
  std::uint32_t calculate_serialized_size(const void* const,
                                          fast::DataRepresentationId_t) override {
    return 0;
  }
  void* create_data() override { return new Bytes; }
  void delete_data(void* data) override { delete static_cast<Bytes*>(data); }
  bool compute_key(rtps::SerializedPayload_t&, rtps::InstanceHandle_t&, bool) override {
    return false;
  }
  bool compute_key(const void* const, rtps::InstanceHandle_t&, bool) override { return false; }
#endif

 private:
  static bool take(const rtps::SerializedPayload_t& payload, void* data) {
    static_cast<Bytes*>(data)->assign(payload.data, payload.data + payload.length);
    return true;
  }
};

int main(int count, char** arguments) {
  if (count != 4) return 2;
  const std::string kind = arguments[3];
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<std::uint32_t>(std::stoi(arguments[1])), fast::PARTICIPANT_QOS_DEFAULT);
  if (participant == nullptr) return 1;
  const char* type = "sensor_msgs::msg::dds_::PointCloud2_";
  const fast::TypeSupport support(new AnyType(type));
  support.register_type(participant);
  auto* topic = participant->create_topic(arguments[2], type, fast::TOPIC_QOS_DEFAULT);
  fast::DataReaderQos settings = fast::DATAREADER_QOS_DEFAULT;
  settings.reliability().kind =
      kind == "best_effort" ? fast::BEST_EFFORT_RELIABILITY_QOS : fast::RELIABLE_RELIABILITY_QOS;
  settings.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  settings.history().depth = 50;
  settings.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  auto* reader = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT)
                     ->create_datareader(topic, settings);
  if (reader == nullptr) return 1;
  std::fputs("ready\n", stderr);
  Bytes message;
  fast::SampleInfo info;
  bool any = false;
  for (;;) {
    while (kind != "deaf" && reader->take_next_sample(&message, &info) == kOk) {
      if (!info.valid_data) continue;
      const auto size = static_cast<std::uint32_t>(message.size());
      std::uint8_t head[4];
      for (int i = 0; i < 4; ++i) head[i] = static_cast<std::uint8_t>(size >> (8 * i));
      std::fwrite(head, 1, 4, stdout);
      std::fwrite(message.data(), 1, size, stdout);
    }
    fast::SubscriptionMatchedStatus matched;
    reader->get_subscription_matched_status(matched);
    any = any || matched.total_count > 0;
    if (any && matched.current_count == 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::fflush(stdout);
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
