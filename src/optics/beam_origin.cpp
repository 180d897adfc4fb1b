// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/beam_origin.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley {

std::vector<PrismSize> shared_prism_sizes() {
  return {{"prism_thickness_m", {{1.0}, {}}}, {"prism_spacing_m", {{}, {1.0}}}};
}

std::vector<PrismSize> own_prism_sizes(int prisms) {
  if (prisms < 1 || prisms > kMaxPrisms) refuse_layout(prisms);
  std::vector<PrismSize> sizes;
  sizes.reserve(2 * static_cast<std::size_t>(prisms));
  const auto unit = [](int count, int at) {
    std::vector<double> values(static_cast<std::size_t>(count), 0.0);
    values[static_cast<std::size_t>(at)] = 1.0;
    return values;
  };
  for (int i = 0; i < prisms; ++i) {
    sizes.push_back({fmt::format("prism_thickness_{}_m", prism_letter(i)), {unit(prisms, i), {}}});
  }
  for (int i = 0; i + 1 < prisms; ++i) {
    sizes.push_back(
        {fmt::format("prism_spacing_{}_m", prism_letter(i)), {{}, unit(prisms - 1, i)}});
  }
  return sizes;
}

std::vector<double> face_positions(const std::vector<FaceOrder>& face_order,
                                   const PrismGeometry& geometry) {
  const auto one_each = [](const char* name, const std::vector<double>& values,
                           std::size_t count) -> std::vector<double> {
    for (const double value : values) require_finite(name, value, "m");
    if (values.empty()) return std::vector<double>(count, 0.0);
    if (values.size() == 1) return std::vector<double>(count, values.front());
    if (values.size() == count) return values;
    throw InvalidArgument(
        fmt::format("{} has {} values, allowed none, 1 or {}", name, values.size(), count));
  };
  const std::size_t prisms = face_order.size();
  const TrainLayout layout = layout_of(face_order);
  const auto thickness = one_each("thickness", geometry.thickness, prisms);
  const auto spacing = one_each("spacing", geometry.spacing, prisms - 1);
  std::vector<double> positions(2 * prisms);
  if (layout.reflects()) return positions;
  double perpendicular = 0;
  for (std::size_t prism = prisms; prism-- > 0;) {
    if (prism + 1 < prisms) perpendicular -= spacing[prism];
    const bool angled_last = face_order[prism] == FaceOrder::perpendicular_angled;
    positions[2 * prism] = angled_last ? perpendicular : perpendicular - thickness[prism];
    positions[2 * prism + 1] = angled_last ? perpendicular + thickness[prism] : perpendicular;
  }
  return positions;
}

Ray emergent_ray(const PrismTrain& train, const PrismGeometry& geometry,
                 std::span<const double> rotation_angles, int beam) {
  check_beam(train, beam);
  return with_layout(train.layout(), [&]<TrainLayout N>() -> Ray {
    require_length("rotation_angles", rotation_angles.size(), N);
    std::array<double, N> angles;
    std::copy_n(rotation_angles.begin(), N, angles.begin());
    std::array<double, 2 * N> positions;
    const std::vector<double> faces = face_positions(train.face_order(), geometry);
    std::copy_n(faces.begin(), 2 * N, positions.begin());
    const auto prepared =
        prepare<double, N>(parameter_array<N>(train, beam), face_order_array<N>(train));
    const auto trace = trace_forward(prepared, angles);
    if (!trace.valid()) {
      constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
      return {{kNaN, kNaN, kNaN}, {kNaN, kNaN, kNaN}, false};
    }
    return {beam_origin(trace, positions), trace.direction(), true};
  });
}

}  // namespace risley
