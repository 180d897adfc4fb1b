// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley {

/// The subject of a warning, for programs: a stable name.
struct WarningCode {
  explicit constexpr WarningCode(std::string_view of) : name(of) {}
  std::string_view name;
  bool operator==(const WarningCode&) const = default;
};

/// All of them; docs/files/json.md explains each.
struct WarningCodes {
  // What a file holds.
  WarningCode cut_off{"cut_off"}, content_left_out{"content_left_out"},
      columns_unused{"columns_unused"}, columns_guessed{"columns_guessed"},
      unit_guessed{"unit_guessed"}, values_changed{"values_changed"},
      header_contradicted{"header_contradicted"}, implausible_values{"implausible_values"},
      devices_unclear{"devices_unclear"}, shots_lost{"shots_lost"},
      packets_incomplete{"packets_incomplete"};
  // Times.
  WarningCode no_shot_times{"no_shot_times"}, times_coarse{"times_coarse"},
      times_corrected{"times_corrected"}, times_guessed{"times_guessed"},
      rows_sorted{"rows_sorted"}, clock_unknown{"clock_unknown"}, clock_reset{"clock_reset"},
      clock_wrapped{"clock_wrapped"}, clock_rate{"clock_rate"}, clocks_disagree{"clocks_disagree"};
  // Sensor and frame.
  WarningCode sensor_guessed{"sensor_guessed"}, sensor_unknown{"sensor_unknown"},
      sensor_contradicted{"sensor_contradicted"}, firing_order{"firing_order"},
      coordinates_cut{"coordinates_cut"}, mirrored{"mirrored"}, turned_back{"turned_back"},
      pose_undecided{"pose_undecided"}, pose_unused{"pose_unused"}, frame_turned{"frame_turned"};
  // Numbers.
  WarningCode shots_unused{"shots_unused"}, many_outliers{"many_outliers"},
      sigmas_enlarged{"sigmas_enlarged"}, sigmas_too_small{"sigmas_too_small"},
      unusual_noise{"unusual_noise"}, model_incomplete{"model_incomplete"},
      taken_as_exact{"taken_as_exact"}, not_seen{"not_seen"}, input_left_out{"input_left_out"};
  // Calibrations and flights.
  WarningCode poor_datum{"poor_datum"}, uneven_plane{"uneven_plane"},
      held_contradicted{"held_contradicted"}, control_doubtful{"control_doubtful"},
      coarse_knots{"coarse_knots"}, trajectory_gaps{"trajectory_gaps"},
      trajectory_jumps{"trajectory_jumps"}, trajectory_errors{"trajectory_errors"},
      velocity_frame{"velocity_frame"}, terrain_assumed{"terrain_assumed"};
  // Clouds and results.
  WarningCode calibration_doubtful{"calibration_doubtful"},
      ranges_uncorrected{"ranges_uncorrected"}, points_missing{"points_missing"},
      distribution_unknown{"distribution_unknown"}, map_assumed{"map_assumed"},
      datum_changed{"datum_changed"}, outside_map{"outside_map"},
      targets_doubtful{"targets_doubtful"}, calibration_assumed{"calibration_assumed"},
      common_errors_unknown{"common_errors_unknown"}, results_renamed{"results_renamed"};
};

/// By name: kWarning.cut_off.
inline constexpr WarningCodes kWarning;

/// A remark for the user that does not invalidate the result: a tail that was cut off while
/// recording, a guessed sensor.
struct Warning {
  WarningCode code;
  std::string message;
  FilePlace place = {};            ///< of the file read, if there is one
  std::uint64_t lost_records = 0;  ///< known to be lost; 0 also if the number is unknown
};

/// Adds a warning, formatted by fmt. @return it, valid until the next one
template <class... Values>
Warning& warn(std::vector<Warning>& warnings, WarningCode code, fmt::format_string<Values...> words,
              Values&&... values) {
  return warnings.emplace_back(Warning{code, fmt::format(words, std::forward<Values>(values)...)});
}

/// In one line: the message, then the place in brackets, as in "... (at byte 17)", "... (line 3)".
std::string warning_text(const Warning& warning);

/// The same warning for one of several files, which its message names first.
Warning of_file(const std::string& file, Warning warning);

/// Puts some behind others.
void append(std::vector<Warning>& warnings, const std::vector<Warning>& more);

}  // namespace risley
