// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley::estimation {

/// Azimuth and zenith of a shot as functions of the free parameters and the rotation angles: what
/// the start and the filter share.
template <int N>
class ResidualModel {
 public:
  ResidualModel(const PrismTrain& train, const std::vector<FreeParameter>& free)
      : all_(train.parameters()),
        face_order_(face_order_array<N>(train)),
        free_(free),
        d_parameters_(2, static_cast<Eigen::Index>(free.size())) {}

  /// Changes the free parameters. @param values  [free], SI units
  void set(const Eigen::Ref<const Eigen::VectorXd>& values) {
    for (std::size_t i = 0; i < free_.size(); ++i) {
      for (const int at : free_[i].places) {
        all_[static_cast<std::size_t>(at)] = values[static_cast<Eigen::Index>(i)];
      }
    }
    std::array<double, parameter_count(N)> parameters;
    std::copy_n(all_.begin(), parameters.size(), parameters.begin());
    train_ = prepare<double, N>(parameters, face_order_);
    derivatives_ = prepare_derivatives<double, N>(parameters, face_order_);
  }

  /// Evaluates one shot. @return false when the beam does not get through
  /// @param beam  emitter that fired, of those that the train has
  bool linearise(const std::array<double, N>& rotation_angle, int beam) {
    if (all_.size() > parameter_count(N)) turn_to(beam);
    const auto result = linearise_angles(train_, derivatives_, rotation_angle);
    azimuth_ = result.angles.azimuth;
    zenith_ = result.angles.zenith;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      double azimuth = 0, zenith = 0;
      for (const int at : free_[i].places) {
        azimuth += derivative_by(result.azimuth, at, beam);
        zenith += derivative_by(result.zenith, at, beam);
      }
      d_parameters_(0, static_cast<Eigen::Index>(i)) = azimuth;
      d_parameters_(1, static_cast<Eigen::Index>(i)) = zenith;
    }
    for (std::size_t i = 0; i < N; ++i) {
      d_angles_(0, static_cast<Eigen::Index>(i)) = result.azimuth.rotation_angles[i];
      d_angles_(1, static_cast<Eigen::Index>(i)) = result.zenith.rotation_angles[i];
    }
    return result.valid;
  }

  /// Observed minus modelled, rad, azimuth first.
  Eigen::Vector2d residual(double azimuth, double zenith) const {
    return {wrap_to_pi(azimuth - azimuth_), zenith - zenith_};
  }
  /// d (azimuth, zenith) / d free parameters [2, free].
  const Eigen::Matrix2Xd& d_parameters() const { return d_parameters_; }
  /// d (azimuth, zenith) / d rotation angles [2, N].
  const Eigen::Matrix<double, 2, N>& d_angles() const { return d_angles_; }

 private:
  /// Takes the beam of one of several emitters.
  void turn_to(int beam) {
    const auto at = static_cast<std::size_t>(place::incident_beam_horizontal(beam, N));
    train_.incident = leaning_direction(all_[at], all_[at + 1]);
    derivatives_.incident_horizontal = leaning_horizontal_rate(all_[at], all_[at + 1]);
    derivatives_.incident_vertical = leaning_vertical_rate(all_[at], all_[at + 1]);
  }

  std::vector<double> all_;  // flat vector
  std::array<FaceOrder, N> face_order_;
  const std::vector<FreeParameter>& free_;
  PreparedTrain<double, N> train_;
  PreparedDerivatives<double, N> derivatives_;
  double azimuth_ = 0, zenith_ = 0;
  Eigen::Matrix2Xd d_parameters_;
  Eigen::Matrix<double, 2, N> d_angles_;
};

/// Values of the free parameters in a train, SI units.
inline Eigen::VectorXd free_values(const PrismTrain& train,
                                   const std::vector<FreeParameter>& free) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(free.size()));
  for (std::size_t i = 0; i < free.size(); ++i) {
    values[static_cast<Eigen::Index>(i)] = train[free[i].places.front()];
  }
  return values;
}

/// A train with the free parameters replaced.
inline PrismTrain with_free_values(PrismTrain train, const std::vector<FreeParameter>& free,
                                   const Eigen::VectorXd& values) {
  for (std::size_t i = 0; i < free.size(); ++i) {
    for (const int at : free[i].places) train.set_place(at, values[static_cast<Eigen::Index>(i)]);
  }
  return train;
}

}  // namespace risley::estimation
