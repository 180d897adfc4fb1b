// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/bags/bag.hpp"

#include <array>
#include <fstream>

#include <fmt/format.h>

#include "risley/core/require.hpp"

#include "bags/bag_kinds.hpp"

namespace risley::bags {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kSqliteSignature = "SQLite format 3\0"sv;

}  // namespace

std::optional<BagKind> bag_kind(std::string_view head) {
  if (head.starts_with(kRos1Signature)) return BagKind::ros1;
  if (head.starts_with(kSqliteSignature)) return BagKind::ros2;
  return std::nullopt;
}

std::optional<BagKind> bag_kind_of_file(const std::string& path) {
  std::array<char, 32> head{};
  std::ifstream stream(path, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  return bag_kind({head.data(), static_cast<std::size_t>(stream.gcount())});
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
  fail(fmt::format("message {}{} of topic {} ({}): {}", kind_ == BagKind::ros2 ? "row " : "",
                   message.number, topic.name, topic.type, problem));
}

void Bag::require_topics(const std::vector<bool>& wanted) const {
  require_length("wanted", wanted.size(), topics_.size());
}

std::unique_ptr<Bag> open_bag(const std::string& path, BagKind kind, const Progress& progress) {
  return kind == BagKind::ros1 ? open_ros1_bag(path, progress) : open_ros2_bag(path, progress);
}

std::unique_ptr<Bag> open_bag(const std::string& path, const Progress& progress) {
  const std::optional<BagKind> kind = bag_kind_of_file(path);
  if (!kind) throw FileError(path, {0, {}}, "is no bag of ROS 1 or ROS 2");
  return open_bag(path, *kind, progress);
}

std::vector<Topic> list_topics(const std::string& path) {
  if (bag_kind_of_file(path) == BagKind::ros1) return list_ros1_topics(path);
  return open_bag(path)->topics();
}

}  // namespace risley::bags
