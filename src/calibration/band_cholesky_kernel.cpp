// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "calibration/band_cholesky_kernel.hpp"

#include "risley/core/simd.hpp"

namespace risley::calibration::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;
/// Rows of the factor that a row is multiplied with at once: it is loaded once for all of them.
constexpr std::size_t kRows = 4;
/// Batches of columns that one row is solved for at once.
constexpr std::size_t kColumns = 4;

double product(const double* a, const double* b, std::size_t count) {
  Batch sum(0.0);
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    sum = xsimd::fma(Batch::load_unaligned(a + i), Batch::load_unaligned(b + i), sum);
  }
  double result = sum_of_lanes(sum);
  for (; i < count; ++i) result += a[i] * b[i];
  return result;
}

/// Products of one row with kRows others.
void products(const double* a, const double* const* b, std::size_t count, double* result) {
  Batch sums[kRows];
  for (Batch& sum : sums) sum = Batch(0.0);
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    const Batch own = Batch::load_unaligned(a + i);
    for (std::size_t r = 0; r < kRows; ++r) {
      sums[r] = xsimd::fma(own, Batch::load_unaligned(b[r] + i), sums[r]);
    }
  }
  for (std::size_t r = 0; r < kRows; ++r) {
    result[r] = sum_of_lanes(sums[r]);
    for (std::size_t j = i; j < count; ++j) result[r] += a[j] * b[r][j];
  }
}

}  // namespace

bool factorise_band(const BandArguments& a) {
  const std::size_t width = a.width, stride = width + 1;
  for (std::size_t i = 0; i < a.size; ++i) {
    const std::size_t first = i < width ? 0 : i - width;
    // Rows by column: row[j] is entry (i, j).
    double* own = a.rows + i * stride + width - i;
    const auto other = [&](std::size_t j) { return a.rows + j * stride + width - j; };
    std::size_t j = first;
    // All columns of a group have the entries from `first` on: row j + kRows - 1 begins before.
    for (; j + kRows <= i; j += kRows) {
      const double* rows[kRows];
      for (std::size_t r = 0; r < kRows; ++r) rows[r] = other(j + r) + first;
      double sums[kRows];
      products(own + first, rows, j - first, sums);
      for (std::size_t r = 0; r < kRows; ++r) {
        double value = own[j + r] - sums[r];
        for (std::size_t k = 0; k < r; ++k) value -= own[j + k] * other(j + r)[j + k];
        own[j + r] = value / other(j + r)[j + r];
      }
    }
    for (; j < i; ++j) {
      own[j] = (own[j] - product(own + first, other(j) + first, j - first)) / other(j)[j];
    }
    const double square = own[i] - product(own + first, own + first, i - first);
    if (!(square > 0) || !(square <= __DBL_MAX__)) return false;
    own[i] = __builtin_sqrt(square);
  }
  return true;
}

bool solve_lower_band(const BandArguments& a) {
  const std::size_t width = a.width, stride = width + 1;
  for (std::size_t i = 0; i < a.size; ++i) {
    const std::size_t first = i < width ? 0 : i - width;
    const double* factor = a.rows + i * stride + width - i;
    const double over = 1.0 / factor[i];
    double* own = a.columns + i * a.count;
    std::size_t c = 0;
    for (; c + kColumns * kLanes <= a.count; c += kColumns * kLanes) {
      Batch sums[kColumns];
      for (std::size_t b = 0; b < kColumns; ++b) {
        sums[b] = Batch::load_unaligned(own + c + b * kLanes);
      }
      for (std::size_t j = first; j < i; ++j) {
        const Batch by(factor[j]);
        const double* other = a.columns + j * a.count + c;
        for (std::size_t b = 0; b < kColumns; ++b) {
          sums[b] = xsimd::fnma(by, Batch::load_unaligned(other + b * kLanes), sums[b]);
        }
      }
      for (std::size_t b = 0; b < kColumns; ++b) {
        (sums[b] * Batch(over)).store_unaligned(own + c + b * kLanes);
      }
    }
    for (; c + kLanes <= a.count; c += kLanes) {
      Batch sum = Batch::load_unaligned(own + c);
      for (std::size_t j = first; j < i; ++j) {
        sum =
            xsimd::fnma(Batch(factor[j]), Batch::load_unaligned(a.columns + j * a.count + c), sum);
      }
      (sum * Batch(over)).store_unaligned(own + c);
    }
    for (; c < a.count; ++c) {
      double sum = own[c];
      for (std::size_t j = first; j < i; ++j) sum -= factor[j] * a.columns[j * a.count + c];
      own[c] = sum * over;
    }
  }
  return true;
}

}  // namespace risley::calibration::RISLEY_KERNEL_NAMESPACE
