// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags of ROS 1 (version 2.0) and of ROS 2 (SQLite, MCAP), and folders of these: topics and the
// bytes of their messages. What the messages mean is for the layers above.
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

/// Which kind of bag a file is that begins with these bytes; nothing where it is none.
std::optional<BagKind> bag_kind(std::string_view head);

/// Whether a folder holds one recording of ROS 2: it has a metadata.yaml, or lacks it and has files
/// named as rosbag2 names the parts of a bag (drive_0.mcap, drive_1.mcap).
bool is_bag_folder(const std::string& folder);

/// The files that a folder of ROS 2 names as one bag in its metadata.yaml, in their order. They lie
/// in the folder itself.
/// @throws FileError without such a file, with the names of files that are missing, for a name that
///         leads out of the folder or stands twice, and for files that rosbag2 compressed
///         where they do not lie unpacked beside
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

/// A topic of a bag.
struct Topic {
  std::string name;
  std::string type;  ///< with what a reader must know where the name alone would mislead
  std::optional<MessageKind> kind;  ///< empty for all that is not known
  Serialisation serialisation = Serialisation::ros1;
};

/// "/a (nav_msgs/Odometry), /b (std_msgs/String)", or "no topic"
std::string words_of(const std::vector<Topic>& topics);

/// A message that is not as its type says; Bag::fail() adds where it stands.
class BadMessage : public Error {
 public:
  using Error::Error;
};

/// One serialised message.
struct Message {
  std::size_t topic = 0;                ///< index of the topic
  std::int64_t number = 0;              ///< of its topic, from 1; in SQLite: row of the table
  std::span<const std::uint8_t> bytes;  ///< valid until the next one is asked for
  std::optional<std::uint64_t> byte_offset = {};  ///< in the file, of it or of its packed chunk
};

/// A bag that is read from its beginning to its end.
class Bag {
 public:
  virtual ~Bag() = default;
  BagKind kind() const { return kind_; }             ///< ROS 1, ROS 2 or MCAP
  const std::string& path() const { return path_; }  ///< as it was given when the bag was opened
  /// By name; a topic may stand here twice, with different types.
  const std::vector<Topic>& topics() const { return topics_; }

  /// Begins at the first message of the wanted topics.
  /// @param wanted  by topic
  /// @throws FileError; InvalidArgument for a different number of topics
  virtual void rewind(const std::vector<bool>& wanted) = 0;
  /// The next message of a wanted topic, in the order of recording; rewind() must have been called.
  /// @return false at the end
  /// @throws FileError; Cancelled, however many messages of others stand before it
  virtual bool next(Message& message) = 0;
  /// Part of the messages already read, [0, 1].
  virtual double fraction_read() const = 0;
  /// Since rewind(): a bag that was cut off while it was recorded, where its kind can be read.
  const std::vector<Warning>& warnings() const { return warnings_; }

  /// Refuses the bag. @throws FileError, always
  [[noreturn]] void fail(const std::string& problem) const;
  /// Refuses the message that next() gave last. @throws FileError, always
  [[noreturn]] virtual void fail(const Message& message, const std::string& problem) const;

 protected:
  Bag(BagKind kind, std::string path, const Progress& progress)
      : path_(std::move(path)), progress_(progress.silent()), kind_(kind) {}
  /// Refuses a choice that does not hold one value per topic. @throws InvalidArgument
  void require_topics(const std::vector<bool>& wanted) const;

  std::string path_;
  Progress progress_;  ///< asked whether to go on
  std::vector<Topic> topics_;
  std::vector<Warning> warnings_;

 private:
  BagKind kind_;
};

/// Opens a bag of a kind. The structure of a ROS 1 bag is checked to its end before; an MCAP file
/// without a sound summary is looked through for its topics.
/// @param progress  cancels opening and reading; its flag must outlive the bag
/// @throws FileError when it is no bag, is cut off or damaged
std::unique_ptr<Bag> open_bag(const io::InputFile& file, BagKind kind,
                              const Progress& progress = {});
/// Opens a bag, recognising its kind from its first bytes.
/// @param path  file, or folder as files_of_bag_folder() takes it
std::unique_ptr<Bag> open_bag(const std::string& path, const Progress& progress = {});

/// The topics of a bag, from its index alone.
/// @throws FileError as open_bag, for damage in what has to be read; Cancelled
std::vector<Topic> list_topics(const std::string& path, const Progress& progress = {});

}  // namespace risley::bags
