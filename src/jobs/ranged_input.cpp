// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/ranged_input.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"

#include "jobs/checks.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {

using calibration::RangedRecording;

namespace {

/// Each recording stands for observations of its own.
void require_recordings(const std::vector<recordings::Source>& recordings) {
  if (recordings.empty()) throw InvalidArgument("option recordings is empty, expected one or more");
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (recordings[i].is_same_as(recordings[j])) {
        throw InvalidArgument(fmt::format("{} is given twice", recordings[i].name()));
      }
    }
  }
}

/// Ranges that the sensor cannot have measured are in another unit, or of another sensor.
void require_within_reach(const estimation::PackedSeries& series, const sensors::Sensor& sensor,
                          const std::string& path) {
  constexpr double kMostBeyond = 0.01, kMostBelow = 0.5;  // parts of all shots with a return
  std::size_t returns = 0, beyond = 0, below = 0;
  double longest = 0;
  estimation::AngleSeries rows;
  for (std::size_t begin = 0; begin < series.size();) {
    const std::size_t end = std::min(series.size(), begin + std::size_t{65536});
    series.rows({begin, end}, rows);
    for (const double range : rows.range) {
      if (!(range > 0)) continue;
      ++returns;
      if (range > sensor.range_maximum) ++beyond;
      if (range < sensor.range_minimum) ++below;
      longest = std::max(longest, range);
    }
    begin = end;
  }
  const auto part = [&](std::size_t count) {
    return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(returns, 1));
  };
  if (part(beyond) <= kMostBeyond && part(below) <= kMostBelow) return;
  throw EstimationError(fmt::format(
      "{}: {:.0f} % of its ranges, up to {:.6g} m, lie outside the {:g} to {:g} m that a {} "
      "measures: check the unit of the ranges, and the sensor",
      path, 100 * (part(beyond) + part(below)), longest, sensor.range_minimum, sensor.range_maximum,
      sensor.name));
}

}  // namespace

void check_ranged_input(const RangedInputOptions& options) {
  if (options.rate) check_positive(*options.rate, "rate", "Hz");
  if (options.angle_noise) check_positive(*options.angle_noise, "angle_noise", "rad");
  require_recordings(options.recordings);
}

RangedRecording read_ranged(const RangedInputOptions& options, std::size_t number,
                            RangedInput& result, const Progress& progress,
                            const EstimateTaker& take) {
  const std::string& path = options.recordings[number].name();
  EstimationInput input =
      read_for_estimation({options.recordings[number],
                           options.reading,
                           options.sensor,
                           {.rate = options.rate, .ranges = true, .rows = false}},
                          progress.stage("reading"));
  result.reading_time += input.reading_time;
  result.observations += input.recording.audit.observations;
  if (!input.recording.header.has_range) {
    throw EstimationError(
        fmt::format("{} holds no ranges, which a calibration on walls needs", path));
  }
  require_within_reach(input.series, input.choice.sensor, path);
  estimation::EstimateOptions settings;
  settings.sensor = input.choice.sensor;
  settings.angle_noise = options.angle_noise;
  settings.cartesian = input.whole_steps;
  settings.mirrored = options.mirrored;
  if (number == 0) {
    result.nominal = settings.sensor;
    result.choice = input.choice;
  }
  for (const std::string& text : input.warnings) {
    result.warnings.push_back(fmt::format("{}: {}", path, text));
  }
  const Stopwatch watch;
  const Progress angles =
      progress.stage(fmt::format("rotation angles {}/{}", number + 1, options.recordings.size()));
  const estimation::Estimate estimate = [&] {
    try {
      return estimation::estimate(estimation::Method::map, std::move(input.series), input.head,
                                  settings, angles);
    } catch (const EstimationError& error) {
      throw EstimationError(fmt::format("{}: {}", path, error.what()));
    }
  }();
  for (const std::string& text : estimate.warnings) {
    result.warnings.push_back(fmt::format("{}: {}", path, text));
  }
  RangedRecording recording =
      calibration::ranged_recording(estimate, path, input.recording.serial());
  recording.unit_assumed = input.recording.header.length_unit_assumed;
  if (take) take(estimate, angles);
  result.recordings.push_back(std::move(input.recording));
  result.angles_time += watch.seconds();
  return recording;
}

}  // namespace risley::jobs
