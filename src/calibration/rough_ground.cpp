// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/rough_ground.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "risley/algebra/symmetric.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
constexpr int kPatches = RoughGround::kPatches;

/// Most shots used: more hardly improve the result.
constexpr std::size_t kRoughShots = 400'000;
/// Ground counts as rough beyond this many sigmas.
constexpr double kRoughSigmas = 5;

std::int8_t patch_of(const std::array<float, 3>& point, const GroundCellOptions& grid) {
  const auto along = [&](double value, double shift) {
    const double cells = value / grid.size + shift;
    const auto third = static_cast<int>((cells - std::floor(cells)) * RoughGround::kSide);
    return std::clamp(third, 0, RoughGround::kSide - 1);
  };
  return static_cast<std::int8_t>(RoughGround::kSide * along(point[1], grid.shift_north) +
                                  along(point[0], grid.shift_east));
}

struct PatchResidual {
  std::int32_t plane = 0;
  std::int8_t patch = 0;
  double residual = 0;
};

using Patches = Eigen::Array<double, kPatches, 1>;

/// Of one cell.
struct CellSums {
  Patches residual = Patches::Zero(), squares = Patches::Zero(), count = Patches::Zero();
};

}  // namespace

std::optional<RoughGround> rough_ground(const FlightShots& shots, const ShotPoses& poses,
                                        const PlaneOfShot& plane, const ShotPoints& points,
                                        const GroundCellOptions& grid, const FlightModel& model,
                                        const FlightWeights& weights) {
  const auto step = static_cast<std::int32_t>(shots.size() / kRoughShots + 1);
  RoughGround ground;
  ground.cells_for_each = step;
  ground.patch.assign(shots.size(), -1);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (plane[i] != kNoPlane && plane[i] % step == 0) ground.patch[i] = patch_of(points[i], grid);
  }
  std::vector<std::vector<PatchResidual>> pieces(flight_pieces(model));
  for_each_flight_piece(shots, poses, plane, model, weights,
                        [&](std::size_t piece, const FlightRows& rows) {
                          const auto columns = static_cast<std::size_t>(rows.columns);
                          for (std::size_t i = 0; i < rows.shots.size(); ++i) {
                            const std::size_t shot = rows.shots[i];
                            const double* row = rows.values.data() + (i + 1) * columns - 3;
                            if (ground.patch[shot] < 0 || row[2] == 0) continue;
                            pieces[piece].push_back({plane[shot], ground.patch[shot], row[0]});
                          }
                        });
  std::vector<CellSums> cells(model.planes.size());
  for (const auto& piece : pieces) {
    for (const PatchResidual& own : piece) {
      CellSums& cell = cells[own.plane];
      cell.residual[own.patch] += own.residual;
      cell.squares[own.patch] += own.residual * own.residual;
      ++cell.count[own.patch];
    }
  }
  Eigen::Matrix<double, kPatches, kPatches> products, pairs;
  products.setZero();
  pairs.setZero();
  double squares = 0, count = 0;
  for (const CellSums& cell : cells) {
    products += (cell.residual.matrix() * cell.residual.matrix().transpose());
    products.diagonal() -= cell.squares.matrix();
    pairs += (cell.count.matrix() * cell.count.matrix().transpose());
    pairs.diagonal() -= cell.count.matrix();
    squares += cell.squares.sum();
    count += cell.count.sum();
  }
  const double all_pairs = pairs.diagonal().sum();
  if (!(all_pairs > 0) || !(pairs.minCoeff() > 0)) return std::nullopt;
  const double shared = products.diagonal().sum() / all_pairs;
  const double chance = squares / count * std::sqrt(2 / all_pairs);
  if (shared <= kRoughSigmas * chance) return std::nullopt;
  const algebra::PrincipalAxes axes = algebra::principal_axes(products.cwiseQuotient(pairs));
  ground.covariance =
      axes.vectors * axes.values.cwiseMax(0).asDiagonal() * axes.vectors.transpose();
  return ground;
}

}  // namespace risley::calibration
