// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/surface_change.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "risley/algebra/distributions.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/cloud/point_covariance.hpp"
#include "risley/cloud/pointing_model.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/square.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::cloud {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Fewer points determine neither a mean nor its scatter.
constexpr std::size_t kFewest = 6;
/// Of more, every n-th is used: their mean is already better than their common error.
constexpr std::size_t kMost = 400;
/// A surface is thinner than this share of its width.
constexpr double kThickness = 0.35;
/// Points this many scatters from the middle belong to another object.
constexpr double kOffSurface = 4;
/// Number of points for which the trajectory's errors are evaluated: they change slowly.
constexpr std::size_t kOfTrajectory = 24;

using Place = std::array<float, 3>;

/// Points sorted by cell.
class CellIndex {
 public:
  using Key = std::array<std::int32_t, 3>;

  CellIndex(std::vector<Place> places, double cell) : places_(std::move(places)), cell_(cell) {
    rows_.resize(places_.size());
    std::vector<Key> keys(places_.size());
    for (std::size_t i = 0; i < places_.size(); ++i) {
      rows_[i] = static_cast<std::uint32_t>(i);
      keys[i] = key_of({places_[i][0], places_[i][1], places_[i][2]});
    }
    std::ranges::sort(rows_, [&](std::uint32_t i, std::uint32_t j) {
      return keys[i] != keys[j] ? keys[i] < keys[j] : i < j;
    });
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (cells_.empty() || cells_.back().first != keys[rows_[i]]) {
        cells_.emplace_back(keys[rows_[i]], i);
      }
    }
  }

  std::size_t cells() const { return cells_.size(); }
  /// Rows of the points of a cell, by its number.
  std::span<const std::uint32_t> rows(std::size_t cell) const {
    const std::size_t begin = cells_[cell].second;
    const std::size_t end = cell + 1 < cells_.size() ? cells_[cell + 1].second : rows_.size();
    return std::span(rows_).subspan(begin, end - begin);
  }
  Vector3d place(std::uint32_t row) const {
    return {places_[row][0], places_[row][1], places_[row][2]};
  }
  Key key_of(const Vector3d& place) const {
    Key key;
    for (std::size_t k = 0; k < 3; ++k) {
      key[k] = static_cast<std::int32_t>(std::floor(place[static_cast<Index>(k)] / cell_));
    }
    return key;
  }

  /// Rows of the points within a cylinder about a place.
  /// @param axis  unit vector  @param half  of its length
  std::vector<std::uint32_t> in_cylinder(const Vector3d& middle, const Vector3d& axis,
                                         double radius, double half) const {
    std::vector<std::uint32_t> found;
    const Vector3d wide = Vector3d::Constant(radius) + half * axis.cwiseAbs();
    const Key low = key_of(middle - wide), high = key_of(middle + wide);
    for (std::int32_t x = low[0]; x <= high[0]; ++x) {
      for (std::int32_t y = low[1]; y <= high[1]; ++y) {
        // Cells of one x and y follow each other by z.
        auto at = std::ranges::lower_bound(cells_, Key{x, y, low[2]}, {},
                                           &std::pair<Key, std::size_t>::first);
        for (; at != cells_.end() && at->first <= Key{x, y, high[2]}; ++at) {
          for (const std::uint32_t row : rows(static_cast<std::size_t>(at - cells_.begin()))) {
            const Vector3d off = place(row) - middle;
            const double along = off.dot(axis);
            if (std::abs(along) > half || off.squaredNorm() - square(along) > square(radius)) {
              continue;
            }
            found.push_back(row);
          }
        }
      }
    }
    std::ranges::sort(found);
    return found;
  }

 private:
  std::vector<Place> places_;
  double cell_;
  std::vector<std::uint32_t> rows_;
  std::vector<std::pair<Key, std::size_t>> cells_;  ///< with their first place in rows_, ascending
};

/// Points of one cloud on a piece of surface.
struct Patch {
  Points points;
  std::vector<double> height;   ///< along the normal, m
  std::vector<Vector2d> aside;  ///< across it, m
  std::vector<double> weight;   ///< of each height in the distance
  double mean = 0;
  Vector2d middle{0, 0};

  std::size_t size() const { return height.size(); }
};

/// Two directions across a normal.
Eigen::Matrix<double, 3, 2> across(const Vector3d& normal) {
  Index least = 0;
  normal.cwiseAbs().minCoeff(&least);
  Eigen::Matrix<double, 3, 2> axes;
  axes.col(0) = normal.cross(Vector3d::Unit(least)).normalized();
  axes.col(1) = normal.cross(axes.col(0));
  return axes;
}

/// Removes outliers of the heights, then thins.
std::vector<std::size_t> on_surface(const CellIndex& index, std::vector<std::uint32_t> rows,
                                    const Vector3d& middle, const Vector3d& normal) {
  std::vector<std::size_t> kept;
  if (rows.size() < kFewest) return kept;
  std::vector<double> height, off;
  for (const std::uint32_t row : rows) height.push_back(normal.dot(index.place(row) - middle));
  std::vector<double> ordered = height;
  const double center = upper_median(ordered);
  for (const double h : height) off.push_back(std::abs(h - center));
  const double limit = kOffSurface * kSigmaOverMedianDistance * upper_median(off);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (std::abs(height[i] - center) <= limit) kept.push_back(rows[i]);
  }
  if (kept.size() <= kMost) return kept;
  std::vector<std::size_t> thinned;
  for (std::size_t i = 0; i < kMost; ++i) thinned.push_back(kept[i * kept.size() / kMost]);
  return thinned;
}

Patch patch_of(const CloudFile& file, const std::vector<std::size_t>& rows, const Vector3d& middle,
               const Vector3d& normal) {
  Patch patch;
  patch.points = file.points(rows);
  const Eigen::Matrix<double, 3, 2> axes = across(normal);
  const auto n = static_cast<double>(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Vector3d off = Vector3d(patch.points.x[i], patch.points.y[i], patch.points.z[i]) - middle;
    patch.height.push_back(normal.dot(off));
    patch.aside.emplace_back(axes.transpose() * off);
    patch.mean += patch.height.back() / n;
    patch.middle += patch.aside.back() / n;
  }
  return patch;
}

/// n' C n of one row of six columns.
double along(const std::array<std::vector<double>, kCovarianceTerms>& c, std::size_t row,
             const Vector3d& n) {
  return n.x() * n.x() * c[kXX][row] + n.y() * n.y() * c[kYY][row] + n.z() * n.z() * c[kZZ][row] +
         2 * (n.x() * n.y() * c[kXY][row] + n.x() * n.z() * c[kXZ][row] +
              n.y() * n.z() * c[kYZ][row]);
}

/// Variance of a weighted sum of heights due to the trajectory's errors.
double of_trajectory(const Patch& patch, const TrajectoryErrors& errors, const Vector3d& normal) {
  Points bare = patch.points;
  bare.loading.clear();
  for (auto& column : bare.own_covariance) column.assign(patch.size(), 0.0);
  std::vector<std::size_t> rows;
  const std::size_t n = std::min(kOfTrajectory, patch.size());
  double chosen = 0, all = 0;
  for (std::size_t i = 0; i < n; ++i) rows.push_back(i * patch.size() / n);
  for (const std::size_t row : rows) chosen += patch.weight[row];
  for (const double weight : patch.weight) all += weight;
  Eigen::VectorXd weights(3 * std::ssize(rows));
  for (std::size_t i = 0; i < n; ++i) {
    weights.segment<3>(3 * static_cast<Index>(i)) = all / chosen * patch.weight[rows[i]] * normal;
  }
  return weights.dot(joint_covariance(bare, errors, rows) * weights);
}

/// Common errors of a cloud's points, and each point's own.
struct Shared {
  double own = 0, own_expected = 0;  ///< variance of the sum, and of a point
  double variance = 0;               ///< of the sum, without the factors of both clouds
  std::vector<double> factor;        ///< effect of one sigma of each factor of the cloud on the sum
};

Shared shared_of(const CloudFile& file, const Patch& patch, const Vector3d& normal) {
  Shared result;
  const std::size_t factors = file.factors().size();
  const std::size_t of_all = factors - file.factors_of_source();
  const bool has_own = !patch.points.own_covariance[kXX].empty();
  result.factor.assign(of_all, 0.0);
  std::map<std::uint16_t, std::vector<double>> of_source;
  double unknown = 0;
  const auto& errors = file.trajectory();
  for (std::size_t i = 0; i < patch.size(); ++i) {
    const double whole = along(patch.points.covariance, i, normal);
    double own = has_own ? along(patch.points.own_covariance, i, normal) : 0.0;
    double told = 0;
    auto& own_source = of_source[patch.points.point_source[i]];
    own_source.resize(factors - of_all, 0.0);
    for (std::size_t k = 0; k < factors; ++k) {
      const auto& f = patch.points.loading[k];
      const double moved = normal.x() * f[0][i] + normal.y() * f[1][i] + normal.z() * f[2][i];
      (k < of_all ? result.factor[k] : own_source[k - of_all]) += patch.weight[i] * moved;
      told += square(moved);
    }
    // A cloud with loadings but without own covariances: the rest is its own.
    if (!has_own && factors > 0) own = std::max(0.0, whole - told);
    result.own += square(patch.weight[i]) * own;
    result.own_expected += own / static_cast<double>(patch.size());
    if (factors == 0) {
      unknown += std::abs(patch.weight[i]) * std::sqrt(std::max(0.0, whole - own));
    }
  }
  result.variance = square(unknown);
  for (const auto& [source, sums] : of_source) {
    for (const double sum : sums) result.variance += square(sum);
  }
  if (errors && factors > 0) result.variance += of_trajectory(patch, *errors, normal);
  return result;
}

/// Common factors that are the same in both clouds, by their places: from one calibration, and from
/// one set of targets.
std::vector<std::pair<std::size_t, std::size_t>> same_factors(const CloudFile& a,
                                                              const CloudFile& b) {
  const auto is_same = [](const std::string& of_a, const std::string& of_b) {
    return !of_a.empty() && of_a == of_b;
  };
  const bool calibration = is_same(a.calibration(), b.calibration());
  const bool targets = is_same(a.targets(), b.targets());
  std::vector<std::pair<std::size_t, std::size_t>> same;
  const std::size_t of_a = a.factors().size() - a.factors_of_source();
  const std::size_t of_b = b.factors().size() - b.factors_of_source();
  for (std::size_t i = 0; i < of_a; ++i) {
    const std::string& name = a.factors()[i];
    if (!(name.starts_with(kTargets) ? targets : calibration)) continue;
    // Factors of a recording's rotors, and of a mount that may have been another one.
    if (name.starts_with("rotation_angle_") || name.starts_with("boresight_") ||
        name.starts_with("lever_arm_") || name.starts_with("clock_offset_")) {
      continue;
    }
    const auto end = b.factors().begin() + static_cast<std::ptrdiff_t>(of_b);
    const auto at = std::find(b.factors().begin(), end, name);
    if (at != end) same.emplace_back(i, static_cast<std::size_t>(at - b.factors().begin()));
  }
  return same;
}

/// Why a cell has no distance.
enum class Without { nothing, surface, points };

class Comparison {
 public:
  Comparison(const CloudFile& a, const CloudFile& b, const ChangeOptions& options,
             const Progress& progress)
      : a_(a),
        b_(b),
        options_(options),
        offset_(offset_of(a)),
        in_a_(a.coordinates(offset_, progress.part(0, 0.1)), options.cell),
        in_b_(b.coordinates(offset_, progress.part(0.1, 0.2)), options.cell),
        same_(same_factors(a, b)) {}

  std::size_t cells() const { return in_a_.cells(); }
  std::size_t shared() const { return same_.size(); }

  /// The distance at a cell. @param without  why there is none
  std::optional<SurfaceCell> at(std::size_t number, Without& without) const {
    without = Without::points;
    const std::span<const std::uint32_t> own = in_a_.rows(number);
    if (own.size() < kFewest) return std::nullopt;
    Vector3d middle = Vector3d::Zero();
    for (const std::uint32_t row : own) middle += in_a_.place(row) / double(own.size());
    const std::optional<Vector3d> normal = normal_at(middle);
    if (!normal) {
      without = Without::surface;
      return std::nullopt;
    }
    const double radius = 0.5 * options_.cell;
    const auto rows = [&](const CellIndex& index, double half) {
      return on_surface(index, index.in_cylinder(middle, *normal, radius, half), middle, *normal);
    };
    const std::vector<std::size_t> rows_a = rows(in_a_, radius),
                                   rows_b = rows(in_b_, options_.reach);
    if (rows_a.size() < kFewest || rows_b.size() < kFewest) return std::nullopt;
    const Vector3d place = middle + Vector3d(offset_[0], offset_[1], offset_[2]);
    std::array<Patch, 2> patches{patch_of(a_, rows_a, place, *normal),
                                 patch_of(b_, rows_b, place, *normal)};
    SurfaceCell cell;
    cell.place = place;
    cell.normal = *normal;
    cell.points_a = rows_a.size();
    cell.points_b = rows_b.size();
    measure(patches, cell);
    without = Without::nothing;
    return cell;
  }

 private:
  static std::array<double, 3> offset_of(const CloudFile& a) {
    if (a.size() == 0) return {};
    const std::size_t middle = a.size() / 2;
    const Points one = a.points({&middle, 1});
    return {std::round(one.x[0]), std::round(one.y[0]), std::round(one.z[0])};
  }

  /// The normal of the surface about a place, if there is a surface.
  std::optional<Vector3d> normal_at(const Vector3d& middle) const {
    const double radius = options_.cell;
    std::vector<Vector3d> near;
    for (const std::uint32_t row : in_a_.in_cylinder(middle, Vector3d::UnitZ(), radius, radius)) {
      const Vector3d off = in_a_.place(row) - middle;
      if (off.squaredNorm() < square(radius)) near.push_back(off);
    }
    Vector3d mean = Vector3d::Zero();
    for (const Vector3d& off : near) mean += off / double(near.size());
    Matrix3d spread = Matrix3d::Zero();
    for (const Vector3d& off : near) spread += (off - mean) * (off - mean).transpose();
    const algebra::PrincipalAxes axes = algebra::principal_axes(spread);
    if (!(axes.values[0] < square(kThickness) * axes.values[1])) return std::nullopt;
    Vector3d normal = axes.vectors.col(0);
    Index largest = 2;
    if (std::abs(normal.z()) < 0.1) normal.head<2>().cwiseAbs().maxCoeff(&largest);
    if (normal[largest] < 0) normal = -normal;
    return normal;
  }

  /// The distance and its sigma. Both patches have the same slope: its effect on points that are
  /// not above each other is removed.
  void measure(std::array<Patch, 2>& patches, SurfaceCell& cell) const {
    Matrix2d spread = Matrix2d::Zero();
    Vector2d moment = Vector2d::Zero();
    for (const Patch& patch : patches) {
      for (std::size_t i = 0; i < patch.size(); ++i) {
        const Vector2d off = patch.aside[i] - patch.middle;
        spread += off * off.transpose();
        moment += off * patch.height[i];
      }
    }
    const Matrix2d inverse = spread.inverse();
    const Vector2d slope = inverse * moment, apart = patches[1].middle - patches[0].middle;
    cell.distance = patches[1].mean - patches[0].mean - slope.dot(apart);
    std::array<Shared, 2> shared;
    double variance = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      Patch& patch = patches[k];
      const auto n = static_cast<double>(patch.size());
      double squares = 0;
      for (std::size_t i = 0; i < patch.size(); ++i) {
        const Vector2d off = patch.aside[i] - patch.middle;
        patch.weight.push_back((k == 0 ? -1 : 1) / n - apart.dot(inverse * off));
        squares += square(patch.height[i] - patch.mean - slope.dot(off));
      }
      shared[k] = shared_of(k == 0 ? a_ : b_, patch, cell.normal);
      // Rough ground scatters more than its points' own errors.
      const double scatter = squares / (n - 2);
      const double rough = shared[k].own_expected > 0 ? scatter / shared[k].own_expected : 1;
      double own = shared[k].own * std::max(1.0, rough);
      if (shared[k].own == 0) {  // the cloud does not state it: as large as the scatter
        for (const double weight : patch.weight) own += square(weight) * scatter;
      }
      variance += own + shared[k].variance;
    }
    for (const auto& [of_a, of_b] : same_) {
      variance += square(shared[0].factor[of_a] + shared[1].factor[of_b]);
      shared[0].factor[of_a] = shared[1].factor[of_b] = 0;
    }
    for (const Shared& one : shared) {
      for (const double moved : one.factor) variance += square(moved);
    }
    cell.sigma = std::sqrt(variance);
  }

  const CloudFile& a_;
  const CloudFile& b_;
  const ChangeOptions& options_;
  std::array<double, 3> offset_;
  CellIndex in_a_, in_b_;
  std::vector<std::pair<std::size_t, std::size_t>> same_;
};

}  // namespace

SurfaceChange surface_change(const CloudFile& a, const CloudFile& b, const ChangeOptions& options,
                             const Progress& progress) {
  require_between(kSetting.cell_size, options.cell, 0.01, 100);
  require_between(kSetting.reach, options.reach, 0.01, 100);
  require_between(kSetting.false_alarm, options.false_alarm, 1e-9, 0.5);
  if (a.frame() != b.frame()) {
    throw InvalidArgument(
        fmt::format("{} and {} are in different frames or on different maps: make one of them "
                    "again with the {} of the other",
                    a.path(), b.path(), name_of(kSetting.crs)));
  }
  const Comparison comparison(a, b, options, progress);
  std::vector<std::optional<SurfaceCell>> found(comparison.cells());
  std::vector<Without> without(found.size());
  constexpr std::size_t kBlock = 256;
  const std::size_t blocks = (found.size() + kBlock - 1) / kBlock;
  for (std::size_t first = 0; first < blocks; first += 64) {
    const std::size_t some = std::min<std::size_t>(64, blocks - first);
    progress.report(0.2 + 0.8 * static_cast<double>(first) / static_cast<double>(blocks));
    parallel::for_each(some, [&](std::size_t block) {
      const std::size_t begin = (first + block) * kBlock;
      for (std::size_t i = begin; i < std::min(begin + kBlock, found.size()); ++i) {
        found[i] = comparison.at(i, without[i]);
      }
    });
  }
  SurfaceChange change;
  change.critical = algebra::two_sided_normal_quantile(options.false_alarm);
  change.shared = comparison.shared();
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (without[i] == Without::surface) ++change.uneven;
    if (without[i] == Without::points) ++change.unseen;
    if (!found[i]) continue;
    found[i]->significant = std::abs(found[i]->distance) > change.critical * found[i]->sigma;
    change.significant += found[i]->significant ? 1 : 0;
    change.cells.push_back(*found[i]);
  }
  if (change.cells.empty()) {
    throw InvalidArgument(
        fmt::format("{} and {} have no surface in common: no cell of {:g} m with {} points of each",
                    a.path(), b.path(), options.cell, kFewest));
  }
  change.significant /= static_cast<double>(change.cells.size());
  for (const CloudFile* file : {&a, &b}) {
    if (!file->factors().empty()) continue;
    warn(change.warnings, kWarning.common_errors_unknown,
         "{} does not state the common errors of its points ({} yes): all errors but those of "
         "single points count as common, so the level of detection is too large",
         file->path(), name_of(kSetting.common_factors));
  }
  return change;
}

}  // namespace risley::cloud
