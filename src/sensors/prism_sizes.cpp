// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/prism_sizes.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace risley::sensors {
namespace {

/// Those that all prisms share, then the prisms' own.
std::vector<PrismSize> all_sizes(int prisms) {
  std::vector<PrismSize> sizes = shared_prism_sizes();
  const std::vector<PrismSize> own = own_prism_sizes(prisms);
  sizes.insert(sizes.end(), own.begin(), own.end());
  return sizes;
}

bool is_a_thickness(const PrismSize& size) { return !size.rate.thickness.empty(); }

}  // namespace

std::optional<PrismSize> find_prism_size(std::string_view name, int prisms) {
  for (PrismSize& size : all_sizes(prisms)) {
    if (size.name == name) return std::move(size);
  }
  return std::nullopt;
}

double prism_size(const Sensor& sensor, const PrismSize& size) {
  const bool thickness = is_a_thickness(size);
  const std::vector<double>& values =
      thickness ? sensor.geometry.thickness : sensor.geometry.spacing;
  const std::vector<double>& rate = thickness ? size.rate.thickness : size.rate.spacing;
  if (values.empty()) return 0;
  const auto at = static_cast<std::size_t>(std::find(rate.begin(), rate.end(), 1.0) - rate.begin());
  return values.size() == 1 ? values.front() : values.at(at);
}

double prism_size_sigma(const Sensor& sensor, const PrismSize& size) {
  const Knowledge* known = sensor.find_knowledge(size.name);
  return known == nullptr ? 0 : std::max(known->sigma, known->total_sigma);
}

std::vector<PrismSize> uncertain_prism_sizes(const Sensor& sensor) {
  const std::vector<PrismSize> all = all_sizes(sensor.prisms());
  const auto& names = sensor.covariance_names;
  const auto in_covariance = [&](const PrismSize& size) {
    return std::find(names.begin(), names.end(), size.name) != names.end();
  };
  std::vector<PrismSize> result;
  for (const PrismSize& size : all) {
    const bool joint = std::any_of(all.begin(), all.end(), [&](const PrismSize& other) {
      return is_a_thickness(other) == is_a_thickness(size) && in_covariance(other);
    });
    if (joint ? in_covariance(size) : prism_size_sigma(sensor, size) > 0) result.push_back(size);
  }
  return result;
}

}  // namespace risley::sensors
