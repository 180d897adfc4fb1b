// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/datum.hpp"
#include "risley/optics/prism_train.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Fewer units do not show the scatter of a type.
inline constexpr std::size_t kFewestUnitsOfFleet = 5;

/// One parameter over a fleet, SI units.
struct FleetParameter {
  std::string name;   ///< as in parameter_list(), or kRangeOffset
  double middle = 0;  ///< median over the units
  double spread = 0;  ///< of the units' values, from their median distance from the median
};

/// One unit beside the others.
struct FleetUnit {
  /// Distance from the median over the root of spread^2 + sigma^2, [parameters of the fleet]; NaN
  /// if this unit has no value of the parameter.
  std::vector<double> robust_z;
  std::vector<double> robust_z_combined;  ///< the same of the fleet's combinations
  /// The largest absolute value of all.
  double worst_z = 0;
  /// Its parameter, or the one that contributes most to its combination.
  std::size_t worst = 0;
  bool worst_is_combined = false;
  /// Upper limit of the probability that chance puts any unit of the fleet so far off in anything.
  double p_value = 1;
  bool outlier = false;              ///< p_value is below the requested probability
  bool tested = false;               ///< it has any of the parameters
  calibration::PointingError beams;  ///< directions of the unit minus those of the fleet's median
};

/// "outlier", "like the others", or "no sigmas to test with".
std::string answer_words(const FleetUnit& unit);

/// Units of one type against each other. docs/theory/fleet.md
struct Fleet {
  TrainShape shape;                        ///< of all of them
  std::vector<FleetParameter> parameters;  ///< for which enough units have a sigma
  std::vector<FleetUnit> units;            ///< in the order of the sensors
  /// Sums of parameters whose errors are independent of each other, as columns of weights
  /// [parameters, combinations]: results determine some of them far better than any single
  /// parameter.
  Eigen::MatrixXd combinations;
};

/// The largest deviation of a unit: "wedge_angle_deg", "wedge_angle_deg and others"; "-" if it was
/// not tested.
std::string worst_words(const FleetUnit& unit, const Fleet& fleet);

/// Finds the units that differ from the others.
/// @param units  one result of each, of one kind of optics; at least kFewestUnitsOfFleet
/// @param false_alarm largest probability that any unit of a homogeneous fleet is called an outlier
/// @throws InvalidArgument
Fleet fleet_of(const std::vector<sensors::Sensor>& units, double false_alarm);

}  // namespace risley::jobs
