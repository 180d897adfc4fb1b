// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/evaluation.hpp"
#include "risley/estimation/noise_model.hpp"
#include "risley/jobs/estimate_details.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/jobs/sensor_choice.hpp"

namespace risley::jobs {

/// Default number of shots per second of a method, empty for all: a rate that the filter can
/// process in acceptable time.
std::optional<double> usual_rate(estimation::Method method);

struct EstimatedRecording;

/// What to estimate, and how. SI units.
struct EstimateRecordingOptions {
  recordings::Source recording;     ///< of one sensor
  recordings::ReadOptions reading;  ///< see open_in_sensor_frame()
  GivenSensor sensor;               ///< as given_sensor()
  estimation::Method method = estimation::Method::map;
  std::optional<double> rate;         ///< shots per second to use; empty: all. See usual_rate()
  std::optional<double> angle_noise;  ///< as estimation::EstimateOptions
  HeldParameters fixed;
  std::vector<std::string> additional;  ///< further parameters to free
  /// Motion model of every rotor; empty: maximum likelihood.
  std::optional<estimation::RotorProcess> rotor_process;
  std::optional<bool> mirrored;  ///< the elevation's sign is turned; empty: find out
  std::string truth;             ///< OUT.truth.yaml of a simulation to compare with; may be empty
  bool details = false;          ///< wanted in the result
  ResultFiles files;             ///< names the outputs; without them nothing is written
  /// Further files of the folder, such as a page, made from the result.
  std::function<std::vector<NamedText>(const EstimatedRecording&)> texts;
  bool noise_model = false;  ///< requested in the result; details have it, too
};

/// Checks the options before reading anything. @throws InvalidArgument
void check(const EstimateRecordingOptions& options);

/// What came of it.
struct EstimatedRecording {
  ReadRecording recording;
  estimation::AngleSeries head;  ///< every shot of the first second, as recorded
  estimation::SelectionCounts counts;
  std::vector<Warning> warnings;  ///< of the recording; the estimate has its own
  SensorChoice choice;            ///< how the sensor was chosen
  sensors::Sensor nominal;        ///< what the estimation started from
  estimation::Estimate estimate;
  std::optional<estimation::Evaluation> evaluation;   ///< where the truth is known
  std::optional<EstimateDetails> details;             ///< where they were asked for
  std::optional<estimation::NoiseModel> noise_model;  ///< if it or details were requested
  Provenance provenance;  ///< of the options, with the input; empty if nothing was written
  double reading_time = 0, solving_time = 0;  ///< s
  double total_time = 0;                      ///< of the job, s
};

/// Estimates a sensor's parameters and the rotation angles of its prisms from a recording. Stages:
/// reading, estimating, judging.
/// @throws EstimationError when the data give no result; InvalidArgument; FileError; Cancelled
EstimatedRecording estimate_recording(const EstimateRecordingOptions& options,
                                      const Progress& progress = {});

/// Compares an estimate with the truth of its simulation.
/// @param truth  OUT.truth.yaml, with OUT.truth.nc beside it
estimation::Evaluation evaluate_by_file(const estimation::Estimate& estimate,
                                        const std::string& truth);

}  // namespace risley::jobs
