// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags of ROS 1 and of ROS 2, whose messages are read alike.
#include <memory>

#include "risley/bags/bag.hpp"

#include "recordings/formats/bag_writer.hpp"
#include "recordings/formats/format.hpp"
#include "recordings/formats/livox_messages.hpp"

namespace risley::recordings {
namespace {

template <bags::BagKind Kind>
bool is_bag(std::string_view head) {
  return bags::bag_kind(head) == Kind;
}

template <bags::BagKind Kind>
std::unique_ptr<Writer> create_bag(const std::string& path, const RecordingHeader& header,
                                   const WriteOptions& options) {
  return create_bag_recording(path, Kind, header, options);
}

template <const Format& Its, bags::BagKind Kind>
std::unique_ptr<Reader> open_bag(const io::InputFile& file, const Progress& progress) {
  return std::make_unique<MessageReader>(bags::open_bag(file, Kind, progress), Its.name);
}

}  // namespace

const Format kRos1BagFormat = {
    "ros1-bag",
    ".bag",
    "ROS 1 bag: messages of Livox drivers, point clouds",
    is_bag<bags::BagKind::ros1>,
    open_bag<kRos1BagFormat, bags::BagKind::ros1>,
    create_bag<bags::BagKind::ros1>,
};

const Format kRos2BagFormat = {
    "ros2-bag",
    ".db3",
    "ROS 2 bag, a folder with a SQLite database: messages of Livox drivers, point clouds",
    is_bag<bags::BagKind::ros2>,
    open_bag<kRos2BagFormat, bags::BagKind::ros2>,
    create_bag<bags::BagKind::ros2>,
};

const Format kMcapFormat = {
    "mcap",
    ".mcap",
    "ROS 2 or ROS 1 bag in MCAP: messages of Livox drivers, point clouds",
    is_bag<bags::BagKind::mcap>,
    open_bag<kMcapFormat, bags::BagKind::mcap>,
    create_bag<bags::BagKind::mcap>,
};

}  // namespace risley::recordings
