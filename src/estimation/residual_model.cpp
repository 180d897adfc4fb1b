// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/residual_model.hpp"

#include <algorithm>

#include "risley/core/angle.hpp"

namespace risley::estimation {

template <int N>
[[gnu::flatten]] void ResidualModel::prepare_all(const PrismTrain& train, Prepared<N>& prepared) {
  std::array<double, parameter_count(N)> parameters;
  std::copy_n(train.parameters().begin(), parameters.size(), parameters.begin());
  const auto faces = face_order_array<N>(train);
  prepared.train = prepare<double, N>(parameters, faces);
  prepared.derivatives = prepare_derivatives<double, N>(parameters, faces);
}

ResidualModel::ResidualModel(const PrismTrain& train, const std::vector<FreeParameter>& free)
    : train_(train),
      free_(free),
      d_parameters_(2, static_cast<Eigen::Index>(free.size())),
      d_angles_(2, train.prisms()) {
  set(free_values(train, free));
}

void ResidualModel::set(const Eigen::Ref<const Eigen::VectorXd>& values) {
  for (std::size_t i = 0; i < free_.size(); ++i) {
    for (const int at : free_[i].places) {
      train_.set_place(at, values[static_cast<Eigen::Index>(i)]);
    }
  }
  with_prism_count(train_.prisms(), [&]<int N>() {
    if (!std::holds_alternative<Prepared<N>>(prepared_)) prepared_.emplace<Prepared<N>>();
    prepare_all(train_, std::get<Prepared<N>>(prepared_));
  });
}

bool ResidualModel::linearise(std::span<const double> rotation_angle, int beam) {
  return with_prism_count(train_.prisms(), [&]<int N>() {
    auto& [train, derivatives] = std::get<Prepared<N>>(prepared_);
    if (train_.emitters() > 1) {
      const auto& all = train_.parameters();
      const auto at = static_cast<std::size_t>(place::incident_beam_horizontal(beam, N));
      train.incident = leaning_direction(all[at], all[at + 1]);
      derivatives.incident_horizontal = leaning_horizontal_rate(all[at], all[at + 1]);
      derivatives.incident_vertical = leaning_vertical_rate(all[at], all[at + 1]);
    }
    std::array<double, N> angles;
    std::copy_n(rotation_angle.begin(), N, angles.begin());
    const auto result = linearise_angles(train, derivatives, angles);
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
  });
}

Eigen::Vector2d ResidualModel::residual(double azimuth, double zenith) const {
  return {wrap_to_pi(azimuth - azimuth_), zenith - zenith_};
}

}  // namespace risley::estimation
