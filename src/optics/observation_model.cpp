// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/observation_model.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace risley {

Observation observe(const PrismTrain& train, std::span<const double> rotation_angles) {
  if (rotation_angles.size() != static_cast<std::size_t>(train.prisms())) {
    throw InvalidArgument(fmt::format("{} rotation angles given for {} prisms",
                                      rotation_angles.size(), train.prisms()));
  }
  return with_prism_count(train.prisms(), [&]<int N>() -> Observation {
    const auto prepared = prepare<double, N>(parameter_array<N>(train), face_order_array<N>(train));
    std::array<double, N> angles;
    std::copy_n(rotation_angles.begin(), N, angles.begin());
    const Beam<double> beam = trace(prepared, angles);
    const auto [azimuth, zenith] = angles_from_direction(beam.direction);
    return {beam.direction, azimuth, zenith, beam.valid};
  });
}

}  // namespace risley
