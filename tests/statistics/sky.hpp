// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Cholesky>

#include "risley/core/direction.hpp"
#include "risley/core/random.hpp"

#include "statistics/simulated.hpp"

// Recordings as people bring them: returns from a part of the field only, whole millimetres,
// unknown noise.
namespace risley::testing {

/// Where nothing is in the way of the beams: one of six patterns, as the seed says.
class Sky {
 public:
  explicit Sky(std::uint64_t seed) : pattern_(seed % 6), place_(seed, 6) {}

  /// Whether a shot in this direction comes back.
  bool returns(double azimuth, double zenith, std::size_t shot) const {
    constexpr double kHalfWindow = radians_from_degrees(6.0);
    const auto middle = [&](std::uint64_t number) {
      return radians_from_degrees(8.0 * (2 * place_.uniform(number) - 1));
    };
    switch (pattern_) {
      case 0:
        return zenith > kPi / 2 + radians_from_degrees(2.0);
      case 1:
        return zenith < kPi / 2;
      case 2:
        return azimuth > 0;
      case 3:
        return std::abs(azimuth - middle(0)) < kHalfWindow &&
               std::abs(zenith - kPi / 2 - middle(1)) < kHalfWindow;
      case 4:
        return place_.uniform(10 + shot) < 0.2;
      default:
        return true;
    }
  }

 private:
  std::uint64_t pattern_;
  RandomStream place_;
};

/// A row without a return holds nothing.
inline void erase_row(recordings::Observations& o, std::size_t row) {
  o.valid[row] = 0;
  o.azimuth[row] = o.zenith[row] = std::nan("");
  o.range[row] = 0;
}

/// Leaves out what does not return, with its direction.
template <class Returns>
void leave_out(recordings::Observations& o, const Returns& returns) {
  for (std::size_t i = 0; i < o.size(); ++i) {
    if (!returns(o.azimuth[i], o.zenith[i], i)) erase_row(o, i);
  }
}

/// The directions as a record of whole millimetres in a hall holds them.
template <class Returns>
void as_millimetres(recordings::Observations& o, const Returns& returns) {
  constexpr double kStep = 0.001;
  for (std::size_t i = 0; i < o.size(); ++i) {
    const auto v = direction_from_angles<double>({o.azimuth[i], o.zenith[i]});
    if (!returns(o.azimuth[i], o.zenith[i], i)) {
      erase_row(o, i);
      continue;
    }
    const double range = 3.0 / std::max(0.1, std::abs(v.y) + std::abs(v.z));
    const auto whole = [&](double value) { return kStep * std::round(range * value / kStep); };
    const Vector3<double> point{whole(v.x), whole(v.y), whole(v.z)};
    const auto angles = angles_from_direction(point);
    o.azimuth[i] = angles.azimuth;
    o.zenith[i] = angles.zenith;
    o.range[i] = norm(point);
    o.zenith_resolution[i] = static_cast<float>(kStep / o.range[i]);
    o.azimuth_resolution[i] = static_cast<float>(kStep / o.range[i] / std::sin(angles.zenith));
  }
}

/// Estimates from the nominal Mid-40 and finds the noise.
inline estimation::Estimate estimate_found_noise(const recordings::Observations& observations,
                                                 bool cartesian) {
  estimation::ShotSelector selector({.rate = {}, .ranges = cartesian, .rows = false});
  selector.add(observations);
  estimation::EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.cartesian = cartesian;
  return estimation::estimate(estimation::Method::map, selector.take_series(), selector.head(),
                              options);
}

/// NEES of the prisms' parameters per degree of freedom.
inline double nees(const estimation::Estimate& estimate, const sensors::Sensor& truth,
                   double& largest) {
  Eigen::VectorXd error(estimate.parameters.size());
  for (std::size_t k = 0; k < estimate.free.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    error[at] = estimate.parameters[at] - truth.get(estimate.free[k].name);
    largest = std::max(largest, std::abs(error[at]) / std::sqrt(estimate.covariance(at, at)));
  }
  return error.dot(estimate.covariance.ldlt().solve(error)) / static_cast<double>(error.size());
}

}  // namespace risley::testing
