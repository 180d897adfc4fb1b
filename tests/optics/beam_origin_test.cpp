// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/beam_origin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/plane.hpp"
#include "risley/optics/batch.hpp"

#include "optics/trains.hpp"

namespace risley {
namespace {

constexpr PrismGeometry kMid40{0.007, 0.030};

PrismTrain ideal_mid_40() { return PrismTrain(parse_face_order("PA-AP")); }

/// Y and Z where the beam leaves, mm.
std::array<double, 2> correction_mm(const PrismTrain& train, double a_deg, double b_deg) {
  const std::array<double, 2> angles{radians_from_degrees(a_deg), radians_from_degrees(b_deg)};
  const Ray ray = emergent_ray(train, kMid40, angles);
  EXPECT_TRUE(ray.valid);
  return {1e3 * ray.origin.y, 1e3 * ray.origin.z};
}

// Table A1, printed to 0.1 mm.
TEST(BeamOrigin, ReproducesTableA1) {
  const auto first = correction_mm(ideal_mid_40(), 96.667, 233.000);
  EXPECT_NEAR(first[0], 3.0, 0.05);
  EXPECT_NEAR(first[1], 0.8, 0.05);
  const auto second = correction_mm(ideal_mid_40(), 231.667, 95.333);
  EXPECT_NEAR(second[0], -2.1, 0.05);
  EXPECT_NEAR(second[1], 2.3, 0.05);
}

// Appendix A: all combinations of both rotation angles at 1/3 degree.
TEST(BeamOrigin, ReachesTheExtremesOfFigureA1) {
  constexpr std::size_t kSteps = 1081;
  std::vector<double> a(kSteps), b(kSteps), x(kSteps), y(kSteps), z(kSteps);
  for (std::size_t i = 0; i < kSteps; ++i) b[i] = radians_from_degrees(static_cast<double>(i) / 3);
  double smallest_y = 0, largest_y = 0, smallest_z = 0, largest_z = 0;
  for (std::size_t i = 0; i < kSteps; ++i) {
    std::fill(a.begin(), a.end(), b[i]);
    DirectionColumns out;
    out.origin_x = x;
    out.origin_y = y;
    out.origin_z = z;
    out.geometry = kMid40;
    const std::array<std::span<const double>, 2> angles{a, b};
    ASSERT_EQ(observe_batch(ideal_mid_40(), angles, out), 0u);
    smallest_y = std::min(smallest_y, *std::min_element(y.begin(), y.end()));
    largest_y = std::max(largest_y, *std::max_element(y.begin(), y.end()));
    smallest_z = std::min(smallest_z, *std::min_element(z.begin(), z.end()));
    largest_z = std::max(largest_z, *std::max_element(z.begin(), z.end()));
  }
  for (const double extreme : {-smallest_y, largest_y, -smallest_z, largest_z}) {
    EXPECT_NEAR(1e3 * extreme, 4.4, 0.05);
  }
}

TEST(BeamOrigin, PerpendicularFaceOfTheLastPrismStandsAtTheFramesOrigin) {
  const auto at = [](const char* order) { return face_positions(parse_face_order(order), kMid40); };
  EXPECT_EQ(at("PA-AP"), (std::vector<double>{-0.030, -0.023, -0.007, 0.0}));
  EXPECT_EQ(at("AP-PA"), (std::vector<double>{-0.037, -0.030, 0.0, 0.007}));
  EXPECT_EQ(at("PA-PA"), (std::vector<double>{-0.030, -0.023, 0.0, 0.007}));
  EXPECT_EQ(at("PA-AP-AP").front(), -0.060);
}

// Each point lies on its face and each piece of the way has the direction of its beam, for every
// face order: an independent walk in plain numbers.
TEST(BeamOrigin, WalksFromFaceToFace) {
  for (const std::string& order : testing::all_face_orders()) {
    const PrismTrain train = testing::imperfect_train(order, 0.5, 3);
    const auto positions = face_positions(train.face_order(), kMid40);
    with_prism_count(train.prisms(), [&]<int N>() {
      const auto prepared =
          prepare<double, N>(parameter_array<N>(train), face_order_array<N>(train));
      std::array<double, N> angles;
      for (std::size_t k = 0; k < N; ++k) angles[k] = 0.7 + 1.9 * static_cast<double>(k);
      const auto trace = trace_forward(prepared, angles);
      ASSERT_TRUE(trace.valid());
      Vector3<double> point{positions[0], 0, 0};
      for (std::size_t face = 1; face < 2 * N; ++face) {
        const Vector3<double> corner{positions[face], 0, 0};
        const Plane plane{trace.normal[face], dot(trace.normal[face], corner)};
        point += hit_distance(plane, point, trace.incident[face]) * trace.incident[face];
        EXPECT_NEAR(signed_distance(plane, point), 0.0, 1e-15);
      }
      const Ray ray = emergent_ray(train, kMid40, angles);
      EXPECT_LT(norm(ray.origin - point), 1e-15) << order;
      EXPECT_LT(norm(ray.direction - trace.direction()), 1e-15);
    });
  }
}

TEST(BeamOrigin, ThinPrismsAtOnePlaceLeaveTheBeamAtTheOrigin) {
  const std::array<double, 2> angles{1.0, 2.0};
  EXPECT_EQ(norm(emergent_ray(ideal_mid_40(), {}, angles).origin), 0.0);
}

TEST(BeamOrigin, EveryInstructionSetAgreesWithPlainNumbers) {
  constexpr std::size_t kShots = 37;
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.5, 4);
  std::vector<double> a(kShots), b(kShots), x(kShots), y(kShots), z(kShots);
  for (std::size_t i = 0; i < kShots; ++i) {
    a[i] = 0.17 * static_cast<double>(i);
    b[i] = 5.0 - 0.11 * static_cast<double>(i);
  }
  const std::array<std::span<const double>, 2> angles{a, b};
  for (const InstructionSet set : available_instruction_sets()) {
    DirectionColumns out;
    out.origin_x = x;
    out.origin_y = y;
    out.origin_z = z;
    out.geometry = kMid40;
    observe_batch(train, angles, out, set);
    for (std::size_t i = 0; i < kShots; ++i) {
      const Ray ray = emergent_ray(train, kMid40, std::array<double, 2>{a[i], b[i]});
      EXPECT_LT(norm(ray.origin - Vector3<double>{x[i], y[i], z[i]}), 1e-16) << to_string(set);
    }
  }
}

TEST(BeamOrigin, ABeamThatDoesNotGetThroughHasNoRay) {
  PrismTrain train = ideal_mid_40();
  train.set("wedge_angle_deg", radians_from_degrees(45.0));
  const Ray ray = emergent_ray(train, kMid40, std::array<double, 2>{0.0, 0.0});
  EXPECT_FALSE(ray.valid);
  EXPECT_TRUE(std::isnan(ray.origin.y));
  EXPECT_TRUE(std::isnan(ray.direction.x));
  EXPECT_THROW(emergent_ray(train, kMid40, std::array<double, 1>{0.0}), InvalidArgument);
}

}  // namespace
}  // namespace risley
