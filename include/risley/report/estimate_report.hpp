// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/evaluation.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/jobs/estimate_details.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/report/chart.hpp"
#include "risley/report/report_facts.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::report {

/// All that the page of one estimation says and draws, and all that report.json keeps of it.
/// SI units; the diagrams are in the units of their axes.
struct EstimateReport {
  ReportedRecording recording;
  std::string sensor;
  int prisms = 0;
  std::optional<int> emitters;  ///< not in files of older versions, which know one alone
  int combination = 0;          ///< speed combination 1 or 2; 0: the sensor has none
  bool mirrored = false;
  std::string method;  ///< "map" or "ekf"

  bool converged = false;
  std::string reason;
  std::optional<ReportedVerdict> verdict;  ///< not in files of older versions
  std::vector<std::string> warnings;
  std::size_t shots = 0, outliers = 0;

  std::vector<ReportedParameter> parameters;
  std::vector<std::string> free;  ///< what the covariance is of
  Eigen::MatrixXd covariance;     ///< [free, free]
  std::vector<estimation::WeakDirection> unobservable;
  std::vector<std::string> advice;  ///< what the recording can tell, in sentences

  estimation::Moments azimuth_residuals, zenith_residuals;  ///< rad
  double expected_residual = kUnknown;                      ///< rms of noise and rounding, rad
  /// Noise of the directions before rounding, rad.
  struct Noise {
    bool held = false;  ///< by the user or the method; sigmas are 0 then
    double azimuth = kUnknown, azimuth_sigma = kUnknown;
    double zenith = kUnknown, zenith_sigma = kUnknown;
    double usual = kUnknown;  ///< of a healthy unit
  };
  std::optional<Noise> noise;
  /// How the recording's frame is turned against the sensor's, rad; none where it is not.
  struct Frame {
    double yaw = 0, yaw_sigma = 0, pitch = 0, pitch_sigma = 0;
  };
  std::optional<Frame> frame;
  /// What residuals did to the sigmas; method map only.
  struct Variance {
    double unit_variance = 1, autocorrelation_factor = 1, variance_factor = 1;
  };
  std::optional<Variance> variance;
  std::vector<double> unevenness;  ///< [prisms], AngleProfile::chi2_per_bin

  /// Against the truth of a simulation.
  struct Truth {
    std::vector<double> rotation_angle_rmse;  ///< [prisms], rad
    double nees_parameters = kUnknown, nees_rotation_angles = kUnknown;
  };
  std::optional<Truth> truth;

  /// Of pieces of the recording, each estimated alone.
  struct Pieces {
    std::size_t count = 0, failed = 0;
    double duration = 0;     ///< of one, s
    double chi2 = kUnknown;  ///< per degree of freedom
    double degrees_of_freedom = 0;
  };
  std::optional<Pieces> pieces;

  std::vector<Chart> parameter_charts, rotor_charts, residual_charts, pattern_charts;
  Provenance provenance;

  /// Numbers of prisms and emitters; one emitter in files that do not name a number.
  TrainShape shape() const { return {prisms, emitters.value_or(1)}; }
};

/// What a report is made of. References must live until it is made.
struct EstimateReportInput {
  const estimation::Estimate& estimate;
  const sensors::Sensor& nominal;                           ///< what the estimation started from
  const std::optional<estimation::Evaluation>& evaluation;  ///< when the truth is known
  const estimation::AngleSeries& head;                      ///< every shot of the beginning
  const jobs::EstimateDetails& details;
  ReportedRecording recording;
  Provenance provenance;
  std::vector<std::string> warnings;  ///< beside those of the estimate
};

/// Thins and bins what the page draws.
EstimateReport estimate_report(const EstimateReportInput& input);
/// Of a job's result. @throws InvalidArgument when it was not asked for details
EstimateReport estimate_report(const jobs::EstimatedRecording& estimated);

}  // namespace risley::report
