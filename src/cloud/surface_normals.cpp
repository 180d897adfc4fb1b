// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/surface_normals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "risley/core/direction.hpp"
#include "risley/core/require.hpp"

namespace risley::cloud {
namespace {

/// Of a fit: nine degrees of freedom determine its roughness to a quarter, 1 / sqrt(2 * 9).
constexpr double kLeastShots = 12;
/// Least X of the directions used: sine of the six degrees documented in SurfaceNormals.
constexpr double kLeastForward = 0.1;
/// Share of the squared spread across that shots along one line lack: 1 - correlation^2.
/// SurfaceNormals.ShotsAlongALineHaveNone
constexpr double kLeastSpread = 1e-3;
/// Distance of the neighbours searched for a cell without a fit: an edge in one cell spoils the
/// fits of all eight around it.
constexpr int kReach = 2;
/// A shot is on a nearby surface that predicts its range within this many sigmas.
constexpr double kNearEnough = 3;
/// Surfaces that differ by less, in sigmas and as the cosine between normals, are one: 3 degrees.
constexpr double kSameRange = 1, kSameNormal = 0.9986;

constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

}  // namespace

const SurfaceNormals::FittedPlane SurfaceNormals::kNoPlane{{kNoValue, kNoValue, kNoValue},
                                                           kNoValue};
const Vector3<double> SurfaceNormals::kNone{kNoValue, kNoValue, kNoValue};

template <class Function>
void SurfaceNormals::for_cells_around(std::size_t cell, int reach, Function&& function) {
  const int row = static_cast<int>(cell) / kSide, column = static_cast<int>(cell) % kSide;
  for (int i = std::max(row - reach, 0); i <= std::min(row + reach, kSide - 1); ++i) {
    for (int j = std::max(column - reach, 0); j <= std::min(column + reach, kSide - 1); ++j) {
      function(i * kSide + j);
    }
  }
}

void SurfaceNormals::Moments::add(const Moments& other) {
  for (const auto term :
       {&Moments::n, &Moments::u, &Moments::v, &Moments::uu, &Moments::uv, &Moments::vv,
        &Moments::q, &Moments::qu, &Moments::qv, &Moments::qq, &Moments::count}) {
    this->*term += other.*term;
  }
}

double SurfaceNormals::FittedPlane::slope(const Vector3<double>& direction) const {
  const double cosine = dot(normal(), direction);
  return range(direction) * std::sqrt(std::max(1 - cosine * cosine, 0.0)) / cosine;
}

double SurfaceNormals::variance(const FittedPlane& plane, const Vector3<double>& direction) const {
  const double slanted = plane.slope(direction) * direction_noise_;
  return range_noise_ * range_noise_ + slanted * slanted;
}

SurfaceNormals::SurfaceNormals(double range_noise, double direction_noise)
    : range_noise_(range_noise), direction_noise_(direction_noise) {
  require_above("range noise", range_noise, 0, "m");
  require_not_below("direction noise", direction_noise, 0, "rad");
  moments_.resize(static_cast<std::size_t>(kSide) * kSide);
  surfaces_.assign(moments_.size(), {kNoPlane});
}

void SurfaceNormals::clear() {
  for (const std::size_t cell : touched_) moments_[cell] = {};
  touched_.clear();
}

void SurfaceNormals::add(double azimuth, double zenith, double range) {
  const std::size_t cell = cell_of(azimuth, zenith);
  if (cell == kNowhere) return;
  if (!(range > 0)) return;
  const Vector3<double> d = direction_from_angles<double>({azimuth, zenith});
  if (!(d.x > kLeastForward)) return;
  Moments& m = moments_[cell];
  if (m.count == 0) touched_.push_back(cell);
  const double u = d.y / d.x, v = d.z / d.x;
  const double depth = range * d.x;
  const double q = 1.0 / depth;
  const double w = range * range * depth * depth;
  m.n += w;
  m.u += w * u;
  m.v += w * v;
  m.uu += w * u * u;
  m.uv += w * u * v;
  m.vv += w * v * v;
  m.q += w * q;
  m.qu += w * q * u;
  m.qv += w * q * v;
  m.qq += range * range;
  m.count += 1;
}

void SurfaceNormals::fit() {
  std::ranges::fill(surfaces_, Surface{kNoPlane});
  beside_.clear();
  for (const std::size_t cell : touched_) {
    Moments sum;
    for_cells_around(cell, 1, [&](std::size_t other) { sum.add(moments_[other]); });
    surfaces_[cell].plane = fitted(sum);
  }
  for (const std::size_t cell : touched_) {
    if (!surfaces_[cell].plane.exists()) find_beside(cell);
  }
}

void SurfaceNormals::find_beside(std::size_t cell) {
  Surface& own = surfaces_[cell];
  own.beside = static_cast<std::uint32_t>(beside_.size());
  const auto middle = [](std::size_t number) {
    return (static_cast<double>(number) + 0.5) / kCellsPerRadian;
  };
  const Vector3<double> towards = direction_from_angles<double>(
      {middle(cell % kSide) - kHalf / kCellsPerRadian, middle(cell / kSide)});
  const auto known = [&](const FittedPlane& plane) {
    return std::any_of(beside_.begin() + own.beside, beside_.end(), [&](const FittedPlane& other) {
      return std::abs(plane.range(towards) - other.range(towards)) < kSameRange * range_noise_ &&
             std::abs(dot(plane.normal(), other.normal())) > kSameNormal;
    });
  };
  for_cells_around(cell, kReach, [&](std::size_t other) {
    const FittedPlane& plane = surfaces_[other].plane;
    if (plane.exists() && !known(plane)) beside_.push_back(plane);
  });
  own.beside_count = static_cast<std::uint32_t>(beside_.size()) - own.beside;
}

Vector3<double> SurfaceNormals::normal_beside(const Surface& surface, double azimuth, double zenith,
                                              double range) const {
  const Vector3<double> direction = direction_from_angles<double>({azimuth, zenith});
  double nearest = kNearEnough;  // sigmas
  Vector3<double> normal = kNone;
  for (std::uint32_t k = 0; k < surface.beside_count; ++k) {
    const FittedPlane& plane = beside_[surface.beside + k];
    const double off =
        std::abs(plane.range(direction) - range) / std::sqrt(variance(plane, direction));
    if (!(off < nearest)) continue;
    nearest = off;
    normal = plane.normal();
  }
  return normal;
}

SurfaceNormals::FittedPlane SurfaceNormals::fitted(const Moments& m) const {
  if (m.count < kLeastShots) return kNoPlane;
  // About the mean: q + slope_u (u - mean u) + slope_v (v - mean v).
  const double u = m.u / m.n, v = m.v / m.n, q = m.q / m.n;
  const double uu = m.uu - m.n * u * u, uv = m.uv - m.n * u * v, vv = m.vv - m.n * v * v;
  const double qu = m.qu - m.n * q * u, qv = m.qv - m.n * q * v;
  const double determinant = uu * vv - uv * uv;
  // Shots along one line determine a slope in one direction only.
  if (!(determinant > kLeastSpread * uu * vv)) return kNoPlane;
  const double slope_u = (qu * vv - qv * uv) / determinant;
  const double slope_v = (qv * uu - qu * uv) / determinant;
  const double misfit = m.qq - m.n * q * q - slope_u * qu - slope_v * qv;
  // The coefficients of 1, u and v are n over the distance.
  const Vector3<double> over_distance{q - u * slope_u - v * slope_v, slope_u, slope_v};
  const double distance = 1.0 / norm(over_distance);
  const Vector3<double> normal = distance * over_distance;
  const FittedPlane plane{
      {static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)},
      static_cast<float>(distance)};
  const Vector3<double> towards = (1.0 / std::sqrt(1 + u * u + v * v)) * Vector3<double>{1, u, v};
  const double limit = kRoughest * kRoughest * variance(plane, towards);
  return misfit > limit * (m.count - 3) ? kNoPlane : plane;
}

}  // namespace risley::cloud
