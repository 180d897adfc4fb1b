// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>

#include "risley/bags/bag.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/livox_messages.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kRos2Bag = "ros2-bag";

}  // namespace

const Format kRos2BagFormat = {
    kRos2Bag,
    "",
    "ROS 2 bag in SQLite (.db3): messages of Livox drivers, point clouds (read only)",
    [](std::string_view head) { return bags::bag_kind(head) == bags::BagKind::ros2; },
    [](const io::InputFile& file, const Progress& progress) -> std::unique_ptr<Reader> {
      return std::make_unique<MessageReader>(bags::open_bag(file, bags::BagKind::ros2, progress),
                                             kRos2Bag);
    },
    nullptr,
};

}  // namespace risley::recordings
