// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/observation_model.hpp"

#include <algorithm>
#include <limits>

#include "risley/core/require.hpp"

namespace risley {

Observation observe(const PrismTrain& train, std::span<const double> rotation_angles, int beam) {
  require_length("rotation_angles", rotation_angles.size(),
                 static_cast<std::size_t>(train.prisms()));
  check_beam(train, beam);
  return with_layout(train.layout(), [&]<TrainLayout N>() -> Observation {
    const auto prepared =
        prepare<double, N>(parameter_array<N>(train, beam), face_order_array<N>(train));
    std::array<double, N> angles;
    std::copy_n(rotation_angles.begin(), N, angles.begin());
    const Beam<double> emergent = trace(prepared, angles);
    const auto [azimuth, zenith] = angles_from_direction(emergent.direction);
    return {emergent.direction, azimuth, zenith, emergent.valid};
  });
}

}  // namespace risley
