// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags of ROS 2 as rosbag2 stores them by default: a SQLite database whose messages are in CDR.
// Messages come in the order of their ids, the order of recording.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/core/error.hpp"
#include "risley/tables/sqlite_input.hpp"

#include "bags/bag_kinds.hpp"
#include "bags/unpack.hpp"

namespace risley::bags {
namespace {

class Ros2Bag final : public Bag {
 public:
  Ros2Bag(const std::string& path, const Progress& progress)
      : Bag(BagKind::ros2, path, progress), database_(path, "a ROS 2 bag", progress) {
    database_.require_plain_table("topics");
    database_.require_plain_table("messages");
    find_topics();
    find_stored();
    find_ids();
    messages_ = database_.query("SELECT id, topic_id, data, timestamp FROM messages ORDER BY id");
  }

  void rewind(const std::vector<bool>& wanted) override {
    require_topics(wanted);
    wanted_ = wanted;
    messages_->rewind();
    id_ = first_id_;
    any_read_ = false;
    blob_bytes_ = 0;
    ended_ = false;
  }

  bool next(Message& message) override {
    if (ended_) return false;  // stepping again would begin anew
    while (messages_->next("be read to its end")) {
      progress_.check();
      const std::int64_t id = messages_->integer(0);
      if (any_read_ && id <= id_) {  // pages repeated in the table
        fail(fmt::format("message row {} follows row {}, expected ascending numbers", id, id_));
      }
      id_ = id;
      any_read_ = true;
      const auto topic = topic_of(messages_->integer(1));
      if (!topic) continue;
      message.topic = *topic;
      message.number = id;
      message.time_ns = message.publish_time_ns = static_cast<std::uint64_t>(messages_->integer(3));
      message.bytes = messages_->bytes(2);
      blob_bytes_ += message.bytes.size();
      if (blob_bytes_ > database_.file_bytes()) {  // pages shared by several messages
        fail(fmt::format("the messages up to row {} have {} bytes, but the database only {}", id_,
                         blob_bytes_, database_.file_bytes()));
      }
      try {
        message.bytes = unpacker_.message(message.bytes);
      } catch (const BadMessage& bad) {
        fail(message, bad.what());
      }
      return true;
    }
    ended_ = true;
    return false;
  }

  double fraction_read() const override {
    if (ended_ || last_id_ <= first_id_) return ended_ ? 1.0 : 0.0;
    const double part = (static_cast<double>(id_) - static_cast<double>(first_id_)) /
                        (static_cast<double>(last_id_) - static_cast<double>(first_id_));
    return std::min(std::max(part, 0.0), 1.0);
  }

 private:
  void find_topics() {
    tables::SqliteQuery query = database_.query(
        "SELECT id, name, type, serialization_format FROM topics ORDER BY name, id");
    while (query.next("give its topics")) {
      Topic topic;
      topic.name = query.text(1);
      topic.type = query.text(2);
      topic.kind = ros2_kind(topic.type);
      topic.serialisation = Serialisation::cdr;
      topic.stored.type = topic.type;
      const std::string serialization = query.text(3);
      if (serialization != "cdr") topic.stored.encoding = serialization;
      if (topic.kind && serialization != "cdr") {
        topic.kind.reset();
        topic.type += fmt::format(", stored as \"{}\" instead of cdr", serialization);
      }
      ids_.push_back(query.integer(0));
      topics_.push_back(std::move(topic));
    }
  }

  /// Definitions and qualities of service, which not every version of rosbag2 stores.
  void find_stored() {
    std::map<std::int64_t, std::string> qualities;  // by topic
    take_texts("SELECT id, offered_qos_profiles FROM topics", [&](const auto& row) {
      return qualities.insert_or_assign(row.integer(0), row.text(1)).first->second.size();
    });
    struct Definition {
      std::string format, text;
    };
    std::map<std::string, Definition> definitions;  // by type
    database_.require_plain_table("message_definitions");
    take_texts("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions",
               [&](const auto& row) {
                 Definition& one = definitions[row.text(0)];
                 one = {row.text(1), row.text(2)};
                 return one.text.size();
               });
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      StoredTopic& stored = topics_[i].stored;
      if (const auto found = qualities.find(ids_[i]); found != qualities.end()) {
        stored.details.emplace_back("offered_qos_profiles", found->second);
      }
      if (const auto found = definitions.find(stored.type); found != definitions.end()) {
        stored.definition_format = found->second.format;
        stored.definition = found->second.text;
      }
    }
  }

  /// Runs a query if the database has its columns: messages can be read without it.
  /// @param take  for each row; returns its bytes, which together cannot exceed the file's
  template <class Take>
  void take_texts(const char* sql, const Take& take) {
    std::size_t bytes = 0;
    try {
      tables::SqliteQuery query = database_.query(sql);
      while (bytes <= database_.file_bytes() && query.next("give its topics")) bytes += take(query);
    } catch (const FileError&) {
      // A column that this version does not have, or damage that other queries report.
    }
  }

  void find_ids() {
    // Each alone is found at one end of the table.
    first_id_ = id_at_end("SELECT MIN(id) FROM messages");
    last_id_ = id_at_end("SELECT MAX(id) FROM messages");
    id_ = first_id_;
  }

  /// A damaged end does not invalidate the data before it.
  std::int64_t id_at_end(const char* sql) const {
    tables::SqliteQuery query = database_.query(sql);
    try {
      return query.next("give its ends") ? query.integer(0) : 0;
    } catch (const FileError&) {
      return 0;
    }
  }

  std::optional<std::size_t> topic_of(std::int64_t id) const {
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      if (ids_[i] == id && wanted_[i]) return i;
    }
    return std::nullopt;
  }

  tables::SqliteInput database_;
  Unpacker unpacker_;
  std::uint64_t blob_bytes_ = 0;   ///< of the messages read so far
  bool any_read_ = false;          ///< and id_ is that of the last message
  std::vector<std::int64_t> ids_;  ///< by topic
  std::vector<bool> wanted_;       ///< by topic
  std::int64_t first_id_ = 0, last_id_ = 0, id_ = 0;
  bool ended_ = false;
  std::optional<tables::SqliteQuery> messages_;  ///< none only while the bag is opened
};

}  // namespace

std::unique_ptr<Bag> open_ros2_bag(const std::string& path, const Progress& progress) {
  return std::make_unique<Ros2Bag>(path, progress);
}

}  // namespace risley::bags
