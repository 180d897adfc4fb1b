// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// Offset from UTC (since 1 January 1970) to the time of a trajectory, ns: one number for a whole
/// flight, since seconds of week and of day run on. If week or day are not known, those that bring
/// the time nearest to the trajectory are used.
/// @param utc_ns  of the flight, which determines the leap seconds
/// @return nothing for an unknown scale of time
/// @throws InvalidArgument for a trajectory without records
std::optional<std::int64_t> shift_from_utc_ns(const Trajectory& trajectory, std::int64_t utc_ns);

/// Offset from a trajectory's time to UTC since 1 January 1970, ns; nothing if week or day are not
/// known.
std::optional<std::int64_t> shift_to_utc_ns(const Trajectory& trajectory);

/// "from 388077.010 s to 388078.005 s (GPS second of week)"
std::string interval_words(const Trajectory& trajectory);

/// Reason why a recording and a trajectory share no pose: both intervals, and the probable cause:
/// leap seconds, a week, another scale of time, a gap.
/// @param first_ns, last_ns  of the recording, on the assumed time scale of the trajectory
/// @param stamps_after_times_ns  by which UTC stamps of its messages are later than its times
std::string no_overlap_words(const Trajectory& trajectory, std::int64_t first_ns,
                             std::int64_t last_ns,
                             std::optional<std::int64_t> stamps_after_times_ns = {});

}  // namespace risley::trajectories
