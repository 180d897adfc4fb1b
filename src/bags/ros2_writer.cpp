// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Folders as rosbag2 writes them: metadata.yaml (version 5, which Humble and later read) and a
// database of SQLite (schema 4, with the definitions of types). The database grows beside the
// folder, which is created when everything is complete; without metadata.yaml, its last file, it is
// not a bag.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/bags/bag_writer.hpp"
#include "risley/core/error.hpp"
#include "risley/io/folder.hpp"
#include "risley/io/text_file.hpp"
#include "risley/tables/sqlite_output.hpp"

#include "bags/bag_kinds.hpp"

namespace risley::bags {
namespace {

namespace fs = std::filesystem;

/// A text as valid YAML: in double quotes.
std::string quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return quoted + "\"";
}

class Ros2Writer final : public BagWriter {
 public:
  explicit Ros2Writer(const std::string& path)
      : folder_(without_slash(path)), database_name_(folder_.stem().string() + "_0.db3") {
    std::error_code code;
    if (fs::exists(folder_, code) && !fs::is_directory(folder_, code)) {
      throw FileError(path, {},
                      "is a file; a bag of ROS 2 in SQLite is a folder, expected its name");
    }
    database_.emplace((folder_.parent_path() / database_name_).string());
    database_->run(
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
        "INSERT INTO schema VALUES(4, 'risley');"
        "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,"
        " metadata TEXT NOT NULL);"
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL,"
        " type_description_hash TEXT NOT NULL);"
        "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL,"
        " encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL,"
        " type_description_hash TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC);");
  }

  std::size_t add(const Topic& topic) override {
    if (topic.serialisation != Serialisation::cdr) {
      throw InvalidArgument(
          fmt::format("{}: the messages of topic {} ({}) are serialised as in ROS 1, which a bag "
                      "of ROS 2 in SQLite cannot hold: write .mcap or .bag",
                      folder_.string(), topic.name, topic.type));
    }
    const auto id = static_cast<std::int64_t>(topics_.size() + 1);
    const StoredTopic& stored = topic.stored;
    const std::string encoding = stored.encoding.empty() ? "cdr" : stored.encoding;
    std::string qualities;
    for (const auto& [name, value] : stored.details) {
      if (name == "offered_qos_profiles") qualities = value;
    }
    database_->insert("INSERT INTO topics VALUES(?, ?, ?, ?, ?, '')",
                      {id, topic.name, stored.type, encoding, qualities});
    const bool defined = std::ranges::any_of(
        topics_, [&stored](const Written& other) { return other.type == stored.type; });
    if (!defined && !stored.definition.empty()) {
      database_->insert(
          "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition,"
          " type_description_hash) VALUES(?, ?, ?, '')",
          {stored.type, stored.definition_format, stored.definition});
    }
    topics_.push_back({topic.name, stored.type, encoding, qualities, 0});
    return topics_.size() - 1;
  }

  void write(std::size_t topic, const Message& message) override {
    database_->insert("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
                      {static_cast<std::int64_t>(topic + 1),
                       static_cast<std::int64_t>(message.time_ns), message.bytes});
    ++topics_[topic].messages;
    first_ns_ = messages_ == 0 ? message.time_ns : std::min(first_ns_, message.time_ns);
    last_ns_ = std::max(last_ns_, message.time_ns);
    ++messages_;
  }

  void close() override {
    const bool made = io::make_folder(folder_.string());
    try {
      database_->commit((folder_ / database_name_).string());
    } catch (...) {
      std::error_code code;
      if (made) fs::remove(folder_, code);
      throw;
    }
    io::write_text_file((folder_ / kMetadata).string(), metadata());
  }

 private:
  struct Written {
    std::string name, type, encoding, qualities;
    std::uint64_t messages = 0;
  };

  static fs::path without_slash(const std::string& path) {
    const fs::path folder = fs::path(path).lexically_normal();
    return folder.has_filename() ? folder : folder.parent_path();
  }

  std::string metadata() const {
    const std::string times = fmt::format(
        "duration:\n{{0}}  nanoseconds: {}\n{{0}}starting_time:\n{{0}}  nanoseconds_since_epoch: "
        "{}\n{{0}}message_count: {}\n",
        last_ns_ - first_ns_, first_ns_, messages_);
    const auto indented = [&times](const std::string& by) {
      return fmt::format(fmt::runtime(times), by);
    };
    std::string text = fmt::format(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  {}"
        "  topics_with_message_count:{}\n",
        indented("  "), topics_.empty() ? " []" : "");
    for (const Written& topic : topics_) {
      text += fmt::format(
          "    - topic_metadata:\n        name: {}\n        type: {}\n"
          "        serialization_format: {}\n        offered_qos_profiles: {}\n"
          "      message_count: {}\n",
          quoted(topic.name), quoted(topic.type), quoted(topic.encoding), quoted(topic.qualities),
          topic.messages);
    }
    return text + fmt::format(
                      "  compression_format: \"\"\n  compression_mode: \"\"\n"
                      "  relative_file_paths:\n    - {}\n  files:\n    - path: {}\n      {}",
                      quoted(database_name_), quoted(database_name_), indented("      "));
  }

  fs::path folder_;
  std::string database_name_;
  std::optional<tables::SqliteOutput> database_;  ///< none only at first
  std::vector<Written> topics_;
  std::uint64_t messages_ = 0, first_ns_ = 0, last_ns_ = 0;
};

}  // namespace

std::unique_ptr<BagWriter> create_ros2_bag(const std::string& path) {
  return std::make_unique<Ros2Writer>(path);
}

}  // namespace risley::bags
