// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/evaluation.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::estimation {
namespace {

/// Columns of the estimate used here.
void require_estimate(const Estimate& estimate) {
  const RotorStates& states = estimate.states;
  const auto prisms = static_cast<std::size_t>(estimate.sensor.prisms());
  require_at_least("shots of the estimate", static_cast<long long>(states.size()), 1);
  const auto require_all = [&](const std::string& name,
                               const std::vector<std::vector<double>>& columns, std::size_t count) {
    require_length(name, columns.size(), count);
    for (const auto& column : columns) {
      require_length("a column of " + name, column.size(), states.size());
    }
  };
  require_all("rotation_angle", states.rotation_angle, prisms);
  require_all("angular_velocity", states.angular_velocity, prisms);
  require_all("angular_velocity_sigma", states.angular_velocity_sigma, prisms);
  require_all("rotation_angle_covariance", states.rotation_angle_covariance,
              prisms * (prisms + 1) / 2);
  const std::size_t free = estimate.free.size();
  require_at_least("number of values of the estimate",
                   static_cast<long long>(estimate.values.size()), static_cast<long long>(free));
  require_length("a column of the covariance", static_cast<std::size_t>(estimate.covariance.rows()),
                 free);
  require_length("a row of the covariance", static_cast<std::size_t>(estimate.covariance.cols()),
                 free);
}

/// Row of the truth for every shot of the estimate, by time.
std::vector<std::size_t> matching_rows(const std::vector<std::int64_t>& shots,
                                       const std::vector<std::int64_t>& truth) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> rows(shots.size(), kNone);
  std::size_t row = 0, found = 0;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    while (row < truth.size() && truth[row] < shots[i]) ++row;
    if (row < truth.size() && truth[row] == shots[i]) {
      rows[i] = row;
      ++found;
    }
  }
  if (found != shots.size()) {
    throw InvalidArgument(
        "the truth belongs to another recording: " + std::to_string(shots.size() - found) + " of " +
        std::to_string(shots.size()) + " shots have no row in it");
  }
  return rows;
}

/// Contribution of held parameters that are off in the truth to the covariance of the free ones.
Eigen::MatrixXd covariance_of_held_errors(const Estimate& estimate, const PrismTrain& truth) {
  const auto count = static_cast<Eigen::Index>(estimate.free.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(count, count);
  const HeldChanges& changes = estimate.held_changes;
  for (std::size_t j = 0; j < changes.held.size(); ++j) {
    const int at = changes.held[j].places.front();
    if (truth[at] == estimate.sensor.train[at]) continue;
    sum += changes.covariance(j, count);
  }
  return sum;
}

}  // namespace

Evaluation evaluate(const Estimate& estimate, const sensors::Sensor& truth_sensor,
                    const recordings::TruthColumns& truth) {
  const RotorStates& states = estimate.states;
  const int prisms = estimate.sensor.prisms();
  check_shape(estimate.sensor.shape());
  require_estimate(estimate);
  require_between("number of prisms of the true sensor", truth_sensor.prisms(), prisms, prisms);
  const int emitters = estimate.sensor.train.emitters();
  require_between("number of emitters of the true sensor", truth_sensor.train.emitters(), emitters,
                  emitters);
  recordings::require_columns(truth, prisms);
  const auto rows = matching_rows(states.time_ns, truth.time_ns);
  const auto rotor_count = static_cast<std::size_t>(prisms);
  const double duration =
      1e-9 * static_cast<double>(states.time_ns.back() - states.time_ns.front());

  Evaluation result;
  const auto compare = [&](const EstimatedValue& value, double true_value, double error) {
    result.parameters.push_back(
        {value.name, true_value, error, value.sigma > 0 ? error / value.sigma : 0.0});
  };
  for (const EstimatedValue& value : estimate.values) {
    const ParameterInfo& info = find_parameter(value.name, estimate.sensor.shape());
    const auto rotor = static_cast<std::size_t>(info.places.front());
    if (info.kind == ParameterKind::train) {
      const double true_value = truth_sensor.train[info.places.front()];
      compare(value, true_value, value.value - true_value);
    } else if (info.kind == ParameterKind::angular_velocity) {
      // The rotor's actual speed is the reference, not the nominal one.
      const auto& angle = truth.rotation_angle[rotor];
      const double true_value = duration > 0 ? (angle[rows.back()] - angle[rows.front()]) / duration
                                             : truth.angular_velocity[rotor][rows.front()];
      compare(value, true_value, value.value - true_value);
    } else {
      const std::int64_t first_ns = estimate.series.time_ns(first_used_shot(estimate));
      const std::size_t row = matching_rows({first_ns}, truth.time_ns).front();
      const double true_value = wrap_to_pi(truth.rotation_angle[rotor][row]);
      compare(value, true_value, wrap_to_pi(value.value - true_value));
    }
  }

  const auto statics = static_cast<Eigen::Index>(estimate.free.size());
  if (statics > 0) {
    Eigen::VectorXd error(statics);
    for (Eigen::Index i = 0; i < statics; ++i) {
      error[i] = result.parameters[static_cast<std::size_t>(i)].error;
    }
    const Eigen::MatrixXd covariance =
        estimate.covariance + covariance_of_held_errors(estimate, truth_sensor.train);
    result.nees_parameters =
        algebra::SymmetricSolver(covariance).chi2(error) / static_cast<double>(statics);
  }

  std::vector<double> squares(rotor_count, 0.0), variances = squares, speed_squares = squares,
                                                 speed_variances = squares;
  Eigen::VectorXd error(prisms);
  Eigen::MatrixXd covariance(prisms, prisms);
  result.rotation_angle_error.assign(rotor_count, std::vector<double>(rows.size()));
  double nees = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::size_t entry = 0;
    for (std::size_t k = 0; k < rotor_count; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      error[row] = wrap_to_pi(states.rotation_angle[k][i] - truth.rotation_angle[k][rows[i]]);
      result.rotation_angle_error[k][i] = error[row];
      squares[k] += error[row] * error[row];
      variances[k] += states.rotation_angle_covariance[entry][i];
      speed_squares[k] +=
          std::pow(states.angular_velocity[k][i] - truth.angular_velocity[k][rows[i]], 2);
      speed_variances[k] += std::pow(states.angular_velocity_sigma[k][i], 2);
      for (std::size_t l = k; l < rotor_count; ++l) {
        const auto column = static_cast<Eigen::Index>(l);
        covariance(row, column) = covariance(column, row) =
            states.rotation_angle_covariance[entry++][i];
      }
    }
    nees += error.dot(covariance.ldlt().solve(error)) / prisms;
  }
  const auto count = static_cast<double>(rows.size());
  for (std::size_t k = 0; k < rotor_count; ++k) {
    result.rotation_angle_rmse.push_back(std::sqrt(squares[k] / count));
    result.angular_velocity_rmse.push_back(std::sqrt(speed_squares[k] / count));
    result.rotation_angle_rmse_over_sigma.push_back(std::sqrt(squares[k] / variances[k]));
    result.angular_velocity_rmse_over_sigma.push_back(
        std::sqrt(speed_squares[k] / speed_variances[k]));
  }
  result.nees_rotation_angles = nees / count;
  return result;
}

}  // namespace risley::estimation
