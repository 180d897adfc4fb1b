// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/same_walls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/setting.hpp"

#include "calibration/eigen_vectors.hpp"

namespace risley::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Planes as found are off by a degree, which the adjustment will correct, and by the motion of the
/// sensor between recordings.
constexpr double kSamePlane = radians_from_degrees(3.0);
constexpr double kFarthestShift = 0.5;  // m
/// Distances not explained by a shift, relative and absolute, m.
constexpr double kDistancePart = 0.005, kDistanceAtLeast = 0.02;
/// Walls that fix a rotation meet at more than this angle.
constexpr double kSteepest = radians_from_degrees(20.0);
/// Share of the points of a recording that must lie on walls of the other.
constexpr double kLeastShared = 0.7;
/// Another rotation fits as well if it explains as many points, and a shift shorter by this, m,
/// does not distinguish them.
constexpr double kAsWell = 0.95, kShorterShift = 0.3, kOtherTurn = radians_from_degrees(10.0);

struct Pose {
  Matrix3d turn = Matrix3d::Identity();
  Vector3d position = Vector3d::Zero();
  double points = 0;  ///< that lie on shared walls
};

using Planes = std::vector<const FoundPlane*>;

/// The best rotation from two directions to two others.
Matrix3d turn_between(const Vector3d& a1, const Vector3d& b1, const Vector3d& a2,
                      const Vector3d& b2) {
  const Matrix3d product =
      a2 * a1.transpose() + b2 * b1.transpose() + a2.cross(b2) * a1.cross(b1).transpose();
  const Eigen::JacobiSVD<Matrix3d> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d sign = Matrix3d::Identity();
  sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

Vector3d normal_of(const FoundPlane& plane) { return eigen(plane.plane.normal); }

/// The pose with its shift, and the share of the recording that it explains; nothing if distances
/// contradict it.
std::optional<Pose> checked(const Planes& own, const Planes& reference, const Matrix3d& turn) {
  Pose pose{turn, Vector3d::Zero(), 0};
  std::vector<std::pair<const FoundPlane*, const FoundPlane*>> pairs;
  for (const FoundPlane* plane : own) {
    const FoundPlane* best = nullptr;
    double least = kSamePlane;
    for (const FoundPlane* other : reference) {
      const Vector3d turned = turn * normal_of(*plane);
      const double angle =
          std::atan2(turned.cross(normal_of(*other)).norm(), turned.dot(normal_of(*other)));
      const double apart = std::abs(plane->plane.distance - other->plane.distance);
      if (angle > least || apart > kFarthestShift) continue;
      best = other;
      least = angle;
    }
    if (best != nullptr) pairs.emplace_back(plane, best);
  }
  // n . shift = distance in the reference less the own one; zero along directions that no wall
  // determines.
  Matrix3d normal = 1e-6 * Matrix3d::Identity();
  Vector3d right = Vector3d::Zero();
  for (const auto& [plane, other] : pairs) {
    const Vector3d n = normal_of(*other);
    normal += n * n.transpose();
    right += n * (other->plane.distance - plane->plane.distance);
  }
  pose.position = normal.ldlt().solve(right);
  if (pose.position.norm() > kFarthestShift) return std::nullopt;
  for (const auto& [plane, other] : pairs) {
    const double left =
        other->plane.distance - plane->plane.distance - normal_of(*other).dot(pose.position);
    const double allowed = kDistanceAtLeast + kDistancePart * other->plane.distance;
    if (std::abs(left) > allowed) return std::nullopt;
    pose.points += static_cast<double>(plane->points);
  }
  return pose;
}

double angle_between_turns(const Matrix3d& a, const Matrix3d& b) {
  return Eigen::AngleAxisd(a * b.transpose()).angle();
}

std::vector<Pose> candidates(const Planes& own, const Planes& reference) {
  std::vector<Pose> found;
  for (const FoundPlane* a : own) {
    for (const FoundPlane* b : own) {
      const double between = angle_between(a->plane.normal, b->plane.normal);
      if (a == b || between < kSteepest || between > kPi - kSteepest) continue;
      for (const FoundPlane* c : reference) {
        for (const FoundPlane* d : reference) {
          const double there = angle_between(c->plane.normal, d->plane.normal);
          if (c == d || std::abs(there - between) > kSamePlane) continue;
          if (std::abs(a->plane.distance - c->plane.distance) > kFarthestShift) continue;
          const auto pose =
              checked(own, reference,
                      turn_between(normal_of(*a), normal_of(*b), normal_of(*c), normal_of(*d)));
          if (pose) found.push_back(*pose);
        }
      }
    }
  }
  std::ranges::stable_sort(found, [](const Pose& x, const Pose& y) {
    return x.points != y.points ? x.points > y.points : x.position.norm() < y.position.norm();
  });
  return found;
}

}  // namespace

FoundPoses poses_before_same_walls(const std::vector<FoundPlane>& found,
                                   const std::vector<std::string>& recordings) {
  std::vector<Planes> planes(recordings.size());
  std::vector<double> points(recordings.size(), 0.0);
  for (const FoundPlane& plane : found) {
    planes[plane.recording].push_back(&plane);
    points[plane.recording] += static_cast<double>(plane.points);
  }
  FoundPoses poses;
  for (std::size_t r = 1; r < planes.size(); ++r) {
    if (planes[r].size() > planes[poses.reference].size()) poses.reference = r;
  }
  std::vector<scenes::Station> stations(recordings.size());
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    scenes::Station& station = stations[r];
    station.name = recordings[r];
    station.sigma = std::numeric_limits<double>::infinity();
    if (r == poses.reference) continue;
    const std::vector<Pose> all = candidates(planes[r], planes[poses.reference]);
    if (all.empty() || all.front().points < kLeastShared * points[r]) {
      poses.why_not = fmt::format("{} does not see the walls of {}", recordings[r],
                                  recordings[poses.reference]);
      return poses;
    }
    const Pose& best = all.front();
    for (const Pose& other : all) {
      if (angle_between_turns(other.turn, best.turn) < kOtherTurn ||
          other.points < kAsWell * best.points ||
          other.position.norm() > best.position.norm() + kShorterShift) {
        continue;
      }
      poses.why_not = fmt::format(
          "the walls of {} and {} fit in several ways, as in a square room: state how the sensor "
          "was turned ({})",
          recordings[r], recordings[poses.reference], name_of(kSetting.stations));
      return poses;
    }
    const Vector3d angles = best.turn.eulerAngles(2, 1, 0);
    station.yaw = angles[0];
    station.pitch = angles[1];
    station.roll = angles[2];
    station.position = plain(best.position);
  }
  poses.stations = std::move(stations);
  return poses;
}

}  // namespace risley::calibration
