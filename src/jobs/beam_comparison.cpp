// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/beam_comparison.hpp"

#include <algorithm>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/checks.hpp"

namespace risley::jobs {
namespace {

using calibration::RangedRecording;

constexpr std::size_t kMostBeams = 50000;  // of all recordings

/// Directions of some shots before and after, and the true ones.
struct Beams {
  std::vector<Vector3<double>> before, after, truth;
};

/// What directions are computed with.
struct BeamModel {
  const PrismTrain& train;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< of the sensor
};

Vector3<double> turned(const Eigen::Matrix3d& turn, const Vector3<double>& v) {
  const Eigen::Vector3d result = turn * Eigen::Vector3d(v.x, v.y, v.z);
  return {result.x(), result.y(), result.z()};
}

/// @param true_turn  of the sensor
void add_beams(const RangedRecording& recording, const BeamModel& before, const BeamModel& after,
               const Eigen::Matrix3d& true_turn, const std::vector<double>& shift,
               const std::string& truth_path, std::size_t most, Beams& beams) {
  const std::vector<std::size_t> rows = calibration::spread_rows(recording.shots.size(), most);
  std::vector<std::int64_t> times;
  times.reserve(rows.size());
  for (const std::size_t row : rows) times.push_back(recording.time_ns[row]);
  std::sort(times.begin(), times.end());
  const recordings::TruthColumns truth = recordings::load_truth(truth_columns(truth_path), times);
  std::vector<Vector3<double>> recorded, true_beams;
  for (const std::size_t row : rows) {
    const auto found =
        std::lower_bound(truth.time_ns.begin(), truth.time_ns.end(), recording.time_ns[row]);
    if (found == truth.time_ns.end() || *found != recording.time_ns[row]) continue;
    const auto at = static_cast<std::size_t>(found - truth.time_ns.begin());
    std::vector<double> angles;
    for (const auto& column : recording.shots.rotation_angle) angles.push_back(column[row]);
    const int beam = recording.shots.beam[row];
    recorded.push_back(observe(before.train, angles, beam).direction);
    true_beams.push_back(direction_from_angles<double>({truth.azimuth[at], truth.zenith[at]}));
    beams.before.push_back(turned(before.turn, recorded.back()));
    for (std::size_t k = 0; k < angles.size(); ++k) angles[k] += shift[k];
    beams.after.push_back(turned(after.turn, observe(after.train, angles, beam).direction));
    beams.truth.push_back(turned(true_turn, true_beams.back()));
  }
  check_truth_is_of_recording(recorded, true_beams, truth_path);
}

/// Appends computed minus true angles.
void add_errors(const Vector3<double>& beam, const SphericalAngles<double>& truth,
                std::vector<double>& azimuth, std::vector<double>& zenith) {
  const SphericalAngles<double> computed = angles_from_direction(beam);
  azimuth.push_back(wrap_to_pi(computed.azimuth - truth.azimuth));
  zenith.push_back(computed.zenith - truth.zenith);
}

}  // namespace

BeamComparison compare_beams(const std::vector<RangedRecording>& recordings,
                             const calibration::Calibration& calibration,
                             const std::vector<std::string>& truths, const Progress& progress) {
  check_truths(truths, recordings.size());
  Beams beams;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    progress.report(static_cast<double>(r) / static_cast<double>(recordings.size()));
    add_beams(recordings[r], {recordings[r].believed.train}, {calibration.sensor.train},
              Eigen::Matrix3d::Identity(), calibration.angle_shift[r], truths[r],
              kMostBeams / recordings.size(), beams);
  }
  BeamComparison result;
  result.before = calibration::direction_errors(beams.before, beams.truth);
  result.after = calibration::direction_errors(beams.after, beams.truth);
  result.truth = sensors::load_sensor(truths.front());
  for (std::size_t i = 0; i < beams.truth.size(); ++i) {
    const SphericalAngles<double> truth = angles_from_direction(beams.truth[i]);
    add_errors(beams.before[i], truth, result.azimuth_before, result.zenith_before);
    add_errors(beams.after[i], truth, result.azimuth_after, result.zenith_after);
  }
  return result;
}

FlightTruth compare_flight_beams(const std::vector<RangedRecording>& recordings,
                                 const calibration::FlightRecordings& flight,
                                 const trajectories::Mount& given,
                                 const calibration::FlightCalibration& found,
                                 const std::vector<std::string>& truths, const Progress& progress) {
  check_truths(truths, recordings.size());
  require_length("angle_shift", flight.angle_shift.size(), recordings.size());
  FlightTruth result;
  result.sensor = sensors::load_sensor(truths.front());
  result.mount = trajectories::load_mount(truth_mount(truths.front()));
  // As if the sensor sat on the body as designed.
  const auto turn = [&](const trajectories::Mount& mount) {
    return Eigen::Matrix3d(given.nominal.transpose() * trajectories::body_from_sensor(mount));
  };
  Beams beams;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    progress.report(static_cast<double>(r) / static_cast<double>(recordings.size()));
    add_beams(recordings[r], {flight.sensor.train, turn(given)},
              {found.sensor.train, turn(found.mount)},
              turn(trajectories::load_mount(truth_mount(truths[r]))), flight.angle_shift[r],
              truths[r], kMostBeams / recordings.size(), beams);
  }
  result.before = calibration::direction_errors(beams.before, beams.truth);
  result.after = calibration::direction_errors(beams.after, beams.truth);
  return result;
}

}  // namespace risley::jobs
