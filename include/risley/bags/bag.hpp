// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags of ROS 1 (version 2.0) and of ROS 2 (SQLite, MCAP), and folders of these: topics and the
// bytes of their messages. Higher layers interpret the messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/io/block_file.hpp"

namespace risley::bags {

/// The kinds of bags.
enum class BagKind : std::uint8_t {
  ros1,  ///< version 2.0
  ros2,  ///< SQLite
  mcap,  ///< version 0, with messages of ROS 2 or ROS 1
};

/// "ros1-bag", "ros2-bag" or "mcap".
std::string_view name_of(BagKind kind);

/// How messages are serialised.
enum class Serialisation : std::uint8_t {
  ros1,
  cdr,  ///< plain CDR, as in ROS 2
};

/// The kind of bag that begins with these bytes; nothing if it is not a bag.
std::optional<BagKind> bag_kind(std::string_view head);

/// Whether a folder holds one recording of ROS 2: it has a metadata.yaml, or lacks it and has files
/// named as rosbag2 names the parts of a bag (drive_0.mcap, drive_1.mcap).
bool is_bag_folder(const std::string& folder);

/// The files that a folder of ROS 2 names as one bag in its metadata.yaml, in their order. They are
/// in the folder itself.
/// @throws FileError without this file, with the names of missing files, for a name outside the
/// folder or a repeated one, and for files compressed by rosbag2 without an unpacked copy beside
/// them
std::vector<std::string> files_of_bag_folder(const std::string& folder);

/// Known messages, identified by type in ROS 2 and by the type's MD5 in ROS 1.
enum class MessageKind : std::uint8_t {
  points,                ///< CustomMsg of the Livox drivers
  cloud,                 ///< sensor_msgs PointCloud2
  imu,                   ///< sensor_msgs Imu
  odometry,              ///< nav_msgs Odometry
  pose,                  ///< geometry_msgs PoseStamped
  pose_with_covariance,  ///< geometry_msgs PoseWithCovarianceStamped
  transform,             ///< geometry_msgs TransformStamped
};

/// A bag's description of a topic, for copying to another bag.
struct StoredTopic {
  std::string type;               ///< "sensor_msgs/Imu", in ROS 2 "sensor_msgs/msg/Imu"
  std::string md5;                ///< of the type, in ROS 1
  std::string definition_format;  ///< "ros1msg", "ros2msg", ...; empty where there is none
  std::string definition;         ///< of the type
  std::string encoding;           ///< of messages, if it is not one of Serialisation's Senders and
                                  ///< qualities of service: "callerid", "latching",
                                  ///< "offered_qos_profiles".
  std::vector<std::pair<std::string, std::string>> details;
};

/// A topic of a bag.
struct Topic {
  std::string name;
  std::string type;  ///< with the explanation that a reader needs if the name alone would mislead
  std::optional<MessageKind> kind;  ///< empty if nothing is known
  Serialisation serialisation = Serialisation::ros1;
  StoredTopic stored = {};
};

/// "/a (nav_msgs/Odometry), /b (std_msgs/String)", or "no topic"
std::string words_of(const std::vector<Topic>& topics);

/// A message that contradicts its type; Bag::fail() adds its place.
class BadMessage : public Error {
 public:
  using Error::Error;
};

/// One serialised message.
struct Message {
  std::size_t topic = 0;                ///< index of the topic
  std::int64_t number = 0;              ///< of its topic, from 1; in SQLite: row of the table
  std::span<const std::uint8_t> bytes;  ///< valid until the next call
  std::optional<std::uint64_t> byte_offset = {};  ///< in the file, or in its unpacked chunk
  std::uint64_t time_ns = 0;                      ///< of recording
  std::uint64_t publish_time_ns = 0;  ///< of sending, where the bag knows it; else of recording
};

/// A bag that is read from beginning to end.
class Bag {
 public:
  virtual ~Bag() = default;
  BagKind kind() const { return kind_; }             ///< ROS 1, ROS 2 or MCAP
  const std::string& path() const { return path_; }  ///< as given when the bag was opened
  /// By name; a topic may occur twice here, with different types.
  const std::vector<Topic>& topics() const { return topics_; }

  /// Begins at the first message of the wanted topics.
  /// @param wanted  by topic
  /// @throws FileError; InvalidArgument for a different number of topics
  virtual void rewind(const std::vector<bool>& wanted) = 0;
  /// The next message of a wanted topic, in the order of recording; rewind() must have been called.
  /// @return false at the end
  /// @throws FileError; Cancelled, even in a long run of unwanted messages
  virtual bool next(Message& message) = 0;
  /// Part of the messages already read, [0, 1].
  virtual double fraction_read() const = 0;
  /// Since rewind(): a bag that was cut off while it was recorded, where its kind can be read.
  const std::vector<Warning>& warnings() const { return warnings_; }

  /// Refuses the bag. @throws FileError, always
  [[noreturn]] void fail(const std::string& problem) const;
  /// Reports the message last returned by next() as invalid. @throws FileError, always
  [[noreturn]] virtual void fail(const Message& message, const std::string& problem) const;

 protected:
  Bag(BagKind kind, std::string path, const Progress& progress)
      : path_(std::move(path)), progress_(progress.silent()), kind_(kind) {}
  /// Throws for a choice that does not hold one value per topic. @throws InvalidArgument
  void require_topics(const std::vector<bool>& wanted) const;

  std::string path_;
  Progress progress_;  ///< asked whether to go on
  std::vector<Topic> topics_;
  std::vector<Warning> warnings_;

 private:
  BagKind kind_;
};

/// Opens a bag of a kind. The structure of a ROS 1 bag is checked to its end first; an MCAP file
/// without a valid summary is scanned for its topics.
/// @param progress  cancels opening and reading; its flag must outlive the bag
/// @throws FileError when it is no bag, is cut off or damaged
std::unique_ptr<Bag> open_bag(const io::InputFile& file, BagKind kind,
                              const Progress& progress = {});
/// Opens a bag, recognising its kind from its first bytes.
/// @param path  file, or folder as files_of_bag_folder() takes it
std::unique_ptr<Bag> open_bag(const std::string& path, const Progress& progress = {});

/// The topics of a bag, from its index alone.
/// @throws FileError as open_bag, for damage in the parts read; Cancelled
std::vector<Topic> list_topics(const std::string& path, const Progress& progress = {});

}  // namespace risley::bags
