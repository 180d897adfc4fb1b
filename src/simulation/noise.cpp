// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/noise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"

#include "simulation/streams.hpp"

namespace risley::simulation {
namespace {

void add_noise(const RandomStream& stream, std::uint64_t first, double sigma,
               std::span<double> values, std::vector<double>& buffer) {
  if (sigma == 0.0) return;
  buffer.resize(values.size());
  stream.fill_normal(first, buffer);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += sigma * buffer[i];
}

double rounded(double value, double step) {
  return step > 0.0 ? std::nearbyint(value / step) * step : value;
}

}  // namespace

ObservationNoise::ObservationNoise(const NoiseSettings& settings, std::uint64_t seed)
    : settings_(settings),
      azimuth_(seed, stream::kAzimuthNoise),
      zenith_(seed, stream::kZenithNoise),
      range_(seed, stream::kRangeNoise) {
  require_not_below("angle noise", degrees_from_radians(settings.angle), 0, "deg");
  require_not_below("range noise", settings.range, 0, "m");
  require_not_below("angle resolution", degrees_from_radians(settings.angle_resolution), 0, "deg");
  require_not_below("range resolution", settings.range_resolution, 0, "m");
}

void ObservationNoise::apply_to_angles(std::uint64_t first_shot, std::span<double> azimuth,
                                       std::span<double> zenith) const {
  require_length("zenith", zenith.size(), azimuth.size());
  std::vector<double> buffer;
  add_noise(azimuth_, first_shot, settings_.angle, azimuth, buffer);
  add_noise(zenith_, first_shot, settings_.angle, zenith, buffer);
  for (std::size_t i = 0; i < azimuth.size(); ++i) {
    double& a = azimuth[i];
    double& z = zenith[i];
    a = rounded(a, settings_.angle_resolution);
    z = rounded(z, settings_.angle_resolution);
    if (z < 0.0 || z > kPi) {  // over the pole: the same direction in allowed angles
      z = z < 0.0 ? -z : kTwoPi - z;
      a += kPi;
    }
    if (a <= -kPi || a > kPi) {
      a = wrap_to_pi(a);
      if (a <= -kPi) a = kPi;
    }
  }
}

void ObservationNoise::apply_to_ranges(std::uint64_t first_shot, std::span<double> range) const {
  std::vector<double> buffer(range.size(), 0.0);
  if (settings_.range > 0.0) range_.fill_normal(first_shot, buffer);
  for (std::size_t i = 0; i < range.size(); ++i) {
    if (range[i] == 0.0 || std::isnan(range[i])) continue;
    range[i] =
        std::max(0.0, rounded(range[i] + settings_.range * buffer[i], settings_.range_resolution));
  }
}

}  // namespace risley::simulation
