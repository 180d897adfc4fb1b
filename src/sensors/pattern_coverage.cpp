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

MapPoint mapped(const Vector3<double>& direction) {
  const double scale = std::sqrt(2.0 / (1.0 + direction.x));
  return {scale * direction.y, scale * direction.z};
}

Vector3<double> direction_at(const MapPoint& point) {
  const double square = point.left * point.left + point.up * point.up;
  const double scale = std::sqrt(std::max(0.0, 1.0 - 0.25 * square));
  return {1.0 - 0.5 * square, scale * point.left, scale * point.up};
}

/// The cells of the map, by rows.
class Grid {
 public:
  explicit Grid(double cell)
      : cell_(cell), half_(static_cast<long>(std::ceil(2.0 / cell)) + 1), width_(2 * half_) {}

  double cell() const { return cell_; }
  std::size_t size() const { return static_cast<std::size_t>(width_ * width_); }
  std::size_t width() const { return static_cast<std::size_t>(width_); }
  std::size_t of(const MapPoint& point) const {
    return static_cast<std::size_t>((row(point.up) * width_) + row(point.left));
  }
  MapPoint centre(std::size_t cell) const {
    const long row = static_cast<long>(cell) / width_, column = static_cast<long>(cell) % width_;
    return {cell_ * (static_cast<double>(column - half_) + 0.5),
            cell_ * (static_cast<double>(row - half_) + 0.5)};
  }

 private:
  long row(double value) const {
    return std::clamp(static_cast<long>(std::floor(value / cell_)) + half_, 0L, width_ - 1);
  }
  double cell_;
  long half_, width_;
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
  Neighbours(const Grid& grid, const std::vector<Vector3<double>>& directions,
             const std::vector<std::uint32_t>& counts)
      : grid_(grid), first_(counts.size() + 1), sorted_(directions.size()) {
    std::partial_sum(counts.begin(), counts.end(), first_.begin() + 1);
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (const auto& direction : directions)
      sorted_[next[grid.of(mapped(direction))]++] = direction;
  }

  /// Angle to the nearest of them, rad; stops looking as soon as it is less than `enough`.
  double nearest(const Vector3<double>& own, double enough) const {
    const std::size_t centre = grid_.of(mapped(own));
    const auto width = static_cast<long>(grid_.width());
    const long x = static_cast<long>(centre) % width, y = static_cast<long>(centre) / width;
    double best = std::numeric_limits<double>::infinity();  // square of a chord
    const double enough_chord = 4 * std::pow(std::sin(0.5 * enough), 2);
    for (long ring = 0; ring < width; ++ring) {
      // A cell of the map is nowhere narrower than half its edge within the half sphere.
      const double within = 0.5 * static_cast<double>(ring - 1) * grid_.cell();
      if (ring > 1 && best < std::pow(within, 2)) break;
      for (long j = std::max(0L, y - ring); j <= std::min(width - 1, y + ring); ++j) {
        const bool whole = std::abs(j - y) == ring;
        for (long i = x - ring; i <= x + ring; i += whole ? 1 : std::max(1L, 2 * ring)) {
          if (i < 0 || i >= width) continue;
          const auto at = static_cast<std::size_t>(j * width + i);
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
  scan_pattern(sensor, 0, 1, scan);  // says what is wrong with the scan
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
  const Grid grid(options.cell);

  // One direction of every small cell: where circles without a shot may have their centre.
  const Grid fine(std::max(0.25 * options.cell, kFinest));
  std::vector<char> in_field(grid.size()), seen(fine.size());
  std::vector<Vector3<double>> centres;
  double least_x = 1;
  each_direction(sensor, scan, 0, rows_after(result.field_after), progress.part(0, 0.6),
                 [&](const Vector3<double>& direction, std::uint64_t) {
                   const MapPoint place = mapped(direction);
                   in_field[grid.of(place)] = 1;
                   least_x = std::min(least_x, direction.x);
                   if (std::exchange(seen[fine.of(place)], 1) == 0) centres.push_back(direction);
                 });
  std::vector<std::size_t> field;
  for (std::size_t at = 0; at < grid.size(); ++at) {
    if (in_field[at] != 0) field.push_back(at);
  }
  if (field.empty()) throw EstimationError("no beam passes through the prisms");
  const double cell_angle = options.cell * options.cell;
  result.field_solid_angle = static_cast<double>(field.size()) * cell_angle;
  result.field_half_angle = std::acos(std::clamp(least_x, -1.0, 1.0));
  std::vector<std::size_t> ring_of;
  std::vector<double> ring_angle;
  for (const std::size_t at : field) {
    const MapPoint centre = grid.centre(at);
    const Vector3<double> direction = direction_at(centre);
    const SphericalAngles<double> angles = angles_from_direction(direction);
    result.left.push_back(centre.left);
    result.up.push_back(centre.up);
    result.azimuth.push_back(angles.azimuth);
    result.zenith.push_back(angles.zenith);
    const double from_axis = std::acos(std::clamp(direction.x, -1.0, 1.0));
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
                     const std::size_t at = grid.of(mapped(direction));
                     if (counts[at]++ == 0) {
                       first_shot[at] = static_cast<double>(row + 1) / rows_per_second;
                     }
                   });
    done = rows;
    CoverageAfter now;
    now.time = options.after[k];
    now.shots = directions.size();
    std::uint64_t covered = 0;
    std::uint32_t least = std::numeric_limits<std::uint32_t>::max(), greatest = 0;
    now.ring_density.assign(ring_angle.size(), 0.0);
    for (std::size_t i = 0; i < field.size(); ++i) {
      const std::uint32_t count = counts[field[i]];
      now.cell_shots.push_back(count);
      covered += count > 0 ? 1 : 0;
      least = std::min(least, count);
      greatest = std::max(greatest, count);
      now.ring_density[ring_of[i]] += count;
    }
    for (std::size_t i = 0; i < ring_angle.size(); ++i) {
      now.ring_density[i] = ring_angle[i] > 0 ? now.ring_density[i] / ring_angle[i]
                                              : std::numeric_limits<double>::quiet_NaN();
    }
    now.covered = static_cast<double>(covered) / static_cast<double>(field.size());
    now.mean_density = static_cast<double>(now.shots) / result.field_solid_angle;
    now.least_density = least / cell_angle;
    now.greatest_density = greatest / cell_angle;
    if (directions.empty()) {
      now.gap = now.gap_azimuth = now.gap_zenith = std::numeric_limits<double>::quiet_NaN();
    } else {
      find_gap(now, centres, Neighbours(grid, directions, counts));
    }
    progress.report(share(1));
    result.after.push_back(std::move(now));
  }
  for (const std::size_t at : field) result.first_shot.push_back(first_shot[at]);
  return result;
}

}  // namespace risley::sensors
