// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/geodesy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

namespace risley::trajectories::geodesy_test {

using Long = long double;
using LongVector = Eigen::Matrix<Long, 3, 1>;

constexpr Long kA = 6378137.0L, kF = 1 / 298.257223563L;

struct LongPlace {
  Long latitude, longitude, height;
};

/// The ellipsoid as a parametric surface of the reduced latitude, and its normal.
LongVector long_geocentric(const LongPlace& place) {
  const Long b = kA * (1 - kF);
  const Long reduced = std::atan2((1 - kF) * std::sin(place.latitude), std::cos(place.latitude));
  const Long from_axis = kA * std::cos(reduced) + place.height * std::cos(place.latitude);
  return {from_axis * std::cos(place.longitude), from_axis * std::sin(place.longitude),
          b * std::sin(reduced) + place.height * std::sin(place.latitude)};
}

/// By another way than the library: the height along the normal and the latitude in turns, until
/// nothing changes.
LongPlace long_geodetic(const LongVector& p) {
  const Long squared = kF * (2 - kF);
  const Long from_axis = std::hypot(p.x(), p.y());
  LongPlace place{std::atan2(p.z(), from_axis * (1 - squared)), std::atan2(p.y(), p.x()), 0};
  for (int i = 0; i < 60; ++i) {
    const Long sine = std::sin(place.latitude);
    const Long normal = kA / std::sqrt(1 - squared * sine * sine);
    place.latitude = std::atan2(p.z() + squared * normal * sine, from_axis);
  }
  const Long sine = std::sin(place.latitude), cosine = std::cos(place.latitude);
  place.height = from_axis * cosine + p.z() * sine - kA * std::sqrt(1 - squared * sine * sine);
  return place;
}

std::vector<double> latitudes() {
  std::vector<double> all;
  for (int deg = -90; deg <= 90; deg += 3)
    all.push_back(std::clamp(radians_from_degrees(deg), -kPi / 2, kPi / 2));
  for (const double small : {1e-15, 1e-12, 1e-9, 1e-6, 1e-3}) {
    for (const double sign : {-1.0, 1.0}) {
      all.push_back(sign * small);
      all.push_back(sign * (kPi / 2 - small));
    }
  }
  return all;
}

TEST(Geodesy, GeocentricAgreesWithExtendedPrecision) {
  for (const double latitude : latitudes()) {
    for (const double longitude : {-kPi, -2.0773, 0.0, 1e-9, 0.7, kPi}) {
      for (const double height : {-1e4, -400.0, 0.0, 80.0, 7000.0, 4e5}) {
        const Eigen::Vector3d p = geocentric_from_geodetic({latitude, longitude, height});
        const LongVector exact = long_geocentric({latitude, longitude, height});
        // Half a unit in the last place of 6.4e6 m is 0.47e-9 m, on each of three axes.
        EXPECT_LT(static_cast<double>((p.cast<Long>() - exact).norm()), 0.81e-9)
            << latitude << ' ' << longitude << ' ' << height;
      }
    }
  }
}

TEST(Geodesy, GeodeticAgreesWithAnotherFormulaInExtendedPrecision) {
  for (const double latitude : latitudes()) {
    for (const double longitude : {-3.0, -2.0773, 0.0, 0.7, 3.1}) {
      for (const double height : {-1e4, 0.0, 80.0, 7000.0, 4e5, 3.6e7}) {
        const Eigen::Vector3d p = geocentric_from_geodetic({latitude, longitude, height});
        const Geodetic place = geodetic_from_geocentric(p);
        const LongPlace exact = long_geodetic(p.cast<Long>());
        // In metres: half a unit in the last place of 90 degrees is 0.71e-9 m at the ground.
        const Long radius = kA + height;
        const double unit = static_cast<double>(radius / kA);
        EXPECT_LT(std::abs(static_cast<double>((place.latitude - exact.latitude) * radius)),
                  0.72e-9 * unit)
            << latitude << ' ' << longitude << ' ' << height;
        EXPECT_LT(std::abs(static_cast<double>(place.height - exact.height)), 4e-9)
            << latitude << ' ' << longitude << ' ' << height;
        EXPECT_LT(std::abs(static_cast<double>((place.longitude - exact.longitude) * radius *
                                               std::cos(exact.latitude))),
                  1.5e-9 * unit);
      }
    }
  }
}

TEST(Geodesy, RoundTripStaysWithinANanometre) {
  double worst = 0;
  for (const double latitude : latitudes()) {
    for (const double longitude : {-1.5, -0.3, 0.0, 0.7, 1.4}) {
      for (const double height : {-400.0, 0.0, 80.0, 3000.0}) {
        const Eigen::Vector3d p = geocentric_from_geodetic({latitude, longitude, height});
        const Geodetic place = geodetic_from_geocentric(p);
        // Rounding of the two numbers that hold 6.4e6 m, the geodetic and the geocentric ones, is
        // not the formula's: it is taken out by going back in extended precision.
        const LongVector back = long_geocentric({place.latitude, place.longitude, place.height});
        worst = std::max(worst, static_cast<double>((back - p.cast<Long>()).norm()));
      }
    }
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(Geodesy, KnownPlaces) {
  EXPECT_EQ(geocentric_from_geodetic({0, 0, 0}), Eigen::Vector3d(6378137, 0, 0));
  const Eigen::Vector3d pole = geocentric_from_geodetic({kPi / 2, 0, 10});
  EXPECT_NEAR(pole.z(), 6356752.314245179 + 10, 2e-9);
  EXPECT_NEAR(pole.x(), 0, 1e-9);
  const Geodetic south = geodetic_from_geocentric({0, 0, -6356752.314245179});
  EXPECT_EQ(south.latitude, -kPi / 2);
  EXPECT_EQ(south.longitude, 0);
  EXPECT_NEAR(south.height, 0, 2e-9);
}

TEST(Geodesy, AxesAreDerivativesOfThePlace) {
  for (const double latitude : {-1.2, 0.0, 0.9}) {
    for (const double longitude : {-2.0, 0.3}) {
      const LongPlace here{latitude, longitude, 100};
      constexpr Long kStep = 1e-6L;
      const auto direction = [](const LongVector& d) -> Eigen::Vector3d {
        return (d / d.norm()).cast<double>();
      };
      const Eigen::Matrix3d axes = geocentric_from_ned({latitude, longitude, 100});
      const auto at = [&](Long north, Long east, Long up) {
        return long_geocentric({here.latitude + north, here.longitude + east, here.height + up});
      };
      EXPECT_LT((axes.col(0) - direction(at(kStep, 0, 0) - at(-kStep, 0, 0))).norm(), 1e-12);
      EXPECT_LT((axes.col(1) - direction(at(0, kStep, 0) - at(0, -kStep, 0))).norm(), 1e-12);
      EXPECT_LT((axes.col(2) + direction(at(0, 0, 1) - at(0, 0, -1))).norm(), 1e-12);
      EXPECT_NEAR(axes.determinant(), 1, 1e-15);
    }
  }
}

}  // namespace risley::trajectories::geodesy_test
