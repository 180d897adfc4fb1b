// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Points for messages of ROS 1 and ROS 2 in tests of bags.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace risley::recordings::livox_points {

struct Point {
  std::uint32_t offset_ns;
  float x, y, z;
  std::uint8_t intensity = 0, tag = 0, line = 0;
};

/// Single-return shots every 10 us, as a Mid-40 sends them.
inline std::vector<Point> shots(std::size_t count, float x = 2.0F, std::uint32_t step_ns = 10'000) {
  std::vector<Point> points;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto number = static_cast<float>(i);
    points.push_back({i * step_ns, x + 0.001F * number, 0.25F, -0.5F + 0.002F * number,
                      static_cast<std::uint8_t>(i)});
  }
  return points;
}

/// Of a PointCloud2.
struct Field {
  const char* name;
  std::uint32_t offset;
  std::uint8_t datatype;
};

}  // namespace risley::recordings::livox_points
