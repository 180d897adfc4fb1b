// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "risley/recordings/observations.hpp"

// In which order the rows of a recording stand, told by their times.
namespace risley::recordings {

/// What the times of the rows of one device say of their order.
enum class RowOrder : std::uint8_t {
  ascending,    ///< but for clocks that were reset
  mixed,        ///< the rows stand in another order than that of firing
  begins_anew,  ///< times begin anew with every message or packet: they tell nothing beyond it
  constant,     ///< all times are the same
  overlapping,  ///< pieces begin within the time of those before: of several sensors, it seems
};

/// How the rows of one device stand.
struct OrderJudgement {
  RowOrder order = RowOrder::ascending;
  std::int64_t depth_ns = 0;  ///< by which a row is earlier than one before it, at most
  double step_ns = 0;         ///< where times begin anew: from shot to shot
};

/// Judges the order of some rows, those of one device.
/// @param in_packets  packets keep their shots in order, and single ones come late on a network
OrderJudgement judge_order(const Observations& rows, std::span<const std::size_t> of_device,
                           bool in_packets);

/// Orders rows by their times. Rows of one time are ordered by emitter and number of return, then
/// as they stand.
void order_by_time(const Observations& rows, std::vector<std::size_t>& which);

/// The step of a known rate of shots, where a measured one is near it; the measured one otherwise.
double known_step_or(double step_ns);

/// From shot to shot at the rates of known sensors, ns.
inline constexpr double kKnownSteps_ns[] = {10'000.0, 12'500.0 / 3.0, 5'000.0};

}  // namespace risley::recordings
