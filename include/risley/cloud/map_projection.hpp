// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Core>

#include "risley/core/error.hpp"

namespace risley::cloud {

/// The second-order expansion of a map about one place: coordinates within some hundred metres to
/// millionths of a metre (1e-6 m at 300 m, 2e-6 m at 500 m), without a call of the projection
/// library.
class MapTangent {
 public:
  /// Of a map that leaves coordinates unchanged.
  MapTangent() = default;
  /// @param value     of the map at `center`, m
  /// @param jacobian  [row: map axis, column: axis of the argument]
  /// @param hessian   of each map axis, 1/m
  MapTangent(const Eigen::Vector3d& center, const Eigen::Vector3d& value,
             const Eigen::Matrix3d& jacobian, const std::array<Eigen::Matrix3d, 3>& hessian);

  /// The map at a point, to second order about the centre, m.
  Eigen::Vector3d map(const Eigen::Vector3d& point) const;
  /// At the centre; a covariance C becomes J C J'.
  const Eigen::Matrix3d& jacobian() const { return jacobian_; }
  /// Where the expansion was made, m.
  const Eigen::Vector3d& center() const { return center_; }
  /// Of the map at the centre, m.
  const Eigen::Vector3d& value() const { return value_; }
  /// Half the second derivatives of a map axis, 1/m.
  const Eigen::Matrix3d& half_hessian(std::size_t axis) const { return half_hessian_[axis]; }

 private:
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero(), value_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d jacobian_ = Eigen::Matrix3d::Identity();
  std::array<Eigen::Matrix3d, 3> half_hessian_{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(),
                                               Eigen::Matrix3d::Zero()};
};

/// Area of use of a map.
struct AreaOfUse {
  std::string name;  ///< "Between 6°E and 12°E, northern hemisphere between equator and 84°N, ..."
  double west = 0, south = 0, east = 0, north = 0;  ///< rad; west above east: across 180 degrees
  /// Distance of a place outside, in latitude or longitude, rad; 0 within.
  double beyond(double latitude, double longitude) const;
};

/// A coordinate reference system with angles as coordinates, which points cannot use.
class GeographicSystem : public InvalidArgument {
 public:
  /// @param system  by its usual name: "ETRS89"
  GeographicSystem(const std::string& message, std::string system)
      : InvalidArgument(message), system_(std::move(system)) {}
  /// The same with the UTM zone of the points' place, rad, as advice.
  InvalidArgument at(double latitude, double longitude) const;

 private:
  std::string system_;
};

/// From geocentric coordinates (WGS 84 or another datum of the Earth) to easting, northing and
/// height of a map, all in metres. May be used by several threads.
class MapProjection {
 public:
  /// @param crs     what the map is: "EPSG:25832", with a height system "EPSG:25832+7837", or WKT.
  ///                Without a height system heights are above the ellipsoid.
  /// @param source  the datum of the positions, a geographic or geocentric system: "EPSG:4979" is
  ///                WGS 84, "EPSG:4937" ETRS89, "EPSG:9988" ITRF2020; empty: that of the map
  /// @throws GeographicSystem; InvalidArgument for systems that are unknown, not a map in metres,
  /// or that can only be reached with a file that is not installed (the message names it, and its
  /// source)
  explicit MapProjection(const std::string& crs, const std::string& source = "EPSG:4979");
  ~MapProjection();
  MapProjection(MapProjection&&) noexcept;
  MapProjection& operator=(MapProjection&&) noexcept;

  /// One point, exactly, by the projection library.
  /// @throws InvalidArgument outside the map's reach
  Eigen::Vector3d project(const Eigen::Vector3d& geocentric_m) const;

  /// The geocentric place of a point of the map, m: the inverse of project().
  /// @throws InvalidArgument where there is none
  Eigen::Vector3d unproject(const Eigen::Vector3d& on_map_m) const;

  /// The map about a place. @throws as project()
  MapTangent tangent(const Eigen::Vector3d& geocentric_m) const;

  const std::string& name() const;  ///< "ETRS89 / UTM zone 32N"
  const std::string& wkt() const;   ///< as LAS 1.4 files want it: OGC WKT 1
  bool has_height_system() const;   ///< otherwise heights are ellipsoidal
  /// Nothing if the system does not state it, as private ones in WKT.
  const std::optional<AreaOfUse>& area() const;
  /// The library's description of the change of datum, once a point was projected: "WGS 84 to
  /// ETRS89 (1), accuracy 1 m"; empty if there is none.
  std::string operation() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The UTM zone of a place, with ellipsoidal heights: "EPSG:32632".
/// @param latitude, longitude  rad
/// @param system  geographic system that it is to be of, by name, such as "ETRS89"; WGS 84 where
///                there is no such zone
/// @throws InvalidArgument beyond 84 north and 80 south
std::string utm_zone_of(double latitude, double longitude, const std::string& system = "WGS 84");

}  // namespace risley::cloud
