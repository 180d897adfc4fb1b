// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/band_cholesky.hpp"

#include <algorithm>
#include <cmath>

namespace risley::calibration {

using Eigen::Index;

bool BandMatrix::factorise() {
  for (Index i = 0; i < size(); ++i) {
    const Index first = std::max<Index>(0, i - width_);
    double* const own = rows_.row(i).data() + width_ - i;  // indexed by column
    for (Index j = first; j <= i; ++j) {
      const Index from = std::max(first, j - width_);
      const double* const other = rows_.row(j).data() + width_ - j;
      const double product = Eigen::Map<const Eigen::VectorXd>(own + from, j - from)
                                 .dot(Eigen::Map<const Eigen::VectorXd>(other + from, j - from));
      if (j < i) {
        own[j] = (own[j] - product) / other[j];
      } else {
        const double square = own[i] - product;
        if (!(square > 0) || !std::isfinite(square)) return false;
        own[i] = std::sqrt(square);
      }
    }
  }
  return true;
}

void BandMatrix::solve_lower(Rows& columns) const {
  for (Index i = 0; i < size(); ++i) {
    for (Index j = std::max<Index>(0, i - width_); j < i; ++j) {
      const double factor = at(i, j);
      if (factor != 0) columns.row(i) -= factor * columns.row(j);
    }
    columns.row(i) /= at(i, i);
  }
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
