// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/wall_thickness.hpp"

#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "risley/calibration/fitted_plane.hpp"
#include "risley/calibration/rays.hpp"
#include "risley/core/angle.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/shot_blocks.hpp"

namespace risley::calibration {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
/// Bins of 2 degrees of incidence and of 5 degrees of a rotation angle.
constexpr std::size_t kIncidenceBins = 45, kTurnBins = 72;

/// Root mean squares and means over bins of a variable.
class ProfileBuilder {
 public:
  ProfileBuilder(std::string variable, double from, double to, std::size_t bins)
      : from_(from), width_((to - from) / static_cast<double>(bins)), sums_(bins) {
    profile_.variable = std::move(variable);
  }
  void add(double at, double before, double after) {
    const double bin = std::floor((at - from_) / width_);
    if (!(bin >= 0) || bin >= static_cast<double>(sums_.size())) return;
    Sums& s = sums_[static_cast<std::size_t>(bin)];
    ++s.count;
    s.before += before;
    s.after += after;
    s.before2 += before * before;
    s.after2 += after * after;
  }
  /// Adds the data of another one.
  void add(const ProfileBuilder& other) {
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      sums_[i].count += other.sums_[i].count;
      sums_[i].before += other.sums_[i].before;
      sums_[i].after += other.sums_[i].after;
      sums_[i].before2 += other.sums_[i].before2;
      sums_[i].after2 += other.sums_[i].after2;
    }
  }
  ThicknessProfile result() && {
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      const Sums& s = sums_[i];
      const double n = s.count > 0 ? static_cast<double>(s.count) : kNaN;
      profile_.from.push_back(from_ + width_ * static_cast<double>(i));
      profile_.to.push_back(from_ + width_ * static_cast<double>(i + 1));
      profile_.count.push_back(s.count);
      profile_.rms_before.push_back(std::sqrt(s.before2 / n));
      profile_.rms_after.push_back(std::sqrt(s.after2 / n));
      profile_.mean_before.push_back(s.before / n);
      profile_.mean_after.push_back(s.after / n);
    }
    return std::move(profile_);
  }

 private:
  struct Sums {
    std::size_t count = 0;
    double before = 0, after = 0, before2 = 0, after2 = 0;
  };
  double from_, width_;
  std::vector<Sums> sums_;
  ThicknessProfile profile_;
};

/// Shots of a view with other optics, and the plane that fits them.
struct FittedView {
  Plane plane;
  std::vector<double> distance;  ///< m
  double rms = 0;                ///< m
};

FittedView fitted_view(const PrismTrain& train, const PrismGeometry& geometry,
                       const RangedShots& shots) {
  std::vector<Vector3<double>> points(shots.size());
  for_each_block(shots.size(), [&](std::size_t begin, std::size_t end) {
    const Rays rays(train, geometry, shots, {begin, end});
    for (std::size_t i = begin; i < end; ++i) points[i] = rays.point(i - begin, shots.range[i]);
  });
  std::vector<std::size_t> all(points.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  FittedView view;
  view.plane = fitted_plane(points, all);
  double squares = 0;
  for (const Vector3<double>& point : points) {
    view.distance.push_back(signed_distance(view.plane, point));
    squares += view.distance.back() * view.distance.back();
  }
  view.rms = std::sqrt(squares / static_cast<double>(points.size()));
  return view;
}

/// Root mean square of a wall's deviation over the cells with shots, m.
double rms_where_seen(const WallGrid& grid, const Eigen::VectorXd& height) {
  double squares = 0;
  for (const std::uint32_t cell : grid.cells) {
    const Eigen::Index u = cell % grid.row(), v = cell / grid.row(), row = grid.cells_u + 1;
    const double middle = 0.25 * (height[v * row + u] + height[v * row + u + 1] +
                                  height[(v + 1) * row + u] + height[(v + 1) * row + u + 1]);
    squares += middle * middle;
  }
  return std::sqrt(squares / static_cast<double>(grid.cells.size()));
}

/// Statistics of the shots of one view.
struct ViewThickness {
  CalibratedPlane plane;
  double squares_before = 0, squares_after = 0;
  std::vector<ProfileBuilder> profiles;
};

ViewThickness thickness_of(const PlanarProblem& problem, std::size_t view,
                           const PrismTrain& believed, const LabelledShots& recording,
                           double shape_sigma, double shape_length,
                           std::vector<ProfileBuilder> empty) {
  const WallView& own = problem.views[view];
  const ViewDistances d = view_distances(problem, view, recording, recording.labels.view);
  const RangedShots shots = rows_of(recording.shots, d.rows);
  const FittedView before = fitted_view(believed, problem.geometry, shots);
  ViewThickness result;
  result.profiles = std::move(empty);
  for (std::size_t i = 0; i < d.rows.size(); ++i) {
    result.squares_after += d.distance[i] * d.distance[i];
    result.profiles[0].add(d.incidence[i], before.distance[i], d.distance[i]);
    for (std::size_t k = 0; k < shots.rotation_angle.size(); ++k) {
      result.profiles[k + 1].add(wrap_to_two_pi(shots.rotation_angle[k][i]), before.distance[i],
                                 d.distance[i]);
    }
  }
  const auto n = static_cast<double>(d.rows.size());
  result.squares_before = n * before.rms * before.rms;
  CalibratedPlane& plane = result.plane;
  plane.name = problem.walls[own.wall].name;
  plane.recording = own.recording;
  const Plane adjusted = plane_view(problem, view).plane;
  plane.normal = adjusted.normal;
  plane.distance = adjusted.distance;
  plane.believed = before.plane;
  plane.points = d.rows.size();
  plane.outliers = recording.labels.near[view];
  plane.rms_before = before.rms;
  plane.rms = std::sqrt(result.squares_after / n);
  plane.range_sigma = std::sqrt(own.range_variance);
  plane.shape_sigma = shape_sigma;
  plane.shape_length = shape_sigma > 0 ? shape_length : 0.0;
  return result;
}

}  // namespace

WallThickness wall_thickness(const PlanarSolution& solution, const PrismTrain& believed,
                             const std::vector<LabelledShots>& recordings) {
  const PlanarProblem& problem = solution.problem;
  std::vector<double> shape_sigma(problem.walls.size(), 0.0);
  for (std::size_t w = 0; w < solution.shape.height.size(); ++w) {
    const WallGrid& grid = problem.walls[w].grid;
    if (!grid.empty()) shape_sigma[w] = rms_where_seen(grid, solution.shape.height[w]);
  }
  std::vector<ProfileBuilder> builders;
  builders.emplace_back("incidence", 0.0, kPi / 2, kIncidenceBins);
  for (int k = 0; k < problem.train.prisms(); ++k) {
    builders.emplace_back(fmt::format("rotation_angle_{}", prism_letter(k)), 0.0, kTwoPi,
                          kTurnBins);
  }
  std::vector<ViewThickness> views(problem.views.size());
  parallel::for_each(views.size(), [&, empty = builders](std::size_t v) {
    views[v] = thickness_of(problem, v, believed, recordings[problem.views[v].recording],
                            shape_sigma[problem.views[v].wall], solution.shape.mean.length, empty);
  });
  WallThickness result;
  double before2 = 0, after2 = 0;
  for (ViewThickness& view : views) {
    before2 += view.squares_before;
    after2 += view.squares_after;
    result.points += view.plane.points;
    for (std::size_t k = 0; k < builders.size(); ++k) builders[k].add(view.profiles[k]);
    result.planes.push_back(std::move(view.plane));
  }
  result.rms_before = std::sqrt(before2 / static_cast<double>(result.points));
  result.rms_after = std::sqrt(after2 / static_cast<double>(result.points));
  for (ProfileBuilder& builder : builders) {
    result.profiles.push_back(std::move(builder).result());
  }
  return result;
}

}  // namespace risley::calibration
