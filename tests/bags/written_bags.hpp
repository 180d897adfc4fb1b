// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags for tests: messages written byte by byte, containers by rosbag_storage and SQLite.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sqlite3.h>

namespace risley::bags::written {

/// A serialised message of any type.
struct RawMessage {
  std::string type, md5, definition, bytes;
};

}  // namespace risley::bags::written

namespace ros {
namespace message_traits {

template <>
struct DataType<risley::bags::written::RawMessage> {
  static const char* value(const risley::bags::written::RawMessage& m) { return m.type.c_str(); }
};
template <>
struct MD5Sum<risley::bags::written::RawMessage> {
  static const char* value(const risley::bags::written::RawMessage& m) { return m.md5.c_str(); }
};
template <>
struct Definition<risley::bags::written::RawMessage> {
  static const char* value(const risley::bags::written::RawMessage& m) {
    return m.definition.c_str();
  }
};

}  // namespace message_traits
namespace serialization {

template <>
struct Serializer<risley::bags::written::RawMessage> {
  template <class Stream>
  static void write(Stream& stream, const risley::bags::written::RawMessage& m) {
    const auto bytes = static_cast<std::uint32_t>(m.bytes.size());
    std::ranges::copy(m.bytes, stream.advance(bytes));
  }
  // NOLINTNEXTLINE(readability-identifier-naming): the name that ROS calls
  static std::uint32_t serializedLength(const risley::bags::written::RawMessage& m) {
    return static_cast<std::uint32_t>(m.bytes.size());
  }
};

}  // namespace serialization
}  // namespace ros

namespace risley::bags::written {

inline constexpr const char* kHeaderDefinition =
    "================================================================================\n"
    "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

template <class T>
inline void put(std::string& bytes, std::type_identity_t<T> value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void put_text(std::string& bytes, const std::string& text) {
  put<std::uint32_t>(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

inline std::string ros_header(std::uint64_t time_ns, const std::string& frame = "livox_frame") {
  std::string bytes;
  put<std::uint32_t>(bytes, 7);
  put<std::uint32_t>(bytes, static_cast<std::uint32_t>(time_ns / 1'000'000'000));
  put<std::uint32_t>(bytes, static_cast<std::uint32_t>(time_ns % 1'000'000'000));
  put_text(bytes, frame);
  return bytes;
}

/// A bag of these messages, one each 10 ms.
struct Ros1BagFile {
  rosbag::CompressionType compression = rosbag::compression::Uncompressed;
  std::uint32_t chunk_bytes = 1000;
  std::vector<std::pair<std::string, RawMessage>> messages;

  void add(const std::string& topic, RawMessage message) {
    messages.emplace_back(topic, std::move(message));
  }
  void write(const std::string& path) const {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    bag.setCompression(compression);
    bag.setChunkThreshold(chunk_bytes);
    std::uint32_t number = 0;
    for (const auto& [topic, message] : messages) {
      bag.write(topic, ros::Time(1'600'000'000 + number / 100, number % 100 * 10'000'000), message);
      ++number;
    }
    bag.close();
  }
};

/// A message in CDR, written by hand: numbers stand at multiples of their size.
class Cdr {
 public:
  explicit Cdr(bool big_endian = false) : big_endian_(big_endian) {
    bytes_ = {'\0', big_endian ? '\0' : '\1', '\0', '\0'};
  }
  template <class T>
  Cdr& put(std::type_identity_t<T> value) {
    while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_ += '\0';
    std::string number(reinterpret_cast<const char*>(&value), sizeof value);
    if (big_endian_) number.assign(number.rbegin(), number.rend());
    bytes_ += number;
    return *this;
  }
  Cdr& text(const std::string& value) {
    put<std::uint32_t>(static_cast<std::uint32_t>(value.size() + 1));
    bytes_ += value + '\0';
    return *this;
  }
  Cdr& header(std::uint64_t time_ns, const std::string& frame = "livox_frame") {
    put<std::int32_t>(static_cast<std::int32_t>(time_ns / 1'000'000'000));
    put<std::uint32_t>(static_cast<std::uint32_t>(time_ns % 1'000'000'000));
    return text(frame);
  }
  Cdr& raw(const std::string& bytes) {
    bytes_ += bytes;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  bool big_endian_;
  std::string bytes_;
};

inline constexpr std::uint64_t kFirstStamp = 1'600'000'000'123'456'789;  // ns, of recording: 2020

/// A bag of these messages, one each 10 ms.
struct Ros2BagFile {
  struct Topic {
    std::string name, type, format = "cdr";
  };
  std::vector<Topic> topics;
  std::vector<std::pair<std::size_t, std::string>> messages;
  std::string pragma;

  std::size_t topic(const std::string& name, const std::string& type,
                    const std::string& format = "cdr") {
    topics.push_back({name, type, format});
    return topics.size() - 1;
  }
  void add(std::size_t topic, std::string message) {
    messages.emplace_back(topic, std::move(message));
  }

  /// Leaves the database open, as while recording.
  std::shared_ptr<sqlite3> write(const std::string& path) const {
    sqlite3* opened = nullptr;
    EXPECT_EQ(sqlite3_open(path.c_str(), &opened), SQLITE_OK);
    std::shared_ptr<sqlite3> database(opened, sqlite3_close);
    const auto run = [&](const std::string& sql) {
      EXPECT_EQ(sqlite3_exec(opened, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
    };
    run(pragma +
        "PRAGMA page_size=512; PRAGMA synchronous=OFF;"
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC); BEGIN;");
    for (std::size_t i = 0; i < topics.size(); ++i) {
      run(fmt::format("INSERT INTO topics VALUES({}, '{}', '{}', '{}', '')", i + 10, topics[i].name,
                      topics[i].type, topics[i].format));
    }
    sqlite3_stmt* insert = nullptr;
    sqlite3_prepare_v2(opened, "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
                       -1, &insert, nullptr);
    for (std::size_t i = 0; i < messages.size(); ++i) {
      const std::string& blob = messages[i].second;
      sqlite3_bind_int64(insert, 1, static_cast<sqlite3_int64>(messages[i].first + 10));
      sqlite3_bind_int64(insert, 2, static_cast<sqlite3_int64>(kFirstStamp + i * 10'000'000));
      sqlite3_bind_blob(insert, 3, blob.data(), static_cast<int>(blob.size()), SQLITE_STATIC);
      EXPECT_EQ(sqlite3_step(insert), SQLITE_DONE);
      sqlite3_reset(insert);
    }
    sqlite3_finalize(insert);
    run("COMMIT");
    return database;
  }
};

}  // namespace risley::bags::written
