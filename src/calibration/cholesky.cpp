// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/cholesky.hpp"

#include <algorithm>
#include <utility>

#include <Eigen/Cholesky>

#include "risley/parallel/parallel.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr Index kTile = 128;

}  // namespace

Cholesky::Cholesky(MatrixXd matrix) : factor_(std::move(matrix)) {
  const Index size = factor_.rows();
  for (Index at = 0; at < size; at += kTile) {
    const Index width = std::min(kTile, size - at), behind = at + width;
    Eigen::Ref<MatrixXd> corner = factor_.block(at, at, width, width);
    const Eigen::LLT<Eigen::Ref<MatrixXd>> own(corner);
    if (own.info() != Eigen::Success) return;
    const auto tiles = static_cast<std::size_t>((size - behind + kTile - 1) / kTile);
    const auto rows_of = [&](Index tile) {
      return std::pair{behind + tile * kTile, std::min(kTile, size - behind - tile * kTile)};
    };
    parallel::for_each(tiles, [&](Index tile) {
      const auto [row, rows] = rows_of(tile);
      own.matrixL().transpose().solveInPlace<Eigen::OnTheRight>(
          factor_.block(row, at, rows, width));
    });
    parallel::for_each(tiles * (tiles + 1) / 2, [&](Index number) {
      Index tile = 0;  // of the rows; columns of up to as many tiles
      while (number > tile) number -= ++tile;
      const auto [row, rows] = rows_of(tile);
      const auto [column, columns] = rows_of(number);
      factor_.block(row, column, rows, columns).noalias() -=
          factor_.block(row, at, rows, width) *
          factor_.block(column, at, columns, width).transpose();
    });
  }
  positive_ = true;
}

void Cholesky::solve_in_place(MatrixXd& right) const {
  if (right.cols() == 0) return;  // of which Eigen would read the first element
  factor_.triangularView<Eigen::Lower>().solveInPlace(right);
  factor_.triangularView<Eigen::Lower>().transpose().solveInPlace(right);
}

}  // namespace risley::calibration
