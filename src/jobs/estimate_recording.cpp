// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/estimate_recording.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/vector3.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/jobs/result_folder.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/checks.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

constexpr double kFilterRate = 1000.0;

void write_files(const EstimateRecordingOptions& options, EstimatedRecording& result,
                 ResultFolder& folder, const Progress& progress) {
  if (result.estimate.converged) {
    sensors::Sensor calibrated = result.estimate.sensor;
    calibrated.provenance = result.provenance;
    calibrated.serial = result.recording.serial();
    folder.add_calibration(calibrated);
  }
  folder.add_states("states.nc", result.estimate, options.files.states, result.provenance,
                    progress);
  if (options.texts) {
    for (const NamedText& text : options.texts(result)) folder.add_text(text);
  }
  progress.check();
  append(result.warnings, folder.commit());
}

/// Conclusion about the clock from rotors that all turn too fast or too slowly by the same factor.
std::string clock_words(const estimation::SpeedFactor& factor, double counted_rate) {
  std::string words = fmt::format(
      "all rotors turn {:.5f} ± {:.5f} times as fast as usual for this type, as they would appear "
      "to with a wrong recording clock",
      factor.value, factor.sigma);
  if (counted_rate > 0) {
    words += fmt::format(
        ": at a shot rate of {:.0f} Hz instead of {:.10g} Hz they would turn as usual; nothing was "
        "changed",
        counted_rate / factor.value, counted_rate);
  }
  return words;
}

/// @throws InvalidArgument as check_truth_is_of_recording()
void check_beams(const estimation::PackedSeries& series, const recordings::TruthColumns& columns,
                 const std::string& truth) {
  std::vector<Vector3<double>> recorded, beams;
  std::size_t row = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const std::int64_t time_ns = series.time_ns(i);
    while (row < columns.size() && columns.time_ns[row] < time_ns) ++row;
    if (row == columns.size()) break;
    if (columns.time_ns[row] != time_ns) continue;
    const auto [azimuth, zenith] = series.angles(i);
    recorded.push_back(direction_from_angles<double>({azimuth, zenith}));
    beams.push_back(direction_from_angles<double>({columns.azimuth[row], columns.zenith[row]}));
  }
  check_truth_is_of_recording(recorded, beams, truth);
}

}  // namespace

void check(const EstimateRecordingOptions& options) {
  if (options.rate) require_positive(kSetting.rate, *options.rate);
  if (options.angle_noise) require_positive(kSetting.noise_angle, *options.angle_noise);
  if (options.files.states == StatesRows::all && options.method == estimation::Method::ekf &&
      options.rate) {
    throw InvalidArgument(
        fmt::format("{} all needs {} full: the filter has states only at the shots it uses",
                    name_of(kSetting.states), name_of(kSetting.rate)));
  }
  if (!options.truth.empty()) check_truth_name(options.truth);
}

std::optional<double> usual_rate(estimation::Method method) {
  if (method == estimation::Method::ekf) return kFilterRate;
  return std::nullopt;
}

estimation::Evaluation evaluate_by_file(const estimation::Estimate& estimate,
                                        const std::string& truth) {
  check_truth_name(truth);
  const sensors::Sensor sensor = sensors::load_sensor(truth);
  // One row per state, and the first shot's: the truth of a full-rate recording is larger than the
  // recording.
  std::vector<std::int64_t> times = estimate.states.time_ns;
  const std::int64_t first_ns = estimate.series.time_ns(estimation::first_used_shot(estimate));
  if (std::find(times.begin(), times.end(), first_ns) == times.end()) times.push_back(first_ns);
  std::sort(times.begin(), times.end());
  const recordings::TruthColumns columns = recordings::load_truth(truth_columns(truth), times);
  check_beams(estimate.series, columns, truth);
  return estimation::evaluate(estimate, sensor, columns);
}

EstimatedRecording estimate_recording(const EstimateRecordingOptions& options,
                                      const Progress& progress) {
  const Stopwatch whole;
  check(options);
  ResultFolder folder(options.files.folder);
  std::optional<InputHashes> hashes;
  recordings::Source recording = options.recording.held_open();
  if (folder) hashes.emplace(std::vector{recording}, progress);
  EstimationInput input =
      read_for_estimation({std::move(recording),
                           options.reading,
                           options.sensor,
                           {.rate = options.rate, .ranges = false, .rows = false}},
                          progress.stage("reading"));
  EstimatedRecording result;
  estimation::EstimateOptions settings;
  settings.sensor = input.choice.sensor;
  settings.angle_noise = options.angle_noise;
  settings.fixed = hold(options.fixed, settings.sensor);
  settings.additional = options.additional;
  if (options.rotor_process) {
    settings.rotor_process.assign(static_cast<std::size_t>(settings.sensor.prisms()),
                                  *options.rotor_process);
  }
  settings.mirrored = options.mirrored;
  settings.cartesian = input.whole_steps;
  result.nominal = settings.sensor;
  result.choice = std::move(input.choice);
  result.recording = std::move(input.recording);
  result.counts = input.counts;
  result.warnings = std::move(input.warnings);
  result.head = std::move(input.head);
  result.reading_time = input.reading_time;
  const Stopwatch watch;
  result.estimate =
      estimation::estimate(options.method, std::move(input.series), result.head, settings,
                           progress.stage("estimating"), std::move(input.found));
  result.solving_time = watch.seconds();
  if (const auto& factor = result.estimate.speed_factor) {
    result.warnings.push_back(
        {kWarning.clock_rate, clock_words(*factor, result.recording.header.counted_rate)});
  }
  const Progress judging = progress.stage("judging");
  judging.check();
  if (!options.truth.empty()) {
    result.evaluation = evaluate_by_file(result.estimate, options.truth);
  }
  if (options.noise_model || options.details) {
    result.noise_model = estimation::noise_model(result.estimate, result.nominal);
  }
  if (options.details) {
    result.details =
        estimate_details(result.estimate, result.nominal, result.head, result.evaluation, judging);
  }
  if (folder) {
    result.provenance = hashes->with_inputs(options.files.provenance);
    write_files(options, result, folder, judging);
  }
  result.total_time = whole.seconds();
  return result;
}

}  // namespace risley::jobs
