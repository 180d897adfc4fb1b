// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>

#include "risley/algebra/symmetric.hpp"
#include "risley/calibration/planar_adjustment.hpp"
#include "risley/calibration/rays.hpp"
#include "risley/core/median.hpp"
#include "risley/core/plane.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/eigen_vectors.hpp"
#include "calibration/planar_system.hpp"
#include "calibration/shot_blocks.hpp"
#include "calibration/sorted_rows.hpp"

namespace risley::calibration {
namespace {

/// Narrower cells gain nothing for the shortest waves, wider ones are not linear in them:
/// docs/theory/calibration.md, section Walls have shape. M.
constexpr double kLeastSpacing = 0.3;
/// Most cells of one wall: the time of a solution grows with them.
constexpr double kMostCells = 6000;
/// The process extends this far beyond the shots, in cells.
constexpr int kMargin = 2;

/// Points where the shots of a view meet their wall, in the coordinates of the wall's grid, m.
struct WallPlaces {
  std::vector<double> u, v;
};

WallPlaces places_of(const PlanarProblem& problem, std::size_t view) {
  const WallView& seen = problem.views[view];
  const RangedShots& shots = *seen.shots;
  const StationPose& station = problem.stations[seen.recording];
  const auto tangents = tangents_of(problem.walls[seen.wall].normal);
  const Eigen::Vector3d u1 = eigen(tangents.first), u2 = eigen(tangents.second);
  const Plane plane = plane_view(problem, view).plane;
  WallPlaces places{std::vector<double>(shots.size()), std::vector<double>(shots.size())};
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    const Rays rays(problem.train, problem.geometry, shots, {begin, end});
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3<double> origin = rays.origin(i - begin), direction = rays.direction(i - begin);
      const double range = hit_distance(plane, origin, direction);
      const Eigen::Vector3d point =
          station.scene_from_sensor * eigen(origin + range * direction) + station.position;
      places.u[i] = u1.dot(point);
      places.v[i] = u2.dot(point);
    }
  });
  return places;
}

/// Extent of all places except for one in a thousand at each end, which are far away on a wall at
/// grazing incidence, with a margin of a tenth.
struct PlaceExtent {
  double least = 0, most = 0;

  explicit PlaceExtent(std::vector<double> values) {
    std::erase_if(values, [](double value) { return !std::isfinite(value); });
    if (values.empty()) return;
    const std::size_t beyond = values.size() / 1000;
    least = nth_value(values, beyond);
    most = nth_value(values, values.size() - 1 - beyond);
    const double margin = 0.1 * (most - least);
    least -= margin;
    most += margin;
  }
  double width() const { return most - least; }
};

/// The grid that holds all places, without its list of cells.
WallGrid grid_around(const PlaceExtent& u, const PlaceExtent& v) {
  WallGrid grid;
  grid.spacing = std::max(kLeastSpacing, std::sqrt(u.width() * v.width() / kMostCells));
  const auto cells = [&](const PlaceExtent& extent) {
    return static_cast<int>(std::ceil(extent.width() / grid.spacing + 0.5)) + 2 * kMargin;
  };
  grid.cells_u = cells(u);
  grid.cells_v = cells(v);
  grid.first_u = 0.5 * (u.least + u.most) - 0.5 * grid.spacing * grid.cells_u;
  grid.first_v = 0.5 * (v.least + v.most) - 0.5 * grid.spacing * grid.cells_v;
  return grid;
}

void lay_grid(PlanarProblem& problem, std::size_t wall, const std::vector<std::size_t>& views) {
  std::vector<WallPlaces> places;
  std::vector<double> all_u, all_v;
  for (const std::size_t view : views) {
    const WallPlaces& own = places.emplace_back(places_of(problem, view));
    all_u.insert(all_u.end(), own.u.begin(), own.u.end());
    all_v.insert(all_v.end(), own.v.begin(), own.v.end());
  }
  WallGrid grid = grid_around(PlaceExtent(std::move(all_u)), PlaceExtent(std::move(all_v)));
  const auto cells_u = static_cast<std::uint32_t>(grid.cells_u);
  const std::uint32_t none = cells_u * static_cast<std::uint32_t>(grid.cells_v);
  const auto cell_of = [&](double u, double v) {
    const double at_u = std::floor((u - grid.first_u) / grid.spacing);
    const double at_v = std::floor((v - grid.first_v) / grid.spacing);
    const bool inside = at_u >= 0 && at_u < grid.cells_u && at_v >= 0 && at_v < grid.cells_v;
    return inside ? static_cast<std::uint32_t>(at_v) * cells_u + static_cast<std::uint32_t>(at_u)
                  : none;
  };
  std::vector<std::vector<std::uint32_t>> cell;
  std::vector<std::uint8_t> used(none);
  for (const WallPlaces& at : places) {
    auto& own = cell.emplace_back(at.u.size());
    for (std::size_t i = 0; i < own.size(); ++i) {
      own[i] = cell_of(at.u[i], at.v[i]);
      if (own[i] != none) used[own[i]] = 1;
    }
  }
  std::vector<std::uint32_t> row(used.size());
  for (std::size_t i = 0; i < used.size(); ++i) {
    row[i] = static_cast<std::uint32_t>(grid.cells.size());
    if (used[i] != 0) grid.cells.push_back(static_cast<std::uint32_t>(i));
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    WallView& view = problem.views[views[i]];
    const SortedRows sorted(grid.cells.size(), cell[i].size(), [&](std::size_t shot) {
      return cell[i][shot] == none ? grid.cells.size() : row[cell[i][shot]];
    });
    view.cell_begin.assign(sorted.begin.begin(), sorted.begin.end());
    view.shots = std::make_shared<const RangedShots>(rows_of(*view.shots, sorted.rows));
  }
  problem.walls[wall].grid = std::move(grid);
}

/// Positions of recordings from the distances of shared walls; along directions that no wall
/// determines they keep their stated positions.
void find_positions(PlanarProblem& problem) {
  constexpr double kDistanceSigma = 0.002, kPositionSigma = 0.3;  // m
  if (!problem.stations_known || problem.stations.size() < 2) return;
  const Eigen::Index stations = problem.stations.size();
  const Eigen::Index walls = problem.walls.size();
  const Eigen::Index size = 3 * stations + walls;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  const auto add = [&](const Eigen::VectorXd& row, double value, double sigma) {
    normal += row * row.transpose() / (sigma * sigma);
    right += row * value / (sigma * sigma);
  };
  for (Eigen::Index s = 0; s < stations; ++s) {
    const StationPose& station = problem.stations[s];
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      // The first one is the scene's origin except for stated values.
      add(Eigen::VectorXd::Unit(size, 3 * s + axis), station.position[axis],
          s == 0 ? 1e-3 * kDistanceSigma : kPositionSigma);
    }
  }
  for (const WallView& view : problem.views) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(size);
    row.segment<3>(3 * view.recording) = -eigen(problem.walls[view.wall].normal);
    row[3 * stations + static_cast<Eigen::Index>(view.wall)] = 1;
    add(row, view.side * view.distance, kDistanceSigma);
  }
  const Eigen::VectorXd found = algebra::SymmetricSolver(normal).solve(right);
  for (Eigen::Index s = 0; s < stations; ++s) {
    problem.stations[s].position = found.segment<3>(3 * s);
  }
}

}  // namespace

void lay_grids(PlanarProblem& problem) {
  find_positions(problem);
  const std::vector<std::vector<std::size_t>> views = views_of_walls(problem);
  parallel::for_each(views.size(), [&](std::size_t wall) {
    if (!views[wall].empty()) lay_grid(problem, wall, views[wall]);
  });
}

}  // namespace risley::calibration
