// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/geodesy.hpp"

#include <cmath>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"

namespace risley::trajectories {
namespace {

// Coordinates of 6.4e6 m in double precision are exact to a nanometre. Sums of them are formed in
// extended precision, so that only the rounding of the results remains.
using Extended = long double;

constexpr Extended kRatio = 1 - Extended{kFlattening};  // of the polar axis to the equatorial one
constexpr Extended kEccentricitySquared = 1 - kRatio * kRatio;

void require_place(const Geodetic& place) {
  require_between("latitude", place.latitude, -kPi / 2, kPi / 2, "rad");
  require_between("longitude", place.longitude, -kTwoPi, kTwoPi, "rad");
  require_between("height", place.height, kLowestHeight, kHighestHeight, "m");
}

/// One step towards the normal of the ellipsoid, with components up and out.
/// @param z, from_axis  of the place, m
template <class Number>
void bowring_step(Number z, Number from_axis, Number& up, Number& out) {
  constexpr Number kAxesRatio = static_cast<Number>(kRatio);
  constexpr Number kUp = static_cast<Number>((1 / (kRatio * kRatio) - 1) * kSemiMajorAxis * kRatio);
  constexpr Number kOut = static_cast<Number>(kEccentricitySquared * kSemiMajorAxis);
  const Number flat = kAxesRatio * up;
  const Number length = std::sqrt(flat * flat + out * out);
  const Number sine = flat / length, cosine = out / length;
  up = z + kUp * sine * sine * sine;
  out = from_axis - kOut * cosine * cosine * cosine;
}

}  // namespace

Eigen::Vector3d geocentric_from_geodetic(const Geodetic& place) {
  require_place(place);
  const Extended sine = std::sin(Extended{place.latitude});
  const Extended cosine = std::cos(Extended{place.latitude});
  const Extended normal = kSemiMajorAxis / std::sqrt(1 - kEccentricitySquared * sine * sine);
  const Extended from_axis = (normal + place.height) * cosine;
  return {static_cast<double>(from_axis * std::cos(Extended{place.longitude})),
          static_cast<double>(from_axis * std::sin(Extended{place.longitude})),
          static_cast<double>((normal * (1 - kEccentricitySquared) + place.height) * sine)};
}

Geodetic geodetic_from_geocentric(const Eigen::Vector3d& position) {
  require_finite("position.x", position.x(), "m");
  require_finite("position.y", position.y(), "m");
  require_finite("position.z", position.z(), "m");
  require_between("distance from the centre of the Earth", position.norm(),
                  kSemiMajorAxis * (1 - kFlattening) + kLowestHeight,
                  kSemiMajorAxis + kHighestHeight, "m");
  // Bowring's iteration on the reduced latitude: the error shrinks by a factor of a thousand or
  // more with every step, and the first value is accurate to 0.2 degree. Only the last step is in
  // extended precision.
  const Extended z = position.z();
  const Extended from_axis =
      std::sqrt(Extended{position.x()} * position.x() + Extended{position.y()} * position.y());
  double rough_up = position.z(), rough_out = static_cast<double>(kRatio * kRatio * from_axis);
  for (int i = 0; i < 5; ++i)
    bowring_step(position.z(), static_cast<double>(from_axis), rough_up, rough_out);
  Extended up = rough_up, out = rough_out;  // along the normal of the ellipsoid
  bowring_step(z, from_axis, up, out);
  const Extended length = std::sqrt(up * up + out * out);
  const Extended sine = up / length, cosine = out / length;
  Geodetic place;
  place.latitude = static_cast<double>(std::atan2(up, out));
  place.longitude = std::atan2(position.y(), position.x());
  place.height =
      static_cast<double>(from_axis * cosine + z * sine -
                          kSemiMajorAxis * std::sqrt(1 - kEccentricitySquared * sine * sine));
  return place;
}

Eigen::Matrix3d geocentric_from_ned(const Geodetic& place) {
  require_place(place);
  const double sin_latitude = std::sin(place.latitude), cos_latitude = std::cos(place.latitude);
  const double sin_longitude = std::sin(place.longitude), cos_longitude = std::cos(place.longitude);
  Eigen::Matrix3d axes;
  axes.col(0) << -sin_latitude * cos_longitude, -sin_latitude * sin_longitude, cos_latitude;
  axes.col(1) << -sin_longitude, cos_longitude, 0;
  axes.col(2) << -cos_latitude * cos_longitude, -cos_latitude * sin_longitude, -sin_latitude;
  return axes;
}

}  // namespace risley::trajectories
