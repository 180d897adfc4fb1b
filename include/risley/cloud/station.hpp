// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/cloud/map_projection.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::cloud {

/// Covariance of the errors of a pose: a rotation vector, rad, and a shift, m, both along the axes
/// of the sensor, which is taken as the body: x forward, y left, z up.
using StandingCovariance = Eigen::Matrix<double, 6, 6>;

/// The pose of a sensor that does not move.
struct StandingPose {
  trajectories::Frame frame = trajectories::Frame::local;  ///< x east, y north, z up where local
  Eigen::Vector3d position{0, 0, 0};                       ///< of the sensor's origin, m
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();      ///< frame from sensor
  StandingCovariance covariance = StandingCovariance::Zero();
  /// Effect on the pose of one standard deviation of each common factor of the sensor's points, if
  /// the points determined the pose: [6, factors] in the order of PointingModel; otherwise empty.
  Eigen::MatrixXd response;
  /// Effect on the pose of one standard deviation of each error that all stations of a survey
  /// share through common targets: [6, errors], see share_targets(); may be empty.
  Eigen::MatrixXd of_survey;
};

/// A measured pose.
struct StatedPose {
  /// Easting, northing and height on the map, m; or, where geographic, latitude and longitude, rad,
  /// and height above the ellipsoid, m.
  Eigen::Vector3d place{0, 0, 0};
  bool geographic = false;
  Eigen::Vector3d sigma{0, 0, 0};  ///< along east, north and up, m
  /// Of the sensor as a body (x forward, y right, z down). The heading is from the northing axis of
  /// the map, or from true north where the place is geographic.
  trajectories::RollPitchHeading angles;
  trajectories::RollPitchHeading angle_sigma;  ///< rad
};

/// A point that is known on the map and visible in the scan.
struct StationTarget {
  std::string name;
  Eigen::Vector3d place{0, 0, 0};    ///< on the map, m
  Eigen::Vector3d sigma{0, 0, 0};    ///< along its axes, m
  Eigen::Vector3d in_scan{0, 0, 0};  ///< picked, or near the centre of a sphere; sensor's frame, m
  double in_scan_sigma = 0;          ///< of a picked point, along each axis, m
  std::optional<double> radius;      ///< of a sphere, m
};

/// Pose of a stationary sensor: stated, or determined from three or more targets.
struct Station {
  std::string name;
  std::optional<StatedPose> stated;
  std::vector<StationTarget> targets;
};

/// The stations of a survey, in the order of their recordings.
struct Stations {
  std::string crs;    ///< of all places, as MapProjection; empty: that of the points, or none
  std::string datum;  ///< of geographic places, as MapProjection; empty: WGS 84
  std::vector<Station> stations;
};

/// Reads risley_stations: 1, crs, datum (optional), stations: [{name, position, attitude}] or
/// [{name, targets}], see docs/files/stations.md.
/// @param path  for messages only
/// @throws FileError with the line for anything else
Stations parse_stations(const std::string& text, const std::string& path);

/// parse_stations of a file. @throws FileError
Stations load_stations(const std::string& path);

/// Axes of a map at a place, as columns in the frame: east, north (that of the map's grid) and up,
/// unit vectors at right angles.
/// @param map       nullptr: none, the frame is local
/// @param position  in the frame, m
/// @throws InvalidArgument as MapProjection::project
Eigen::Matrix3d map_axes(const MapProjection* map, const Eigen::Vector3d& position);

/// A stated pose in the frame of the points: geocentric, or local without a map.
/// @param map  of the place unless it is geographic; nullptr: none
/// @throws InvalidArgument for a place that the map or the ellipsoid does not have
StandingPose standing_pose(const StatedPose& stated, const MapProjection* map);

/// A pose on a map: place, m, angles from its grid, and their standard deviations.
/// @param map  nullptr: none @throws InvalidArgument as MapProjection::project
StatedPose pose_on_map(const StandingPose& pose, const MapProjection* map);

}  // namespace risley::cloud
