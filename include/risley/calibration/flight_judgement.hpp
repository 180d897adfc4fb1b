// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/optics/parameters.hpp"

namespace risley::calibration {

/// One of the unknowns that a whole flight shares.
struct FlightUnknown {
  std::string name;                        ///< as unknown_names()
  double start = 0, value = 0, sigma = 0;  ///< SI
  double prior_sigma = 0;                  ///< SI; infinite: none
  bool held = false;
  /// Share of the prior in the result: (sigma / prior sigma)^2, 1 if the flight carries no
  /// information.
  double prior_share = 0;
  std::string twin;  ///< the most strongly correlated unknown
  double twin_correlation = 0;
};

/// An SI value of an unknown in the unit that its name states.
double in_file_unit(const FlightUnknown& unknown, double value, TrainShape shape);
/// The unit that in_file_unit() converts to: "deg", "m", "s" or that of the train's parameter.
std::string file_unit(const FlightUnknown& unknown, TrainShape shape);

/// Accuracy of boresight and prisms together, over the field of view.
struct FlightDatum {
  double sigma_x = 0, sigma_y = 0, sigma_z = 0;  ///< of the common rotation, sensor axes, rad
  double rotation = 0, shape = 0, total = 0;     ///< RMS over the beams, rad
  double height = 0;  ///< median range, m: converts an angle to a distance on the ground
};

/// A combination of unknowns that the flight does not determine.
struct NotTold {
  std::string words;  ///< "1.00 lever_arm_z_m", "boresight about the vertical against heading"
  double sigma = 0;   ///< after the flight, in units of the sigmas before it
};

/// The constant quantities that a flight determines, and those that it does not.
struct FlightJudgement {
  std::vector<FlightUnknown> unknowns;
  /// [unknowns, unknowns], SI: noise, white noise shared by samples, the trajectory's process
  /// between the knots, priors.
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd correction_sigma;  ///< [6, knots], from the normal equations
  FlightDatum datum;
  std::vector<NotTold> not_told;
};

}  // namespace risley::calibration
