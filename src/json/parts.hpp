// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
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

// Common parts of several results. Angles are converted from rad to deg.

inline double deg(double radians) { return degrees_from_radians(radians); }

/// JSON cannot represent NaN and infinity.
Json number_or_null(double value);

/// An angle and its sigma.
Json value_json(double value, double sigma);

/// A verdict: stable code, words, recommended action.
template <class Verdict>
Json verdict_json(const Verdict& verdict) {
  return {{"code", to_string(verdict.code)}, {"words", verdict.words}, {"to_do", verdict.to_do}};
}

/// The sensor and how it was chosen: sensor, preset, sensor_chosen_by, sensor_choice.
Json choice_json(const jobs::SensorChoice& choice);

/// The turn of a frame by the names of its angles, including a roll for a sensor about Z.
/// @param about_first  and second: in the order of estimation::turn_names()
Json turn_json(bool axis_up, Json yaw, Json about_first, Json about_second);

/// The turn of a recording's frame; zeros without sigma if it is the sensor's.
/// @param axis_up  of the sensor: a roll replaces the yaw, which is 0
Json frame_json(const std::optional<estimation::FrameEstimate>& turn = {}, bool axis_up = false);

/// Errors in the count of shots: [{row, shots}], shots null if they could not be counted.
Json slips_json(const std::vector<recordings::ShotSlip>& slips);
/// Slips of all recordings, each with its recording's name.
Json slips_of_all(const std::vector<jobs::ReadRecording>& recordings);

/// A combination of parameters that data do not determine.
Json weak_direction_json(const estimation::WeakDirection& direction);

/// First those of a job, then those of its result.
Json all_warnings(std::vector<Warning> of_job, const std::vector<Warning>& own);

/// Errors of directions, with sigmas.
Json pointing_json(const calibration::PointingError& pointing);
/// The tolerance; null if there is none.
/// @param tolerance  rad; 0: none
Json tolerance_json(double tolerance);
/// The three numbers.
Json vector_json(const Eigen::Vector3d& vector);

/// Errors of directions against a known truth.
Json errors_json(const calibration::DirectionErrors& errors);

/// Final members of calibrations on walls and in flight.
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

/// Members of a plan in place of a calibration's sensor and verdict.
Json plan_head(const std::string& sensor);

/// Distribution of a flight's points on the ground.
Json distribution_json(const cloud::PointDistributionSummary& distribution);

}  // namespace risley::json
