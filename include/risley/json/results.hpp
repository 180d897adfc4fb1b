// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace risley {
class FileError;
namespace sensors {
struct PatternCoverage;
struct Sensor;
}  // namespace sensors
namespace simulation {
struct SimulationResult;
}
namespace jobs {
struct BeamOrigins;
struct CalibratedFlight;
struct CalibratedRecordings;
struct ComparedSeries;
struct ConvertedRecording;
struct ConvertedTrajectory;
struct EstimatedRecording;
struct IdentifiedRecording;
struct InspectedRecording;
struct InspectedTrajectory;
struct JudgedObservability;
struct PlannedCalibration;
struct PlannedFlightResult;
struct RecordingCloud;
struct ResultComparison;
struct WrittenPattern;
}  // namespace jobs
}  // namespace risley

namespace risley::json {

/// Keys stay in the order in which they were put.
using Json = nlohmann::ordered_json;

/// Of every object that is printed or handed out; changes when a key changes its meaning.
inline constexpr int kFormatVersion = 1;

// What every job found, in the keys, units and codes that docs/schemas describe: angles in degrees,
// numbers that are not finite as null. Messages say "option NAME".

Json of(const jobs::EstimatedRecording& found);
Json of(const jobs::CalibratedRecordings& found);
Json of(const jobs::CalibratedFlight& found);
Json of(const jobs::PlannedCalibration& planned);
Json of(const jobs::PlannedFlightResult& planned);
Json of(const jobs::JudgedObservability& judged);
Json of(const jobs::IdentifiedRecording& found);
Json of(const jobs::RecordingCloud& made);
Json of(const jobs::InspectedRecording& found);
Json of(const jobs::ConvertedRecording& done);
Json of(const jobs::InspectedTrajectory& found);
Json of(const jobs::ConvertedTrajectory& done);
Json of(const jobs::WrittenPattern& written);
Json of(const jobs::BeamOrigins& found);
Json of(const jobs::ResultComparison& compared);
Json of(const jobs::ComparedSeries& series);
Json of(const simulation::SimulationResult& simulated);
Json of(const sensors::PatternCoverage& coverage);
/// What a list of presets tells of one.
Json of(const sensors::Sensor& sensor);
/// Which file is wrong, where, and why.
Json of(const FileError& error);

}  // namespace risley::json
