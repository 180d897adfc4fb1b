// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/free_parameters.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley::estimation {

/// Azimuth and zenith of one shot as functions of the free parameters and the rotation angles.
class ResidualModel {
 public:
  ResidualModel(const PrismTrain& train, const std::vector<FreeParameter>& free);

  /// Changes the free parameters. @param values  [free], SI units
  void set(const Eigen::Ref<const Eigen::VectorXd>& values);

  /// Evaluates one shot. @return false when the beam does not get through
  /// @param rotation_angle  [prisms]
  /// @param beam  emitter that fired, of those that the train has
  bool linearise(std::span<const double> rotation_angle, int beam);

  /// Observed minus modelled, rad, azimuth first.
  Eigen::Vector2d residual(double azimuth, double zenith) const;
  /// d (azimuth, zenith) / d free parameters [2, free].
  const Eigen::Matrix2Xd& d_parameters() const { return d_parameters_; }
  /// d (azimuth, zenith) / d rotation angles [2, prisms].
  const Eigen::Matrix2Xd& d_angles() const { return d_angles_; }

 private:
  template <int N>
  struct Prepared {
    PreparedTrain<double, N> train;
    PreparedDerivatives<double, N> derivatives;
  };

  /// In one function without calls, where the compiler computes every sine once.
  template <int N>
  static void prepare_all(const PrismTrain& train, Prepared<N>& prepared);

  PrismTrain train_;
  const std::vector<FreeParameter>& free_;
  std::variant<Prepared<1>, Prepared<2>, Prepared<3>, Prepared<4>> prepared_;
  double azimuth_ = 0, zenith_ = 0;
  Eigen::Matrix2Xd d_parameters_, d_angles_;
};

}  // namespace risley::estimation
