// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/bags/bag.hpp"

#include <array>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "risley/core/require.hpp"

#include "bags/bag_kinds.hpp"

namespace risley::bags {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kSqliteSignature = "SQLite format 3\0"sv;

bool is_folder(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored);
}

}  // namespace

std::optional<BagKind> bag_kind(std::string_view head) {
  if (head.starts_with(kRos1Signature)) return BagKind::ros1;
  if (head.starts_with(kSqliteSignature)) return BagKind::ros2;
  if (head.starts_with(kMcapSignature)) return BagKind::mcap;
  return std::nullopt;
}

std::string_view name_of(BagKind kind) {
  switch (kind) {
    case BagKind::ros1:
      return "ros1-bag";
    case BagKind::ros2:
      return "ros2-bag";
    case BagKind::mcap:
      break;
  }
  return "mcap";
}

std::optional<BagKind> bag_kind_of(const io::InputFile& file) {
  std::array<char, 32> head{};
  return bag_kind({head.data(), file.read(0, head.data(), head.size())});
}

std::string words_of(const std::vector<Topic>& topics) {
  std::string words;
  for (const Topic& topic : topics) {
    words += fmt::format("{}{} ({})", words.empty() ? "" : ", ", topic.name, topic.type);
  }
  return words.empty() ? "no topic" : words;
}

void Bag::fail(const std::string& problem) const { throw FileError(path_, {}, problem); }

void Bag::fail(const Message& message, const std::string& problem) const {
  const Topic& topic = topics_[message.topic];
  throw FileError(
      path_, {message.byte_offset, {}},
      fmt::format("message {}{} of topic {} ({}): {}", kind_ == BagKind::ros2 ? "row " : "",
                  message.number, topic.name, topic.type, problem));
}

void Bag::require_topics(const std::vector<bool>& wanted) const {
  require_length("wanted", wanted.size(), topics_.size());
}

std::optional<MessageKind> ros2_kind(std::string_view type) {
  if (type == "livox_interfaces/msg/CustomMsg" || type == "livox_ros_driver2/msg/CustomMsg") {
    return MessageKind::points;
  }
  for (const KnownType& known : kKnownTypes) {
    if (type == known.ros2_name) return known.kind;
  }
  return std::nullopt;
}

Topic ros1_topic(const std::string& name, const std::string& type, const std::string& md5) {
  Topic topic{name, type, std::nullopt};
  bool named_alike = type.ends_with("/CustomMsg");
  if (md5.empty() && named_alike) topic.kind = MessageKind::points;
  for (const KnownType& known : kKnownTypes) {
    if (md5.empty() ? type == known.ros1_name : md5 == known.md5) topic.kind = known.kind;
    named_alike = named_alike || type == known.ros1_name;
  }
  if (named_alike && !topic.kind) topic.type += fmt::format(" with the unknown md5 {}", md5);
  return topic;
}

std::unique_ptr<Bag> open_bag(const io::InputFile& file, BagKind kind, const Progress& progress) {
  switch (kind) {
    case BagKind::ros1:
      return open_ros1_bag(file, progress);
    case BagKind::ros2:
      return open_ros2_bag(file.path(), progress);
    case BagKind::mcap:
      break;
  }
  return open_mcap_bag(file, progress);
}

std::unique_ptr<Bag> open_bag(const std::string& path, const Progress& progress) {
  if (is_folder(path)) return open_bag_folder(path, progress);
  const io::InputFile file(path);
  const std::optional<BagKind> kind = bag_kind_of(file);
  if (!kind) throw FileError(path, {0, {}}, "is not a ROS 1 or ROS 2 bag");
  return open_bag(file, *kind, progress);
}

std::vector<Topic> list_topics(const std::string& path, const Progress& progress) {
  if (!is_folder(path)) {
    const io::InputFile file(path);
    if (bag_kind_of(file) == BagKind::ros1) return list_ros1_topics(file);
  }
  return open_bag(path, progress)->topics();
}

}  // namespace risley::bags
