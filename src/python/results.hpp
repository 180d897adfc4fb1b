// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/jobs/calibrate_flight.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/jobs/plan_calibration.hpp"
#include "risley/jobs/plan_flight.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// What was found, as columns in SI units under names without a unit.
struct ValueTable {
  std::vector<std::string> names, units;
  std::vector<double> values, sigmas, sigmas_given_held;
  std::vector<std::string> file_names;  ///< with the unit
  /// What the covariance is of, and that of them if what was held is exact.
  std::vector<std::string> covariance_names;
  Eigen::MatrixXd covariance;
};

ValueTable table_of(const jobs::EstimatedRecording& found);
ValueTable table_of(const jobs::CalibratedRecordings& found);
ValueTable table_of(const jobs::CalibratedFlight& found);
/// Without values: a plan knows sigmas alone.
ValueTable table_of(const jobs::PlannedCalibration& planned);
ValueTable table_of(const jobs::PlannedFlightResult& planned);

/// The verdict and a table of what was found, in the units of files.
std::string html_of(const std::string& code, const std::string& words, const ValueTable& table);

}  // namespace risley::python
