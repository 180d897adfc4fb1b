// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/map_projection.hpp"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "cloud/transverse_mercator.hpp"
#include "refusal.hpp"

namespace risley::cloud::map_projection_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kFlattening = 1 / 298.257223563;  // WGS 84
const UtmReferee kZone32{6378137.0L, static_cast<long double>(kFlattening), 9 * M_PIl / 180};

Vector3d vector(const std::array<long double, 3>& place) {
  return {static_cast<double>(place[0]), static_cast<double>(place[1]),
          static_cast<double>(place[2])};
}

// 50 degrees north, 2.7 degrees off the meridian: 2.07 degrees of convergence.
const double kLatitude = radians_from_degrees(50.1), kLongitude = radians_from_degrees(11.7);

TEST(MapProjection, AgreesWithAnIndependentSeries) {
  const MapProjection map("EPSG:32632");
  for (const double height : {-400.0, 0.0, 137.25, 4000.0}) {
    const Vector3d place = vector(kZone32.geocentric(kLatitude, kLongitude, height));
    const auto [east, north] = kZone32.map(kLatitude, kLongitude);
    const Vector3d mapped = map.project(place);
    EXPECT_NEAR(mapped.x(), static_cast<double>(east), 1e-6);
    EXPECT_NEAR(mapped.y(), static_cast<double>(north), 1e-6);
    EXPECT_NEAR(mapped.z(), height, 1e-6);
    EXPECT_GT(mapped.y(), 5.5e6);
    EXPECT_LT((map.unproject(mapped) - place).norm(), 1e-6);
  }
  EXPECT_EQ(map.name(), "WGS 84 / UTM zone 32N");
  EXPECT_FALSE(map.has_height_system());
  EXPECT_NE(map.wkt().find("PROJCS[\"WGS 84 / UTM zone 32N\""), std::string::npos) << map.wkt();
}

TEST(MapProjection, TheExpansionHoldsForHundredsOfMetres) {
  const MapProjection map("EPSG:32632");
  const Vector3d center = vector(kZone32.geocentric(kLatitude, kLongitude, 180));
  const MapTangent tangent = map.tangent(center);
  for (const double reach : {50.0, 200.0, 300.0, 500.0}) {
    double worst = 0;
    for (const Vector3d& to : {Vector3d(1, 0.3, -0.2), Vector3d(-0.5, 1, 0.4),
                               Vector3d(0.2, -0.3, 1), Vector3d(-1, -1, -1)}) {
      const Vector3d place = center + reach * to.normalized();
      worst = std::max(worst, (tangent.map(place) - map.project(place)).norm());
    }
    EXPECT_LT(worst, reach < 400 ? 1e-6 : 2e-6) << reach;
  }
}

// Convergence and scale of the zone, from the derivatives: a metre to the north turns by the
// convergence, a metre upwards stays a metre upwards.
TEST(MapProjection, TheJacobianTurnsByTheConvergence) {
  const MapProjection map("EPSG:32632");
  const Vector3d center = vector(kZone32.geocentric(kLatitude, kLongitude, 0));
  const Matrix3d jacobian = map.tangent(center).jacobian();
  const double sl = std::sin(kLatitude), cl = std::cos(kLatitude);
  const Vector3d north(-sl * std::cos(kLongitude), -sl * std::sin(kLongitude), cl);
  const Vector3d up(cl * std::cos(kLongitude), cl * std::sin(kLongitude), sl);
  const Vector3d mapped = jacobian * north;
  const double convergence =
      std::atan(std::tan(kLongitude - radians_from_degrees(9)) * sl);  // of the sphere
  EXPECT_NEAR(std::atan2(mapped.x(), mapped.y()), -convergence, 1e-5);
  EXPECT_GT(convergence, radians_from_degrees(2));
  EXPECT_NEAR(mapped.norm(), 1.00006, 1e-4);
  EXPECT_NEAR((jacobian * up - Vector3d::UnitZ()).norm(), 0, 1e-8);
}

TEST(MapProjection, RefusesWhatIsNoMapInMetres) {
  const auto refused = [](const std::string& crs, const std::string& source = "EPSG:4979") {
    return refusal([&] { MapProjection(crs, source); });
  };
  EXPECT_NE(refused("EPSG:999999").find("EPSG:999999"), std::string::npos);
  EXPECT_NE(refused("nonsense").find("EPSG:25832"), std::string::npos);
  EXPECT_NE(refused("EPSG:4326").find("latitudes"), std::string::npos);
  EXPECT_NE(refused("EPSG:4978").find("not a map"), std::string::npos);
  EXPECT_NE(refused("EPSG:2225").find("US survey foot"), std::string::npos);
  EXPECT_NE(refused("EPSG:32632", "EPSG:4326").find("three-dimensional"), std::string::npos);
  EXPECT_NE(refused("EPSG:32632", "EPSG:32632").find("three-dimensional"), std::string::npos);
  const std::string wrong_place = refusal([] {
    const MapProjection map("EPSG:32632");
    map.project({0, 0, 1.0 / 0.0});
  });
  EXPECT_NE(wrong_place.find("zone 32N"), std::string::npos);
}

// A height system needs its grid; without it the answer would be wrong by some fifty metres.
TEST(MapProjection, HeightsNeverLackTheirGridSilently) {
  try {
    const MapProjection map("EPSG:25832+7837", "EPSG:4937");  // DHHN2016
    EXPECT_TRUE(map.has_height_system());
    const UtmReferee grs80{6378137.0L, 1 / 298.257222101L, 9 * M_PIl / 180};
    const Vector3d mapped = map.project(vector(grs80.geocentric(kLatitude, kLongitude, 300)));
    EXPECT_NEAR(mapped.z(), 300 - 46.5, 2) << "geoid of Germany";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("grid"), std::string::npos) << error.what();
  }
}

TEST(MapProjection, NamesTheGridThatIsMissingAndWhereToGetIt) {
  const std::string words = refusal([] { MapProjection("EPSG:6340+5703", ""); });  // NAVD88
  if (words.empty()) GTEST_SKIP() << "the grid is installed";
  EXPECT_NE(words.find("us_noaa_g"), std::string::npos) << words;
  EXPECT_NE(words.find("https://"), std::string::npos) << words;
  EXPECT_NE(words.find("PROJ_DATA"), std::string::npos) << words;
}

TEST(MapProjection, LatitudesAndLongitudesAreAnsweredWithTheZoneOfThePlace) {
  const auto zone_for = [](const std::string& crs, double latitude_deg, double longitude_deg) {
    try {
      const MapProjection map(crs);
    } catch (const GeographicSystem& system) {
      const std::string words =
          system.at(radians_from_degrees(latitude_deg), radians_from_degrees(longitude_deg)).what();
      return words.substr(words.rfind("EPSG:"));
    }
    return std::string();
  };
  EXPECT_EQ(zone_for("EPSG:4258", 50, 9), "EPSG:25832");
  EXPECT_EQ(zone_for("EPSG:4937", 50, 9), "EPSG:25832");
  EXPECT_EQ(zone_for("EPSG:6318", 34, -117), "EPSG:6340");
  EXPECT_EQ(zone_for("EPSG:4326", -33, 151), "EPSG:32756");
}

TEST(MapProjection, AMapOfItsOwnDatumNeedsNoChange) {
  for (const char* crs : {"EPSG:25832", "EPSG:6340", "EPSG:31467", "EPSG:2056"}) {
    const MapProjection map(crs, "");
    const auto& area = *map.area();
    const trajectories::Geodetic middle{0.5 * (area.south + area.north),
                                        0.5 * (area.west + area.east), 300};
    const Vector3d on_map = map.project(trajectories::geocentric_from_geodetic(middle));
    EXPECT_LT((map.project(map.unproject(on_map)) - on_map).norm(), 1e-6) << crs;
    EXPECT_EQ(map.operation(), "") << crs;
  }
}

TEST(MapProjection, SaysHowTheDatumWasChanged) {
  const MapProjection same("EPSG:32632"), other("EPSG:25832");
  const Vector3d place = vector(kZone32.geocentric(kLatitude, kLongitude, 0));
  same.project(place);
  EXPECT_EQ(same.operation(), "");
  other.project(place);
  EXPECT_NE(other.operation().find("accuracy"), std::string::npos) << other.operation();
}

TEST(MapProjection, AreasOfUse) {
  const auto beyond = [](const std::string& crs, double latitude_deg, double longitude_deg) {
    const MapProjection map(crs);
    EXPECT_TRUE(map.area().has_value()) << crs;
    return degrees_from_radians(map.area()->beyond(radians_from_degrees(latitude_deg),
                                                   radians_from_degrees(longitude_deg)));
  };
  EXPECT_EQ(beyond("EPSG:32632", 50, 9), 0);
  EXPECT_NEAR(beyond("EPSG:32632", 50, 13.5), 1.5, 1e-9);
  EXPECT_NEAR(beyond("EPSG:32632", 50, 4), 2, 1e-9);
  EXPECT_NEAR(beyond("EPSG:32632", -30, 9), 30, 1e-9);
  EXPECT_NEAR(beyond("EPSG:32632", 50, 189), 177, 1e-9);
  EXPECT_EQ(beyond("EPSG:32601", 10, 181), 0);
  EXPECT_NEAR(beyond("EPSG:32660", 10, -178), 2, 1e-9);
  const AreaOfUse across{"New Zealand", radians_from_degrees(160), radians_from_degrees(-56),
                         radians_from_degrees(-171), radians_from_degrees(-25)};
  EXPECT_EQ(across.beyond(radians_from_degrees(-40), radians_from_degrees(179)), 0);
  EXPECT_EQ(across.beyond(radians_from_degrees(-40), radians_from_degrees(-175)), 0);
  EXPECT_NEAR(across.beyond(radians_from_degrees(-40), radians_from_degrees(-169)),
              radians_from_degrees(2), 1e-12);
  const AreaOfUse world{"", -kPi, -kPi / 2, kPi, kPi / 2};
  EXPECT_EQ(world.beyond(0.3, 3.1), 0);
  EXPECT_NE(MapProjection("EPSG:32632").area()->name, "");
}

TEST(MapProjection, UtmZones) {
  const auto zone = [](double latitude_deg, double longitude_deg) {
    return utm_zone_of(radians_from_degrees(latitude_deg), radians_from_degrees(longitude_deg));
  };
  EXPECT_EQ(zone(50, 9), "EPSG:32632");
  EXPECT_EQ(zone(-33, 151), "EPSG:32756");
  EXPECT_EQ(zone(10, -180), "EPSG:32601");
  EXPECT_EQ(zone(10, 179.99), "EPSG:32660");
  EXPECT_NE(refusal([&] { zone(85, 0); }).find("latitude"), std::string::npos);
}

}  // namespace risley::cloud::map_projection_test
