// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "risley/calibration/datum.hpp"
#include "risley/cloud/point_distribution.hpp"
#include "risley/core/angle.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/jobs/ranged_input.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/json/results.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::json {

// What several results have in common. Angles come in rad and leave in deg.

inline double deg(double radians) { return degrees_from_radians(radians); }

/// NaN and the infinite have no place in JSON.
Json number_or_null(double value);

/// An angle and its sigma.
Json value_json(double value, double sigma);

/// A verdict: stable code, words, what to do.
template <class Verdict>
Json verdict_json(const Verdict& verdict) {
  return {{"code", to_string(verdict.code)}, {"words", verdict.words}, {"to_do", verdict.to_do}};
}

/// Which sensor it was and how that is known: sensor, preset, sensor_chosen_by, sensor_choice.
Json choice_json(const jobs::SensorChoice& choice);

/// A turn of a frame by the names of its angles, of which a sensor about Z has a roll, too.
/// @param about_first  and second: in the order of estimation::turn_names()
Json turn_json(bool axis_up, Json yaw, Json about_first, Json about_second);

/// How a recording's frame is turned; zeros without sigma where it is the sensor's.
/// @param axis_up  of the sensor: a roll takes the place of the yaw, which is 0
Json frame_json(const std::optional<estimation::FrameEstimate>& turn = {}, bool axis_up = false);

/// Where the count of shots was wrong: [{row, shots}], shots null where they could not be counted.
Json slips_json(const std::vector<recordings::ShotSlip>& slips);
/// Slips of all recordings, each with the name of its own.
Json slips_of_all(const std::vector<jobs::ReadRecording>& recordings);

/// A combination of parameters that data do not determine.
Json weak_direction_json(const estimation::WeakDirection& direction);

/// Those of a job, then those of what it computed.
Json all_warnings(std::vector<Warning> of_job, const std::vector<Warning>& own);

/// How far directions are off, with sigmas.
Json pointing_json(const calibration::PointingError& pointing);
/// An error that is tolerated; null where none is.
/// @param tolerance  rad; 0: none
Json tolerance_json(double tolerance);
/// Errors of directions against a known truth.
Json errors_json(const calibration::DirectionErrors& errors);

/// What calibrations on walls and in flight end with.
/// @tparam Found  jobs::CalibratedRecordings or jobs::CalibratedFlight
template <class Found>
void add_end(const Found& found, Json& object) {
  object.update({{"frame", frame_json()},
                 {"slips", slips_of_all(found.recordings)},
                 {"warnings", all_warnings(found.warnings, found.calibration.warnings)},
                 {"seconds",
                  {{"read", found.reading_time},
                   {"rotation_angles", found.angles_time},
                   {"solve", found.solving_time},
                   {"total", found.total_time}}}});
  object.update(choice_json(found.choice));
  if (!found.truth) return;
  object["truth"] = {{"before", errors_json(found.truth->before)},
                     {"after", errors_json(found.truth->after)}};
}

/// What a plan says where a calibration says whose sensor it was, and how it turned out.
Json plan_head(const std::string& sensor);

/// How the points of a flight lie on the ground.
Json distribution_json(const cloud::PointDistributionSummary& distribution);

}  // namespace risley::json
