// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/station.hpp"

#include <cmath>
#include <set>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"
#include "risley/trajectories/geodesy.hpp"

namespace risley::cloud {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using io::YamlMap;
using trajectories::Frame;
using trajectories::RollPitchHeading;

constexpr int kStationsVersion = 1;
constexpr double kFarthestPlace = 1e8, kFarthestTarget = 1000;  // m
constexpr double kLargestSigma = 1000;                          // m and degrees
constexpr double kSmallestRadius = 0.01, kLargestRadius = 10;   // m
/// Number of points that determine the pose of a scan.
constexpr std::size_t kFewestTargets = 3;

Vector3d three(const YamlMap& map, const char* key, double lower, double upper, const char* unit) {
  const std::vector<double> values = map.reals(key, 3, lower, upper, unit);
  return {values[0], values[1], values[2]};
}

double angle(const YamlMap& map, const char* key, double lower_deg, double upper_deg) {
  return radians_from_degrees(map.real(key, lower_deg, upper_deg, "deg"));
}

StatedPose read_pose(const YamlMap& map) {
  StatedPose pose;
  const YamlMap position = map.section("position");
  pose.geographic = position.find("latitude_deg") != nullptr;
  if (pose.geographic) {
    position.allow_only({"latitude_deg", "longitude_deg", "ellipsoidal_height_m", "sigma_m"});
    pose.place = {angle(position, "latitude_deg", -90, 90),
                  angle(position, "longitude_deg", -360, 360),
                  position.real("ellipsoidal_height_m", trajectories::kLowestHeight,
                                trajectories::kHighestHeight, "m")};
  } else {
    position.allow_only({"easting_m", "northing_m", "height_m", "sigma_m"});
    pose.place = {position.real("easting_m", -kFarthestPlace, kFarthestPlace, "m"),
                  position.real("northing_m", -kFarthestPlace, kFarthestPlace, "m"),
                  position.real("height_m", -kFarthestPlace, kFarthestPlace, "m")};
  }
  pose.sigma = three(position, "sigma_m", 0, kLargestSigma, "m");
  const YamlMap attitude = map.section("attitude");
  attitude.allow_only({"roll_deg", "pitch_deg", "heading_deg", "sigma_deg"});
  pose.angles = {angle(attitude, "roll_deg", -180, 180), angle(attitude, "pitch_deg", -90, 90),
                 angle(attitude, "heading_deg", -360, 360)};
  const Vector3d sigma = three(attitude, "sigma_deg", 0, kLargestSigma, "deg");
  pose.angle_sigma = {radians_from_degrees(sigma[0]), radians_from_degrees(sigma[1]),
                      radians_from_degrees(sigma[2])};
  return pose;
}

StationTarget read_target(const YamlMap& map) {
  map.allow_only({"name", "place_m", "sigma_m", "in_scan_m", "in_scan_sigma_m", "radius_m"});
  StationTarget target;
  target.name = map.words("name");
  target.place = three(map, "place_m", -kFarthestPlace, kFarthestPlace, "m");
  target.sigma = three(map, "sigma_m", 0, kLargestSigma, "m");
  target.in_scan = three(map, "in_scan_m", -kFarthestTarget, kFarthestTarget, "m");
  if (map.find("radius_m") != nullptr) {
    target.radius = map.real("radius_m", kSmallestRadius, kLargestRadius, "m");
    if (const auto* sigma = map.find("in_scan_sigma_m")) {
      io::fail_at(map.path(), sigma->line,
                  fmt::format("{}: a sphere's points determine it; delete this line or radius_m",
                              map.field("in_scan_sigma_m")));
    }
  } else {
    constexpr double kSmallest = 1e-5;  // m; an exact place cannot be adjusted
    target.in_scan_sigma = map.real("in_scan_sigma_m", kSmallest, kLargestSigma, "m");
  }
  return target;
}

void refuse_twice(const YamlMap& map, std::set<std::string>& earlier) {
  if (earlier.insert(map.text("name")).second) return;
  io::fail_at(map.path(), map.at("name").line,
              fmt::format("{} = \"{}\" appears twice", map.field("name"), map.text("name")));
}

Station read_station(const YamlMap& map) {
  map.allow_only({"name", "position", "attitude", "targets"});
  Station station;
  station.name = map.words("name");
  std::set<std::string> names;
  for (const YamlMap& target : map.maps("targets")) {
    station.targets.push_back(read_target(target));
    refuse_twice(target, names);
  }
  const auto* targets = map.find("targets");
  if (targets == nullptr) {
    station.stated = read_pose(map);
    return station;
  }
  for (const char* key : {"position", "attitude"}) {
    if (const auto* stated = map.find(key)) {
      io::fail_at(
          map.path(), stated->line,
          fmt::format("{} stands beside targets, which determine it: give only one of the two",
                      map.field(key)));
    }
  }
  if (station.targets.size() < kFewestTargets) {
    io::fail_at(map.path(), targets->line,
                fmt::format("{}: {} targets, allowed {} and more, not on one line",
                            map.field("targets"), station.targets.size(), kFewestTargets));
  }
  return station;
}

/// Body axes (x forward, y right, z down) as columns in those of the sensor.
Matrix3d sensor_from_body() { return Vector3d(1, -1, -1).asDiagonal(); }

/// North, east and down of axes east, north and up.
Matrix3d ned_of(const Matrix3d& map) {
  Matrix3d ned;
  ned << map.col(1), map.col(0), -map.col(2);
  return ned;
}

/// Axes about which roll, pitch and heading turn, as columns among north, east and down.
Matrix3d turning_axes(const RollPitchHeading& angles) {
  const Matrix3d attitude = trajectories::ned_from_body(angles).toRotationMatrix();
  Matrix3d axes;
  axes << attitude.col(0), Vector3d(-std::sin(angles.heading), std::cos(angles.heading), 0),
      Vector3d::UnitZ();
  return axes;
}

Matrix3d true_axes(const Vector3d& position) {
  const Matrix3d ned =
      trajectories::geocentric_from_ned(trajectories::geodetic_from_geocentric(position));
  Matrix3d axes;
  axes << ned.col(1), ned.col(0), -ned.col(2);
  return axes;
}

}  // namespace

Stations parse_stations(const std::string& text, const std::string& path) {
  const YamlMap root(io::parse_yaml(text, path), path, "");
  if (root.find("risley_stations") == nullptr) {
    io::fail_at(path, root.line(), "is not a list of stations: risley_stations is missing");
  }
  root.integer("risley_stations", kStationsVersion, kStationsVersion);
  root.allow_only({"risley_stations", "crs", "datum", "stations"});
  Stations result;
  if (root.find("crs") != nullptr) result.crs = root.words("crs");
  if (root.find("datum") != nullptr) result.datum = root.words("datum");
  const YamlMap::Entry& list = root.at("stations");
  std::set<std::string> names;
  for (const YamlMap& map : root.maps("stations")) {
    result.stations.push_back(read_station(map));
    refuse_twice(map, names);
  }
  if (result.stations.empty()) io::fail_at(path, list.line, "stations: the list is empty");
  return result;
}

Stations load_stations(const std::string& path) {
  return parse_stations(io::read_text_file(path), path);
}

Matrix3d map_axes(const MapProjection* map, const Vector3d& position) {
  if (map == nullptr) return Matrix3d::Identity();
  const Vector3d up = true_axes(position).col(2);
  const Vector3d along = map->tangent(position).jacobian().inverse().col(1);
  const Vector3d north = (along - along.dot(up) * up).normalized();
  Matrix3d axes;
  axes << north.cross(up), north, up;
  return axes;
}

StandingPose standing_pose(const StatedPose& stated, const MapProjection* map) {
  StandingPose pose;
  Matrix3d axes;  // east, north, up
  if (stated.geographic) {
    pose.frame = Frame::geocentric;
    pose.position =
        trajectories::geocentric_from_geodetic({stated.place[0], stated.place[1], stated.place[2]});
    axes = true_axes(pose.position);
  } else {
    pose.frame = map == nullptr ? Frame::local : Frame::geocentric;
    pose.position = map == nullptr ? stated.place : map->unproject(stated.place);
    axes = map_axes(map, pose.position);
  }
  const Matrix3d ned = ned_of(axes);
  pose.turn = ned * trajectories::ned_from_body(stated.angles).toRotationMatrix() *
              sensor_from_body().transpose();
  const Matrix3d turns = pose.turn.transpose() * ned * turning_axes(stated.angles);
  const Matrix3d shifts = pose.turn.transpose() * axes;
  const Vector3d sigma(stated.angle_sigma.roll, stated.angle_sigma.pitch,
                       stated.angle_sigma.heading);
  pose.covariance.topLeftCorner<3, 3>() =
      turns * sigma.cwiseAbs2().asDiagonal() * turns.transpose();
  pose.covariance.bottomRightCorner<3, 3>() =
      shifts * stated.sigma.cwiseAbs2().asDiagonal() * shifts.transpose();
  return pose;
}

StatedPose pose_on_map(const StandingPose& pose, const MapProjection* map) {
  StatedPose stated;
  stated.place = map == nullptr ? pose.position : map->project(pose.position);
  const Matrix3d axes = map_axes(map, pose.position), ned = ned_of(axes);
  stated.angles = trajectories::roll_pitch_heading(
      Eigen::Quaterniond(Matrix3d(ned.transpose() * pose.turn * sensor_from_body())));
  const Matrix3d shifts = axes.transpose() * pose.turn;
  const Matrix3d turns = turning_axes(stated.angles).inverse() * ned.transpose() * pose.turn;
  // The effect of the sensor's own errors on a pose from its points is part of the pose's error.
  StandingCovariance all = pose.covariance;
  for (const Eigen::MatrixXd* moved : {&pose.response, &pose.of_survey}) {
    if (moved->size() > 0) all += *moved * moved->transpose();
  }
  const Matrix3d shifted = shifts * all.bottomRightCorner<3, 3>() * shifts.transpose();
  const Matrix3d turned = turns * all.topLeftCorner<3, 3>() * turns.transpose();
  stated.sigma = shifted.diagonal().cwiseSqrt();
  const Vector3d sigma = turned.diagonal().cwiseSqrt();
  stated.angle_sigma = {sigma[0], sigma[1], sigma[2]};
  return stated;
}

}  // namespace risley::cloud
