// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace risley::calibration {

/// A symmetric positive definite matrix that is zero outside a band along the diagonal, and its
/// factor L L'. Rows are stored in memory order, so that products of rows are contiguous.
class BandMatrix {
 public:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// @param width  entries of a row left of the diagonal
  BandMatrix(Eigen::Index size, Eigen::Index width)
      : width_(width), rows_(Rows::Zero(size, width + 1)) {}

  Eigen::Index size() const { return rows_.rows(); }
  /// An entry of the lower triangle, within the band.
  double& at(Eigen::Index row, Eigen::Index column) { return rows_(row, column - row + width_); }
  double at(Eigen::Index row, Eigen::Index column) const {
    return rows_(row, column - row + width_);
  }

  /// Replaces the matrix by its factor. @return whether there is one
  bool factorise();
  /// L^-1 times the columns, in place.
  void solve_lower(Rows& columns) const;
  /// L'^-1 times a vector, in its place.
  void solve_upper(Eigen::VectorXd& vector) const;
  /// Log of the determinant of the matrix whose factor this is.
  double log_determinant() const;

 private:
  Eigen::Index width_;
  Rows rows_;
};

}  // namespace risley::calibration
