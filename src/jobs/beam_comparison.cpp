// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/beam_comparison.hpp"

#include <algorithm>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/checks.hpp"

namespace risley::jobs {
namespace {

using calibration::RangedRecording;

constexpr std::size_t kMostBeams = 50000;  // of all recordings

/// Directions of some shots before and after, and where the beams really went.
struct Beams {
  std::vector<Vector3<double>> before, after, truth;
};

void add_beams(const RangedRecording& recording, const PrismTrain& calibrated,
               const std::vector<double>& shift, const std::string& truth_path, std::size_t most,
               Beams& beams) {
  const std::vector<std::size_t> rows = calibration::spread_rows(recording.shots.size(), most);
  std::vector<std::int64_t> times;
  times.reserve(rows.size());
  for (const std::size_t row : rows) times.push_back(recording.time_ns[row]);
  std::sort(times.begin(), times.end());
  const recordings::TruthColumns truth = recordings::load_truth(truth_columns(truth_path), times);
  for (const std::size_t row : rows) {
    const auto found =
        std::lower_bound(truth.time_ns.begin(), truth.time_ns.end(), recording.time_ns[row]);
    if (found == truth.time_ns.end() || *found != recording.time_ns[row]) continue;
    const auto at = static_cast<std::size_t>(found - truth.time_ns.begin());
    std::vector<double> angles;
    for (const auto& column : recording.shots.rotation_angle) angles.push_back(column[row]);
    const int beam = recording.shots.beam[row];
    beams.before.push_back(observe(recording.believed.train, angles, beam).direction);
    for (std::size_t k = 0; k < angles.size(); ++k) angles[k] += shift[k];
    beams.after.push_back(observe(calibrated, angles, beam).direction);
    beams.truth.push_back(direction_from_angles<double>({truth.azimuth[at], truth.zenith[at]}));
  }
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
    add_beams(recordings[r], calibration.sensor.train, calibration.angle_shift[r], truths[r],
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

}  // namespace risley::jobs
