// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/residual_maps.hpp"

#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "estimation/used_shots.hpp"

namespace risley::estimation {
namespace {

/// Collects residuals cell by cell.
class MapMaker {
 public:
  explicit MapMaker(double cell) : cell_(cell) {
    require_above("cell", degrees_from_radians(cell), 0, "deg");
  }

  void add(double x, double y, double azimuth_residual, double zenith_residual) {
    if (!std::isfinite(x + y + azimuth_residual + zenith_residual)) return;
    Cell& cell = cells_[{std::lround(std::floor(x / cell_)), std::lround(std::floor(y / cell_))}];
    ++cell.count;
    cell.azimuth += azimuth_residual;
    cell.zenith += zenith_residual;
    squares_azimuth_ += azimuth_residual * azimuth_residual;
    squares_zenith_ += zenith_residual * zenith_residual;
  }

  void add(const MapMaker& others) {
    for (const auto& [place, other] : others.cells_) {
      Cell& cell = cells_[place];
      cell.count += other.count;
      cell.azimuth += other.azimuth;
      cell.zenith += other.zenith;
    }
    squares_azimuth_ += others.squares_azimuth_;
    squares_zenith_ += others.squares_zenith_;
  }

  ResidualMap result() const {
    ResidualMap map;
    map.cell = cell_;
    for (const auto& [place, cell] : cells_) {
      const auto count = static_cast<double>(cell.count);
      map.x.push_back(cell_ * (static_cast<double>(place.first) + 0.5));
      map.y.push_back(cell_ * (static_cast<double>(place.second) + 0.5));
      map.count.push_back(cell.count);
      map.mean_azimuth.push_back(cell.azimuth / count);
      map.mean_zenith.push_back(cell.zenith / count);
      map.shots += cell.count;
    }
    if (map.shots > 0) {
      map.sigma_azimuth = std::sqrt(squares_azimuth_ / static_cast<double>(map.shots));
      map.sigma_zenith = std::sqrt(squares_zenith_ / static_cast<double>(map.shots));
    }
    return map;
  }

 private:
  struct Cell {
    std::uint64_t count = 0;
    double azimuth = 0, zenith = 0;
  };
  double cell_;
  std::map<std::pair<long, long>, Cell> cells_;
  double squares_azimuth_ = 0, squares_zenith_ = 0;
};

/// Map of all used shots. @param place_of  (solved shots, one of them) its cell
template <class PlaceOf>
ResidualMap map_of(const Estimate& estimate, double cell, const PlaceOf& place_of) {
  MapMaker all(cell);
  for_all_shots(
      estimate,
      [&](const SolvedShots& solved) {
        MapMaker some(cell);
        for (std::size_t i = 0; i < solved.shots.size(); ++i) {
          if (!solved.used(i)) continue;
          const auto [x, y] = place_of(solved, i);
          some.add(x, y, solved.residuals.azimuth[i], solved.residuals.zenith[i]);
        }
        return some;
      },
      [&](const MapMaker& some) { all.add(some); });
  return all.result();
}

}  // namespace

ResidualMap residuals_over_field(const Estimate& estimate, double cell) {
  return map_of(estimate, cell, [](const SolvedShots& solved, std::size_t i) {
    return std::pair(wrap_to_pi(solved.shots.azimuth[i] - solved.residuals.azimuth[i]),
                     solved.shots.zenith[i] - solved.residuals.zenith[i]);
  });
}

ResidualMap residuals_over_angles(const Estimate& estimate, int prism_x, int prism_y, double cell) {
  const int prisms = estimate.states.prisms();
  if (prism_x < 0 || prism_y < 0 || prism_x >= prisms || prism_y >= prisms) {
    throw InvalidArgument(
        fmt::format("prisms {} and {}, allowed 0 to {}", prism_x, prism_y, prisms - 1));
  }
  const auto x = static_cast<std::size_t>(prism_x), y = static_cast<std::size_t>(prism_y);
  return map_of(estimate, cell, [&](const SolvedShots& solved, std::size_t i) {
    return std::pair(wrap_to_two_pi(solved.rotation_angle[x][i]),
                     wrap_to_two_pi(solved.rotation_angle[y][i]));
  });
}

}  // namespace risley::estimation
