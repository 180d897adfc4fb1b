// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/pattern_coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"

namespace risley::sensors {
namespace {

constexpr double kMostShots = 1e7;
constexpr double kFinest = radians_from_degrees(0.1);
constexpr std::uint64_t kChunk = 65'536;

/// A place in the map.
struct MapPoint {
  double left = 0, up = 0;
};

/// Lambert's equal-area maps in square cells, by rows: the azimuthal map about X; of a scan all
/// around the cylindrical one about Z, which is true to scale near kTrueElevation, where a whole
/// number of cells goes around.
class Grid {
 public:
  Grid(double cell, bool all_around) : cell_(cell), all_around_(all_around) {
    const double turn = kTwoPi * std::cos(kTrueElevation) / cell;
    columns_ = all_around ? std::max(1L, std::lround(turn)) : 2 * cells_to(2.0);
    if (all_around) scale_ = static_cast<double>(columns_) * cell / kTwoPi;
    rows_ = 2 * cells_to(all_around ? 1.0 / scale_ : 2.0);
  }

  double cell() const { return cell_; }
  bool all_around() const { return all_around_; }
  std::size_t size() const { return static_cast<std::size_t>(columns_ * rows_); }
  long columns() const { return columns_; }
  long rows() const { return rows_; }

  MapPoint mapped(const Vector3<double>& direction) const {
    if (all_around_)
      return {scale_ * angles_from_direction(direction).azimuth, direction.z / scale_};
    const double scale = std::sqrt(2.0 / (1.0 + direction.x));
    return {scale * direction.y, scale * direction.z};
  }
  Vector3<double> direction_at(const MapPoint& point) const {
    if (all_around_) {
      const double z = std::clamp(scale_ * point.up, -1.0, 1.0);
      return direction_from_angles(SphericalAngles<double>{point.left / scale_, std::acos(z)});
    }
    const double square = point.left * point.left + point.up * point.up;
    const double scale = std::sqrt(std::max(0.0, 1.0 - 0.25 * square));
    return {1.0 - 0.5 * square, scale * point.left, scale * point.up};
  }
  std::size_t of(const Vector3<double>& direction) const {
    const MapPoint point = mapped(direction);
    return static_cast<std::size_t>(place(point.up, rows_) * columns_ +
                                    place(point.left, columns_));
  }
  MapPoint centre(std::size_t cell) const {
    const long row = static_cast<long>(cell) / columns_,
               column = static_cast<long>(cell) % columns_;
    return {coordinate(column, columns_), coordinate(row, rows_)};
  }
  /// The least chord across one of many cells side by side over its edge, where none of them is
  /// farther than this from the horizon; of the azimuthal map within the half sphere.
  double narrowest(double greatest_elevation) const {
    if (!all_around_) return 0.5;
    return 2 / kPi * std::min(scale_, std::cos(greatest_elevation) / scale_);
  }

 private:
  static constexpr double kTrueElevation = radians_from_degrees(30.0);

  long cells_to(double end) const { return static_cast<long>(std::ceil(end / cell_)) + 1; }
  // An odd number of cells has one in the middle.
  double coordinate(long at, long count) const {
    return cell_ * (static_cast<double>(at) + 0.5 - 0.5 * static_cast<double>(count));
  }
  long place(double value, long count) const {
    const double at = std::floor(value / cell_ + (count % 2 == 0 ? 0.0 : 0.5));
    return std::clamp(static_cast<long>(at) + count / 2, 0L, count - 1);
  }

  double cell_;
  bool all_around_;
  double scale_ = 1;
  long columns_ = 0, rows_ = 0;
};

/// Calls visit(direction, row) for rows [first, last) of the pattern that get through the prisms.
template <class Visit>
void each_direction(const Sensor& sensor, const ScanPatternOptions& scan, std::uint64_t first,
                    std::uint64_t last, const Progress& progress, Visit visit) {
  for (std::uint64_t row = first; row < last; row += kChunk) {
    progress.report(static_cast<double>(row - first) / static_cast<double>(last - first));
    const ScanPattern pattern =
        scan_pattern(sensor, row, static_cast<std::size_t>(std::min(kChunk, last - row)), scan);
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      if (std::isnan(pattern.azimuth[i])) continue;
      visit(direction_from_angles(SphericalAngles<double>{pattern.azimuth[i], pattern.zenith[i]}),
            row + i);
    }
  }
}

/// Directions by the cell of the map they lie in.
class Neighbours {
 public:
  /// @param narrowest  as Grid has it
  Neighbours(const Grid& grid, double narrowest, const std::vector<Vector3<double>>& directions,
             const std::vector<std::uint32_t>& counts)
      : grid_(grid),
        narrowest_(narrowest * grid.cell()),
        first_(counts.size() + 1),
        sorted_(directions.size()) {
    std::partial_sum(counts.begin(), counts.end(), first_.begin() + 1);
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (const auto& direction : directions) sorted_[next[grid.of(direction)]++] = direction;
  }

  /// Angle to the nearest of them, rad; the search stops as soon as it is less than `enough`.
  double nearest(const Vector3<double>& own, double enough) const {
    const auto centre = static_cast<long>(grid_.of(own));
    const long columns = grid_.columns(), rows = grid_.rows();
    const long x = centre % columns, y = centre / columns;
    double best = std::numeric_limits<double>::infinity();  // square of a chord
    const double enough_chord = 4 * std::pow(std::sin(0.5 * enough), 2);
    for (long ring = 0; ring < std::max(columns, rows); ++ring) {
      const double within = narrowest_ * static_cast<double>(ring - 1);
      if (ring > 1 && best < std::pow(within, 2)) break;
      for (long j = std::max(0L, y - ring); j <= std::min(rows - 1, y + ring); ++j) {
        const bool whole = std::abs(j - y) == ring;
        for (long i = x - ring; i <= x + ring; i += whole ? 1 : std::max(1L, 2 * ring)) {
          const bool beyond = i < 0 || i >= columns;
          if (beyond && !grid_.all_around()) continue;
          const long column = beyond ? (i % columns + columns) % columns : i;
          const auto at = static_cast<std::size_t>(j * columns + column);
          for (std::size_t k = first_[at]; k < first_[at + 1]; ++k) {
            const Vector3<double> apart = sorted_[k] - own;
            best = std::min(best, dot(apart, apart));
          }
        }
      }
      if (best < enough_chord) break;
    }
    return 2 * std::asin(std::min(1.0, 0.5 * std::sqrt(best)));
  }

 private:
  const Grid& grid_;
  double narrowest_;
  std::vector<std::uint32_t> first_;
  std::vector<Vector3<double>> sorted_;
};

/// The largest empty circle about one of the directions.
void find_gap(CoverageAfter& result, const std::vector<Vector3<double>>& field,
              const Neighbours& shots) {
  const Vector3<double>* best = &field.front();
  double radius = 0;
  for (const Vector3<double>& centre : field) {
    const double here = shots.nearest(centre, radius);
    if (here <= radius) continue;
    radius = here;
    best = &centre;
  }
  const SphericalAngles<double> angles = angles_from_direction(*best);
  result.gap = 2 * radius;
  result.gap_azimuth = angles.azimuth;
  result.gap_zenith = angles.zenith;
}

void check(const CoverageOptions& options, double rows_per_second) {
  require_at_least("integration times", static_cast<long long>(options.after.size()), 1);
  double before = 0;
  for (const double time : options.after) {
    require_above("integration time", time, before, "s");
    require_between("integration time", time, 0, kMostShots / rows_per_second, "s");
    before = time;
  }
  require_above("field_after", options.field_after, 0, "s");
  require_between("cell", degrees_from_radians(options.cell), 0.1, 30, "deg");
  require_between("ring", degrees_from_radians(options.ring), 0.1, 30, "deg");
}

}  // namespace

double PatternCoverage::time_to_cover(double share) const {
  require_between("share", share, 0, 1);
  std::vector<double> times = first_shot;
  const auto wanted =
      static_cast<std::size_t>(std::ceil(share * static_cast<double>(times.size()) * (1 - 1e-12)));
  if (wanted == 0) return 0;
  return nth_value(times, wanted - 1);
}

PatternCoverage pattern_coverage(const Sensor& sensor, const ScanPatternOptions& scan,
                                 const CoverageOptions& options, const Progress& progress) {
  scan_pattern(sensor, 0, 1, scan);  // reports the defect of the scan
  const double rows_per_second =
      scan.shot_rate.value_or(sensor.shot_rate) / static_cast<double>(scan.every);
  check(options, rows_per_second);
  const auto rows_after = [&](double time) {
    return static_cast<std::uint64_t>(std::llround(time * rows_per_second));
  };
  PatternCoverage result;
  result.cell = options.cell;
  result.ring = options.ring;
  result.field_after =
      std::max(options.after.back(), std::min(options.field_after, kMostShots / rows_per_second));
  result.all_around = sensor.train.layout().axis_up;
  const Grid grid(options.cell, result.all_around);

  // One direction of every small cell: possible centres of circles without a shot.
  const Grid fine(std::max(0.25 * options.cell, kFinest), result.all_around);
  std::vector<char> in_field(grid.size()), seen(fine.size());
  std::vector<Vector3<double>> centres;
  const auto along_axis = [&](const Vector3<double>& direction) {
    return result.all_around ? direction.z : direction.x;
  };
  double least = 1, greatest = -1;  // along the axis
  each_direction(sensor, scan, 0, rows_after(result.field_after), progress.part(0, 0.6),
                 [&](const Vector3<double>& direction, std::uint64_t) {
                   in_field[grid.of(direction)] = 1;
                   least = std::min(least, along_axis(direction));
                   greatest = std::max(greatest, along_axis(direction));
                   if (std::exchange(seen[fine.of(direction)], 1) == 0)
                     centres.push_back(direction);
                 });
  std::vector<std::size_t> field;
  for (std::size_t at = 0; at < grid.size(); ++at) {
    if (in_field[at] != 0) field.push_back(at);
  }
  if (field.empty()) throw EstimationError("no beam passes through the prisms");
  const double cell_angle = options.cell * options.cell;
  result.field_solid_angle = static_cast<double>(field.size()) * cell_angle;
  result.field_half_angle = std::acos(std::clamp(least, -1.0, 1.0));
  result.field_inner_angle = std::acos(std::clamp(greatest, -1.0, 1.0));
  const double narrowest = grid.narrowest(
      std::max(kPi / 2 - result.field_inner_angle, result.field_half_angle - kPi / 2));
  std::vector<std::size_t> ring_of;
  std::vector<double> ring_angle;
  for (const std::size_t at : field) {
    const MapPoint centre = grid.centre(at);
    const Vector3<double> direction = grid.direction_at(centre);
    const SphericalAngles<double> angles = angles_from_direction(direction);
    result.left.push_back(centre.left);
    result.up.push_back(centre.up);
    result.azimuth.push_back(angles.azimuth);
    result.zenith.push_back(angles.zenith);
    const double from_axis = std::acos(std::clamp(along_axis(direction), -1.0, 1.0));
    ring_of.push_back(static_cast<std::size_t>(from_axis / options.ring));
    if (ring_angle.size() <= ring_of.back()) ring_angle.resize(ring_of.back() + 1);
    ring_angle[ring_of.back()] += cell_angle;
  }

  std::vector<Vector3<double>> directions;
  std::vector<std::uint32_t> counts(grid.size());
  std::vector<double> first_shot(grid.size(), std::numeric_limits<double>::infinity());
  std::uint64_t done = 0;
  for (std::size_t k = 0; k < options.after.size(); ++k) {
    const std::uint64_t rows = rows_after(options.after[k]);
    const auto share = [&](double part) {
      return 0.6 + 0.4 * (static_cast<double>(k) + part) / double(options.after.size());
    };
    each_direction(sensor, scan, done, std::max(rows, done), progress.part(share(0), share(0.5)),
                   [&](const Vector3<double>& direction, std::uint64_t row) {
                     directions.push_back(direction);
                     const std::size_t at = grid.of(direction);
                     if (counts[at]++ == 0) {
                       first_shot[at] = static_cast<double>(row + 1) / rows_per_second;
                     }
                   });
    done = rows;
    CoverageAfter now;
    now.time = options.after[k];
    now.shots = directions.size();
    std::uint64_t covered = 0;
    std::uint32_t fewest = std::numeric_limits<std::uint32_t>::max(), most = 0;
    now.ring_density.assign(ring_angle.size(), 0.0);
    for (std::size_t i = 0; i < field.size(); ++i) {
      const std::uint32_t count = counts[field[i]];
      now.cell_shots.push_back(count);
      covered += count > 0 ? 1 : 0;
      fewest = std::min(fewest, count);
      most = std::max(most, count);
      now.ring_density[ring_of[i]] += count;
    }
    for (std::size_t i = 0; i < ring_angle.size(); ++i) {
      now.ring_density[i] = ring_angle[i] > 0 ? now.ring_density[i] / ring_angle[i]
                                              : std::numeric_limits<double>::quiet_NaN();
    }
    now.covered = static_cast<double>(covered) / static_cast<double>(field.size());
    now.mean_density = static_cast<double>(now.shots) / result.field_solid_angle;
    now.least_density = fewest / cell_angle;
    now.greatest_density = most / cell_angle;
    if (directions.empty()) {
      now.gap = now.gap_azimuth = now.gap_zenith = std::numeric_limits<double>::quiet_NaN();
    } else {
      find_gap(now, centres, Neighbours(grid, narrowest, directions, counts));
    }
    progress.report(share(1));
    result.after.push_back(std::move(now));
  }
  for (const std::size_t at : field) result.first_shot.push_back(first_shot[at]);
  return result;
}

}  // namespace risley::sensors
