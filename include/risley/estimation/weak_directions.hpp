// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/free_parameters.hpp"

namespace risley::estimation {

/// A combination of parameters that data do not determine.
struct WeakDirection {
  /// Parameters by name, each in its prior sigmas (1 degree, 0.01 in an index), as a unit vector;
  /// weights below 0.05 are omitted. The largest is positive.
  std::vector<std::pair<std::string, double>> weights;
  double ratio = 0;  ///< its singular value over the largest one
  double sigma = 0;  ///< of the combination after the data, in prior sigmas
};

/// Singular values of the data's information on the parameters, each scaled by its prior sigma: the
/// directions that stay wider than most_sigma prior sigmas.
/// @param information  [free, free], of the data alone, rotors eliminated
std::vector<WeakDirection> weak_directions(const Eigen::MatrixXd& information,
                                           const std::vector<FreeParameter>& free,
                                           double most_sigma);

/// "0.71 refractive_index_air - 0.70 refractive_index"
std::string direction_text(const WeakDirection& direction);

}  // namespace risley::estimation
