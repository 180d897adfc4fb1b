// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/georeference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/trajectories/clock.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "cloud/entry_checks.hpp"
#include "cloud/georeference_kernel.hpp"
#include "cloud/pose_columns.hpp"
#include "cloud/sensor_path.hpp"

namespace risley::cloud {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using trajectories::Frame;

/// Spacing of the trajectory's places in the cloud's table: straight lines between them are off by
/// millimetres, which does not affect a covariance.
constexpr std::int64_t kTableStep_ns = 1'000'000'000;
/// Largest distance of the points of one call from their middle for the expansion of the map, and
/// its largest error, m.
constexpr double kWidestExpansion = 1500, kExpansionError = 1e-5;
/// Coordinates in files with multiples of a step begin at a multiple of this, m.
constexpr double kOffsetStep = 1000;

/// Message when positions leave a map's area of use; empty when they do not.
/// @param what  they are of
/// @throws InvalidArgument far away from it, where a map is not usable
std::string far_from_map(const MapProjection& map, std::span<const Vector3d> positions,
                         std::string_view what) {
  constexpr std::size_t kPlaces = 100;
  constexpr double kFarAway = 6 * kRadiansPerDegree;  // the width of a zone of UTM
  if (!map.area()) return {};
  double farthest = 0;
  trajectories::Geodetic where;
  for (std::size_t i = 0; i <= kPlaces; ++i) {
    const trajectories::Geodetic place =
        trajectories::geodetic_from_geocentric(positions[(positions.size() - 1) * i / kPlaces]);
    const double beyond = map.area()->beyond(place.latitude, place.longitude);
    if (beyond <= farthest) continue;
    farthest = beyond;
    where = place;
  }
  // Borders of areas are rounded.
  constexpr double kRounded = 0.01 * kRadiansPerDegree;
  if (farthest <= kRounded) return {};
  std::string words = fmt::format(
      "crs {} is for {} (latitude {:.2f} to {:.2f}, longitude {:.2f} to {:.2f} degrees), and the "
      "{} is at latitude {:.4f}, longitude {:.4f}: is it the right zone?",
      map.name(), map.area()->name.empty() ? "another area" : map.area()->name,
      degrees_from_radians(map.area()->south), degrees_from_radians(map.area()->north),
      degrees_from_radians(map.area()->west), degrees_from_radians(map.area()->east), what,
      degrees_from_radians(where.latitude), degrees_from_radians(where.longitude));
  if (farthest > kFarAway) throw InvalidArgument(words);
  return words;
}

/// The six terms of a symmetric matrix in the order of kXX ... kZZ.
void copy_terms(const Matrix3d& m, double (&terms)[kCovarianceTerms]) {
  terms[kXX] = m(0, 0);
  terms[kXY] = m(0, 1);
  terms[kXZ] = m(0, 2);
  terms[kYY] = m(1, 1);
  terms[kYZ] = m(1, 2);
  terms[kZZ] = m(2, 2);
}

void copy_vector(const Vector3d& v, double (&numbers)[3]) { std::copy_n(v.data(), 3, numbers); }

/// Row by row.
void copy_matrix(const Matrix3d& m, double (&numbers)[9]) {
  for (Index i = 0; i < 9; ++i) numbers[i] = m(i / 3, i % 3);
}

}  // namespace

struct Georeference::State {
  /// Of a sensor that moves.
  struct Flight {
    explicit Flight(const MovingPlatform& what)
        : platform(what),
          interpolation(what.trajectory),
          path(what.trajectory, interpolation, what.mount),
          errors(what.errors ? std::optional<trajectories::ErrorProcess>(
                                   std::in_place, *what.errors, what.trajectory)
                             : std::nullopt) {}

    const MovingPlatform& platform;
    trajectories::Interpolation interpolation;
    SensorPath path;
    std::optional<trajectories::ErrorProcess> errors;
  };

  std::optional<Flight> flight;              ///< of a sensor that moves
  const StandingSensor* standing = nullptr;  ///< of one that stands
  Frame frame = Frame::local;
  std::optional<MapProjection> map;
  bool map_assumed = false;  ///< not given by any input
  std::int64_t shift_ns = 0;
  std::optional<std::int64_t> utc_shift_ns;  ///< of the trajectory's time
  std::string beyond_area;                   ///< in words; empty: within the map's area of use
  bool clock_known = false;                  ///< the recording states the time scale of its clock

  /// @param positions  of the sensor  @param what  they are of
  void open_map(const std::string& crs, const std::string& datum,
                std::span<const Vector3d> positions, std::string_view what) {
    const Vector3d& first = positions.front();
    if (frame == Frame::geocentric) {
      map_assumed = crs.empty();
      const trajectories::Geodetic place = trajectories::geodetic_from_geocentric(first);
      map.emplace(map_assumed ? utm_zone_of(place.latitude, place.longitude) : crs, datum);
      map->project(first);  // rejects a place outside the map's reach
      beyond_area = far_from_map(*map, positions, what);
    } else if (!crs.empty()) {
      throw InvalidArgument(
          fmt::format("crs = \"{}\" with a {} in a local frame, which has no place on a map: give "
                      "no crs, or a {} with latitudes and longitudes",
                      crs, what, what));
    }
  }

  /// The map about a place of the frame, or that frame itself.
  MapTangent tangent(const Vector3d& place) const {
    return map ? map->tangent(place) : MapTangent();
  }

  /// North, east and down at a place, axes of the map.
  Matrix3d map_from_ned(const MapTangent& tangent, const Vector3d& place) const {
    return tangent.jacobian() * trajectories::ned_axes(frame, place);
  }

  /// What a header says of coordinates. @param place  in the middle, in the frame
  void announce_map(PointFrame& of, const Vector3d& place) const {
    const Vector3d value = tangent(place).value();
    of.wkt = map->wkt();
    of.text =
        fmt::format("{}, heights {}", map->name(),
                    map->has_height_system() ? "of its height system" : "above the ellipsoid");
    of.axes = {"easting", "northing", "height"};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      of.offset[axis] = kOffsetStep * std::round(value[static_cast<Index>(axis)] / kOffsetStep);
    }
  }
};

Georeference::Georeference(const MovingPlatform& platform,
                           recordings::TimeReference recording_clock, std::int64_t first_time_ns) {
  trajectories::require_mount(platform.mount);
  state_ = std::make_unique<State>();
  State& s = *state_;
  s.flight.emplace(platform);
  const trajectories::Trajectory& trajectory = platform.trajectory;
  s.frame = trajectory.frame;
  s.open_map(platform.crs, platform.datum, trajectory.position, "trajectory");
  s.shift_ns = std::llround(1e9 * platform.mount.clock_offset.value);
  if (recording_clock == recordings::TimeReference::utc) {
    const auto shift = trajectories::shift_from_utc_ns(trajectory, first_time_ns);
    s.clock_known = shift.has_value();
    s.shift_ns += shift.value_or(0);
  }
  s.utc_shift_ns = trajectories::shift_to_utc_ns(trajectory);
}

Georeference::Georeference(const StandingSensor& sensor) {
  require_at_least("number of the station", sensor.number, 1);
  state_ = std::make_unique<State>();
  state_->standing = &sensor;
  state_->frame = sensor.pose.frame;
  state_->open_map(sensor.crs, sensor.datum, {&sensor.pose.position, 1}, "station");
}

Georeference::~Georeference() = default;

void Georeference::find_poses(std::span<const std::int64_t> times_ns, SensorPoses& poses,
                              std::vector<std::size_t>& rows, InstructionSet set) const {
  if (state_->standing != nullptr) {
    const StandingPose& pose = state_->standing->pose;
    poses.resize(times_ns.size());
    poses.lever_arm = Vector3d::Zero();
    for (Index axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      std::ranges::fill(poses.reference[k], pose.position[axis]);
      std::ranges::fill(poses.velocity[k], 0.0);
      std::ranges::fill(poses.rate[k], 0.0);
    }
    for (std::size_t k = 0; k < 9; ++k) std::ranges::fill(poses.turn[k], pose.turn.data()[k]);
    std::ranges::fill(poses.strip, state_->standing->number);
    rows.resize(times_ns.size());
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    return;
  }
  std::vector<std::int64_t> shifted(times_ns.begin(), times_ns.end());
  for (std::int64_t& time_ns : shifted) time_ns += state_->shift_ns;
  state_->flight->path.find(shifted, poses, rows, set);
}

void Georeference::announce(CloudHeader& header) const {
  const State& s = *state_;
  header.has_own_covariance = header.has_covariance;
  header.has_point_source = true;
  if (s.standing != nullptr) {
    header.frame.name = "stations";
    header.frame.text = "of the stations: X east, Y north, Z up";
    header.frame.axes = {"east", "north", "up"};
    if (s.map) s.announce_map(header.frame, s.standing->pose.position);
    return;
  }
  const trajectories::Trajectory& trajectory = s.flight->platform.trajectory;
  const auto middle = static_cast<std::size_t>(trajectory.size() / 2);
  header.frame.name = "trajectory";
  header.frame.text = "of the trajectory: X east, Y north, Z up if it says so";
  header.frame.axes = {"x of the trajectory's frame", "y of the trajectory's frame", "up"};
  if (s.map) s.announce_map(header.frame, trajectory.position[middle]);
  header.time_reference =
      s.utc_shift_ns ? recordings::TimeReference::utc : recordings::TimeReference::relative;
  const auto& process = s.flight->errors;
  if (!process || !header.has_covariance) return;
  TrajectoryErrors& errors = header.trajectory.emplace();
  const auto copy = [](const trajectories::PoseErrorVector& from, std::array<double, 6>& to) {
    std::ranges::copy(from, to.begin());
  };
  copy(process->correlation_times(), errors.correlation_time);
  copy(process->white(), errors.white);
  errors.sample_interval = s.flight->platform.errors->sample_interval;
  errors.first_sample_ns = trajectory.time_ns.front() + s.utc_shift_ns.value_or(0);
  const Vector3d& place_there = trajectory.position[middle];
  const Matrix3d axes = s.map_from_ned(s.tangent(place_there), place_there);
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      errors.axes_from_ned[k][axis] = axes(axis, k);
    }
  }
  std::int64_t next = trajectory.time_ns.front();
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (trajectory.time_ns[i] < next && i + 1 < trajectory.size()) continue;
    next = trajectory.time_ns[i] + kTableStep_ns;
    const Vector3d place = s.map ? s.map->project(trajectory.position[i]) : trajectory.position[i];
    errors.time_ns.push_back(trajectory.time_ns[i] + s.utc_shift_ns.value_or(0));
    errors.position.push_back({place.x(), place.y(), place.z()});
    copy(process->sigmas(trajectory.time_ns[i]), errors.sigma.emplace_back());
  }
}

void Georeference::apply(Points& points, const SensorPoses& poses, InstructionSet set) const {
  const State& s = *state_;
  const std::size_t n = points.size();
  require_poses(poses, n);
  require_length("point_source", points.point_source.size(), n);
  if (n == 0) return;
  const bool covariance = !points.covariance[kXX].empty();

  // Location of the points, and the map about their middle.
  const auto& [first_x, first_y, first_z] = poses.reference;
  const Vector3d local(first_x.front(), first_y.front(), first_z.front());  // keeps digits
  const auto columns = std::make_unique_for_overwrite<double[]>(6 * n);
  std::array<double*, 3> arm{}, place{};
  PlaceArguments put;
  put.poses = pose_columns(poses);
  put.shots = n;
  put.point[0] = points.x.data();
  put.point[1] = points.y.data();
  put.point[2] = points.z.data();
  copy_vector(local, put.local);
  Vector3d middle = Vector3d::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put.arm[axis] = arm[axis] = columns.get() + axis * n;
    put.place[axis] = place[axis] = arm[axis] + 3 * n;
  }
  RISLEY_KERNEL_COPIES(place_points).at(set)(put);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    middle[axis] = std::accumulate(place[axis], place[axis] + n, 0.0) / static_cast<double>(n);
  }
  const auto place_of = [&](std::size_t i) {
    return Vector3d(local + Vector3d(place[0][i], place[1][i], place[2][i]));
  };
  const Vector3d center = local + middle;
  const MapTangent tangent = s.tangent(center);
  double farthest = 0;
  std::size_t far = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = place[0][i] - middle.x(), y = place[1][i] - middle.y(),
                 z = place[2][i] - middle.z();
    const double distance = x * x + y * y + z * z;
    if (distance > farthest) {
      farthest = distance;
      far = i;
    }
  }
  const bool expand =
      !s.map ||
      (farthest < kWidestExpansion * kWidestExpansion &&
       (tangent.map(place_of(far)) - s.map->project(place_of(far))).cwiseAbs().maxCoeff() <
           kExpansionError);

  const Matrix3d& jacobian = tangent.jacobian();
  const Matrix3d ned = s.map_from_ned(tangent, center);
  Matrix3d position = Matrix3d::Zero(), turning = Matrix3d::Zero();
  if (s.flight && s.flight->errors) {  // sigmas change slowly
    const trajectories::ErrorProcess& errors = *s.flight->errors;
    const std::int64_t time_ns = points.time_ns[n / 2] + s.shift_ns;
    const trajectories::PoseErrorVector variance =
        errors.sigmas(time_ns).cwiseAbs2() + errors.white().cwiseAbs2();
    position = ned * variance.head<3>().asDiagonal() * ned.transpose();
    turning = ned * variance.tail<3>().asDiagonal() * ned.transpose();
  }
  const std::int64_t time_shift = s.shift_ns + s.utc_shift_ns.value_or(0);
  for (std::int64_t& time_ns : points.time_ns) time_ns += time_shift;
  points.point_source = poses.strip;

  MapArguments to_map;
  to_map.poses = put.poses;
  to_map.shots = n;
  to_map.point[0] = points.x.data();
  to_map.point[1] = points.y.data();
  to_map.point[2] = points.z.data();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    to_map.arm[axis] = arm[axis];
    to_map.place[axis] = place[axis];
    copy_matrix(tangent.half_hessian(axis), to_map.half_hessian[axis]);
  }
  copy_matrix(jacobian, to_map.jacobian);
  // A frame without a map is expanded about the local place, which has fewer digits.
  copy_vector(s.map ? middle : Vector3d(Vector3d::Zero()), to_map.center);
  copy_vector(s.map ? tangent.value() : local, to_map.value);
  std::vector<double*> loading;
  if (covariance) {
    for (auto& factor : points.loading) {
      for (auto& column : factor) loading.push_back(column.data());
    }
    to_map.loading = loading.data();
    to_map.loadings = points.loading.size();
    for (std::size_t k = 0; k < kCovarianceTerms; ++k) {
      to_map.covariance[k] = points.covariance[k].data();
      to_map.own_covariance[k] = points.own_covariance[k].data();
    }
    copy_terms(position, to_map.shifted);
    copy_terms(turning, to_map.turned_by);
  }
  RISLEY_KERNEL_COPIES(map_points).at(set)(to_map);
  if (expand) return;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d mapped = s.map->project(place_of(i));
    points.x[i] = mapped.x();
    points.y[i] = mapped.y();
    points.z[i] = mapped.z();
  }
}

std::vector<Warning> Georeference::warnings() const {
  const State& s = *state_;
  std::vector<Warning> warnings;
  if (s.flight && !s.flight->errors) {
    warn(warnings, kWarning.taken_as_exact,
         "the trajectory states no accuracy: covariances include only the sensor and the mount");
  }
  if (s.flight && !s.clock_known) {
    const MovingPlatform& platform = s.flight->platform;
    warn(warnings, kWarning.clock_unknown,
         "the recording does not state the time scale of its clock: its times, with the mount's "
         "offset of {:g} s, are taken as the trajectory's ({}); a sensor that is set by PPS and "
         "NMEA counts UTC, 18 s less than GPS time",
         platform.mount.clock_offset.value, words_of(platform.trajectory.time_scale));
  }
  if (!s.beyond_area.empty()) warnings.push_back({kWarning.outside_map, s.beyond_area});
  if (s.map_assumed) {
    warn(warnings, kWarning.map_assumed,
         "no map was named: points are in {} with ellipsoidal heights", s.map->name());
  }
  if (s.map) {
    const std::string operation = s.map->operation();
    if (!operation.empty()) {
      warn(warnings, kWarning.datum_changed, "the datum was changed on the way to the map: {}",
           operation);
    }
  }
  if (!s.flight) return warnings;
  for (const trajectories::TrajectoryGap& gap : s.flight->interpolation.gaps()) {
    warn(warnings, kWarning.trajectory_gaps,
         "the trajectory has no records for {:.3f} s from {:.3f} s on: shots in that interval have "
         "no points",
         1e-9 * static_cast<double>(gap.end_ns - gap.begin_ns),
         1e-9 * static_cast<double>(gap.begin_ns));
  }
  return warnings;
}

std::int64_t Georeference::clock_shift_ns() const { return state_->shift_ns; }
const std::vector<trajectories::FlownStrip>& Georeference::strips() const {
  static const std::vector<trajectories::FlownStrip> kNone;
  return state_->flight ? state_->flight->path.strips() : kNone;
}

std::vector<StripLine> Georeference::strip_lines() const {
  const State& s = *state_;
  std::vector<StripLine> lines;
  for (const trajectories::FlownStrip& strip : strips()) {
    std::array<Vector3d, 2> ends;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto pose = s.flight->interpolation.at(k == 0 ? strip.begin_ns : strip.end_ns);
      if (!pose) return {};
      const Vector3d place =
          pose->position + pose->attitude * trajectories::lever_arm(s.flight->platform.mount);
      ends[k] = s.tangent(place).map(place);
    }
    lines.push_back({"",
                     {ends[0].x(), ends[0].y()},
                     {ends[1].x(), ends[1].y()},
                     0.5 * (ends[0].z() + ends[1].z())});
  }
  return lines;
}

}  // namespace risley::cloud
