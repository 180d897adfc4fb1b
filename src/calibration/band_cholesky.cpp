// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/band_cholesky.hpp"

#include <algorithm>
#include <cstddef>

#include "calibration/band_cholesky_kernel.hpp"

namespace risley::calibration {

using Eigen::Index;

bool BandMatrix::factorise() {
  BandArguments all;
  all.rows = rows_.data();
  all.size = static_cast<std::size_t>(size());
  all.width = static_cast<std::size_t>(width_);
  return RISLEY_KERNEL_COPIES(factorise_band).at(best_instruction_set())(all);
}

void BandMatrix::solve_lower(Rows& columns) const {
  BandArguments all;
  all.rows = const_cast<double*>(rows_.data());  // the kernel only reads it here
  all.size = static_cast<std::size_t>(size());
  all.width = static_cast<std::size_t>(width_);
  all.columns = columns.data();
  all.count = static_cast<std::size_t>(columns.cols());
  RISLEY_KERNEL_COPIES(solve_lower_band).at(best_instruction_set())(all);
}

void BandMatrix::solve_upper(Eigen::VectorXd& vector) const {
  for (Index i = size(); i-- > 0;) {
    vector[i] /= at(i, i);
    const Index first = std::max<Index>(0, i - width_);
    vector.segment(first, i - first) -=
        vector[i] * rows_.row(i).segment(first - i + width_, i - first).transpose();
  }
}

double BandMatrix::log_determinant() const { return 2.0 * rows_.col(width_).array().log().sum(); }

}  // namespace risley::calibration
