// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/report/chart.hpp"
#include "risley/report/report_facts.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::report {

/// All that the page of one calibration says and draws, and all that report.json keeps of it.
/// SI units; the diagrams are in the units of their axes.
struct CalibrationReport {
  std::vector<ReportedRecording> recordings;
  std::uint64_t observations = 0;  ///< rows of all recordings
  std::string sensor, serial, preset;
  int prisms = 0;
  std::optional<int> emitters;  ///< not in files of older versions, which know one alone
  calibration::CalibrationMethod method = calibration::CalibrationMethod::adjustment;

  bool converged = false;
  std::string reason;
  std::optional<ReportedVerdict> verdict;  ///< not in files of older versions
  std::vector<std::string> warnings;
  std::size_t points = 0;  ///< used

  std::vector<ReportedParameter> parameters;
  /// Sizes of the prisms and range errors; not in files of older versions.
  std::optional<std::vector<calibration::CalibratedNumber>> numbers;
  std::vector<std::string> free;  ///< what the covariance is of
  Eigen::MatrixXd covariance;     ///< [free, free]
  std::vector<estimation::WeakDirection> unobservable;

  calibration::DatumKind datum_kind = calibration::DatumKind::none;
  calibration::FormalDatum datum, datum_without_common;
  std::optional<calibration::PointingError> pointing_error;  ///< not in files of older versions
  std::vector<calibration::PriorTest> prior_tests;
  std::vector<calibration::CalibratedPlane> planes;
  std::vector<calibration::SurfaceStep> steps;
  double rms_before = kUnknown, rms_after = kUnknown;  ///< of all planes, m
  double sigma0 = 0;
  std::optional<calibration::ShapeParameters> wall_shape;  ///< not in files of older versions

  /// Of the beams of all recordings together, against the truth of simulations.
  struct Truth {
    calibration::DirectionErrors before, after;
  };
  std::optional<Truth> truth;

  std::optional<std::vector<Chart>> pointing_charts;  ///< not in files of older versions
  std::vector<Chart> truth_charts, thickness_charts, wall_charts, view_charts;
  Provenance provenance;

  /// Numbers of prisms and emitters; one emitter in files that do not name a number.
  TrainShape shape() const { return {prisms, emitters.value_or(1)}; }
};

/// What a report is made of. References must live until it is made.
struct CalibrationReportInput {
  const calibration::Calibration& calibration;
  const sensors::Sensor& nominal;  ///< preset the calibration started from
  const jobs::CalibrationDetails& details;
  const std::optional<jobs::BeamComparison>& truth;  ///< where it is known
  std::vector<ReportedRecording> recordings;
  Provenance provenance;
  std::vector<std::string> warnings;  ///< beside those of the calibration
};

/// Thins and bins what the page draws. What is not finite stays so.
CalibrationReport calibration_report(const CalibrationReportInput& input);
/// Of a job's result. @throws InvalidArgument when it was not asked for details
CalibrationReport calibration_report(const jobs::CalibratedRecordings& calibrated);

}  // namespace risley::report
