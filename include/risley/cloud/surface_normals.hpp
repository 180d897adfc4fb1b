// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "risley/core/vector3.hpp"

namespace risley::cloud {

/// Orientations of the surfaces in a sensor's view, from the ranges around each direction. Cells of
/// one degree collect moments of inverse depth over y/x and z/x, in which a plane is linear; a cell
/// and its eight neighbours together give one fit. Where surfaces end or meet there is no fit, and
/// a shot belongs to the surface of a nearby cell that predicts its range, if there is one.
/// Directions flatter than six degrees to the plane across the X axis, or behind it, have none.
/// Derivation: docs/theory/cloud.md
class SurfaceNormals {
 public:
  /// @param range_noise 1 sigma, m: surfaces whose ranges scatter more than kRoughest times as much
  /// are edges, leaves or several surfaces, and get no normal
  /// @param direction_noise  1 sigma about two axes, rad: on a slanted surface it adds its distance
  ///                     times the tangent of the angle of incidence to the scatter of ranges
  /// @throws InvalidArgument for range noise not above 0, direction noise below 0
  explicit SurfaceNormals(double range_noise, double direction_noise = 0);

  /// Largest scatter of ranges about a surface, as a multiple of the noise.
  static constexpr double kRoughest = 2.0;

  /// Discards all shots; normals stay until the next fit().
  void clear();
  /// Adds one shot; one without a range above 0 is ignored. @param azimuth, zenith  rad
  /// @param range  m
  void add(double azimuth, double zenith, double range);
  /// Fits all cells to the shots added.
  void fit();
  /// Unit normal of the surface at a shot, of either sign, sensor frame; NaN if there is none.
  Vector3<double> normal(double azimuth, double zenith, double range) const {
    const std::size_t cell = cell_of(azimuth, zenith);
    if (cell == kNowhere) return kNone;
    const Surface& own = surfaces_[cell];
    if (own.beside_count == 0) return own.plane.normal();
    return normal_beside(own, azimuth, zenith, range);
  }

 private:
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
  static constexpr int kHalf = 90;         // cells on either side of the X axis
  static constexpr int kSide = 2 * kHalf;  // cells along azimuth and along zenith
  static constexpr double kCellsPerRadian = 57.29577951308232;
  static const Vector3<double> kNone;

  /// Of u = y/x, v = z/x and inverse depth q = 1/x, weighted so that residuals count as ranges do.
  struct Moments {
    double n = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0, q = 0, qu = 0, qv = 0, qq = 0;
    double count = 0;
    void add(const Moments& other);
  };

  static std::size_t cell_of(double azimuth, double zenith) {
    const double column = azimuth * kCellsPerRadian + kHalf;
    const double row = zenith * kCellsPerRadian;
    if (!(column >= 0 && column < kSide && row >= 0 && row < kSide)) return kNowhere;
    return static_cast<std::size_t>(row) * kSide + static_cast<std::size_t>(column);
  }
  /// Points p with n p = distance; NaN if there is none.
  struct FittedPlane {
    std::array<float, 3> n;
    float distance = 0;

    bool exists() const { return n[0] == n[0]; }
    Vector3<double> normal() const { return {n[0], n[1], n[2]}; }
    /// Its distance in a direction.
    double range(const Vector3<double>& direction) const {
      return static_cast<double>(distance) / dot(normal(), direction);
    }
    /// Slope of the range over the direction, m per rad.
    double slope(const Vector3<double>& direction) const;
  };
  /// Result of a cell: its plane, or those of nearby cells.
  struct Surface {
    FittedPlane plane;
    std::uint32_t beside = 0;  ///< first of its row in beside_
    std::uint32_t beside_count = 0;
  };

  static const FittedPlane kNoPlane;

  FittedPlane fitted(const Moments& moments) const;
  void find_beside(std::size_t cell);
  template <class Function>
  static void for_cells_around(std::size_t cell, int reach, Function&& function);
  Vector3<double> normal_beside(const Surface& surface, double azimuth, double zenith,
                                double range) const;

  /// Variance of ranges of a plane in a direction, m^2.
  double variance(const FittedPlane& plane, const Vector3<double>& direction) const;

  double range_noise_, direction_noise_;
  std::vector<Moments> moments_;
  std::vector<std::size_t> touched_;
  std::vector<Surface> surfaces_;
  std::vector<FittedPlane> beside_;
};

}  // namespace risley::cloud
