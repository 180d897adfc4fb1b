// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace risley {
class FileError;
struct Warning;
namespace calibration {
struct FormalDatum;
}
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
struct CampaignChunk;
struct CampaignResult;
struct CloudOfStations;
struct ComparedClouds;
struct ComparedUnits;
struct ConvertedRecording;
struct ConvertedTrajectory;
struct EmulatedSensor;
struct EstimatedRecording;
struct FoundSensor;
struct IdentifiedRecording;
struct InspectedRecording;
struct InspectedTrajectory;
struct JudgedObservability;
struct PlannedCalibration;
struct PlannedFlightResult;
struct ReadRecording;
struct RecordedSensors;
struct LiveRecording;
struct RecordingCloud;
struct ResultComparison;
struct WrittenPattern;
}  // namespace jobs
}  // namespace risley

namespace risley::json {

/// Keys keep the order of insertion.
using Json = nlohmann::ordered_json;

/// Of every object that is printed or returned; changes when a key changes its meaning.
inline constexpr int kFormatVersion = 1;

// Results of all jobs, in the keys, units and codes of docs/schemas: angles in degrees, non-finite
// numbers as null.

/// Of `risley estimate`.
Json of(const jobs::EstimatedRecording& found);
/// Of `risley calibrate` on walls.
Json of(const jobs::CalibratedRecordings& found);
/// Of `risley calibrate --trajectory`.
Json of(const jobs::CalibratedFlight& found);
/// Of `risley calibrate --plan` on walls.
Json of(const jobs::PlannedCalibration& planned);
/// Of `risley calibrate --plan` in flight.
Json of(const jobs::PlannedFlightResult& planned);
/// Of `risley observability`.
Json of(const jobs::JudgedObservability& judged);
/// Of `risley identify`.
Json of(const jobs::IdentifiedRecording& found);
/// Of `risley cloud`.
Json of(const jobs::RecordingCloud& made);
/// Of `risley cloud --station`.
Json of(const jobs::CloudOfStations& made);
/// Of `risley info` about a recording.
Json of(const jobs::InspectedRecording& found);
/// Of every verb: `warnings`.
Json of(const std::vector<Warning>& warnings);
/// Findings of the reader about the recording of a result, and the quality of its times.
Json of(const jobs::ReadRecording& recording);
/// Accuracy of the directions of a calibration on walls; without the `kind` of the datum.
Json of(const calibration::FormalDatum& datum);
/// Of `risley convert` with a recording.
Json of(const jobs::ConvertedRecording& done);
/// Of `risley info` about a trajectory.
Json of(const jobs::InspectedTrajectory& found);
/// Of `risley convert` with a trajectory.
Json of(const jobs::ConvertedTrajectory& done);
/// Of `risley pattern` with an output.
Json of(const jobs::WrittenPattern& written);
/// Extremes of the beams' origins, of `risley cloud --beam-origin-map`.
Json of(const jobs::BeamOrigins& found);
/// Of `risley report` about two results.
Json of(const jobs::ResultComparison& compared);
/// Of `risley compare` about two clouds.
Json of(const jobs::ComparedClouds& compared);
/// Of `risley compare`.
Json of(const jobs::ComparedUnits& compared);
/// Of `risley campaign` for one chunk.
Json of(const jobs::CampaignChunk& chunk);
/// Of `risley campaign` for all chunks together.
Json of(const jobs::CampaignResult& merged);
/// Of `risley simulate`.
Json of(const simulation::SimulationResult& simulated);
/// Of `risley record --list`.
Json of(const std::vector<jobs::FoundSensor>& found);
/// Of `risley record`.
Json of(const jobs::RecordedSensors& recorded);
/// A running recording: events of its page.
Json of(const jobs::LiveRecording& live);
/// Of `risley emulate`.
Json of(const jobs::EmulatedSensor& truth);
/// The `coverage` of `risley pattern`.
Json of(const sensors::PatternCoverage& coverage);
/// One preset's line in a list of presets.
Json of(const sensors::Sensor& sensor);
/// Which file is wrong, where, and why.
Json of(const FileError& error);

}  // namespace risley::json
