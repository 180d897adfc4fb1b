// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/calibration_details.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "risley/calibration/surface_steps.hpp"
#include "risley/core/direction.hpp"

namespace risley::jobs {
namespace {

using calibration::Calibration;
using calibration::kSurfaceCell;

constexpr int kFewestPointsInCell = 5;  // points that make a mean over a cell of the field of view
constexpr std::size_t kMostSpaces = 3;  // recordings shown in space

bool is_complete(const SamplePoint& point) {
  return std::isfinite(point.before + point.after + point.azimuth + point.zenith);
}

long cell_of(double angle) { return std::lround(std::floor(angle / kSurfaceCell)); }

/// Means of two quantities over cells of the field of view.
class FieldMeans {
 public:
  void add(double azimuth, double zenith, double first, double second) {
    Sum& sum = sums_[{cell_of(azimuth), cell_of(zenith)}];
    ++sum.count;
    sum.first += first;
    sum.second += second;
  }
  /// Passes every cell with enough points to function(count, mean of the first, of the second).
  template <class Function>
  FieldCells for_each(int fewest, Function&& function) const {
    FieldCells cells{kSurfaceCell, {}, {}};
    for (const auto& [place, sum] : sums_) {
      if (sum.count < fewest) continue;
      cells.azimuth.push_back(kSurfaceCell * (static_cast<double>(place.first) + 0.5));
      cells.zenith.push_back(kSurfaceCell * (static_cast<double>(place.second) + 0.5));
      function(sum.count, sum.first / sum.count, sum.second / sum.count);
    }
    return cells;
  }

 private:
  struct Sum {
    int count = 0;
    double first = 0, second = 0;
  };
  std::map<std::pair<long, long>, Sum> sums_;
};

/// Distances of points from their planes over the field of view, beyond or in front.
std::optional<WallField> wall_field(const std::vector<const SamplePoint*>& points) {
  WallField result;
  result.fewest_points = kFewestPointsInCell;
  FieldMeans means;
  double squares = 0;
  for (const SamplePoint* point : points) {
    if (!is_complete(*point)) continue;
    means.add(point->azimuth, point->zenith, point->before, point->after);
    squares += point->after * point->after;
    ++result.points;
  }
  double before_squares = 0, after_squares = 0, noise_squares = 0;
  result.cells = means.for_each(kFewestPointsInCell, [&](int count, double before, double after) {
    result.mean_before.push_back(before);
    result.mean_after.push_back(after);
    before_squares += before * before;
    after_squares += after * after;
    noise_squares += squares / static_cast<double>(result.points) / count;
  });
  if (result.mean_before.empty()) return std::nullopt;
  const auto count = static_cast<double>(result.mean_before.size());
  result.rms_before = std::sqrt(before_squares / count);
  result.rms_after = std::sqrt(after_squares / count);
  result.noise = std::sqrt(noise_squares / count);
  return result;
}

/// Errors of reported directions over the field of view.
std::optional<PointingField> pointing_field(const Calibration& c,
                                            const std::vector<SamplePoint>& sample) {
  FieldMeans means;
  const Vector3<double>& turn = c.pointing_error.errors.rotation;
  for (const SamplePoint& point : sample) {
    const double total = norm(point.off);
    if (!std::isfinite(total + point.azimuth)) continue;
    const auto beam = direction_from_angles<double>({point.azimuth, point.zenith});
    means.add(point.azimuth, point.zenith, total, norm(point.off - cross(turn, beam)));
  }
  PointingField result;
  result.cells = means.for_each(1, [&](int, double total, double shape) {
    result.total.push_back(total);
    result.shape.push_back(shape);
  });
  if (result.total.empty()) return std::nullopt;
  return result;
}

/// The walls of one recording in patches.
WallsInSpace walls_in_space(const Calibration& c, const std::vector<const SamplePoint*>& points,
                            std::size_t recording) {
  struct Sum {
    int count = 0;
    WallPatch patch;
  };
  WallsInSpace result;
  result.recording = recording;
  result.fewest_points = kFewestPointsInCell;
  std::map<std::array<long, 3>, Sum> cells;
  for (const SamplePoint* point : points) {
    if (point->recording != recording || !is_complete(*point)) continue;
    Sum& sum = cells[{point->plane, cell_of(point->azimuth), cell_of(point->zenith)}];
    sum.patch.plane = static_cast<std::size_t>(point->plane);
    sum.patch.foot =
        sum.patch.foot + point->point - point->after * c.planes[sum.patch.plane].normal;
    sum.patch.before += point->before;
    sum.patch.after += point->after;
    ++sum.count;
    ++result.points;
  }
  double squares = 0;
  for (auto& [place, sum] : cells) {
    if (sum.count < kFewestPointsInCell) continue;
    WallPatch& patch = sum.patch;
    patch.foot = (1.0 / sum.count) * patch.foot;
    patch.before /= sum.count;
    patch.after /= sum.count;
    result.largest = std::max({result.largest, std::abs(patch.before), std::abs(patch.after)});
    result.farthest = std::max(result.farthest, norm(patch.foot));
    squares += patch.before * patch.before;
    result.patches.push_back(patch);
  }
  if (!result.patches.empty()) {
    result.rms_before = std::sqrt(squares / static_cast<double>(result.patches.size()));
  }
  return result;
}

}  // namespace

CalibrationDetails calibration_details(const Calibration& calibration, std::size_t recordings,
                                       std::vector<SamplePoint> sample,
                                       const std::optional<BeamComparison>& truth) {
  CalibrationDetails result;
  result.sample = std::move(sample);
  std::vector<const SamplePoint*> on_planes;
  std::vector<double> before, after;
  for (const SamplePoint& point : result.sample) {
    if (point.plane < 0) continue;
    on_planes.push_back(&point);
    before.push_back(point.before);
    after.push_back(point.after);
  }
  result.points_on_planes = on_planes.size();
  result.distances_before = estimation::moments(before);
  result.distances_after = estimation::moments(after);
  result.pointing = pointing_field(calibration, result.sample);
  result.field = wall_field(on_planes);
  for (std::size_t r = 0; r < std::min(recordings, kMostSpaces); ++r) {
    result.walls.push_back(walls_in_space(calibration, on_planes, r));
  }
  if (truth) {
    result.beam_errors = {
        estimation::moments(truth->azimuth_before), estimation::moments(truth->zenith_before),
        estimation::moments(truth->azimuth_after), estimation::moments(truth->zenith_after)};
  }
  return result;
}

}  // namespace risley::jobs
