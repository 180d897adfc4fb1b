// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "calibration/band_cholesky_kernel.hpp"

#include "risley/core/simd.hpp"

namespace risley::calibration::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;
/// Columns of the factor computed at once, for kRows of its rows, so that loaded values are reused.
/// The sums stay in registers, of which AVX-512 has twice as many.
constexpr std::size_t kColumns = 4, kRows = kLanes < 8 ? 2 : 4;
/// Batches of right-hand sides solved at once for one row.
constexpr std::size_t kBatches = 4;

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

/// Products of kRows rows with kColumns others, over the columns [first, end) of the matrix. Rows
/// are given by column: row[j] is entry (i, j).
void products(const double* const* a, const double* const* b, std::size_t first, std::size_t end,
              double (*result)[kColumns]) {
  Batch sums[kRows][kColumns];
  for (auto& row : sums) {
    for (Batch& sum : row) sum = Batch(0.0);
  }
  std::size_t k = first;
  for (; k + kLanes <= end; k += kLanes) {
    Batch own[kRows];
    for (std::size_t r = 0; r < kRows; ++r) own[r] = Batch::load_unaligned(a[r] + k);
    for (std::size_t c = 0; c < kColumns; ++c) {
      const Batch other = Batch::load_unaligned(b[c] + k);
      for (std::size_t r = 0; r < kRows; ++r) sums[r][c] = xsimd::fma(own[r], other, sums[r][c]);
    }
  }
  for (std::size_t r = 0; r < kRows; ++r) {
    for (std::size_t c = 0; c < kColumns; ++c) {
      result[r][c] = sum_of_lanes(sums[r][c]);
      for (std::size_t j = k; j < end; ++j) result[r][c] += a[r][j] * b[c][j];
    }
  }
}

/// A band matrix whose rows are given by column.
struct Band {
  double* rows;
  std::size_t width;

  double* row(std::size_t i) const { return rows + i * (width + 1) + width - i; }
  std::size_t first(std::size_t i) const { return i < width ? 0 : i - width; }

  /// Entries [begin, end) of row i of the factor, when those left of them are known.
  void find(std::size_t i, std::size_t begin, std::size_t end) const {
    double* own = row(i);
    const std::size_t left = first(i);
    for (std::size_t j = begin; j < end; ++j) {
      const double* other = row(j);
      own[j] = (own[j] - product(own + left, other + left, j - left)) / other[j];
    }
  }
};

}  // namespace

bool factorise_band(const BandArguments& a) {
  const Band band{a.rows, a.width};
  std::size_t i = 0;
  for (; i < a.size; i += kRows) {
    const std::size_t count = i + kRows <= a.size ? kRows : a.size - i;
    // From column j on, all of the rows are within the band.
    const std::size_t last = band.first(i + count - 1);
    std::size_t j = last < i ? last : i;
    for (std::size_t r = 0; r < count; ++r) band.find(i + r, band.first(i + r), j);
    if (count == kRows) {
      const std::size_t common = j;
      double* own[kRows];
      for (std::size_t r = 0; r < kRows; ++r) own[r] = band.row(i + r);
      for (; j + kColumns <= i; j += kColumns) {
        const double* other[kColumns];
        for (std::size_t c = 0; c < kColumns; ++c) other[c] = band.row(j + c);
        double sums[kRows][kColumns];
        products(own, other, common, j, sums);
        for (std::size_t r = 0; r < kRows; ++r) {
          const std::size_t left = band.first(i + r);
          for (std::size_t c = 0; c < kColumns; ++c) {
            double value = own[r][j + c] - sums[r][c];
            value -= product(own[r] + left, other[c] + left, common - left);
            value -= product(own[r] + j, other[c] + j, c);
            own[r][j + c] = value / other[c][j + c];
          }
        }
      }
    }
    for (std::size_t r = 0; r < count; ++r) {
      double* own = band.row(i + r);
      const std::size_t left = band.first(i + r);
      band.find(i + r, j < left ? left : j, i + r);
      const double square = own[i + r] - product(own + left, own + left, i + r - left);
      if (!(square > 0) || !(square <= __DBL_MAX__)) return false;
      own[i + r] = __builtin_sqrt(square);
    }
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
    for (; c + kBatches * kLanes <= a.count; c += kBatches * kLanes) {
      Batch sums[kBatches];
      for (std::size_t b = 0; b < kBatches; ++b) {
        sums[b] = Batch::load_unaligned(own + c + b * kLanes);
      }
      for (std::size_t j = first; j < i; ++j) {
        const Batch by(factor[j]);
        const double* other = a.columns + j * a.count + c;
        for (std::size_t b = 0; b < kBatches; ++b) {
          sums[b] = xsimd::fnma(by, Batch::load_unaligned(other + b * kLanes), sums[b]);
        }
      }
      for (std::size_t b = 0; b < kBatches; ++b) {
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
