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
#include "risley/jobs/estimate_details.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/jobs/sensor_choice.hpp"

namespace risley::jobs {

/// Shots per second that a method uses by default, empty for all: the filter is
/// given what it can do in a time that one waits for.
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
  std::string truth;             ///< OUT.truth.yaml of a simulation to judge by; may be empty
  bool details = false;          ///< wanted in the result
  ResultFiles files;             ///< names the outputs; without them nothing is written
  /// Further files of the folder, such as a page, made from the result.
  std::function<std::vector<NamedText>(const EstimatedRecording&)> texts;
};

/// Checks the options before anything is read. @throws InvalidArgument
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
  std::optional<estimation::Evaluation> evaluation;  ///< where the truth is known
  std::optional<EstimateDetails> details;            ///< where they were asked for
  Provenance provenance;  ///< of the options, with the input; empty where nothing was written
  double reading_time = 0, solving_time = 0;  ///< s
  double total_time = 0;                      ///< of the job, s
};

/// Estimates a sensor's parameters and the rotation angles of its prisms from a recording. Stages:
/// reading, estimating, judging.
/// @throws EstimationError when the data cannot answer; InvalidArgument; FileError; Cancelled
EstimatedRecording estimate_recording(const EstimateRecordingOptions& options,
                                      const Progress& progress = {});

/// Judges an estimate by the truth of its simulation.
/// @param truth  OUT.truth.yaml, beside which OUT.truth.nc stands
estimation::Evaluation evaluate_by_file(const estimation::Estimate& estimate,
                                        const std::string& truth);

}  // namespace risley::jobs
