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

constexpr float kNoNormal = std::numeric_limits<float>::quiet_NaN();
/// Of a fit: nine degrees of freedom tell its roughness to a quarter, 1 / sqrt(2 * 9).
constexpr double kLeastShots = 12;
/// X of the directions that are looked at: sine of the six degrees that SurfaceNormals tells of.
constexpr double kLeastForward = 0.1;
/// Part of the squared spread across that shots along one line lack: 1 - correlation^2.
/// SurfaceNormals.ShotsAlongALineHaveNone
constexpr double kLeastSpread = 1e-3;

}  // namespace

const Vector3<double> SurfaceNormals::kNone{kNoNormal, kNoNormal, kNoNormal};

void SurfaceNormals::Moments::add(const Moments& other) {
  for (const auto term :
       {&Moments::n, &Moments::u, &Moments::v, &Moments::uu, &Moments::uv, &Moments::vv,
        &Moments::q, &Moments::qu, &Moments::qv, &Moments::qq, &Moments::count}) {
    this->*term += other.*term;
  }
}

SurfaceNormals::SurfaceNormals(double range_noise) : range_noise_(range_noise) {
  require_above("range noise", range_noise, 0, "m");
  moments_.resize(static_cast<std::size_t>(kSide) * kSide);
  normals_.assign(moments_.size(), {kNoNormal, kNoNormal, kNoNormal});
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
  std::fill(normals_.begin(), normals_.end(),
            std::array<float, 3>{kNoNormal, kNoNormal, kNoNormal});
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
  if (m.count < kLeastShots) return {kNoNormal, kNoNormal, kNoNormal};
  // About the mean: q + slope_u (u - mean u) + slope_v (v - mean v).
  const double u = m.u / m.n, v = m.v / m.n, q = m.q / m.n;
  const double uu = m.uu - m.n * u * u, uv = m.uv - m.n * u * v, vv = m.vv - m.n * v * v;
  const double qu = m.qu - m.n * q * u, qv = m.qv - m.n * q * v;
  const double determinant = uu * vv - uv * uv;
  // Shots along one line tell a slope in one direction only.
  if (!(determinant > kLeastSpread * uu * vv)) return {kNoNormal, kNoNormal, kNoNormal};
  const double slope_u = (qu * vv - qv * uv) / determinant;
  const double slope_v = (qv * uu - qu * uv) / determinant;
  const double misfit = m.qq - m.n * q * q - slope_u * qu - slope_v * qv;
  const double limit = kRoughest * range_noise_;
  if (misfit > limit * limit * (m.count - 3)) return {kNoNormal, kNoNormal, kNoNormal};
  const Vector3<double> normal =
      normalized(Vector3<double>{q - u * slope_u - v * slope_v, slope_u, slope_v});
  return {static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)};
}

}  // namespace risley::cloud
