// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Laws that every train obeys, whatever its face order.
#include "risley/optics/observation_model.hpp"

#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "risley/optics/batch.hpp"

#include "optics/trains.hpp"
#include "parameter_name.hpp"

namespace risley::observation_model_test {

class LawsOfEveryTrain : public ::testing::TestWithParam<std::string> {
 protected:
  std::mt19937 generator{17};
};

TEST_P(LawsOfEveryTrain, TurningAllPrismsTurnsTheBeamAboutTheAxis) {
  const PrismTrain ideal(parse_face_order(GetParam()));
  for (int i = 0; i < 100; ++i) {
    auto angles = testing::random_angles(ideal.prisms(), generator);
    const auto before = testing::along_axis(ideal, observe(ideal, angles).direction);
    const double turn = testing::random_angles(1, generator)[0];
    for (double& angle : angles) angle += turn;
    const auto after = testing::along_axis(ideal, observe(ideal, angles).direction);
    EXPECT_NEAR(after.x, before.x, 1e-14);
    EXPECT_NEAR(after.y, std::cos(turn) * before.y - std::sin(turn) * before.z, 1e-14);
    EXPECT_NEAR(after.z, std::sin(turn) * before.y + std::cos(turn) * before.z, 1e-14);
  }
}

TEST_P(LawsOfEveryTrain, NegatingAllAnglesMirrorsTheIdealBeam) {
  const PrismTrain ideal(parse_face_order(GetParam()));
  for (int i = 0; i < 100; ++i) {
    auto angles = testing::random_angles(ideal.prisms(), generator);
    const auto before = testing::along_axis(ideal, observe(ideal, angles).direction);
    for (double& angle : angles) angle = -angle;
    const auto after = testing::along_axis(ideal, observe(ideal, angles).direction);
    EXPECT_NEAR(after.x, before.x, 1e-14);
    EXPECT_NEAR(after.y, -before.y, 1e-14);
    EXPECT_NEAR(after.z, before.z, 1e-14);
  }
}

TEST_P(LawsOfEveryTrain, AnglesRepeatAfterAFullTurn) {
  const PrismTrain train = testing::imperfect_train(GetParam(), 0.5, 4);
  for (int i = 0; i < 100; ++i) {
    auto angles = testing::random_angles(train.prisms(), generator);
    const auto before = observe(train, angles).direction;
    for (double& angle : angles) angle += kTwoPi;
    EXPECT_LT(angle_between(observe(train, angles).direction, before), 1e-14);
  }
}

TEST_P(LawsOfEveryTrain, GlassOfAirOrPlatesWithoutWedgeDeviateNothing) {
  if (layout_of(parse_face_order(GetParam())).reflects()) return;  // a mirror does
  PrismTrain air = testing::imperfect_train(GetParam(), 0.5, 4);
  PrismTrain plate = air;
  air.set("refractive_index", air.get("refractive_index_air"));
  plate.set("wedge_angle_deg", 0.0);
  for (const PrismTrain& train : {air, plate}) {
    const Vector3<double> incident = leaning_direction(train[place::incident_beam_horizontal()],
                                                       train[place::incident_beam_vertical()]);
    for (int i = 0; i < 50; ++i) {
      const auto shot = observe(train, testing::random_angles(train.prisms(), generator));
      EXPECT_LT(angle_between(shot.direction, incident), 1e-14);
    }
  }
}

TEST_P(LawsOfEveryTrain, DirectionsAreUnitVectorsAndAnglesTellTheSameDirection) {
  const PrismTrain train = testing::imperfect_train(GetParam(), 1.0, 9);
  for (int i = 0; i < 200; ++i) {
    const auto shot = observe(train, testing::random_angles(train.prisms(), generator));
    ASSERT_TRUE(shot.valid);
    EXPECT_NEAR(norm(shot.direction), 1.0, 4e-15);
    EXPECT_LT(
        angle_between(direction_from_angles<double>({shot.azimuth, shot.zenith}), shot.direction),
        2e-15);
  }
}

TEST_P(LawsOfEveryTrain, IdealModelEqualsThePaperEquationsWrittenOutWithQuaternions) {
  // An independent transcription of Eq. (13-26) with rotation matrices from Eigen's quaternions.
  const PrismTrain train = testing::imperfect_train(GetParam(), 0.5, 12);
  const auto lean = [](double h, double v) {
    return Eigen::Vector3d(std::cos(h) * std::cos(v), -std::sin(h) * std::cos(v), std::sin(v));
  };
  for (int i = 0; i < 100; ++i) {
    const auto angles = testing::random_angles(train.prisms(), generator);
    Eigen::Vector3d beam = lean(train[1], train[2]);
    for (int prism = 0; prism < train.prisms(); ++prism) {
      const double bh = train[place::bearing_tilt_horizontal(prism)];
      const double bv = train[place::bearing_tilt_vertical(prism)];
      const double th = train[place::prism_tilt_horizontal(prism)];
      const double tv = train[place::prism_tilt_vertical(prism)];
      const double angle = train[place::wedge_angle(prism)];
      const Eigen::Quaterniond turn(
          Eigen::AngleAxisd(angles[static_cast<std::size_t>(prism)], lean(bh, bv)));
      const double ratio = train[0] / train[place::refractive_index(prism)];
      const auto normal = [&](double v) -> Eigen::Vector3d { return turn * lean(bh + th, bv + v); };
      const auto refract = [&](const Eigen::Vector3d& n, double m) {
        const double c = n.dot(beam);
        beam = m * (beam - c * n) + n * std::sqrt(1 - m * m * (1 - c * c));
      };
      switch (train.face_order()[static_cast<std::size_t>(prism)]) {
        case FaceOrder::perpendicular_angled:
          refract(normal(tv), ratio);
          refract(normal(tv + angle), 1 / ratio);
          break;
        case FaceOrder::angled_perpendicular:
          refract(normal(tv - angle), ratio);
          refract(normal(tv), 1 / ratio);
          break;
        case FaceOrder::angled_angled:
          refract(normal(tv), ratio);
          refract(normal(angle), 1 / ratio);
          break;
        case FaceOrder::perpendicular_mirror_upright:
          refract(normal(tv), ratio);
          beam -= 2 * normal(tv + angle).dot(beam) * normal(tv + angle);
          refract(normal(tv - kPi / 2), 1 / ratio);
          break;
      }
    }
    const Vector3<double> shot = testing::along_axis(train, observe(train, angles).direction);
    EXPECT_NEAR(shot.x, beam.x(), 1e-14);
    EXPECT_NEAR(shot.y, beam.y(), 1e-14);
    EXPECT_NEAR(shot.z, beam.z(), 1e-14);
  }
}

INSTANTIATE_TEST_SUITE_P(FaceOrders, LawsOfEveryTrain,
                         ::testing::ValuesIn(testing::all_face_orders()), kByItself);

TEST(ObservationModel, EqualWedgesWithLikeFacesFacingAndParallelFormAPlate) {
  // PA-AP with the second prism turned by half a turn: the slanted faces are parallel.
  for (const char* order : {"PA-AP", "AP-PA"}) {
    const PrismTrain train(parse_face_order(order));
    for (const double angle : {0.0, 1.0, 4.0}) {
      const auto shot = observe(train, std::array{angle, angle + kPi});
      EXPECT_LT(angle_between(shot.direction, {1, 0, 0}), 1e-15) << order;
    }
  }
}

TEST(ObservationModel, TotalReflectionIsAnInvalidShotInEveryScalar) {
  PrismTrain train(parse_face_order("PA-AP"));
  train.set("wedge_angle_deg", radians_from_degrees(38.0));
  train.set("refractive_index", 1.9);
  const std::array aligned{0.0, 0.0};
  const Observation shot = observe(train, aligned);
  EXPECT_FALSE(shot.valid);
  EXPECT_TRUE(std::isnan(shot.direction.x) && std::isnan(shot.azimuth) && std::isnan(shot.zenith));

  const std::vector<double> column(11, 0.0);
  const std::vector<std::span<const double>> angles{column, column};
  for (const InstructionSet set : available_instruction_sets()) {
    std::vector<double> azimuth(11, 1.0), x(11, 1.0);
    EXPECT_EQ(observe_batch(train, angles, {x, {}, {}, azimuth, {}}, {}, set), 11u)
        << to_string(set);
    for (std::size_t i = 0; i < 11; ++i) {
      EXPECT_TRUE(std::isnan(azimuth[i]) && std::isnan(x[i]));
    }
  }
}

TEST(ObservationModel, PositiveRotationRaisesTheBeamFromTheLeft) {
  // Sign convention (docs/theory/frames.md): right-handed about X. At zero the beam points down;
  // a quarter turn of both prisms moves it to +Y, the left.
  const PrismTrain train(parse_face_order("PA-AP"));
  const auto down = observe(train, std::array{0.0, 0.0});
  EXPECT_LT(down.direction.z, -0.3);
  const auto left = observe(train, std::array{kPi / 2, kPi / 2});
  EXPECT_GT(left.direction.y, 0.3);
  EXPECT_NEAR(left.direction.z, 0.0, 1e-15);
}

TEST(Parameters, NamesBoundsAndUnitsAreChecked) {
  PrismTrain train(parse_face_order("PA-AP"));
  try {
    train.set("wedge_angle_deg", radians_from_degrees(95.0));
    FAIL() << "accepted";
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(error.what(), "wedge_angle_deg = 95 deg, allowed 0 to 60");
  }
  EXPECT_THROW(train.set("refractive_index", NAN), InvalidArgument);
  EXPECT_THROW(train.set("no_such_thing", 1.0), InvalidArgument);
  EXPECT_THROW(train.set("bearing_tilt_b_horizontal_deg", 0.0), InvalidArgument);
  train.set("refractive_index", 1.6);
  EXPECT_EQ(train.get("refractive_index_b"), 1.6);
  EXPECT_THROW(parse_face_order("PA-"), InvalidArgument);
  EXPECT_THROW(parse_face_order("PA-AP-PA-AP-PA"), InvalidArgument);
  EXPECT_THROW(parse_face_order(""), InvalidArgument);
  EXPECT_EQ(to_string(parse_face_order("AP-PA-PA")), "AP-PA-PA");
}

}  // namespace risley::observation_model_test
