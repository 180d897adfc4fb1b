// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/common_factors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/algebra/products.hpp"
#include "risley/sensors/prism_sizes.hpp"

namespace risley::cloud {
namespace {

using Eigen::Index;

/// Share of a variance that counts as rounding: the remainder of one that others determine.
constexpr double kRoundedPivot = 1e-12;

bool has_any(const sensors::RangeErrors& errors) {
  return errors.near != 0 || errors.incidence != 0 || errors.per_decade != 0 ||
         std::ranges::any_of(errors.emitter, [](double error) { return error != 0; });
}

}  // namespace

Eigen::MatrixXd lower_factor(const Eigen::MatrixXd& c) {
  const Index n = c.rows();
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(n, n);
  for (Index j = 0; j < n; ++j) {
    const double pivot = c(j, j) - factor.row(j).head(j).squaredNorm();
    if (!(pivot > kRoundedPivot * c(j, j))) continue;
    factor(j, j) = std::sqrt(pivot);
    for (Index i = j + 1; i < n; ++i) {
      factor(i, j) = (c(i, j) - factor.row(i).head(j).dot(factor.row(j).head(j))) / factor(j, j);
    }
  }
  return factor;
}

Factors::Factors(PointingModel& model, const SensorBelief& belief)
    : model_(model), belief_(belief), range_values_(sensors::range_values(model.train.emitters())) {
  for (int place = 0; place < all_places(); ++place) model_.places.push_back(place);
}

void Factors::add(const algebra::NamedCovariance& uncertain, bool moves_beam, bool moves_angles,
                  bool of_recording) {
  const Eigen::MatrixXd factor = lower_factor(uncertain.matrix);
  const auto& of_mount = trajectories::mount_names();
  for (Index j = 0; j < factor.cols(); ++j) {
    CommonFactor common = nothing(uncertain.names[j]);
    common.of_recording = of_recording;
    for (Index i = j; i < factor.rows(); ++i) {
      const std::string& name = uncertain.names[i];
      if (double* number = range_number(name, common)) {
        *number = factor(i, j);
        continue;
      }
      const auto size = std::ranges::find_if(
          model_.sizes, [&](const PrismSize& one) { return one.name == name; });
      if (size != model_.sizes.end()) {
        common.weights[size_row(size - model_.sizes.begin())] += factor(i, j);
        continue;
      }
      const auto own = std::ranges::find(of_mount, name);
      if (own != of_mount.end()) {
        common.mount[own - of_mount.begin()] = factor(i, j);
        continue;
      }
      const ParameterInfo parameter = find_parameter(name, model_.train.shape());
      if (moves_beam) {
        for (const int place : parameter.places) common.weights[place] += factor(i, j);
      }
      if (moves_angles) move_angles(name, factor(i, j), common);
    }
    keep(std::move(common));
  }
}

void Factors::add_angles(const algebra::NamedCovariance& uncertain) {
  if (uncertain.empty()) return;  // held, all of them
  const Eigen::MatrixXd factor =
      lower_factor(algebra::propagated(belief_.angle_sensitivity, uncertain.matrix));
  for (int j = 0; j < prisms(); ++j) {
    CommonFactor common = nothing(fmt::format("rotation_angle_{}_deg", prism_letter(j)));
    common.of_recording = true;
    common.weights.segment(all_places(), prisms()) = factor.col(j);
    keep(std::move(common));
  }
}

void Factors::add_geometry(const sensors::Sensor& sensor) {
  const auto& names = sensor.covariance_names;
  const auto is_joint = [&names](const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  };
  for (std::size_t i = 0; i < model_.sizes.size(); ++i) {
    const PrismSize& size = model_.sizes[i];
    if (is_joint(size.name)) continue;
    CommonFactor common = nothing(size.name);
    common.weights[size_row(i)] = sensors::prism_size_sigma(sensor, size);
    keep(std::move(common));
  }
  for (const sensors::RangeValue& value : range_values_) {
    const sensors::Knowledge* known = sensor.find_knowledge(value.name);
    if (known == nullptr || is_joint(value.name)) continue;
    CommonFactor common = nothing(value.name);
    *range_number(value.name, common) = std::max(known->sigma, known->total_sigma);
    keep(std::move(common));
  }
}

void Factors::finish() {
  std::vector<Index> rows;
  std::vector<int> places;
  for (const int place : model_.places) {
    const bool used = std::ranges::any_of(model_.factors,
                                          [place](const auto& f) { return f.weights[place] != 0; });
    if (!used) continue;
    rows.push_back(place);
    places.push_back(place);
  }
  const Index others = prisms() + std::ssize(model_.sizes);
  for (Index i = 0; i < others; ++i) rows.push_back(all_places() + i);
  for (CommonFactor& factor : model_.factors) {
    factor.weights = Eigen::VectorXd(factor.weights(rows));
  }
  model_.places = std::move(places);
}

CommonFactor Factors::nothing(std::string name) const {
  return {std::move(name),
          Eigen::VectorXd::Zero(all_places() + prisms() + std::ssize(model_.sizes)),
          0.0,
          {},
          false,
          {}};
}

double* Factors::range_number(std::string_view name, CommonFactor& common) const {
  const auto found = std::ranges::find_if(
      range_values_, [name](const sensors::RangeValue& value) { return value.name == name; });
  if (found == range_values_.end()) return nullptr;
  sensors::RangeErrors& errors = common.range_errors;
  const std::array<double*, 4> shared{&common.range_offset, &errors.near, &errors.incidence,
                                      &errors.per_decade};
  const auto at = static_cast<std::size_t>(found - range_values_.begin());
  if (at < shared.size()) return shared[at];
  errors.emitter.resize(range_values_.size() - shared.size(), 0.0);
  return &errors.emitter[at - shared.size()];
}

void Factors::move_angles(const std::string& name, double value, CommonFactor& common) const {
  for (std::size_t j = 0; j < belief_.free.size(); ++j) {
    if (belief_.free[j].name != name) continue;
    for (int k = 0; k < prisms(); ++k) {
      common.weights[all_places() + k] += belief_.angle_sensitivity(k, j) * value;
    }
  }
}

void Factors::keep(CommonFactor common) {
  const bool moves_mount =
      std::ranges::any_of(common.mount, [](double weight) { return weight != 0; });
  const bool moves_range = common.range_offset != 0 || has_any(common.range_errors);
  if (!moves_range && common.weights.isZero(0.0) && !moves_mount) return;
  model_.factors.push_back(std::move(common));
}

}  // namespace risley::cloud
