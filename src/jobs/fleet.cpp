// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/fleet.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Core>

#include "risley/algebra/distributions.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/jobs/compare_results.hpp"

namespace risley::jobs {
namespace {

using algebra::NamedCovariance;
using sensors::Sensor;

/// Of the Student's distribution of robust z among this many units; docs/theory/fleet.md
double degrees_of_freedom(std::size_t units) {
  const auto n = static_cast<double>(units);
  return std::min(0.5 * (n - 1), 0.37 * n + 0.7);
}

/// A value and its sigma; NaN if the unit has none.
struct Known {
  double value = 0, sigma = std::numeric_limits<double>::quiet_NaN();
};

Known known_of(const Sensor& unit, const NamedCovariance& known, const std::string& name) {
  const Eigen::Index at = known.find(name);
  const double variance = at < 0 ? 0 : known.matrix(at, at);
  if (!(variance > 0)) return {};
  return {value_of(unit, name), std::sqrt(variance)};
}

/// Everything that determines the beam bundle, in the middle of the fleet.
Sensor middle_of(const std::vector<Sensor>& units, const Fleet& fleet) {
  Sensor middle = units.front();
  middle.covariance_names.clear();
  middle.covariance.resize(0, 0);
  std::vector<double> values(units.size());
  for (const ParameterInfo& parameter : parameter_list(middle.shape())) {
    if (parameter.kind != ParameterKind::train || parameter.places.size() != 1) continue;
    std::transform(units.begin(), units.end(), values.begin(),
                   [&](const Sensor& unit) { return unit.get(parameter.name); });
    middle.set(parameter.name, median(values));
  }
  for (const FleetParameter& parameter : fleet.parameters) {
    if (parameter.name != kRangeOffset) middle.set(parameter.name, parameter.middle);
  }
  return middle;
}

/// Distribution of the units in one quantity.
struct Scatter {
  double middle = 0, spread = 0;
  std::vector<double> robust_z;  ///< [units]
};

/// Nothing if too few units have it.
std::optional<Scatter> scatter_of(const std::vector<Known>& known) {
  std::vector<double> values;
  for (const Known& one : known) {
    if (std::isfinite(one.sigma)) values.push_back(one.value);
  }
  if (values.size() < kFewestUnitsOfFleet) return std::nullopt;
  Scatter scatter;
  scatter.middle = median(values);
  for (double& value : values) value = std::abs(value - scatter.middle);
  scatter.spread = kSigmaOverMedianDistance * median(values);
  for (const Known& one : known) {
    scatter.robust_z.push_back((one.value - scatter.middle) /
                               std::hypot(scatter.spread, one.sigma));
  }
  return scatter;
}

void add_parameter(const std::string& name, const std::vector<Known>& known, Fleet& fleet) {
  const std::optional<Scatter> scatter = scatter_of(known);
  if (!scatter) return;
  fleet.parameters.push_back({name, scatter->middle, scatter->spread});
  for (std::size_t i = 0; i < known.size(); ++i) {
    fleet.units[i].robust_z.push_back(scatter->robust_z[i]);
  }
}

/// A unit that has all of the fleet's parameters.
struct WholeUnit {
  std::size_t place;
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
};

std::vector<WholeUnit> whole_units(const std::vector<Sensor>& units,
                                   const std::vector<NamedCovariance>& known, const Fleet& fleet) {
  std::vector<std::string> names;
  for (const FleetParameter& parameter : fleet.parameters) names.push_back(parameter.name);
  const auto n = static_cast<Eigen::Index>(names.size());
  std::vector<WholeUnit> whole;
  for (std::size_t i = 0; i < units.size(); ++i) {
    const NamedCovariance part = known[i].part(names);
    if (part.names.size() != names.size()) continue;
    WholeUnit one{i, Eigen::VectorXd(n), part.matrix};
    for (Eigen::Index k = 0; k < n; ++k) {
      one.values[k] = known_of(units[i], part, names[static_cast<std::size_t>(k)]).value;
    }
    whole.push_back(std::move(one));
  }
  return whole;
}

/// Sums whose errors are independent, on average over the units.
Eigen::MatrixXd combinations_of(const std::vector<WholeUnit>& whole) {
  const Eigen::Index n = whole.front().values.size();
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(n, n);
  for (const WholeUnit& one : whole) mean += one.covariance / static_cast<double>(whole.size());
  const Eigen::VectorXd per_sigma = mean.diagonal().cwiseSqrt().cwiseInverse();
  const algebra::PrincipalAxes axes = algebra::principal_axes(algebra::scaled(mean, per_sigma));
  Eigen::MatrixXd weights(n, 0);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (axes.values[k] <= kSmallestVariance * static_cast<double>(n)) continue;
    weights.conservativeResize(n, weights.cols() + 1);
    weights.rightCols(1) = per_sigma.cwiseProduct(axes.vectors.col(k));
  }
  return weights;
}

void add_combinations(const std::vector<Sensor>& units, const std::vector<NamedCovariance>& known,
                      Fleet& fleet) {
  if (fleet.parameters.empty()) return;
  const std::vector<WholeUnit> whole = whole_units(units, known, fleet);
  if (whole.size() < kFewestUnitsOfFleet) return;
  fleet.combinations = combinations_of(whole);
  for (Eigen::Index k = 0; k < fleet.combinations.cols(); ++k) {
    const Eigen::VectorXd weights = fleet.combinations.col(k);
    std::vector<Known> values(units.size());
    for (const WholeUnit& one : whole) {
      values[one.place] = {weights.dot(one.values),
                           std::sqrt(std::max(0.0, weights.dot(one.covariance * weights)))};
    }
    const std::optional<Scatter> scatter = scatter_of(values);
    for (std::size_t i = 0; i < units.size(); ++i) {
      fleet.units[i].robust_z_combined.push_back(scatter->robust_z[i]);
    }
  }
}

/// The parameter that contributes most to a unit's deviation in a combination.
std::size_t largest_part(const Sensor& unit, const Fleet& fleet, Eigen::Index combination) {
  std::size_t largest = 0;
  double most = 0;
  for (std::size_t k = 0; k < fleet.parameters.size(); ++k) {
    const FleetParameter& one = fleet.parameters[k];
    const double part = std::abs(fleet.combinations(static_cast<Eigen::Index>(k), combination) *
                                 (value_of(unit, one.name) - one.middle));
    if (part <= most) continue;
    most = part;
    largest = k;
  }
  return largest;
}

void judge(const std::vector<Sensor>& units, double false_alarm, Fleet& fleet) {
  const auto unit_count = static_cast<double>(units.size());
  const double tests =
      unit_count * static_cast<double>(fleet.parameters.size() +
                                       static_cast<std::size_t>(fleet.combinations.cols()));
  for (std::size_t i = 0; i < units.size(); ++i) {
    FleetUnit& unit = fleet.units[i];
    for (std::size_t k = 0; k < unit.robust_z.size(); ++k) {
      unit.tested = unit.tested || std::isfinite(unit.robust_z[k]);
      if (!(std::abs(unit.robust_z[k]) > std::abs(unit.worst_z))) continue;
      unit.worst_z = unit.robust_z[k];
      unit.worst = k;
    }
    for (std::size_t k = 0; k < unit.robust_z_combined.size(); ++k) {
      if (!(std::abs(unit.robust_z_combined[k]) > std::abs(unit.worst_z))) continue;
      unit.worst_z = unit.robust_z_combined[k];
      unit.worst = largest_part(units[i], fleet, static_cast<Eigen::Index>(k));
      unit.worst_is_combined = true;
    }
    unit.p_value = std::min(1.0, tests * algebra::two_sided_student_tail(
                                             unit.worst_z, degrees_of_freedom(units.size())));
    unit.outlier = unit.p_value < false_alarm;
  }
}

}  // namespace

std::string answer_words(const FleetUnit& unit) {
  if (!unit.tested) return "no sigmas to test with";
  return unit.outlier ? "outlier" : "like the others";
}

std::string worst_words(const FleetUnit& unit, const Fleet& fleet) {
  if (!unit.tested) return "-";
  return fleet.parameters[unit.worst].name + (unit.worst_is_combined ? " and others" : "");
}

Fleet fleet_of(const std::vector<Sensor>& units, double false_alarm) {
  require_at_least("number of units", static_cast<long long>(units.size()), kFewestUnitsOfFleet);
  require_between(kSetting.false_alarm, false_alarm, 0, 1);
  for (const Sensor& unit : units) require_same_optics(units.front(), unit);
  Fleet fleet;
  fleet.shape = units.front().shape();
  fleet.units.resize(units.size());
  std::vector<NamedCovariance> known;
  known.reserve(units.size());
  std::vector<std::string> names;
  for (const Sensor& unit : units) {
    known.push_back(covariance_given_held(unit));
    for (const std::string& name : known.back().names) {
      if (name != kRangeOffset && !is_of_train(name, unit)) continue;
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  for (const std::string& name : names) {
    std::vector<Known> of_units(units.size());
    for (std::size_t i = 0; i < units.size(); ++i) {
      of_units[i] = known_of(units[i], known[i], name);
    }
    add_parameter(name, of_units, fleet);
  }
  add_combinations(units, known, fleet);
  judge(units, false_alarm, fleet);
  const Sensor middle = middle_of(units, fleet);
  for (std::size_t i = 0; i < units.size(); ++i) {
    fleet.units[i].beams = directions_apart(units[i], middle, known[i]);
  }
  return fleet;
}

}  // namespace risley::jobs
