// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/ranged_input.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"

#include "jobs/checks.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {

using calibration::RangedRecording;

namespace {

/// Each recording represents separate observations.
void require_recordings(const std::vector<recordings::Source>& recordings) {
  if (recordings.empty()) throw InvalidArgument("no recording is given, expected one or more");
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (recordings[i].is_same_as(recordings[j])) {
        throw InvalidArgument(fmt::format("{} is given twice", recordings[i].name()));
      }
    }
  }
}

}  // namespace

void check_ranged_input(const RangedInputOptions& options) {
  if (options.rate) require_positive(kSetting.rate, *options.rate);
  if (options.angle_noise) require_positive(kSetting.noise_angle, *options.angle_noise);
  require_recordings(options.recordings);
}

std::vector<recordings::Source> held_open(std::vector<recordings::Source> sources) {
  for (recordings::Source& source : sources) source = source.held_open();
  return sources;
}

RangedRecording read_ranged(recordings::Source source, const RangedInputOptions& options,
                            std::size_t number, RangedInput& result, const Progress& progress,
                            const EstimateTaker& take) {
  const std::string path = source.name();
  EstimationInput input =
      read_for_estimation({std::move(source),
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
  if (!input.choice.beyond_reach.empty()) {
    throw EstimationError(fmt::format("{}: {}", path, input.choice.beyond_reach));
  }
  estimation::EstimateOptions settings;
  settings.sensor = input.choice.sensor;
  settings.angle_noise = options.angle_noise;
  settings.cartesian = input.whole_steps;
  settings.mirrored = options.mirrored;
  if (number == 0) {
    result.nominal = settings.sensor;
    result.choice = input.choice;
  }
  for (const Warning& warning : input.warnings) result.warnings.push_back(of_file(path, warning));
  const Stopwatch watch;
  const Progress angles =
      progress.stage(fmt::format("rotation angles {}/{}", number + 1, options.recordings.size()));
  const estimation::Estimate estimate = [&] {
    try {
      return estimation::estimate(estimation::Method::map, std::move(input.series), input.head,
                                  settings, angles, std::move(input.found));
    } catch (const EstimationError& error) {
      throw EstimationError(fmt::format("{}: {}", path, error.what()));
    }
  }();
  for (const Warning& warning : estimate.warnings) {
    result.warnings.push_back(of_file(path, warning));
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
