// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/bags/bag_writer.hpp"

#include "risley/core/text.hpp"

#include "bags/bag_kinds.hpp"

namespace risley::bags {

std::unique_ptr<BagWriter> create_bag(const std::string& path, BagKind kind) {
  switch (kind) {
    case BagKind::ros1:
      return create_ros1_bag(path);
    case BagKind::ros2:
      return create_ros2_bag(path);
    case BagKind::mcap:
      break;
  }
  return create_mcap_bag(path);
}

std::optional<BagKind> bag_kind_of_name(const std::string& path) {
  const std::string name = lower_case(path);
  if (name.ends_with(".bag")) return BagKind::ros1;
  if (name.ends_with(".db3")) return BagKind::ros2;
  if (name.ends_with(".mcap")) return BagKind::mcap;
  return std::nullopt;
}

Serialisation serialisation_of(BagKind kind) {
  return kind == BagKind::ros1 ? Serialisation::ros1 : Serialisation::cdr;
}

}  // namespace risley::bags
