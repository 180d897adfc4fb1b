// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/rotor_process.hpp"

namespace risley::estimation {

/// Columns of one length; beams and ranges may be omitted.
inline void require_columns(const AngleSeries& series) {
  for_each_entry<kSeriesColumns>(
      [&series](const SeriesColumn& entry, const auto& column) {
        (entry.optional ? require_length_or_none : require_length)(entry.name, column.size(),
                                                                   series.size());
      },
      series);
}

/// A start with an angle and a speed for every prism of a train.
inline void require_start(const Start& start, int prisms) {
  const auto rotors = static_cast<std::size_t>(prisms);
  require_length("rotation_angle of the start", start.rotation_angle.size(), rotors);
  require_length("angular_velocity of the start", start.angular_velocity.size(), rotors);
  require_between("number of prisms of the start", start.train.prisms(), prisms, prisms);
  for (std::size_t k = 0; k < rotors; ++k) {
    require_finite("rotation_angle of the start", start.rotation_angle[k], "rad");
    require_finite("angular_velocity of the start", start.angular_velocity[k], "rad/s");
  }
}

/// Process noise for every rotor, or none at all if it is found from the data.
inline void require_process(std::span<const RotorProcess> process, int prisms) {
  if (!process.empty() && process.size() != static_cast<std::size_t>(prisms)) {
    throw InvalidArgument(
        fmt::format("process noise for {} rotors given, the train has {}", process.size(), prisms));
  }
  for (const RotorProcess& rotor : process) {
    require_not_below("acceleration", rotor.acceleration, 0, "rad/s/sqrt(s)");
    require_not_below("angle walk", rotor.angle_walk, 0, "rad/sqrt(s)");
    require_not_below("jerk", rotor.jerk, 0, "rad/s^2/sqrt(s)");
  }
}

/// Places of the flat vector, and no more parameters, nor more places of theirs, than it has: the
/// kernels have room for those.
inline void require_free(const std::vector<FreeParameter>& free, const PrismTrain& train) {
  const std::size_t places = train.parameters().size();
  require_between("number of free parameters", static_cast<double>(free.size()), 0,
                  static_cast<double>(places));
  std::size_t taken = 0;
  for (const FreeParameter& parameter : free) {
    taken += parameter.places.size();
    for (const int place : parameter.places) {
      require_between("place of " + parameter.name, place, 0, static_cast<double>(places - 1));
    }
  }
  require_between("number of places of free parameters", static_cast<double>(taken), 0,
                  static_cast<double>(places));
}

}  // namespace risley::estimation
