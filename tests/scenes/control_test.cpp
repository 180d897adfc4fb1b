// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/control.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "refusal.hpp"

namespace risley::scenes::control_test {

using ::testing::AllOf;

constexpr const char* kText =
    "risley_control: 1\n"
    "crs: EPSG:25832\n"
    "datum: EPSG:4937\n"
    "ground:\n"
    "  - {name: yard, place_m: [500010, 5.5e6, 301.5], sigma_m: 0.008}\n"
    "  - {name: roof, place_m: [1, 2, 3], sigma_m: 0.02, radius_m: 1.5, normal_azimuth_deg: 90,\n"
    "     normal_zenith_deg: 30, normal_sigma_deg: 0.1}\n";

TEST(Control, IsRead) {
  const Control control = parse_control(kText, "c.yaml");
  EXPECT_EQ(control.crs, "EPSG:25832");
  EXPECT_EQ(control.datum, "EPSG:4937");
  ASSERT_EQ(control.ground.size(), 2U);
  const KnownGround &yard = control.ground[0], &roof = control.ground[1];
  EXPECT_EQ(yard.name, "yard");
  EXPECT_EQ(yard.place.y, 5.5e6);
  EXPECT_EQ(yard.sigma, 0.008);
  EXPECT_EQ(yard.radius, 1);
  EXPECT_FALSE(yard.normal);
  EXPECT_EQ(roof.radius, 1.5);
  ASSERT_TRUE(roof.normal);
  EXPECT_NEAR(roof.normal->x, 0, 1e-15);
  EXPECT_NEAR(roof.normal->y, 0.5, 1e-15);
  EXPECT_NEAR(roof.normal->z, std::sqrt(0.75), 1e-15);
  EXPECT_NEAR(roof.normal_sigma, radians_from_degrees(0.1), 1e-15);
}

TEST(Control, MistakesAreToldWithTheirLine) {
  const auto failure = [](const std::string& from, const std::string& to) {
    return refusal<FileError>([&] { parse_control(replaced(kText, from, to), "c.yaml"); });
  };
  EXPECT_THAT(failure("risley_control: 1\n", ""), NamesField("risley_control"));
  EXPECT_THAT(failure("risley_control: 1", "risley_control: 2"), NamesField("risley_control"));
  EXPECT_THAT(failure("crs: EPSG:25832\n", ""), AllOf(NamesField("datum"), NamesField("crs")));
  EXPECT_THAT(failure("sigma_m: 0.008", "sigma_m: 0"),
              AllOf(NamesField("c.yaml"), NamesField("ground[0].sigma_m", 5)));
  EXPECT_THAT(failure("[1, 2, 3]", "[1, 2]"), NamesField("3 numbers in m"));
  EXPECT_THAT(failure("radius_m: 1.5", "radius_m: 500"), NamesField("0.1 to 100"));
  EXPECT_THAT(failure("normal_zenith_deg: 30, ", ""), NamesField("normal_zenith_deg"));
  EXPECT_THAT(failure("normal_zenith_deg: 30", "normal_zenith_deg: 80"), NamesField("0 to 60"));
  EXPECT_THAT(failure("name: roof", "name: yard"), NamesField("yard"));
  EXPECT_THAT(failure("name: roof", "nam: roof"), NamesField("nam"));
  EXPECT_THAT(
      refusal<FileError>([&] { parse_control("risley_control: 1\nground: []\n", "c.yaml"); }),
      NamesField("ground"));
}

TEST(Control, EntriesRefuseWhatMakesNoSense) {
  const auto refused = [](const auto& damage) {
    KnownGround ground;
    ground.name = "yard";
    ground.normal = Vector3<double>{0, 0, 1};
    ground.normal_sigma = 0.01;
    damage(ground);
    return refusal([&] { require_known_ground(ground); });
  };
  EXPECT_EQ(refused([](KnownGround&) {}), "");
  EXPECT_THAT(refused([](KnownGround& g) { g.sigma = 0; }), NamesField("yard"));
  EXPECT_NE(refused([](KnownGround& g) { g.radius = -1; }), "");
  EXPECT_NE(refused([](KnownGround& g) { g.normal_sigma = 0; }), "");
  EXPECT_NE(refused([](KnownGround& g) { g.normal->z = 2; }), "");
  EXPECT_NE(refused([](KnownGround& g) { g.place.x = std::numeric_limits<double>::infinity(); }),
            "");
}

}  // namespace risley::scenes::control_test
