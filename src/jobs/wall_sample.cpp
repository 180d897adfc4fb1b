// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/wall_sample.hpp"

#include <limits>

#include "risley/calibration/rays.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/require.hpp"
#include "risley/sensors/footprint.hpp"
#include "risley/sensors/range_values.hpp"

namespace risley::jobs {
namespace {

using calibration::RangedShots;
using calibration::Rays;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostShots = 20000;  // of all recordings: a picture is full with them

}  // namespace

std::vector<SamplePoint> wall_sample(const std::vector<calibration::RangedRecording>& recordings,
                                     const calibration::Calibration& calibration) {
  require_length("plane_of_shot", calibration.plane_of_shot.size(), recordings.size());
  require_length("angle_shift", calibration.angle_shift.size(), recordings.size());
  const sensors::Sensor& sensor = calibration.sensor;
  std::vector<SamplePoint> sample;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const std::vector<int>& plane_of_shot = calibration.plane_of_shot[r];
    require_length("plane_of_shot of a recording", plane_of_shot.size(),
                   recordings[r].shots.size());
    const std::vector<std::size_t> rows =
        calibration::spread_rows(recordings[r].shots.size(), kMostShots / recordings.size());
    RangedShots shots = rows_of(recordings[r].shots, rows);
    for (std::size_t k = 0; k < calibration.angle_shift[r].size(); ++k) {
      for (double& angle : shots.rotation_angle[k]) angle += calibration.angle_shift[r][k];
    }
    const Rays before(calibration.believed, sensor.geometry, shots);
    const Rays after(sensor.train, sensor.geometry, shots);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const SphericalAngles<double> angles = angles_from_direction(after.direction(i));
      SamplePoint one{r,
                      plane_of_shot[rows[i]],
                      {},
                      kNaN,
                      kNaN,
                      angles.azimuth,
                      angles.zenith,
                      before.direction(i) - after.direction(i)};
      double error = sensor.range_offset;
      if (one.plane >= 0) {
        const auto& plane = calibration.planes[static_cast<std::size_t>(one.plane)];
        const Vector3<double> beam = after.direction(i);
        const double range = hit_distance({plane.normal, plane.distance}, after.origin(i), beam);
        const sensors::FootprintAxes axes = sensors::footprint_axes(beam);
        const double depth = sensors::footprint_depth(
            range, sensors::footprint_slope(plane.normal, beam, axes.horizontal),
            sensors::footprint_slope(plane.normal, beam, axes.vertical),
            sensor.beam_divergence_horizontal, sensor.beam_divergence_vertical);
        error = sensors::range_error(
            sensor, range, depth,
            shots.intensity.empty() ? sensors::kWalkIntensity : shots.intensity[i],
            shots.beam.empty() ? std::size_t{0} : shots.beam[i]);
        one.before = signed_distance(plane.believed, before.point(i, shots.range[i]));
      }
      one.point = after.point(i, shots.range[i] - error);
      if (one.plane >= 0) {
        const auto& plane = calibration.planes[static_cast<std::size_t>(one.plane)];
        one.after = signed_distance({plane.normal, plane.distance}, one.point);
      }
      sample.push_back(one);
    }
  }
  return sample;
}

}  // namespace risley::jobs
