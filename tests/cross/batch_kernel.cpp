// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The kernels of optics against the scalar model, on whatever processor this runs: tools/check_neon
// compiles it for aarch64. Prints the largest differences; exit status 1 where they are too large.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <span>
#include <vector>

#include <xsimd/xsimd.hpp>

#include "risley/core/angle.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley {
namespace {

constexpr std::size_t kShots = 10001;  // not a multiple of any number of lanes
constexpr double kAllowed = 1e-12;     // rad, and per rad or index

/// A Mid-40 with errors of every kind.
PrismTrain bent_train() {
  PrismTrain train(std::vector{FaceOrder::perpendicular_angled, FaceOrder::angled_perpendicular});
  train.set_place(place::refractive_index_air(), 1.0003);
  train.set_place(place::incident_beam_horizontal(), 0.001);
  train.set_place(place::incident_beam_vertical(), -0.007);
  for (int prism = 0; prism < 2; ++prism) {
    train.set_place(place::refractive_index(prism), 1.509);
    train.set_place(place::wedge_angle(prism), radians_from_degrees(18.0));
    train.set_place(place::prism_tilt_horizontal(prism), 0.002);
    train.set_place(place::prism_tilt_vertical(prism), -0.005);
  }
  train.set_place(place::bearing_tilt_horizontal(0), 0.0002);
  train.set_place(place::bearing_tilt_vertical(0), 0.0001);
  return train;
}

int check() {
  const PrismTrain train = bent_train();
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-100.0, 100.0);
  std::array<std::vector<double>, 2> angle;
  for (auto& column : angle) {
    for (std::size_t i = 0; i < kShots; ++i) column.push_back(uniform(generator));
  }
  const std::vector<std::span<const double>> angles{angle[0], angle[1]};
  std::vector<double> azimuth(kShots), zenith(kShots);
  observe_batch(train, angles, {{}, {}, {}, azimuth, zenith});

  constexpr std::size_t kColumns = parameter_count(2) + 2;
  std::array<std::vector<double>, 2> linearised;
  std::array<std::vector<std::vector<double>>, 2> gradient;
  for (std::size_t k = 0; k < 2; ++k) {
    linearised[k].resize(kShots);
    gradient[k].assign(kColumns, std::vector<double>(kShots));
  }
  linearise_batch(train, angles,
                  {linearised[0],
                   linearised[1],
                   {gradient[0].begin(), gradient[0].end()},
                   {gradient[1].begin(), gradient[1].end()}});

  const auto parameters = parameter_array<2>(train);
  const auto order = face_order_array<2>(train);
  const auto prepared = prepare<double, 2>(parameters, order);
  const auto derivatives = prepare_derivatives<double, 2>(parameters, order);
  double direction = 0, derivative = 0;
  const auto differ = [](double& worst, double a, double b) {
    worst = std::abs(a - b) <= worst ? worst : std::abs(a - b);  // NaN stays
  };
  for (std::size_t i = 0; i < kShots; ++i) {
    const auto exact = linearise_angles(prepared, derivatives, {angle[0][i], angle[1][i]});
    differ(direction, azimuth[i], exact.angles.azimuth);
    differ(direction, zenith[i], exact.angles.zenith);
    differ(direction, linearised[0][i], exact.angles.azimuth);
    differ(direction, linearised[1][i], exact.angles.zenith);
    for (std::size_t j = 0; j < kColumns; ++j) {
      const auto of = [j](const Gradient<double, 2>& by) {
        return j < kColumns - 2 ? by.parameters[j] : by.rotation_angles[j - kColumns + 2];
      };
      differ(derivative, gradient[0][j][i], of(exact.azimuth));
      differ(derivative, gradient[1][j][i], of(exact.zenith));
    }
  }
  std::printf("%zu lanes of double: directions within %.1e rad, derivatives within %.1e\n",
              xsimd::batch<double>::size, direction, derivative);
  return direction <= kAllowed && derivative <= kAllowed ? 0 : 1;
}

}  // namespace
}  // namespace risley

int main() { return risley::check(); }
