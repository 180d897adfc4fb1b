// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "risley/bags/bag.hpp"

namespace risley::bags {

/// Writes a bag message by message, so that memory does not grow with its size. The file appears
/// under its name only at close(); a writer destroyed before leaves nothing.
class BagWriter {
 public:
  virtual ~BagWriter() = default;

  /// Adds a topic with its stored properties. @return its number, from 0
  /// @throws InvalidArgument for a serialisation that this kind of bag cannot hold; FileError
  virtual std::size_t add(const Topic& topic) = 0;

  /// Appends a message of a topic. @param message  its bytes and times; other members are ignored
  /// @throws InvalidArgument for a time that this kind of bag cannot hold; FileError
  virtual void write(std::size_t topic, const Message& message) = 0;

  /// Completes the bag and renames it to its final name. @throws FileError
  virtual void close() = 0;
};

/// Creates a bag: a file, of BagKind::ros2 a folder with metadata.yaml and a database of SQLite.
/// @throws FileError
std::unique_ptr<BagWriter> create_bag(const std::string& path, BagKind kind);

/// The kind of bag for a name: ".bag", ".mcap" or, for a folder, ".db3".
std::optional<BagKind> bag_kind_of_name(const std::string& path);

/// Serialisation of messages in a new bag: ROS 1's in its own bags, CDR in others.
Serialisation serialisation_of(BagKind kind);

}  // namespace risley::bags
