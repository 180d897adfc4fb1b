// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/algebra/named_covariance.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/jobs/given.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Name of the only quantity in a comparison that is not a parameter of the train.
inline constexpr const char* kRangeOffset = "range_offset_m";

/// Combinations of parameters, in sigmas, with less than this share of the largest variance are
/// numerically zero; times the number of parameters.
inline constexpr double kSmallestVariance = 1e-13;

/// One parameter in two results, SI units.
struct ParameterDifference {
  std::string name;  ///< as in parameter_list(), or kRangeOffset
  double value_a = 0, value_b = 0;
  double sigma_a = 0, sigma_b = 0;  ///< 0 where it was held
  double difference = 0;            ///< b minus a
  double sigma = 0;                 ///< of it, the two results being independent
};

/// Whether two results are of the same optics. The differences of all parameters of the prisms
/// together, with their joint covariance: poorly determined combinations, such as a rotation of all
/// beams when the sensor's orientation was unknown, have little weight.
struct ChangeTest {
  double chi2 = 0;             ///< of independent errors, chi-squared distributed without a change
  int degrees_of_freedom = 0;  ///< 0 where neither result has a covariance
  double p_value = 1;          ///< probability of such differences, or larger ones, by chance
};

/// Two results side by side, from sensors of the same kind.
struct ResultComparison {
  sensors::Sensor a, b;
  std::vector<ParameterDifference> parameters;
  calibration::PointingError beams;  ///< directions of a minus those of b, over all rotation angles
  bool same_unit = false;            ///< the serial numbers are known and equal
  /// Both are assumed to be from one unit and held the same parameters at the same values: their
  /// errors are common to both, and the sigmas exclude them.
  bool held_alike = false;
  ChangeTest change;
};

/// Whether two results are of different units, by their serial numbers.
bool are_two_units(const ResultComparison& comparison);
/// Whether two results are of one unit: "yes", "no" or "not known".
std::string one_unit_words(const ResultComparison& comparison);

/// Reason for treating two results as results of one unit.
enum class OneUnit {
  serials,  ///< their serial numbers, which are known and equal
  caller,   ///< the caller's request, unless the serial numbers are known and differ
};

/// A quantity's value in a sensor, SI units. @throws InvalidArgument
/// @param name  as in parameter_list(), of a size of prisms, or kRangeOffset
double value_of(const sensors::Sensor& sensor, const std::string& name);

/// How files have a quantity.
struct FileUnit {
  std::string unit;        ///< "1", "deg", "m"
  double si_per_unit = 1;  ///< SI units in one of it
};
/// @param name  as value_of(). @throws InvalidArgument
FileUnit file_unit_of(const std::string& name, TrainShape shape);

/// Whether the optics of two sensors have the same parameters.
bool have_same_optics(const sensors::Sensor& a, const sensors::Sensor& b);
/// Refuses sensors with different optics. @throws InvalidArgument naming them
void require_same_optics(const sensors::Sensor& a, const sensors::Sensor& b);

/// Whether a name is that of a parameter of a sensor's train.
bool is_of_train(const std::string& name, const sensors::Sensor& sensor);

/// A result conditioned on exact held parameters: the joint covariance of the others under that
/// condition.
algebra::NamedCovariance covariance_given_held(const sensors::Sensor& sensor);

/// Directions of a minus those of b, over all rotation angles.
/// @param difference  covariance of the difference of the trains; other names are ignored
calibration::PointingError directions_apart(const sensors::Sensor& a, const sensors::Sensor& b,
                                            const algebra::NamedCovariance& difference);

/// A result: one in memory, the calibration.yaml of a folder, such a file, or a preset.
/// @throws FileError
sensors::Sensor load_result(const GivenSensor& given);

/// @throws InvalidArgument for sensors with other numbers of prisms or emitters, and if one of them
/// has an index for all prisms and the other one for each
ResultComparison compare_results(const sensors::Sensor& a, const sensors::Sensor& b,
                                 OneUnit one_unit = OneUnit::serials);

/// The same of files. @param a, b  as load_result()
/// @throws FileError; InvalidArgument
ResultComparison compare_results(const GivenSensor& a, const GivenSensor& b);

}  // namespace risley::jobs
