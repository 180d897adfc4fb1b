// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>

#include "risley/bags/bag.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/livox_messages.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kMcap = "mcap";

}  // namespace

const Format kMcapFormat = {
    kMcap,
    "",
    "ROS 2 or ROS 1 bag in MCAP: messages of Livox drivers, point clouds (read only)",
    [](std::string_view head) { return bags::bag_kind(head) == bags::BagKind::mcap; },
    [](const io::InputFile& file, const Progress& progress) -> std::unique_ptr<Reader> {
      return std::make_unique<MessageReader>(bags::open_bag(file, bags::BagKind::mcap, progress),
                                             kMcap);
    },
    nullptr,
};

}  // namespace risley::recordings
