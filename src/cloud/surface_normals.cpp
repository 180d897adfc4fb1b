// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/surface_normals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley::cloud {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr double kLeastShots = 12;

}  // namespace

const Vector3<double> SurfaceNormals::kNone{kNaN, kNaN, kNaN};

void SurfaceNormals::Moments::add(const Moments& other) {
  n += other.n;
  a += other.a;
  z += other.z;
  aa += other.aa;
  az += other.az;
  zz += other.zz;
  q += other.q;
  qa += other.qa;
  qz += other.qz;
  qq += other.qq;
  count += other.count;
}

SurfaceNormals::SurfaceNormals(double range_noise) : range_noise_(range_noise) {
  if (!(range_noise > 0) || !std::isfinite(range_noise)) {
    throw InvalidArgument(fmt::format("range noise = {} m, allowed above 0", range_noise));
  }
  moments_.resize(static_cast<std::size_t>(kSide) * kSide);
  normals_.assign(moments_.size(), {kNaN, kNaN, kNaN});
}

void SurfaceNormals::clear() {
  for (const std::size_t cell : touched_) moments_[cell] = {};
  touched_.clear();
}

void SurfaceNormals::add(double azimuth, double zenith, double range) {
  const std::size_t cell = cell_of(azimuth, zenith);
  if (cell == kNowhere) return;
  Moments& m = moments_[cell];
  if (m.count == 0) touched_.push_back(cell);
  const double elevation = kPi / 2 - zenith;
  const double range2 = range * range;
  const double w = range2 * range2;
  const double q = 1.0 / range;
  m.n += w;
  m.a += w * azimuth;
  m.z += w * elevation;
  m.aa += w * azimuth * azimuth;
  m.az += w * azimuth * elevation;
  m.zz += w * elevation * elevation;
  m.q += w * q;
  m.qa += w * q * azimuth;
  m.qz += w * q * elevation;
  m.qq += range2;
  m.count += 1;
}

void SurfaceNormals::fit() {
  std::fill(normals_.begin(), normals_.end(), std::array<float, 3>{kNaN, kNaN, kNaN});
  for (const std::size_t cell : touched_) {
    const int row = static_cast<int>(cell) / kSide, column = static_cast<int>(cell) % kSide;
    Moments sum;
    for (int i = std::max(row - 1, 0); i <= std::min(row + 1, kSide - 1); ++i) {
      for (int j = std::max(column - 1, 0); j <= std::min(column + 1, kSide - 1); ++j) {
        sum.add(moments_[static_cast<std::size_t>(i * kSide + j)]);
      }
    }
    normals_[cell] = fitted(sum);
  }
}

std::array<float, 3> SurfaceNormals::fitted(const Moments& m) const {
  if (m.count < kLeastShots) return {kNaN, kNaN, kNaN};
  // About the mean direction: 1/range = q + qa (azimuth - a) + qz (elevation - z).
  const double a = m.a / m.n, z = m.z / m.n, q = m.q / m.n;
  const double aa = m.aa - m.n * a * a, az = m.az - m.n * a * z, zz = m.zz - m.n * z * z;
  const double qa = m.qa - m.n * q * a, qz = m.qz - m.n * q * z;
  const double determinant = aa * zz - az * az;
  // Shots along one line tell a slope in one direction only.
  if (!(determinant > 1e-3 * aa * zz)) return {kNaN, kNaN, kNaN};
  const double slope_a = (qa * zz - qz * az) / determinant;
  const double slope_z = (qz * aa - qa * az) / determinant;
  const double misfit = m.qq - m.n * q * q - slope_a * qa - slope_z * qz;
  const double limit = kRoughest * range_noise_;
  if (misfit > limit * limit * (m.count - 3)) return {kNaN, kNaN, kNaN};
  // normal / distance: its component along the mean direction is q, those along the derivatives of
  // the direction with respect to azimuth and elevation are the slopes.
  const double sin_a = std::sin(a), cos_a = std::cos(a), sin_z = std::sin(z), cos_z = std::cos(z);
  const double across = slope_a / cos_z;
  Vector3<double> normal{q * cos_z * cos_a - across * sin_a - slope_z * sin_z * cos_a,
                         q * cos_z * sin_a + across * cos_a - slope_z * sin_z * sin_a,
                         q * sin_z + slope_z * cos_z};
  normal = normalized(normal);
  return {static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)};
}

}  // namespace risley::cloud
