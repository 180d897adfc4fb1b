// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/vector3.hpp"
#include "risley/scenes/furniture.hpp"

namespace risley::scenes {

/// How far rays are followed, m.
inline constexpr double kFarthestHit = 1e6,  ///< to planes and faces
    kFarthestGround = 1e5;                   ///< to ground with relief

/// Where a ray ends.
struct Hit {
  double range = 0;                         ///< m
  double cosine = 0;                        ///< of the angle of incidence, [0, 1]
  std::size_t surface = 0;                  ///< of the scene, see Scene::surface_name
  Vector3<double> normal;                   ///< of the surface, unit vector, on either side
  double reflectivity = kMattReflectivity;  ///< seen through all panes before it, (0, 1]
};

/// Location of a map on the Earth: geodetic latitude and longitude, rad, and height above the
/// ellipsoid, m.
struct MapOrigin {
  double latitude = 0, longitude = 0, height = 0;
};

/// Hills: amplitude sin(2 pi x / wavelength_x) cos(2 pi y / wavelength_y), m.
struct Relief {
  double amplitude = 0, wavelength_x = 0, wavelength_y = 0;
};

/// Furrows: amplitude sin(2 pi s / wavelength), m, where s is the way from the origin towards a
/// heading, rad, clockwise from north.
struct Waves {
  double amplitude = 0, wavelength = 0, heading = 0;
};

/// The ground: a height, m, and additions to it.
struct Ground {
  double height = 0;
  std::vector<Relief> relief;
  std::vector<Waves> waves;

  /// Height at a place, m.
  double height_at(double x, double y) const;
};

/// Two rectangular faces that meet at a ridge. Heights of all objects are above the ground at their
/// centre.
struct GableRoof {
  std::string name;
  std::array<double, 2> center{0.0, 0.0};  ///< x, y below the middle of the ridge, m
  double length = 0;                       ///< of the ridge, m
  double face_width = 0;                   ///< of a face from ridge to eaves, along its slope, m
  double pitch = 0;                        ///< of the faces, rad
  double ridge_height = 0;                 ///< m
  double heading = 0;                      ///< of the ridge, rad, clockwise from north
  bool walls = false;                      ///< below the eaves and both gables, into the ground
};

/// A box: a flat top and four walls into the ground.
struct Building {
  std::string name;
  std::array<double, 2> center{0.0, 0.0};  ///< x, y, m
  std::array<double, 2> size{0.0, 0.0};    ///< along and across the heading, m
  double height = 0;                       ///< of the top, m
  double heading = 0;                      ///< rad, clockwise from north
};

/// An upright ellipsoid on the ground. A ray ends somewhere inside it, not at its surface.
struct Bush {
  std::string name;
  std::array<double, 2> center{0.0, 0.0};  ///< x, y, m
  double radius = 0, height = 0;           ///< m
};

/// Contents of a terrain, on a map: x east, y north, z up, m.
struct TerrainParts {
  std::optional<MapOrigin> origin;
  std::optional<Ground> ground;  ///< without it there is nothing below, and heights are above z = 0
  std::vector<GableRoof> roofs;
  std::vector<Building> buildings;
  std::vector<Bush> bushes;
};

/// Roofs and bushes at random places of a square. [low, high] are uniform.
struct VillageSettings {
  std::uint64_t seed = 0;
  std::array<double, 2> center{0.0, 0.0};
  double half_extent = 0;       ///< centres lie within center +- half_extent, m
  int roofs = 0, bushes = 0;    ///< how many
  double minimum_distance = 0;  ///< between the centres of two roofs, m
  double length = 0, face_width = 0;
  std::array<double, 2> pitch{0.0, 0.0}, ridge_height{0.0, 0.0};
  bool walls = false;
  std::array<double, 2> bush_radius{0.0, 0.0}, bush_height{0.0, 0.0};
};

/// Adds a village's roofs, "village roof 1", ..., and bushes, "village bush 1", ... The same
/// settings give the same village.
/// @throws InvalidArgument for invalid settings, and if the roofs do not fit
void add_village(const VillageSettings& settings, TerrainParts& parts);

/// A flat convex polygon, seen from both sides.
struct Face {
  std::string name;
  Vector3<double> normal;                ///< unit vector, out of the roof or building
  std::vector<Vector3<double>> corners;  ///< in order, m
};

/// Ground with houses and bushes, in which rays are traced fast: faces and bushes are looked up in
/// a grid over x and y, and ground with relief is approached by steps that cannot jump over it.
/// Rays from above and from below terminate. docs/theory/terrain.md
class Terrain {
 public:
  /// @throws InvalidArgument for invalid parts or an empty terrain
  explicit Terrain(TerrainParts parts);

  /// The parts from which it was made.
  const TerrainParts& parts() const { return parts_; }
  /// All roofs, tops and walls: surfaces 0, 1, ... The bushes follow them, then the ground.
  const std::vector<Face>& faces() const { return faces_; }
  /// Number of surfaces: those of faces(), the bushes and, if there is one, the ground.
  std::size_t surfaces() const;
  /// "barn, right face", "ground". @throws InvalidArgument for a surface that does not exist
  std::string surface_name(std::size_t surface) const;

  /// The nearest surface in front of a ray, or nothing. Arguments are not checked.
  /// @param origin       m
  /// @param direction    unit vector
  /// @param farthest  distance of interest, m
  /// @param penetration  share of a bush that a ray gets through, (0, 1)
  std::optional<Hit> nearest_hit(const Vector3<double>& origin, const Vector3<double>& direction,
                                 double farthest, double penetration) const;

 private:
  /// A face for ray tracing: the plane, and planes through its edges, positive inside.
  struct Slab {
    Vector3<double> normal;
    double offset = 0;
    std::size_t first_edge = 0, end_edge = 0;
  };
  struct Edge {
    Vector3<double> normal;
    double offset = 0;
  };
  /// One sine of the ground: amplitude sin(x * wave_x + y * wave_y).
  struct Sine {
    double amplitude = 0, wave_x = 0, wave_y = 0;
  };
  struct Box {
    Vector3<double> low, high;
  };

  void add_face(std::string name, std::vector<Vector3<double>> corners);
  void add_roof(const GableRoof& roof, double lowest);
  void add_building(const Building& building, double lowest);
  void fill_grid();
  void meet_face(std::size_t face, const Vector3<double>& origin, const Vector3<double>& direction,
                 std::optional<Hit>& nearest, double farthest) const;
  void meet_bush(std::size_t bush, const Vector3<double>& origin, const Vector3<double>& direction,
                 double penetration, std::optional<Hit>& nearest, double farthest) const;
  void meet_ground(const Vector3<double>& origin, const Vector3<double>& direction,
                   std::optional<Hit>& nearest, double farthest) const;

  TerrainParts parts_;
  std::vector<Face> faces_;
  std::vector<Slab> slabs_;
  std::vector<Edge> edges_;
  std::vector<double> bush_floor_;  ///< height of the ground below each bush, m
  std::vector<Sine> sines_;
  double swing_ = 0;  ///< largest height of the ground above and below its mean, m

  // The grid: cell (i, j) holds items_[first_[i + j * columns_]] to the next cell's first.
  std::vector<Box> boxes_;  ///< around each face and bush
  Box around_;              ///< around all of them
  double cell_ = 0;         ///< side, m
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_, items_;
};

}  // namespace risley::scenes
