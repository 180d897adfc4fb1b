// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags of ROS 1, version 2.0, written through rosbag_storage.
#include <cstring>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <boost/make_shared.hpp>
#include <fmt/format.h>
#include <rosbag/bag.h>

#include "risley/bags/bag_writer.hpp"
#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"

#include "bags/bag_kinds.hpp"
#include "bags/rosbag_call.hpp"

namespace risley::bags {
namespace {

/// A serialised message, with the topic that describes it.
struct SerialisedMessage {
  const Topic* topic = nullptr;
  std::span<const std::uint8_t> bytes;
};

}  // namespace
}  // namespace risley::bags

namespace ros {
namespace message_traits {
template <>
struct MD5Sum<risley::bags::SerialisedMessage> {
  static const char* value(const risley::bags::SerialisedMessage& message) {
    return message.topic->stored.md5.c_str();
  }
};
template <>
struct DataType<risley::bags::SerialisedMessage> {
  static const char* value(const risley::bags::SerialisedMessage& message) {
    return message.topic->stored.type.c_str();
  }
};
template <>
struct Definition<risley::bags::SerialisedMessage> {
  static const char* value(const risley::bags::SerialisedMessage& message) {
    return message.topic->stored.definition.c_str();
  }
};
}  // namespace message_traits
namespace serialization {
template <>
struct Serializer<risley::bags::SerialisedMessage> {
  template <class Stream>
  static void write(Stream& stream, const risley::bags::SerialisedMessage& message) {
    const auto bytes = static_cast<std::uint32_t>(message.bytes.size());
    std::memcpy(stream.advance(bytes), message.bytes.data(), bytes);
  }
  // NOLINTNEXTLINE(readability-identifier-naming): the name that ROS calls
  static std::uint32_t serializedLength(const risley::bags::SerialisedMessage& message) {
    return static_cast<std::uint32_t>(message.bytes.size());
  }
};
}  // namespace serialization
}  // namespace ros

namespace risley::bags {
namespace {

class Ros1Writer final : public BagWriter {
 public:
  explicit Ros1Writer(const std::string& path) : output_(path) {
    call([this] {
      bag_ = std::make_unique<rosbag::Bag>();
      bag_->open(output_.temporary_path(), rosbag::bagmode::Write);
    });
  }

  ~Ros1Writer() override {
    if (!bag_) return;
    try {
      call([this] {
        bag_->close();
        bag_.reset();
      });
    } catch (const FileError&) {
      // The file will be removed.
    }
  }

  std::size_t add(const Topic& topic) override {
    if (topic.serialisation != Serialisation::ros1 || !topic.stored.encoding.empty()) {
      throw InvalidArgument(
          fmt::format("{}: the messages of topic {} ({}) are not serialised as in ROS 1, as a bag "
                      "of ROS 1 requires: write .mcap",
                      output_.path(), topic.name, topic.type));
    }
    const auto header = boost::make_shared<ros::M_string>();
    (*header)["topic"] = topic.name;
    (*header)["type"] = topic.stored.type;
    (*header)["md5sum"] = topic.stored.md5;
    (*header)["message_definition"] = topic.stored.definition;
    for (const auto& [name, value] : topic.stored.details) {
      if (name == "callerid" || name == "latching") (*header)[name] = value;
    }
    topics_.push_back({topic, header});
    return topics_.size() - 1;
  }

  void write(std::size_t topic, const Message& message) override {
    constexpr std::uint64_t kSecond = 1'000'000'000, kLast = 0xFFFFFFFF;
    const std::uint64_t seconds = message.time_ns / kSecond;
    if (message.time_ns == 0 || seconds > kLast) {
      throw InvalidArgument(fmt::format(
          "{}: time of a message of topic {} = {} ns, allowed in a bag of ROS 1 1 ns to {} s",
          output_.path(), topics_[topic].topic.name, message.time_ns, kLast));
    }
    const ros::Time time(static_cast<std::uint32_t>(seconds),
                         static_cast<std::uint32_t>(message.time_ns % kSecond));
    const Entry& entry = topics_[topic];
    call([&] {
      bag_->write(entry.topic.name, time, SerialisedMessage{&entry.topic, message.bytes},
                  entry.header);
    });
  }

  void close() override {
    call([this] { bag_->close(); });
    output_.commit();
  }

 private:
  struct Entry {
    Topic topic;
    boost::shared_ptr<ros::M_string> header;
  };

  /// Calls the library and converts its exceptions. A bag that failed cannot be closed any more
  /// (its destructor would try and end the process), so it is kept, and its file open, until the
  /// process ends.
  template <class Function>
  void call(Function&& function) {
    const RosbagCall held;
    try {
      function();
    } catch (const std::exception& error) {
      static auto& abandoned = *new std::vector<rosbag::Bag*>;
      abandoned.push_back(bag_.release());
      throw FileError(output_.path(), {}, fmt::format("cannot be written: {}", error.what()));
    }
  }

  io::OutputFile output_;
  std::unique_ptr<rosbag::Bag> bag_;
  std::vector<Entry> topics_;
};

}  // namespace

std::unique_ptr<BagWriter> create_ros1_bag(const std::string& path) {
  return std::make_unique<Ros1Writer>(path);
}

}  // namespace risley::bags
