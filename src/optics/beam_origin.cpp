// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/beam_origin.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace risley {

std::vector<double> face_positions(const std::vector<FaceOrder>& face_order,
                                   const PrismGeometry& geometry) {
  std::vector<double> positions;
  for (std::size_t prism = 0; prism < face_order.size(); ++prism) {
    const double perpendicular =
        -geometry.spacing * static_cast<double>(face_order.size() - 1 - prism);
    if (face_order[prism] == FaceOrder::perpendicular_angled) {
      positions.insert(positions.end(), {perpendicular, perpendicular + geometry.thickness});
    } else {
      positions.insert(positions.end(), {perpendicular - geometry.thickness, perpendicular});
    }
  }
  return positions;
}

Ray emergent_ray(const PrismTrain& train, const PrismGeometry& geometry,
                 std::span<const double> rotation_angles) {
  return with_prism_count(train.prisms(), [&]<int N>() -> Ray {
    if (rotation_angles.size() != N) {
      throw InvalidArgument(
          fmt::format("{} rotation angles given for {} prisms", rotation_angles.size(), N));
    }
    std::array<double, N> angles;
    std::copy_n(rotation_angles.begin(), N, angles.begin());
    std::array<double, 2 * N> positions;
    const std::vector<double> faces = face_positions(train.face_order(), geometry);
    std::copy_n(faces.begin(), 2 * N, positions.begin());
    const auto prepared = prepare<double, N>(parameter_array<N>(train), face_order_array<N>(train));
    const auto trace = trace_forward(prepared, angles);
    if (!trace.valid()) {
      constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
      return {{kNaN, kNaN, kNaN}, {kNaN, kNaN, kNaN}, false};
    }
    return {beam_origin(trace, positions), trace.direction(), true};
  });
}

}  // namespace risley
