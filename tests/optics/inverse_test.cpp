// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/inverse.hpp"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/optics/observation_model.hpp"

#include "optics/trains.hpp"
#include "parameter_name.hpp"

namespace risley::inverse_test {

constexpr double kTolerance = radians_from_degrees(1e-10);

/// How far the pairs of a solution miss the direction, at worst.
double worst_miss(const PrismTrain& train, const Vector3<double>& direction,
                  const InverseSolution& solution, std::vector<double> fixed = {}) {
  double worst = 0;
  for (const RotationPair& pair : solution.pairs) {
    std::vector<double> angles = fixed;
    angles.push_back(pair.first);
    angles.push_back(pair.second);
    worst = std::max(worst, angle_between(observe(train, angles).direction, direction));
  }
  return worst;
}

bool contains(const InverseSolution& solution, double first, double second, double tolerance) {
  for (const RotationPair& pair : solution.pairs) {
    if (std::abs(wrap_to_pi(pair.first - first)) < tolerance &&
        std::abs(wrap_to_pi(pair.second - second)) < tolerance) {
      return true;
    }
  }
  return false;
}

class InverseOfEveryTrain : public ::testing::TestWithParam<std::string> {};

TEST_P(InverseOfEveryTrain, FindsTheGivenPairAndItsPartner) {
  std::mt19937 generator(7);
  for (const double error_deg : {0.0, 0.3}) {
    const PrismTrain train = error_deg == 0.0 ? PrismTrain(parse_face_order(GetParam()))
                                              : testing::imperfect_train(GetParam(), error_deg, 11);
    int with_two = 0;
    const int count = 10000 / 2;  // per kind of train; both together are the 10,000 of the claim
    for (int i = 0; i < count; ++i) {
      const auto angles = testing::random_angles(train.prisms(), generator);
      const Observation shot = observe(train, angles);
      ASSERT_TRUE(shot.valid);
      const std::vector<double> fixed(angles.begin(), angles.end() - 2);
      const InverseSolution solution = rotation_angles_for(train, shot.direction, fixed);
      ASSERT_GE(solution.pairs.size(), 1u) << i;
      ASSERT_LE(solution.pairs.size(), 4u) << i;
      ASSERT_LT(worst_miss(train, shot.direction, solution, fixed), kTolerance) << i;
      // Near the merging at the edge the angles are worth the square root of a direction.
      ASSERT_TRUE(contains(solution, angles[angles.size() - 2], angles.back(), 1e-5)) << i;
      with_two += solution.pairs.size() == 2;
    }
    EXPECT_GT(with_two, count * 95 / 100);
  }
}

INSTANTIATE_TEST_SUITE_P(FaceOrders, InverseOfEveryTrain,
                         ::testing::Values("PA-PA", "PA-AP", "AP-AP", "AP-PA", "PA-AP-PA"),
                         kByItself);

TEST(Inverse, PairsMergeAtTheEdgeOfTheFieldOfView) {
  const PrismTrain train(parse_face_order("PA-AP"));
  const std::array aligned{1.0, 1.0};
  const Vector3<double> edge = observe(train, aligned).direction;
  const InverseSolution solution = rotation_angles_for(train, edge);
  ASSERT_EQ(solution.pairs.size(), 1u);
  EXPECT_TRUE(contains(solution, 1.0, 1.0, 1e-5));
  EXPECT_LT(worst_miss(train, edge, solution), kTolerance);
}

TEST(Inverse, JustInsideTheEdgeThereAreTwoPairsAndJustOutsideNone) {
  const PrismTrain train(parse_face_order("PA-AP"));
  const double edge_zenith = observe(train, std::array{0.0, 0.0}).zenith;
  for (const double step : {1e-9, 1e-6, 1e-3}) {
    const auto direction = [&](double zenith) {
      return direction_from_angles<double>({0.0, zenith});
    };
    const InverseSolution inside = rotation_angles_for(train, direction(edge_zenith - step));
    EXPECT_EQ(inside.pairs.size(), 2u) << step;
    EXPECT_LT(worst_miss(train, direction(edge_zenith - step), inside), kTolerance) << step;
    EXPECT_TRUE(rotation_angles_for(train, direction(edge_zenith + step)).pairs.empty()) << step;
  }
}

TEST(Inverse, TheCentreOfAnIdealSensorIsReachedByAContinuum) {
  const PrismTrain train(parse_face_order("PA-AP"));
  const Vector3<double> axis{1, 0, 0};
  const InverseSolution solution = rotation_angles_for(train, axis);
  EXPECT_TRUE(solution.continuum);
  ASSERT_EQ(solution.pairs.size(), 1u);
  EXPECT_LT(worst_miss(train, axis, solution), kTolerance);
}

TEST(Inverse, UnequalWedgesLeaveAHoleInTheCentre) {
  PrismTrain train(parse_face_order("PA-AP"));
  train.set("wedge_angle_b_deg", radians_from_degrees(17.0));
  const InverseSolution solution = rotation_angles_for(train, {1, 0, 0});
  EXPECT_FALSE(solution.continuum);
  EXPECT_TRUE(solution.pairs.empty());
}

TEST(Inverse, NearTheCentreOfAnImperfectSensorEveryPairIsRight) {
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.3, 3);
  for (int i = 0; i < 400; ++i) {
    const double azimuth = 0.004 * ((i % 20) - 9.5) / 10, elevation = 0.004 * ((i / 20) - 9.5) / 10;
    const auto direction = direction_from_angles<double>({azimuth, kPi / 2 - elevation});
    const InverseSolution solution = rotation_angles_for(train, direction);
    EXPECT_EQ(solution.pairs.size() % 2, 0u) << i;  // closed curves cross an even number of times
    EXPECT_LT(worst_miss(train, direction, solution), kTolerance) << i;
  }
}

TEST(Inverse, RefusesWhatItCannotAnswer) {
  const PrismTrain two(parse_face_order("PA-AP")), three(parse_face_order("PA-AP-PA"));
  EXPECT_THROW(rotation_angles_for(PrismTrain(parse_face_order("PA")), {1, 0, 0}), InvalidArgument);
  EXPECT_THROW(rotation_angles_for(two, {2, 0, 0}), InvalidArgument);
  EXPECT_THROW(rotation_angles_for(two, {NAN, 0, 0}), InvalidArgument);
  EXPECT_THROW(rotation_angles_for(three, {1, 0, 0}), InvalidArgument);
  PrismTrain flat = two;
  flat.set("wedge_angle_a_deg", 0.0);
  EXPECT_THROW(rotation_angles_for(flat, {1, 0, 0}), InvalidArgument);
  EXPECT_TRUE(rotation_angles_for(two, {-1, 0, 0}).pairs.empty());
}

}  // namespace risley::inverse_test
