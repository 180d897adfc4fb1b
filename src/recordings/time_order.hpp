// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "risley/recordings/observations.hpp"

// The order of the rows of a recording, found from their times.
namespace risley::recordings {

/// Conclusion from the times of the rows of one device about their order.
enum class RowOrder : std::uint8_t {
  ascending,    ///< except for clocks that were reset
  mixed,        ///< the rows are not in firing order
  begins_anew,  ///< times restart with every message or packet: valid only within it
  constant,     ///< all times are the same
  overlapping,  ///< pieces begin within the time of those before: apparently of several sensors
};

/// Order of the rows of one device.
struct OrderJudgement {
  RowOrder order = RowOrder::ascending;
  std::int64_t depth_ns = 0;  ///< largest amount by which a row is earlier than one before it
  double step_ns = 0;         ///< if times restart: from shot to shot
};

/// Judges the order of some rows, those of one device.
/// @param in_packets  packets keep their shots in order, and single ones come late on a network
OrderJudgement judge_order(const Observations& rows, std::span<const std::size_t> of_device,
                           bool in_packets);

/// Orders rows by their times. Rows of one time are ordered by emitter and number of return, then
/// in file order.
void order_by_time(const Observations& rows, std::vector<std::size_t>& which);

/// The step of a known shot rate, if a measured one is near it; otherwise the measured one.
double known_step_or(double step_ns);

/// From shot to shot at the rates of known sensors, ns.
inline constexpr double kKnownSteps_ns[] = {10'000.0, 12'500.0 / 3.0, 5'000.0};

}  // namespace risley::recordings
