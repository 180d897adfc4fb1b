// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/surface_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Core>
#include <fmt/format.h>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"

#include "calibration/sorted_rows.hpp"

namespace risley::calibration {
namespace {

constexpr std::size_t kLeastPoints = 5;  ///< of a cell
/// Number of cells needed for a smooth surface of degree 1, 2 and 3.
constexpr std::array<std::size_t, 4> kLeastCells{1, 10, 20, 40};
constexpr double kTukey = 4.685;        ///< in robust sigmas: cells beyond have no weight
constexpr int kMostWeightRounds = 30;   ///< of weights and fits
constexpr double kOff = 2.5;            ///< sigmas of a cell of a step
constexpr double kAround = 1.5;         ///< the same of its neighbours
constexpr double kLeastRegion = 3;      ///< cells of a step
constexpr double kSignificant = 6.0;    ///< sigmas of all cells of a step together
constexpr double kLeastHeight = 0.005;  ///< of a step, m
constexpr double kAboveWaves = 3.0;     ///< least height in robust sigmas of the surface's waves
constexpr double kCore = 0.7;           ///< of its height: cells that lie wholly within a step
constexpr double kInside = 0.5;         ///< of its height: cells that lie mostly within a step
constexpr double kSeparable = 4.0;      ///< sigmas of one point: the height decides its side

/// Means over one cell.
struct Cell {
  /// Whether it has enough points. A step continues through cells that have too few.
  bool full = false;
  int column = 0, row = 0;
  double x = 0, y = 0;                  ///< middle on the grid, rad
  std::size_t begin = 0, end = 0;       ///< of its points in the order of the cells
  double mean = 0, mean_sigma = 0;      ///< weighted mean and its sigma, m
  double centre = 0, centre_sigma = 0;  ///< median and its sigma, m
  double offset = 0;                    ///< of the median from the smooth surface, m
  double z = 0;                         ///< offset over its sigma
  int region = -1;                      ///< row of the steps
};

/// Polynomial of two variables, of total degree 3 at most.
class SmoothSurface {
 public:
  /// Fits the medians of cells robustly: Tukey's weights, one degree after the other, so that no
  /// region gets weight again by bending a higher degree.
  /// @param full  number of the counted cells
  SmoothSurface(std::vector<Cell>& cells, std::size_t full) {
    std::array<double, 4> box{cells[0].x, cells[0].x, cells[0].y, cells[0].y};
    for (const Cell& cell : cells) {
      box = {std::min(box[0], cell.x), std::max(box[1], cell.x), std::min(box[2], cell.y),
             std::max(box[3], cell.y)};
    }
    middle_ = {0.5 * (box[0] + box[1]), 0.5 * (box[2] + box[3])};
    half_ = std::max({0.5 * (box[1] - box[0]), 0.5 * (box[3] - box[2]), kSurfaceCell});
    std::vector<double> centres;
    for (const Cell& cell : cells) {
      if (cell.full) centres.push_back(cell.centre);
    }
    coefficients_[0] = median(centres);
    compare(cells);
    for (std::size_t degree = 1; degree < kLeastCells.size(); ++degree) {
      if (full >= kLeastCells[degree]) fit(cells, (degree + 1) * (degree + 2) / 2);
    }
  }

  double operator()(double x, double y) const {
    const auto terms = terms_of(x, y);
    double sum = 0;
    for (std::size_t i = 0; i < terms.size(); ++i) sum += coefficients_[i] * terms[i];
    return sum;
  }
  /// Robust standard deviation of the cells' offsets over their sigmas, at least 1.
  double spread() const { return spread_; }

 private:
  static constexpr std::size_t kTerms = 10;

  std::array<double, kTerms> terms_of(double x, double y) const {
    const double u = (x - middle_[0]) / half_, v = (y - middle_[1]) / half_;
    return {1.0, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v};
  }

  /// Sets the offsets of the cells, and the spread.
  void compare(std::vector<Cell>& cells) {
    std::vector<double> sizes;
    for (Cell& cell : cells) {
      cell.offset = cell.centre - (*this)(cell.x, cell.y);
      cell.z = cell.offset / cell.centre_sigma;
      if (cell.full) sizes.push_back(std::abs(cell.z));
    }
    spread_ = std::max(1.0, kSigmaOverMedianDistance * median(sizes));
  }

  void fit(std::vector<Cell>& cells, std::size_t terms) {
    for (int round = 0; round < kMostWeightRounds; ++round) {
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms, terms);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(terms);
      for (const Cell& cell : cells) {
        const double part = cell.z / (kTukey * spread_);
        // The square root of Tukey's weight over the variance.
        const double root = cell.full ? std::max(0.0, 1.0 - part * part) / cell.centre_sigma : 0.0;
        const auto row = terms_of(cell.x, cell.y);
        for (std::size_t i = 0; i < terms; ++i) {
          const double weighted = root * root * row[i];
          right[i] += weighted * cell.centre;
          for (std::size_t j = 0; j < terms; ++j) {
            normal(i, j) += weighted * row[j];
          }
        }
      }
      // Directions not determined by cells in one row are zero.
      const Eigen::VectorXd solution = algebra::times(algebra::pseudo_inverse(normal), right);
      double change = 0;
      for (std::size_t j = 0; j < terms; ++j) {
        const double next = solution[j];
        change = std::max(change, std::abs(next - coefficients_[j]));
        coefficients_[j] = next;
      }
      compare(cells);
      if (change < 1e-7) return;
    }
  }

  std::array<double, 2> middle_{};
  double half_ = 1;
  std::array<double, kTerms> coefficients_{};
  double spread_ = 1;
};

/// Cells of a grid over the field of view, and the rows of residuals in them.
class Grid {
 public:
  explicit Grid(const SurfaceResiduals& residuals) : residuals_(residuals) {
    const std::size_t size = residuals.distance.size();
    std::vector<std::size_t> rows;
    double zenith = 0;
    for (std::size_t i = 0; i < size; ++i) {
      if (!std::isfinite(residuals.azimuth[i]) || !std::isfinite(residuals.zenith[i]) ||
          !std::isfinite(residuals.distance[i]) || !std::isfinite(residuals.sigma[i]) ||
          !(residuals.sigma[i] > 0)) {
        continue;
      }
      rows.push_back(i);
      zenith += residuals.zenith[i];
    }
    if (rows.empty()) return;
    zenith /= static_cast<double>(rows.size());
    sine_ = std::max(1e-3, std::sin(zenith));
    first_azimuth_ = residuals.azimuth[rows[0]];
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    double right = -kInfinity, top = -kInfinity;
    left_ = bottom_ = kInfinity;
    for (std::size_t i : rows) {
      left_ = std::min(left_, x_of(i));
      right = std::max(right, x_of(i));
      bottom_ = std::min(bottom_, residuals.zenith[i]);
      top = std::max(top, residuals.zenith[i]);
    }
    columns_ = 1 + static_cast<int>((right - left_) / kSurfaceCell);
    rows_ = 1 + static_cast<int>((top - bottom_) / kSurfaceCell);
    std::vector<int> cell_of(size, -1);
    for (std::size_t i : rows) {
      const int column = static_cast<int>((x_of(i) - left_) / kSurfaceCell);
      const int row = static_cast<int>((residuals.zenith[i] - bottom_) / kSurfaceCell);
      cell_of[i] = row * columns_ + column;
    }
    SortedRows sorted(columns_ * rows_, size, [&](std::size_t i) { return cell_of[i]; });
    order_ = std::move(sorted.rows);
    const std::vector<std::size_t>& begin = sorted.begin;
    place_.assign(begin.size() - 1, -1);
    for (std::size_t c = 0; c + 1 < begin.size(); ++c) {
      if (begin[c + 1] == begin[c]) continue;
      place_[c] = static_cast<int>(cells.size());
      cells.push_back(means(static_cast<int>(c), begin[c], begin[c + 1]));
      full += cells.back().full;
    }
  }

  std::vector<Cell> cells;  ///< those that hold points
  std::size_t full = 0;     ///< number of those with enough points

  std::span<const std::size_t> rows_of(const Cell& cell) const {
    return {order_.data() + cell.begin, cell.end - cell.begin};
  }
  double x_of(std::size_t row) const {
    return wrap_to_pi(residuals_.azimuth[row] - first_azimuth_) * sine_;
  }
  double azimuth_at(double x) const { return wrap_to_pi(first_azimuth_ + x / sine_); }
  double solid_angle(const Cell& cell) const {
    return kSurfaceCell * kSurfaceCell * std::sin(cell.y) / sine_;
  }
  /// Places of the up to eight cells with points around one.
  std::vector<std::size_t> around(const Cell& cell) const {
    std::vector<std::size_t> found;
    for (int row = std::max(0, cell.row - 1); row <= std::min(rows_ - 1, cell.row + 1); ++row) {
      for (int column = std::max(0, cell.column - 1);
           column <= std::min(columns_ - 1, cell.column + 1); ++column) {
        const int at = place_[row * columns_ + column];
        if (at >= 0 && (row != cell.row || column != cell.column)) {
          found.push_back(static_cast<std::size_t>(at));
        }
      }
    }
    return found;
  }

 private:
  Cell means(int index, std::size_t begin, std::size_t end) const {
    Cell cell;
    cell.full = end - begin >= kLeastPoints;
    cell.column = index % columns_;
    cell.row = index / columns_;
    cell.x = left_ + (cell.column + 0.5) * kSurfaceCell;
    cell.y = bottom_ + (cell.row + 0.5) * kSurfaceCell;
    cell.begin = begin;
    cell.end = end;
    double weights = 0, sum = 0;
    std::vector<double> values;
    for (std::size_t i : rows_of(cell)) {
      const double weight = 1.0 / (residuals_.sigma[i] * residuals_.sigma[i]);
      weights += weight;
      sum += weight * residuals_.distance[i];
      values.push_back(residuals_.distance[i]);
    }
    cell.mean = sum / weights;
    cell.mean_sigma = 1.0 / std::sqrt(weights);
    cell.centre = median(values);
    // Variance of the median over that of the mean, normal noise: pi/2 for many values.
    const double count = static_cast<double>(values.size());
    cell.centre_sigma = cell.mean_sigma * std::sqrt(0.5 * kPi * count / (count + 0.5 * kPi - 1.0));
    return cell;
  }

  const SurfaceResiduals& residuals_;
  double sine_ = 1, first_azimuth_ = 0, left_ = 0, bottom_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<std::size_t> order_;  ///< rows of the residuals sorted by cell
  std::vector<int> place_;          ///< of every cell of the grid in cells, or -1
};

/// Finds the steps in the offsets of the cells.
class StepSearch {
 public:
  StepSearch(Grid& grid, const SmoothSurface& surface, const SurfaceResiduals& residuals)
      : grid_(grid), surface_(surface), residuals_(residuals) {
    // Scatter of cells beyond their noise is waves: a step must stand out from them.
    std::vector<double> sigmas;
    for (const Cell& cell : grid.cells) {
      if (cell.full) sigmas.push_back(cell.centre_sigma);
    }
    const double spread = surface.spread();
    least_height_ =
        std::max(kLeastHeight, kAboveWaves * median(sigmas) * std::sqrt(spread * spread - 1.0));
  }

  std::vector<StepRegion> run() {
    std::vector<unsigned char> visited(grid_.cells.size(), 0);
    std::vector<StepRegion> steps;
    for (std::size_t start = 0; start < grid_.cells.size(); ++start) {
      if (visited[start] || !grid_.cells[start].full || !off(start, 0)) continue;
      const double sign = grid_.cells[start].z > 0 ? 1.0 : -1.0;
      std::vector<std::size_t> region{start};
      visited[start] = 1;
      for (std::size_t k = 0; k < region.size(); ++k) {
        for (std::size_t next : grid_.around(grid_.cells[region[k]])) {
          if (visited[next] || !off(next, sign)) continue;
          visited[next] = 1;
          region.push_back(next);
        }
      }
      if (!significant(region)) continue;
      StepRegion step = measured(region);
      if (std::abs(step.height) > least_height_) {
        take(region, static_cast<int>(steps.size()), step);
        steps.push_back(std::move(step));
      }
    }
    std::ranges::stable_sort(steps, [](const StepRegion& a, const StepRegion& b) {
      return a.solid_angle > b.solid_angle;
    });
    return steps;
  }

 private:
  /// @param sign  to have, 0 for either
  bool off(std::size_t cell, double sign) const {
    const double z = grid_.cells[cell].z;
    return (sign == 0.0 ? std::abs(z) : sign * z) > kOff * surface_.spread();
  }

  bool significant(const std::vector<std::size_t>& region) const {
    double sum = 0, count = 0;
    for (std::size_t c : region) {
      if (!grid_.cells[c].full) continue;
      sum += grid_.cells[c].z;
      count += 1.0;
    }
    return count >= kLeastRegion &&
           std::abs(sum) > kSignificant * surface_.spread() * std::sqrt(count);
  }

  /// Height, middle and size of a region. Cells on its border are excluded from the height.
  StepRegion measured(const std::vector<std::size_t>& region) const {
    std::vector<double> offsets;
    offsets.reserve(region.size());
    for (std::size_t c : region) offsets.push_back(grid_.cells[c].offset);
    const double about = median(offsets);
    StepRegion step;
    std::vector<double> heights;
    double weights = 0, x = 0, y = 0, inside = 0;
    for (std::size_t c : region) {
      const Cell& cell = grid_.cells[c];
      if (cell.offset / about > kCore) {
        weights += 1.0 / (cell.centre_sigma * cell.centre_sigma);
        for (std::size_t i : grid_.rows_of(cell)) heights.push_back(height_of(i));
      }
      if (cell.offset / about > kInside) {
        step.solid_angle += grid_.solid_angle(cell);
        x += cell.x;
        y += cell.y;
        inside += 1.0;
      }
    }
    step.height = median(heights);
    step.azimuth = grid_.azimuth_at(x / inside);
    step.zenith = y / inside;
    step.significance = std::abs(step.height) * std::sqrt(weights);
    return step;
  }

  double height_of(std::size_t row) const {
    return residuals_.distance[row] - surface_(grid_.x_of(row), residuals_.zenith[row]);
  }

  /// Claims the cells of a step and the neighbours that share in it, and their rows. A high step
  /// determines by itself which rows of a cell on its border are its own.
  void take(std::vector<std::size_t> region, int place, StepRegion& step) {
    const double sign = step.height > 0 ? 1.0 : -1.0;
    for (std::size_t c : region) grid_.cells[c].region = place;
    const std::size_t size = region.size();
    for (std::size_t k = 0; k < size; ++k) {
      for (std::size_t next : grid_.around(grid_.cells[region[k]])) {
        Cell& cell = grid_.cells[next];
        if (cell.region >= 0 || !(sign * cell.z > kAround * surface_.spread())) continue;
        cell.region = place;
        region.push_back(next);
      }
    }
    for (std::size_t c : region) {
      const Cell& cell = grid_.cells[c];
      const bool border = cell.offset / step.height < kCore;
      for (std::size_t i : grid_.rows_of(cell)) {
        const bool is_clear = std::abs(step.height) > kSeparable * residuals_.sigma[i];
        if (border && is_clear && height_of(i) / step.height < 0.5) continue;
        step.rows.push_back(i);
      }
    }
    std::ranges::sort(step.rows);
    step.points = step.rows.size();
  }

  Grid& grid_;
  const SmoothSurface& surface_;
  const SurfaceResiduals& residuals_;
  double least_height_ = 0;
};

}  // namespace

SurfaceReport inspect_surface(const SurfaceResiduals& residuals) {
  const std::size_t size = residuals.distance.size();
  if (residuals.azimuth.size() != size || residuals.zenith.size() != size ||
      residuals.sigma.size() != size) {
    throw InvalidArgument(fmt::format(
        "surface residuals: {} azimuths, {} zeniths, {} distances and {} sigmas, expected the same "
        "number of each",
        residuals.azimuth.size(), residuals.zenith.size(), size, residuals.sigma.size()));
  }
  SurfaceReport report;
  Grid grid(residuals);
  report.cells = grid.full;
  if (grid.full >= kLeastCells[1]) {
    const SmoothSurface surface(grid.cells, grid.full);
    report.steps = StepSearch(grid, surface, residuals).run();
  }
  double normalized = 0, count = 0;
  for (const Cell& cell : grid.cells) {
    const auto around = grid.around(cell);
    // Cells beside a step hold some of its rows, too few to move their median.
    const bool step = cell.region >= 0 || std::ranges::any_of(around, [&](auto c) {
                        return grid.cells[c].region >= 0;
                      });
    if (!cell.full || step) continue;
    normalized += cell.mean * cell.mean / (cell.mean_sigma * cell.mean_sigma);
    count += 1.0;
  }
  if (count > 0) report.unevenness = normalized / count;
  return report;
}

}  // namespace risley::calibration
