// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/datum.hpp"
#include "risley/calibration/flight_calibration.hpp"
#include "risley/calibration/ground_cells.hpp"
#include "risley/jobs/calibrate_flight.hpp"
#include "risley/jobs/flight_details.hpp"
#include "risley/report/chart.hpp"
#include "risley/report/report_facts.hpp"
#include "risley/sensors/sensor.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::report {

/// All that the page of one calibration in flight says and draws, and all that report.json keeps of
/// it. SI units; the diagrams are in the units of their axes.
struct FlightReport {
  std::vector<ReportedRecording> recordings;
  std::uint64_t observations = 0;  ///< rows of all recordings
  std::string sensor, serial, preset;
  int prisms = 0;
  std::optional<int> emitters;
  std::string mount, reference_point;  ///< as the mount names them
  Eigen::MatrixXd body_from_sensor;    ///< [3, 3], as designed

  bool converged = false;
  std::string reason;
  std::optional<ReportedVerdict> verdict;  ///< not in files of older versions
  std::vector<std::string> warnings;
  std::size_t shots = 0, without_pose = 0, used = 0, outliers = 0;
  std::size_t cells = 0, rough_cells = 0;

  std::vector<calibration::FlightUnknown> unknowns;
  std::vector<double> nominal;  ///< [unknowns], of the preset; NaN where it knows none
  Eigen::MatrixXd covariance;   ///< [unknowns, unknowns]
  calibration::FlightDatum datum;
  std::vector<calibration::NotTold> not_told;
  std::vector<calibration::SeenControl> control;  ///< ground that was known

  std::size_t pair_count = 0;  ///< of strips that saw the same ground
  std::vector<calibration::StripPair> pairs_before, pairs_after;  ///< with the most cells
  double rms_before = kUnknown, rms_after = kUnknown;             ///< of all, m
  double sigma0 = 0, range_sigma = kUnknown;                      ///< m
  /// Of the ground within its cells, m; delay of the attitudes and its sigma, s. Not in files of
  /// older versions.
  std::optional<double> roughness, attitude_delay, attitude_delay_sigma;

  /// A strip as it was flown, without its places.
  struct Strip {
    std::uint16_t strip = 0;         ///< from 0
    double begin = 0, duration = 0;  ///< s
    double course = 0, sway = 0;     ///< rad
    double speed = 0, range = 0;     ///< m/s, m
  };
  std::size_t strip_count = 0;
  std::vector<Strip> strips;  ///< the first ones of many
  std::size_t knots = 0;      ///< of the trajectory's corrections
  double knot_spacing = 0;    ///< median, s

  /// Against the truth of a simulation.
  struct Truth {
    /// Of boresight and prisms together.
    calibration::DirectionErrors before, after;
    std::vector<double> values;  ///< [unknowns]
  };
  std::optional<Truth> truth;

  std::vector<Chart> strip_charts, difference_charts, ground_charts, residual_charts,
      correction_charts;
  Provenance provenance;

  /// Numbers of prisms and emitters; one emitter in files that do not name a number.
  TrainShape shape() const { return {prisms, emitters.value_or(1)}; }
};

/// What a report is made of. References must live until it is made.
struct FlightReportInput {
  const calibration::FlightCalibration& calibration;
  const sensors::Sensor& nominal;    ///< preset of the sensor
  const trajectories::Mount& mount;  ///< as given
  const jobs::FlightDetails& details;
  const std::optional<jobs::FlightTruth>& truth;  ///< where it is known
  std::vector<ReportedRecording> recordings;
  Provenance provenance;
  std::vector<std::string> warnings;  ///< beside those of the calibration
};

/// Thins what the page draws. What is not finite stays so.
FlightReport flight_report(const FlightReportInput& input);
/// Of a job's result. @throws InvalidArgument when it was not asked for details
FlightReport flight_report(const jobs::CalibratedFlight& calibrated);

}  // namespace risley::report
