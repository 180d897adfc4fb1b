// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/calibration/datum.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Name of the only quantity in a comparison that is no parameter of the train.
inline constexpr const char* kRangeOffset = "range_offset_m";

/// One parameter as two results have it, SI units.
struct ParameterDifference {
  std::string name;  ///< as in parameter_list(), or kRangeOffset
  double value_a = 0, value_b = 0;
  double sigma_a = 0, sigma_b = 0;  ///< 0 where it was held
  double difference = 0;            ///< b minus a
  double sigma = 0;                 ///< of it, the two results being independent
};

/// Whether two results are of one and the same optics. The differences of all parameters of the
/// prisms together, with their joint covariance: what a result hardly tells, such as a rotation of
/// all beams where nobody knew how the sensor stood, hardly counts.
struct ChangeTest {
  double chi2 = 0;  ///< of independent errors, chi-squared distributed where nothing changed
  int degrees_of_freedom = 0;  ///< 0 where neither result has a covariance
  double p_value = 1;          ///< probability of such differences, or larger ones, by chance
};

/// Two results side by side: what each says of a sensor of the same kind.
struct ResultComparison {
  sensors::Sensor a, b;
  std::vector<ParameterDifference> parameters;
  calibration::PointingError beams;  ///< directions of a minus those of b, over all rotation angles
  bool same_unit = false;            ///< the serial numbers are known and equal
  /// Both are taken to be of one unit and held the same parameters at the same values: what these
  /// are off by is alike in both, and the sigmas leave it out.
  bool held_alike = false;
  ChangeTest change;
};

/// Who says that two results are of one unit.
enum class OneUnit {
  serials,  ///< their serial numbers, which are known and equal
  caller,   ///< whoever asks, unless the serial numbers are known and differ
};

/// @param a, b  folders with the calibration.yaml of a result, such files, or presets
/// @throws FileError; InvalidArgument for sensors with other numbers of prisms or emitters, and
///         where one result has an index for all prisms and the other one for each
ResultComparison compare_results(const std::string& a, const std::string& b,
                                 OneUnit one_unit = OneUnit::serials);

}  // namespace risley::jobs
