// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/filter.hpp"

#include "risley/core/angle.hpp"
#include "risley/estimation/free_parameters.hpp"

namespace risley::estimation {
namespace {

/// How loose the rotors are before the first observation of either direction.
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
    : options_(options),
      prisms_(train.prisms()),
      statics_(static_cast<Eigen::Index>(options.free.size())),
      place_begin_{0} {
  for (const FreeParameter& parameter : options.free) {
    places_.insert(places_.end(), parameter.places.begin(), parameter.places.end());
    place_begin_.push_back(static_cast<int>(places_.size()));
  }
  FilterArguments& a = arguments_;
  a.parameters = train.parameters().data();
  a.face_order = train.face_order().data();
  a.prisms = train.prisms();
  a.emitters = train.emitters();
  a.free = static_cast<int>(statics_);
  a.process = process.data();
  a.noise_variance = options.angle_noise * options.angle_noise;
  a.walk_variance = options.parameter_walk * options.parameter_walk;
  a.time_ns = series.time_ns.data();
  a.beam = series.beam.data();
  a.azimuth = series.azimuth.data();
  a.zenith = series.zenith.data();
  a.azimuth_rounding_variance = series.azimuth_rounding_variance.data();
  a.zenith_rounding_variance = series.zenith_rounding_variance.data();
  if (reference) {
    a.reference_parameters = reference->before.parameters.data();
    a.reference_angle = reference->angle.data();
  }
}

Eigen::MatrixXd Filter::wide_covariance() const {
  Eigen::VectorXd sigma(size());
  for (Eigen::Index i = 0; i < statics_; ++i) {
    sigma[i] = options_.free[static_cast<std::size_t>(i)].prior_sigma;
  }
  for (Eigen::Index k = 0; k < prisms_; ++k) {
    sigma[statics_ + 2 * k] = kLooseAngle;
    sigma[statics_ + 2 * k + 1] = kLooseSpeed;
  }
  return sigma.array().square().matrix().asDiagonal();
}

std::size_t Filter::run(FilterState& state, const FilterRun& run, InstructionSet set) const {
  FilterArguments a = arguments_;
  a.place_begin = place_begin_.data();
  a.places = places_.data();
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
