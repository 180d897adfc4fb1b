// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace risley::calibration {

/// The factor L of a symmetric positive matrix L L', on all threads; the same for any number of
/// them.
class Cholesky {
 public:
  Cholesky() = default;
  /// @param matrix  its lower triangle counts
  explicit Cholesky(Eigen::MatrixXd matrix);

  bool positive() const { return positive_; }  ///< otherwise there is no factor
  /// Lower triangle; the part above the diagonal is undefined.
  const Eigen::MatrixXd& factor() const { return factor_; }
  /// The inverse of the matrix times `right`, in place.
  void solve_in_place(Eigen::MatrixXd& right) const;

 private:
  Eigen::MatrixXd factor_;
  bool positive_ = false;
};

}  // namespace risley::calibration
