// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>

#include "risley/bags/bag.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/livox_messages.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kRos1Bag = "ros1-bag";

}  // namespace

const Format kRos1BagFormat = {
    kRos1Bag,
    "",
    "ROS 1 bag: messages of Livox drivers, point clouds (read only)",
    [](std::string_view head) { return bags::bag_kind(head) == bags::BagKind::ros1; },
    [](const io::InputFile& file, const Progress& progress) -> std::unique_ptr<Reader> {
      return std::make_unique<MessageReader>(bags::open_bag(file, bags::BagKind::ros1, progress),
                                             kRos1Bag);
    },
    nullptr,
};

}  // namespace risley::recordings
