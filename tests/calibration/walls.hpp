// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/fitted_plane.hpp"
#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/random.hpp"
#include "risley/scenes/scene.hpp"

/// Simulated shots of walls by scalar code: rays and where they meet a scene.
namespace risley::testing {

/// The free parameters of a calibration of two prisms.
inline const std::vector<std::string> kTiltNames{
    "incident_beam_horizontal_deg", "incident_beam_vertical_deg", "bearing_tilt_a_horizontal_deg",
    "bearing_tilt_a_vertical_deg",  "prism_tilt_a_vertical_deg",  "prism_tilt_b_horizontal_deg",
    "prism_tilt_b_vertical_deg"};

/// An endless wall.
inline scenes::ScenePlane wall(std::string name, double azimuth_deg, double zenith_deg,
                               double distance, std::optional<double> sigma_deg = std::nullopt) {
  scenes::ScenePlane plane;
  plane.name = std::move(name);
  plane.plane = plane_from_angles(
      SphericalAngles<double>{radians_from_degrees(azimuth_deg), radians_from_degrees(zenith_deg)},
      distance);
  if (sigma_deg) plane.normal_sigma = radians_from_degrees(*sigma_deg);
  return plane;
}

/// A station at the scene's origin, or elsewhere.
inline scenes::Station station(std::string name, double roll_deg, double pitch_deg, double yaw_deg,
                               double sigma_deg, const Vector3<double>& position = {}) {
  return {std::move(name),
          position,
          radians_from_degrees(roll_deg),
          radians_from_degrees(pitch_deg),
          radians_from_degrees(yaw_deg),
          radians_from_degrees(sigma_deg)};
}

inline Eigen::Vector3d eigen(const Vector3<double>& v) { return {v.x, v.y, v.z}; }
inline Vector3<double> plain(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

inline Eigen::Matrix3d rotation_of(const scenes::Station& pose) {
  Eigen::Matrix3d turn;
  turn.col(0) = eigen(pose.scene_from_sensor({1, 0, 0}));
  turn.col(1) = eigen(pose.scene_from_sensor({0, 1, 0}));
  turn.col(2) = eigen(pose.scene_from_sensor({0, 0, 1}));
  return turn;
}

struct ShotSettings {
  std::size_t shots = 1000;  ///< of every station
  double range_noise = 0;    ///< 1 sigma, m
  double angle_noise = 0;    ///< 1 sigma of every rotation angle, also as their covariance, rad
  double range_offset = 0;   ///< m
  std::uint64_t seed = 1;
};

inline std::vector<double> angles_of(const calibration::RangedShots& shots, std::size_t shot) {
  std::vector<double> angles;
  for (const auto& column : shots.rotation_angle) angles.push_back(column[shot]);
  return angles;
}

/// Shots at rotation angles uniform over the circle, sorted by what they meet [planes].
inline std::vector<calibration::RangedShots> shots_of_planes(const PrismTrain& train,
                                                             const PrismGeometry& geometry,
                                                             const scenes::Scene& scene,
                                                             const scenes::Station& pose,
                                                             const ShotSettings& settings) {
  const int prisms = train.prisms();
  std::vector<calibration::RangedShots> planes(scene.planes.size());
  for (auto& shots : planes) shots.resize(prisms, 0);
  const RandomStream range_stream(settings.seed, 1000), angle_stream(settings.seed, 1001);
  for (std::uint64_t i = 0; i < settings.shots; ++i) {
    std::vector<double> angles, reported;
    for (int k = 0; k < prisms; ++k) {
      const std::uint64_t number = i * static_cast<std::uint64_t>(prisms) + k;
      angles.push_back(kTwoPi * angle_stream.uniform(number) - kPi);
      reported.push_back(angles.back() + settings.angle_noise * angle_stream.normal(number));
    }
    const Ray ray = emergent_ray(train, geometry, angles);
    if (!ray.valid) continue;
    const auto hit = nearest_hit(scene, pose.position + pose.scene_from_sensor(ray.origin),
                                 pose.scene_from_sensor(ray.direction));
    if (!hit) continue;
    calibration::RangedShots& shots = planes[hit->surface];
    shots.resize(prisms, shots.size() + 1);
    std::size_t pair = 0;
    for (std::size_t k = 0; k < reported.size(); ++k) {
      shots.rotation_angle[k].back() = reported[k];
      for (std::size_t l = k; l < reported.size(); ++l) {
        shots.angle_covariance[pair++].back() =
            l == k ? static_cast<float>(settings.angle_noise * settings.angle_noise) : 0.0F;
      }
    }
    shots.range.back() =
        hit->range + settings.range_offset + settings.range_noise * range_stream.normal(i);
  }
  return planes;
}

/// The problem of a scene: everything starts at the truth, nothing is known of the parameters, the
/// stations are tied where the scene has any, and the walls are stated where they have a sigma.
/// @param range_sigma  what the problem takes the noise of one range for, m
inline calibration::PlanarProblem planar_problem(const PrismTrain& train,
                                                 const PrismGeometry& geometry,
                                                 const scenes::Scene& scene, double range_sigma,
                                                 const ShotSettings& settings) {
  calibration::PlanarProblem problem;
  problem.train = problem.prior = train;
  problem.geometry = geometry;
  problem.free = estimation::free_parameters(kTiltNames, train.shape());
  problem.range_offset = settings.range_offset;
  for (const scenes::ScenePlane& plane : scene.planes) {
    const Vector3<double>& normal = plane.plane.normal;
    problem.walls.push_back({plane.name, normal, normal, plane.normal_sigma.value_or(-1)});
  }
  std::vector<scenes::Station> poses = scene.stations;
  problem.stations_known = !poses.empty();
  if (poses.empty()) poses.emplace_back();
  for (std::size_t r = 0; r < poses.size(); ++r) {
    const Eigen::Matrix3d turn = rotation_of(poses[r]);
    problem.stations.push_back({poses[r].name, turn, turn, poses[r].sigma});
    ShotSettings own = settings;
    own.seed = settings.seed + 7919 * r;
    auto planes = shots_of_planes(train, geometry, scene, poses[r], own);
    for (std::size_t w = 0; w < planes.size(); ++w) {
      if (planes[w].size() < 30) continue;
      const Plane& plane = scene.planes[w].plane;
      problem.views.push_back(
          {r, w, plane.distance - dot(plane.normal, poses[r].position), range_sigma * range_sigma,
           std::make_shared<const calibration::RangedShots>(std::move(planes[w]))});
    }
  }
  return problem;
}

/// Adds errors to the free parameters, rad.
inline void add_errors(PrismTrain& train, const std::vector<estimation::FreeParameter>& free,
                       const Eigen::VectorXd& errors) {
  for (std::size_t j = 0; j < free.size(); ++j) {
    for (const int at : free[j].places) {
      train.set_place(at, train[at] + errors[j]);
    }
  }
}

inline Eigen::VectorXd normal_vector(std::size_t size, double sigma, std::uint64_t seed) {
  Eigen::VectorXd values(size);
  RandomStream(seed, 1002).fill_normal(0, {values.data(), size});
  return sigma * values;
}

/// The points that a train makes of the shots, sensor frame, m.
inline std::vector<Vector3<double>> points_of(const PrismTrain& train,
                                              const PrismGeometry& geometry,
                                              const calibration::RangedShots& shots) {
  std::vector<Vector3<double>> points;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const Ray ray = emergent_ray(train, geometry, angles_of(shots, i));
    points.push_back(ray.origin + shots.range[i] * ray.direction);
  }
  return points;
}

/// Starts the distances, and the normals of walls that nothing is known of, from planes fitted to
/// the points that the problem's train makes.
inline void start_from_points(calibration::PlanarProblem& problem) {
  for (calibration::WallView& view : problem.views) {
    const auto points = points_of(problem.train, problem.geometry, *view.shots);
    std::vector<std::size_t> all(points.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const Plane plane = calibration::fitted_plane(points, all);
    view.distance = plane.distance;
    calibration::Wall& seen = problem.walls[view.wall];
    if (seen.normal_sigma < 0) {
      seen.normal = plain(problem.stations[view.recording].scene_from_sensor * eigen(plane.normal));
    }
  }
}

}  // namespace risley::testing
