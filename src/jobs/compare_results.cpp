// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/compare_results.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <fmt/format.h>

#include "risley/algebra/distributions.hpp"
#include "risley/algebra/named_covariance.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/sensors/prism_sizes.hpp"
#include "risley/sensors/range_values.hpp"

namespace risley::jobs {
namespace {

using algebra::NamedCovariance;
using sensors::Sensor;

constexpr std::size_t kBeams = 2000;  // over all rotation angles; give a mean square to 3 %

double sigma_of(const NamedCovariance& known, const std::string& name) {
  const Eigen::Index at = known.find(name);
  return at < 0 ? 0 : std::sqrt(known.matrix(at, at));
}

/// Parameters that a result held though they may be off: nothing is added to their sigma.
std::vector<std::string> held_names(const Sensor& sensor) {
  std::vector<std::string> names;
  for (const std::string& name : sensor.covariance_names) {
    const sensors::Knowledge* known = sensor.find_knowledge(name);
    if (known != nullptr && known->total_sigma == 0) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

bool hold_alike(const Sensor& a, const Sensor& b) {
  const std::vector<std::string> held = held_names(a);
  return held == held_names(b) && std::all_of(held.begin(), held.end(), [&](const auto& name) {
           return value_of(a, name) == value_of(b, name);
         });
}

/// Both results, each with its covariance of the difference.
struct Pair {
  const Sensor &a, &b;
  NamedCovariance known_a, known_b;
};

ParameterDifference difference_of(const std::string& name, const Pair& pair, double value_a,
                                  double value_b) {
  const double sigma_a = sigma_of(pair.known_a, name), sigma_b = sigma_of(pair.known_b, name);
  return {
      name, value_a, value_b, sigma_a, sigma_b, value_b - value_a, std::hypot(sigma_a, sigma_b)};
}

/// Whether a parameter of several places has one value in all of them.
bool is_shared(const PrismTrain& train, const ParameterInfo& parameter) {
  return std::all_of(parameter.places.begin(), parameter.places.end(),
                     [&](int place) { return train[place] == train[parameter.places.front()]; });
}

/// Every place of the train once: common parameters under their common name; the range offset, and
/// sizes of prisms from a calibration.
std::vector<ParameterDifference> differences(const Pair& pair) {
  const Sensor &a = pair.a, &b = pair.b;
  std::vector<ParameterDifference> result;
  std::vector<bool> listed(static_cast<std::size_t>(parameter_count(a.shape())), false);
  for (const ParameterInfo& one : parameter_list(a.shape())) {
    if (one.kind != ParameterKind::train) continue;
    if (!is_shared(a.train, one) || !is_shared(b.train, one)) continue;
    if (listed[static_cast<std::size_t>(one.places.front())]) continue;
    for (const int place : one.places) listed[static_cast<std::size_t>(place)] = true;
    result.push_back(difference_of(one.name, pair, a.get(one.name), b.get(one.name)));
  }
  for (const sensors::RangeValue& value : sensors::range_values(b.train.emitters())) {
    const bool known = pair.known_a.find(value.name) >= 0 || pair.known_b.find(value.name) >= 0;
    if (value.name != kRangeOffset && !known) continue;
    result.push_back(difference_of(value.name, pair, sensors::get_range_value(a, value.name),
                                   sensors::get_range_value(b, value.name)));
  }
  for (const PrismSize& size : own_prism_sizes(b.prisms())) {
    if (pair.known_a.find(size.name) < 0 && pair.known_b.find(size.name) < 0) continue;
    result.push_back(
        difference_of(size.name, pair, sensors::prism_size(a, size), sensors::prism_size(b, size)));
  }
  return result;
}

/// Adds a covariance to that of more names, or of fewer.
void add_covariance(const NamedCovariance& known, NamedCovariance& sum) {
  const NamedCovariance part = known.part(sum.names);
  std::vector<Eigen::Index> to(part.names.size());
  std::transform(part.names.begin(), part.names.end(), to.begin(),
                 [&](const std::string& name) { return sum.find(name); });
  sum.matrix(to, to) += part.matrix;
}

/// The covariance of the differences of the train's parameters.
NamedCovariance covariance_of_differences(const Pair& pair) {
  NamedCovariance sum;
  for (const NamedCovariance* known : {&pair.known_a, &pair.known_b}) {
    for (const std::string& name : known->names) {
      if (is_of_train(name, pair.b) && sum.find(name) < 0) sum.names.push_back(name);
    }
  }
  const auto n = static_cast<Eigen::Index>(sum.names.size());
  sum.matrix = Eigen::MatrixXd::Zero(n, n);
  add_covariance(pair.known_a, sum);
  add_covariance(pair.known_b, sum);
  return sum;
}

ChangeTest test_of_change(const Pair& pair, const NamedCovariance& sum) {
  ChangeTest test;
  const auto n = static_cast<Eigen::Index>(sum.names.size());
  if (n == 0) return test;
  // In sigmas, so that units do not matter.
  const Eigen::VectorXd sigma = sum.matrix.diagonal().cwiseMax(0).cwiseSqrt();
  Eigen::VectorXd off(n);
  Eigen::MatrixXd correlation(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::string& name = sum.names[static_cast<std::size_t>(i)];
    off[i] = sigma[i] > 0 ? (pair.b.get(name) - pair.a.get(name)) / sigma[i] : 0.0;
    for (Eigen::Index j = 0; j < n; ++j) {
      const double scale = sigma[i] * sigma[j];
      correlation(i, j) = scale > 0 ? sum.matrix(i, j) / scale : 0.0;
    }
  }
  const algebra::PrincipalAxes axes = algebra::principal_axes(correlation);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (axes.values[k] <= kSmallestVariance * static_cast<double>(n)) continue;
    const double along = axes.vectors.col(k).dot(off);
    test.chi2 += along * along / axes.values[k];
    ++test.degrees_of_freedom;
  }
  if (test.degrees_of_freedom == 0) return test;
  test.p_value = algebra::chi_square_tail(test.chi2, test.degrees_of_freedom);
  return test;
}

}  // namespace

double value_of(const Sensor& sensor, const std::string& name) {
  if (sensors::is_range_value(name)) return sensors::get_range_value(sensor, name);
  const std::optional<PrismSize> size = sensors::find_prism_size(name, sensor.prisms());
  return size ? sensors::prism_size(sensor, *size) : sensor.get(name);
}

FileUnit file_unit_of(const std::string& name, TrainShape shape) {
  if (name == "range_incidence") return {"1", 1};
  if (sensors::is_range_value(name) || sensors::find_prism_size(name, shape.prisms)) {
    return {"m", 1};
  }
  const ParameterInfo& parameter = find_parameter(name, shape);
  return {parameter.unit, parameter.si_per_unit};
}

bool have_same_optics(const Sensor& a, const Sensor& b) {
  return a.shape() == b.shape() && a.train.face_order() == b.train.face_order();
}

void require_same_optics(const Sensor& a, const Sensor& b) {
  if (have_same_optics(a, b)) return;
  const auto words = [](const Sensor& sensor) {
    return fmt::format("{} prisms ({}) and {} emitters", sensor.prisms(),
                       to_string(sensor.train.face_order()), sensor.train.emitters());
  };
  throw InvalidArgument(fmt::format(
      "only results of sensors with the same optics can be compared: the first has {}, the "
      "second {}",
      words(a), words(b)));
}

bool is_of_train(const std::string& name, const Sensor& sensor) {
  const auto& list = parameter_list(sensor.shape());
  return std::any_of(list.begin(), list.end(), [&](const ParameterInfo& one) {
    return one.name == name && one.kind == ParameterKind::train;
  });
}

NamedCovariance covariance_given_held(const Sensor& sensor) {
  const NamedCovariance all{sensor.covariance_names, sensor.covariance};
  const std::vector<std::string> held = held_names(sensor);
  std::vector<std::string> free;
  std::vector<Eigen::Index> free_at, held_at;
  for (std::size_t i = 0; i < all.names.size(); ++i) {
    const bool is_held = std::binary_search(held.begin(), held.end(), all.names[i]);
    (is_held ? held_at : free_at).push_back(static_cast<Eigen::Index>(i));
    if (!is_held) free.push_back(all.names[i]);
  }
  NamedCovariance known = all.part(free);
  if (!held_at.empty()) {
    const Eigen::MatrixXd both = all.matrix(free_at, held_at);
    known.matrix -= both * all.matrix(held_at, held_at).ldlt().solve(both.transpose()).eval();
  }
  return known;
}

calibration::PointingError directions_apart(const Sensor& a, const Sensor& b,
                                            const NamedCovariance& difference) {
  std::vector<std::string> names;
  std::copy_if(difference.names.begin(), difference.names.end(), std::back_inserter(names),
               [&](const std::string& name) { return is_of_train(name, b); });
  const NamedCovariance known = difference.part(names);
  std::vector<std::vector<double>> angles(static_cast<std::size_t>(b.prisms()),
                                          std::vector<double>(kBeams));
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const RandomStream places(0, k);
    for (std::size_t i = 0; i < kBeams; ++i) angles[k][i] = kTwoPi * places.uniform(i);
  }
  std::vector<std::uint8_t> emitters(kBeams);
  for (std::size_t i = 0; i < kBeams; ++i) {
    emitters[i] = static_cast<std::uint8_t>(i % static_cast<std::size_t>(b.train.emitters()));
  }
  const calibration::BeamBundle bundle(b.train, estimation::free_parameters(known.names, b.shape()),
                                       angles, emitters);
  return bundle.pointing_error(a.train, known.matrix);
}

Sensor load_result(const GivenSensor& given) {
  if (given.value()) return *given.value();
  const std::string& path = given.name();
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) {
    if (fs::is_regular_file(path, ignored)) require_settled(path);
    return sensors::load_sensor(path);
  }
  const std::optional<std::string> file = calibration_in(path);
  if (!file) {
    throw FileError(
        (fs::path(path) / kCalibrationFile).string(), {},
        fmt::format("is missing: estimate and calibrate write it only if their result is better "
                    "than what the sensor believed{}",
                    fs::exists(fs::path(path) / "report.html", ignored)
                        ? "; report.html beside it gives the reason"
                        : ""));
  }
  return sensors::load_sensor(*file);
}

bool are_two_units(const ResultComparison& comparison) {
  return !comparison.same_unit && !comparison.a.serial.empty() && !comparison.b.serial.empty();
}

std::string one_unit_words(const ResultComparison& comparison) {
  if (comparison.same_unit) return "yes";
  return are_two_units(comparison) ? "no" : "not known";
}

ResultComparison compare_results(const GivenSensor& a, const GivenSensor& b) {
  return compare_results(load_result(a), load_result(b));
}

ResultComparison compare_results(const Sensor& a, const Sensor& b, OneUnit one_unit) {
  ResultComparison result;
  result.a = a;
  result.b = b;
  require_same_optics(result.a, result.b);
  result.same_unit = !result.a.serial.empty() && result.a.serial == result.b.serial;
  const bool unknown = result.a.serial.empty() || result.b.serial.empty();
  const bool taken_for_one = result.same_unit || (one_unit == OneUnit::caller && unknown);
  result.held_alike = taken_for_one && hold_alike(result.a, result.b);
  const auto known = [&](const Sensor& sensor) {
    return result.held_alike ? covariance_given_held(sensor)
                             : NamedCovariance{sensor.covariance_names, sensor.covariance};
  };
  const Pair pair{result.a, result.b, known(result.a), known(result.b)};
  result.parameters = differences(pair);
  const NamedCovariance covariance = covariance_of_differences(pair);
  result.change = test_of_change(pair, covariance);
  result.beams = directions_apart(result.a, result.b, covariance);
  return result;
}

}  // namespace risley::jobs
