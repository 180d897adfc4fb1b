// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/json/results.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// The results, as columns in SI units under names without a unit.
struct ValueTable {
  std::vector<std::string> names, units;
  std::vector<double> values, sigmas, sigmas_given_held;
  std::vector<std::string> file_names;  ///< with the unit
  /// The quantities of the covariance, and their covariance if held values are exact.
  std::vector<std::string> covariance_names;
  Eigen::MatrixXd covariance;
};

/// From json::of(), without a covariance; NaN if it has no number, like the values of a plan.
ValueTable table_of(const json::Json& result);

/// The verdict and a table of the results, in the units of files.
std::string html_of(const json::Json& result);
/// The same as text, as the command prints them.
std::string text_of(const json::Json& result);

}  // namespace risley::python
