// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/filter.hpp"

#include "risley/core/angle.hpp"
#include "risley/estimation/free_parameters.hpp"

namespace risley::estimation {
namespace {

/// Initial uncertainty of the rotors before the first observation in either direction.
constexpr double kLooseAngle = radians_from_degrees(5.0);
constexpr double kLooseSpeed = radians_from_degrees(100.0);

}  // namespace

FilterReference::FilterReference(const Solution& solution) : before(solution) {
  const auto prisms = static_cast<std::size_t>(before.trajectory.prisms);
  angle.reserve(before.trajectory.size() * prisms);
  for (std::size_t shot = 0; shot < before.trajectory.size(); ++shot) {
    for (std::size_t k = 0; k < prisms; ++k) {
      angle.push_back(before.trajectory.angle(shot, k, 0.0));
    }
  }
}

FilterState FilterReference::first_state(const Eigen::MatrixXd& covariance) const {
  FilterState state{Eigen::VectorXd(covariance.rows()), covariance, before.trajectory.time_ns[0]};
  Eigen::Index at = before.parameters.size();
  state.mean.head(at) = before.parameters;
  for (std::size_t k = 0; k < static_cast<std::size_t>(before.trajectory.prisms); ++k) {
    state.mean[at++] = angles(0)[k];
    state.mean[at++] = before.trajectory.speed(0, k, 0.0);
  }
  return state;
}

Filter::Filter(const AngleSeries& series, const PrismTrain& train, const EkfOptions& options,
               const std::vector<RotorProcess>& process, const FilterReference* reference)
    : options_(options), prisms_(train.prisms()), free_(options.free) {
  FilterArguments& a = arguments_;
  static_cast<TrainArguments&>(a) = arguments_of(train, free_);
  static_cast<ShotArguments&>(a) = arguments_of(series);
  a.process = process.data();
  a.noise_variance = options.angle_noise * options.angle_noise;
  a.walk_variance = options.parameter_walk * options.parameter_walk;
  if (reference) {
    a.reference_parameters = reference->before.parameters.data();
    a.reference_angle = reference->angle.data();
  }
}

Eigen::MatrixXd Filter::wide_covariance() const {
  Eigen::VectorXd sigma(size());
  for (Eigen::Index i = 0; i < statics(); ++i) {
    sigma[i] = options_.free[static_cast<std::size_t>(i)].prior_sigma;
  }
  for (Eigen::Index k = 0; k < prisms_; ++k) {
    sigma[statics() + 2 * k] = kLooseAngle;
    sigma[statics() + 2 * k + 1] = kLooseSpeed;
  }
  return sigma.array().square().matrix().asDiagonal();
}

std::size_t Filter::run(FilterState& state, const FilterRun& run, InstructionSet set) const {
  FilterArguments a = arguments_;
  a.run = run;
  a.mean = state.mean.data();
  a.covariance = state.covariance.data();
  a.state_time_ns = &state.time_ns;
  return RISLEY_NARROW_KERNEL_COPIES(run_filter).at(set)(a);
}

FilterState first_state(const Filter& filter, const AngleSeries& series, const Start& start,
                        const std::vector<FreeParameter>& free) {
  FilterState state{Eigen::VectorXd(filter.size()), filter.wide_covariance(), series.time_ns[0]};
  state.mean.head(filter.statics()) = free_values(start.train, free);
  const double ahead = 1e-9 * static_cast<double>(series.time_ns[0] - start.time_ns);
  for (Eigen::Index k = 0; k < filter.prisms(); ++k) {
    const double speed = start.angular_velocity[static_cast<std::size_t>(k)];
    const double angle = start.rotation_angle[static_cast<std::size_t>(k)] + ahead * speed;
    state.mean[filter.statics() + 2 * k] = wrap_to_pi(angle);
    state.mean[filter.statics() + 2 * k + 1] = speed;
  }
  return state;
}

}  // namespace risley::estimation
