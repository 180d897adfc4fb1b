// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/error.hpp"

namespace risley {

/// What a warning is about, for programs: its name in Warnings, which stays the same.
struct WarningCode {
  explicit constexpr WarningCode(std::string_view of) : name(of) {}
  std::string_view name;
  bool operator==(const WarningCode&) const = default;
};

/// All of them, with what each means; docs/files.md has the same table.
struct WarningCodes {
  // What a file holds.
  WarningCode cut_off{"cut_off"};                    ///< the file ends before it should
  WarningCode content_left_out{"content_left_out"};  ///< some of the file was not used
  WarningCode columns_unused{"columns_unused"};      ///< columns or fields were not used
  WarningCode columns_guessed{"columns_guessed"};    ///< what columns hold was guessed
  WarningCode unit_guessed{"unit_guessed"};          ///< the unit of values was guessed
  WarningCode values_changed{"values_changed"};      ///< values were scaled or limited
  WarningCode header_contradicted{
      "header_contradicted"};  ///< the header contradicts itself or the file
  WarningCode implausible_values{"implausible_values"};  ///< no sensor measures such values
  WarningCode devices_unclear{"devices_unclear"};        ///< what tells sensors apart is uncertain
  WarningCode shots_lost{"shots_lost"};                  ///< shots are missing between others
  WarningCode packets_incomplete{"packets_incomplete"};  ///< points are missing in packets
  // Times.
  WarningCode no_shot_times{"no_shot_times"};      ///< the times are not those of single shots
  WarningCode times_coarse{"times_coarse"};        ///< times are rounded to long steps
  WarningCode times_corrected{"times_corrected"};  ///< times were at fault and were counted anew
  WarningCode times_guessed{"times_guessed"};      ///< times of shots were guessed
  WarningCode rows_sorted{"rows_sorted"};          ///< rows were sorted by time
  WarningCode clock_unknown{"clock_unknown"};      ///< nothing says what times count from
  WarningCode clock_reset{"clock_reset"};          ///< the clock was reset
  WarningCode clock_wrapped{"clock_wrapped"};      ///< the day or week ended; times were continued
  WarningCode clock_rate{"clock_rate"};            ///< the clock seems to run too fast or too slow
  WarningCode clocks_disagree{"clocks_disagree"};  ///< sensor's and trajectory's times do not fit
  // Sensor and frame.
  WarningCode sensor_guessed{"sensor_guessed"};            ///< several sensors would fit
  WarningCode sensor_unknown{"sensor_unknown"};            ///< no preset fits; one was assumed
  WarningCode sensor_contradicted{"sensor_contradicted"};  ///< the scan is not that of the sensor
  WarningCode firing_order{"firing_order"};                ///< emitters do not fire in turn
  WarningCode coordinates_cut{"coordinates_cut"};  ///< coordinates were cut off, not rounded
  WarningCode mirrored{"mirrored"};                ///< a mirror image was turned
  WarningCode turned_back{"turned_back"};          ///< shots were turned back to the sensor's frame
  WarningCode pose_undecided{"pose_undecided"};    ///< it is unclear whether a pose was applied
  WarningCode pose_unused{"pose_unused"};          ///< a stated pose was not applied
  WarningCode frame_turned{"frame_turned"};        ///< the recording's frame is not the sensor's
  // Numbers.
  WarningCode shots_unused{"shots_unused"};          ///< shots were left out of the computation
  WarningCode many_outliers{"many_outliers"};        ///< more than 2 % of the shots do not fit
  WarningCode sigmas_enlarged{"sigmas_enlarged"};    ///< residuals made the sigmas larger
  WarningCode sigmas_too_small{"sigmas_too_small"};  ///< residuals are larger than the sigmas say
  WarningCode unusual_noise{"unusual_noise"};        ///< noise is not that of a healthy unit
  WarningCode model_incomplete{"model_incomplete"};  ///< residuals show what the model lacks
  WarningCode taken_as_exact{"taken_as_exact"};      ///< nothing says how wrong a value may be
  WarningCode not_seen{"not_seen"};                  ///< an emitter, plane or strip has no shot
  WarningCode input_left_out{"input_left_out"};      ///< one of several inputs was not used
  // Calibrations and flights.
  WarningCode poor_datum{"poor_datum"};      ///< the direction that all beams share is uncertain
  WarningCode uneven_plane{"uneven_plane"};  ///< a part of a plane stands off it
  WarningCode held_contradicted{"held_contradicted"};  ///< strips contradict a held value
  WarningCode control_doubtful{"control_doubtful"};    ///< known ground is unseen or contradicted
  WarningCode coarse_knots{"coarse_knots"};            ///< knots are further apart than asked for
  WarningCode trajectory_gaps{"trajectory_gaps"};      ///< there are no poses for some times
  WarningCode trajectory_jumps{"trajectory_jumps"};    ///< position or attitude jumps
  WarningCode trajectory_errors{
      "trajectory_errors"};                      ///< the trajectory's errors are larger than stated
  WarningCode velocity_frame{"velocity_frame"};  ///< velocities do not fit the positions
  WarningCode terrain_assumed{"terrain_assumed"};  ///< the ground was taken to be level
  // Clouds and results.
  WarningCode calibration_doubtful{
      "calibration_doubtful"};  ///< directions contradict the calibration
  WarningCode ranges_uncorrected{
      "ranges_uncorrected"};                     ///< ranges lack their correction by intensities
  WarningCode points_missing{"points_missing"};  ///< some shots have no points
  WarningCode distribution_unknown{"distribution_unknown"};  ///< how points lie is not told
  WarningCode map_assumed{"map_assumed"};                    ///< no map was named
  WarningCode datum_changed{"datum_changed"};  ///< the map has another datum than the trajectory
  WarningCode outside_map{"outside_map"};      ///< the flight is outside the map's area of use
  WarningCode results_renamed{"results_renamed"};  ///< results of an earlier run were renamed
};

/// By name: kWarning.cut_off.
inline constexpr WarningCodes kWarning;

/// Something a user should know that does not make an answer useless: a tail that was cut off while
/// recording, a sensor that was guessed.
struct Warning {
  WarningCode code;
  std::string message;
  FilePlace place = {};            ///< of the file that was read, where there is one
  std::uint64_t lost_records = 0;  ///< that are known to be lost; 0: none, or nobody knows
};

/// In one line: the message, then the place in brackets, as in "... (at byte 17)", "... (line 3)".
std::string warning_text(const Warning& warning);

/// The same warning of one of several files, which its message names first.
Warning of_file(const std::string& file, Warning warning);

/// Puts some behind others.
void append(std::vector<Warning>& warnings, const std::vector<Warning>& more);

}  // namespace risley
