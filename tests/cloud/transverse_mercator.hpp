// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>

namespace risley::cloud {

/// Easting, northing and height by Krueger's series to the sixth power of the third flattening
/// [Krueger 1912; coefficients as Karney 2011, Transverse Mercator with an accuracy of a few
/// nanometers, Eq. 35], and the geocentric place, both in extended precision: the referee of what
/// the projection library and the expansions about a place say.
struct UtmReferee {
  long double a, f;      ///< ellipsoid: semi-major axis, m, and flattening
  long double meridian;  ///< of the zone, rad
  bool south = false;

  std::array<long double, 3> geocentric(long double latitude, long double longitude,
                                        long double height) const {
    const long double e2 = f * (2 - f), s = std::sin(latitude), c = std::cos(latitude);
    const long double n = a / std::sqrt(1 - e2 * s * s);
    return {(n + height) * c * std::cos(longitude), (n + height) * c * std::sin(longitude),
            (n * (1 - e2) + height) * s};
  }

  std::array<long double, 2> map(long double latitude, long double longitude) const {
    const long double n = f / (2 - f), n2 = n * n, n3 = n2 * n, n4 = n2 * n2, n5 = n4 * n,
                      n6 = n3 * n3;
    const long double alpha[6] = {
        n / 2 - 2 * n2 / 3 + 5 * n3 / 16 + 41 * n4 / 180 - 127 * n5 / 288 + 7891 * n6 / 37800,
        13 * n2 / 48 - 3 * n3 / 5 + 557 * n4 / 1440 + 281 * n5 / 630 - 1983433 * n6 / 1935360,
        61 * n3 / 240 - 103 * n4 / 140 + 15061 * n5 / 26880 + 167603 * n6 / 181440,
        49561 * n4 / 161280 - 179 * n5 / 168 + 6601661 * n6 / 7257600,
        34729 * n5 / 80640 - 3418889 * n6 / 1995840,
        212378941 * n6 / 319334400};
    const long double radius = a / (1 + n) * (1 + n2 / 4 + n4 / 64 + n6 / 256);
    const long double e = std::sqrt(f * (2 - f));
    const long double tan = std::tan(latitude);
    const long double sigma = std::sinh(e * std::atanh(e * tan / std::sqrt(1 + tan * tan)));
    const long double conformal =
        tan * std::sqrt(1 + sigma * sigma) - sigma * std::sqrt(1 + tan * tan);
    const long double off = longitude - meridian;
    const long double xi = std::atan2(conformal, std::cos(off));
    const long double eta = std::asinh(
        std::sin(off) / std::sqrt(conformal * conformal + std::cos(off) * std::cos(off)));
    long double north = xi, east = eta;
    for (int j = 1; j <= 6; ++j) {
      const long double twice = 2 * j;
      north += alpha[j - 1] * std::sin(twice * xi) * std::cosh(twice * eta);
      east += alpha[j - 1] * std::cos(twice * xi) * std::sinh(twice * eta);
    }
    const long double scale = 0.9996L * radius;
    return {500000 + scale * east, scale * north + (south ? 10000000.0L : 0.0L)};
  }
};

}  // namespace risley::cloud
