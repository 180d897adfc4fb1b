// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/dds_publisher.hpp"

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/wire/udp_socket.hpp"

#ifdef RISLEY_HAS_FASTDDS

#include <algorithm>
#include <cstring>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fmt/format.h>
#if RISLEY_HAS_FASTDDS < 3
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#else
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#endif

namespace risley::wire {
namespace {

namespace dds = eprosima::fastdds::dds;
#if RISLEY_HAS_FASTDDS < 3
namespace rtps = eprosima::fastrtps::rtps;
using DdsDuration = eprosima::fastrtps::Duration_t;
#else
namespace rtps = eprosima::fastdds::rtps;
using DdsDuration = dds::Duration_t;
#endif

const DdsDuration kForConfirmation{2, 0};
/// Initial room for a message; it grows.
constexpr std::uint32_t kUsualBytes = 1U << 16U;

using Bytes = std::span<const std::uint8_t>;

/// Messages that are bytes already.
class SerialisedType final : public dds::TopicDataType {
 public:
  explicit SerialisedType(const std::string& name) {
#if RISLEY_HAS_FASTDDS < 3
    setName(name.c_str());
    m_typeSize = kUsualBytes;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
#else
    set_name(name);
    max_serialized_type_size = kUsualBytes;
#endif
  }

  // Names and arguments differ between the versions. Topics here have no keys, and nothing is
  // received.
#if RISLEY_HAS_FASTDDS < 3
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    return write(*static_cast<const Bytes*>(data), *payload);
  }
  bool deserialize(rtps::SerializedPayload_t* /*payload*/, void* /*data*/) override {
    return false;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [size = size_of(data)] { return size; };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void* /*data*/, rtps::InstanceHandle_t* /*key*/, bool /*md5*/) override {
    return false;
  }
#else
  bool serialize(const void* const data, rtps::SerializedPayload_t& payload,
                 dds::DataRepresentationId_t /*form*/) override {
    return write(*static_cast<const Bytes*>(data), payload);
  }
  bool deserialize(rtps::SerializedPayload_t& /*payload*/, void* /*data*/) override {
    return false;
  }
  std::uint32_t calculate_serialized_size(const void* const data,
                                          dds::DataRepresentationId_t /*form*/) override {
    return size_of(data);
  }
  void* create_data() override { return new Bytes; }
  void delete_data(void* data) override { delete static_cast<Bytes*>(data); }
  bool compute_key(rtps::SerializedPayload_t& /*payload*/, rtps::InstanceHandle_t& /*key*/,
                   bool /*md5*/) override {
    return false;
  }
  bool compute_key(const void* const /*data*/, rtps::InstanceHandle_t& /*key*/,
                   bool /*md5*/) override {
    return false;
  }
#endif

 private:
  static std::uint32_t size_of(const void* data) {
    return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size());
  }
  static bool write(Bytes message, rtps::SerializedPayload_t& payload) {
    if (message.size() > payload.max_size) return false;
    std::memcpy(payload.data, message.data(), message.size());
    payload.length = static_cast<std::uint32_t>(message.size());
    payload.encapsulation = message.size() > 1 && message[1] == 1 ? CDR_LE : CDR_BE;
    return true;
  }
};

/// sensor_msgs/msg/PointCloud2 of ROS 2 is sensor_msgs::msg::dds_::PointCloud2_ in DDS.
std::string dds_type(const std::string& type) {
  std::string name;
  for (const char letter : type.substr(0, type.rfind('/'))) {
    name += letter == '/' ? "::" : std::string(1, letter);
  }
  return name + "::dds_::" + type.substr(type.rfind('/') + 1) + "_";
}

template <class Entity>
Entity& require_made(Entity* entity, const std::string& what) {
  if (entity == nullptr) throw NetworkError(fmt::format("Fast DDS cannot make {}", what));
  return *entity;
}

}  // namespace

/// Of one domain, with all its publications.
class DdsPublisher::Participant {
 public:
  Participant(int domain, bool local_only) {
    dds::DomainParticipantQos settings;
    settings.name("risley");
    if (local_only) {
      const auto loopback = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
      loopback->interfaceWhiteList.push_back("127.0.0.1");
      settings.transport().use_builtin_transports = false;
      settings.transport().user_transports.push_back(loopback);
    }
    participant_ =
        &require_made(factory().create_participant(static_cast<std::uint32_t>(domain), settings),
                      fmt::format("a participant of domain {}", domain));
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  }

  ~Participant() {
    for (const Topic& topic : topics_) topic.writer->wait_for_acknowledgments(kForConfirmation);
    participant_->delete_contained_entities();
    factory().delete_participant(participant_);
  }
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  std::size_t add(const std::string& name, const std::string& type) {
    const std::scoped_lock lock(mutex_);
    const auto known = std::ranges::find(topics_, name, &Topic::name);
    if (known != topics_.end()) return static_cast<std::size_t>(known - topics_.begin());
    const dds::TypeSupport support(new SerialisedType(dds_type(type)));
    support.register_type(participant_);
    dds::DataWriterQos settings = dds::DATAWRITER_QOS_DEFAULT;
    settings.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    settings.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    settings.history().depth = kKept;
    settings.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
    settings.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    dds::Topic& topic = require_made(
        participant_->create_topic("rt" + name, dds_type(type), dds::TOPIC_QOS_DEFAULT),
        "the topic rt" + name);
    topics_.push_back({name, &require_made(publisher_->create_datawriter(&topic, settings),
                                           "a writer of rt" + name)});
    return topics_.size() - 1;
  }

  void send(std::size_t topic, Bytes message) {
    dds::DataWriter* writer = nullptr;
    {
      const std::scoped_lock lock(mutex_);
      writer = topics_[topic].writer;
    }
#if RISLEY_HAS_FASTDDS < 3
    const bool taken = writer->write(&message);
#else
    const bool taken = writer->write(&message) == dds::RETCODE_OK;
#endif
    if (!taken) {
      throw NetworkError(fmt::format("Fast DDS takes no message of {} bytes", message.size()));
    }
  }

 private:
  static dds::DomainParticipantFactory& factory() {
    return *dds::DomainParticipantFactory::get_instance();
  }
  struct Topic {
    std::string name;  ///< of ROS 2
    dds::DataWriter* writer = nullptr;
  };
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  std::mutex mutex_;  // of the topics
  std::vector<Topic> topics_;
};

}  // namespace risley::wire

#else

namespace risley::wire {

/// There is none without Fast DDS.
class DdsPublisher::Participant {
 public:
  Participant(int /*domain*/, bool /*local_only*/) {
    throw InvalidArgument(
        "this build cannot publish to ROS 2: build it again where Fast DDS is installed "
        "(Debian 12: libfastrtps-dev, Debian 13: libfastdds-dev)");
  }
  static std::size_t add(const std::string& /*name*/, const std::string& /*type*/) { return 0; }
  static void send(std::size_t /*topic*/, std::span<const std::uint8_t> /*message*/) {}
};

}  // namespace risley::wire

#endif

namespace risley::wire {

DdsPublisher::DdsPublisher(int domain, bool local_only) {
  require_between("DDS domain", domain, 0, kHighestDdsDomain);
  participant_ = std::make_unique<Participant>(domain, local_only);
}
DdsPublisher::~DdsPublisher() = default;

std::size_t DdsPublisher::add(const std::string& topic, const std::string& type) {
  return participant_->add(topic, type);
}
void DdsPublisher::send(std::size_t topic, std::span<const std::uint8_t> message) {
  participant_->send(topic, message);
}

}  // namespace risley::wire
