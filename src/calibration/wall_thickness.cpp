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
  const Rays rays(train, geometry, shots);
  std::vector<Vector3<double>> points;
  for (std::size_t i = 0; i < shots.size(); ++i) points.push_back(rays.point(i, shots.range[i]));
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

}  // namespace

WallThickness wall_thickness(const PlanarProblem& problem, const PrismTrain& believed,
                             const std::vector<LabelledShots>& recordings) {
  const auto prisms = static_cast<std::size_t>(problem.train.prisms());
  std::vector<ProfileBuilder> builders;
  builders.emplace_back("incidence", 0.0, kPi / 2, kIncidenceBins);
  for (std::size_t k = 0; k < prisms; ++k) {
    builders.emplace_back(fmt::format("rotation_angle_{}", prism_letter(static_cast<int>(k))), 0.0,
                          kTwoPi, kTurnBins);
  }
  WallThickness result;
  double before2 = 0, after2 = 0;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    const WallView& view = problem.views[v];
    const LabelledShots& recording = recordings[view.recording];
    const ViewDistances d = view_distances(problem, v, recording, recording.labels.view);
    const RangedShots shots = rows_of(recording.shots, d.rows);
    const FittedView before = fitted_view(believed, problem.geometry, shots);
    CalibratedPlane plane;
    plane.name = problem.walls[view.wall].name;
    plane.recording = view.recording;
    const Plane adjusted = plane_view(problem, v).plane;
    plane.normal = adjusted.normal;
    plane.distance = adjusted.distance;
    plane.believed = before.plane;
    plane.points = d.rows.size();
    plane.outliers = recording.labels.near[v];
    plane.rms_before = before.rms;
    plane.range_sigma = std::sqrt(view.range_variance);
    double squares = 0;
    for (std::size_t i = 0; i < d.rows.size(); ++i) {
      squares += d.distance[i] * d.distance[i];
      builders[0].add(d.incidence[i], before.distance[i], d.distance[i]);
      for (std::size_t k = 0; k < prisms; ++k) {
        builders[k + 1].add(wrap_to_two_pi(shots.rotation_angle[k][i]), before.distance[i],
                            d.distance[i]);
      }
    }
    const auto n = static_cast<double>(d.rows.size());
    plane.rms = std::sqrt(squares / n);
    before2 += n * before.rms * before.rms;
    after2 += squares;
    result.points += d.rows.size();
    result.planes.push_back(std::move(plane));
  }
  result.rms_before = std::sqrt(before2 / static_cast<double>(result.points));
  result.rms_after = std::sqrt(after2 / static_cast<double>(result.points));
  for (ProfileBuilder& builder : builders) {
    result.profiles.push_back(std::move(builder).result());
  }
  return result;
}

}  // namespace risley::calibration
