// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/datum.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/optics/observation_model.hpp"

#include "calibration/walls.hpp"
#include "optics/trains.hpp"
#include "refusal.hpp"

namespace risley::calibration::datum_test {

using Eigen::Index;
using testing::add_errors;

constexpr double kDegree = kRadiansPerDegree;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Bundle = std::vector<Vector3<double>>;

/// Rotation angles uniform over the circle [prisms][beams].
std::vector<std::vector<double>> some_angles(std::size_t beams, std::uint64_t seed) {
  std::vector<std::vector<double>> angles(2, std::vector<double>(beams));
  for (std::size_t k = 0; k < 2; ++k) {
    const RandomStream stream(seed, k);
    for (std::size_t i = 0; i < beams; ++i) angles[k][i] = kTwoPi * stream.uniform(i);
  }
  return angles;
}

Bundle beams_of(const PrismTrain& train, const std::vector<std::vector<double>>& angles) {
  Bundle beams;
  for (std::size_t i = 0; i < angles[0].size(); ++i) {
    beams.push_back(observe(train, std::vector<double>{angles[0][i], angles[1][i]}).direction);
  }
  return beams;
}

Bundle some_beams(std::size_t count = 500) {
  return beams_of(testing::imperfect_train("PA-AP", 0.3, 5), some_angles(count, 1));
}

/// A rotation in space has a vector: about X, Y and Z by the right hand.
Bundle turned(const Bundle& beams, const Eigen::Vector3d& by) {
  const Eigen::AngleAxisd turn(by.norm(), by.normalized());
  Bundle result;
  for (const auto& beam : beams) result.push_back(testing::plain(turn * testing::eigen(beam)));
  return result;
}

TEST(DirectionErrors, OfARotationAreAllGauge) {
  const Bundle truth = some_beams();
  for (const Eigen::Vector3d& by :
       {Eigen::Vector3d{1e-5, 0, 0}, Eigen::Vector3d{0, 1e-5, 0}, Eigen::Vector3d{0, 0, 1e-5},
        Eigen::Vector3d{-3e-5, 5e-5, 2e-5}}) {
    const DirectionErrors errors = direction_errors(turned(truth, by), truth);
    EXPECT_NEAR(errors.rotation.x, by[0], 1e-8);
    EXPECT_NEAR(errors.rotation.y, by[1], 1e-9);
    EXPECT_NEAR(errors.rotation.z, by[2], 1e-9);
    double known = 0;
    for (const auto& beam : truth) {
      known += by.cross(testing::eigen(beam)).squaredNorm() / static_cast<double>(truth.size());
    }
    EXPECT_NEAR(errors.gauge, std::sqrt(known), 1e-4 * std::sqrt(known));
    EXPECT_LT(errors.shape, 1e-4 * errors.gauge);
  }
  // A turn about Z is an azimuth; one about Y lowers what lies ahead.
  const DirectionErrors yaw = direction_errors(turned(truth, {0, 0, 1e-5}), truth);
  EXPECT_NEAR(yaw.azimuth_bias, 1e-5, 1e-9);
  EXPECT_NEAR(yaw.azimuth_rmse, 1e-5, 1e-9);
  EXPECT_NEAR(yaw.zenith_rmse, 0.0, 1e-9);
  EXPECT_GT(direction_errors(turned(truth, {0, 1e-5, 0}), truth).zenith_bias, 0.9e-5);
}

/// A cone that opens a little is a change of shape alone: by symmetry there is nothing to turn.
TEST(DirectionErrors, OfAConeThatOpensAreAllShape) {
  constexpr double kHalfAngle = 15 * kDegree, kOpening = 1e-4;
  const auto cone = [](double half_angle) {
    Bundle beams;
    for (int i = 0; i < 360; ++i) {
      beams.push_back({std::cos(half_angle), std::sin(half_angle) * std::cos(i * kDegree),
                       std::sin(half_angle) * std::sin(i * kDegree)});
    }
    return beams;
  };
  const DirectionErrors errors = direction_errors(cone(kHalfAngle + kOpening), cone(kHalfAngle));
  EXPECT_LT(errors.gauge, 1e-6 * kOpening);
  EXPECT_NEAR(errors.shape, kOpening, 1e-6 * kOpening);
  EXPECT_NEAR(errors.azimuth_bias, 0.0, 1e-12);
  EXPECT_NEAR(errors.zenith_bias, 0.0, 1e-8);
}

TEST(DirectionErrors, AreTheRmsOfBothAngles) {
  const Bundle truth = some_beams();
  Bundle computed;
  double azimuth = 0, zenith = 0;
  const RandomStream noise(3, 1);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto angles = angles_from_direction(truth[i]);
    const double da = 2e-4 * noise.normal(2 * i) + 1e-4, dz = 1e-4 * noise.normal(2 * i + 1);
    computed.push_back(
        direction_from_angles(SphericalAngles<double>{angles.azimuth + da, angles.zenith + dz}));
    azimuth += da * da;
    zenith += dz * dz;
  }
  const auto count = static_cast<double>(truth.size());
  const DirectionErrors errors = direction_errors(computed, truth);
  EXPECT_NEAR(errors.azimuth_rmse, std::sqrt(azimuth / count), 1e-12);
  EXPECT_NEAR(errors.zenith_rmse, std::sqrt(zenith / count), 1e-12);
  EXPECT_NEAR(errors.total * errors.total, (azimuth + zenith) / count, 1e-15);
  EXPECT_NEAR(errors.azimuth_bias, 1e-4, 3e-5);
  // Gauge and shape together are the errors in space, where azimuths count by sin(zenith).
  const double together = std::hypot(errors.gauge, errors.shape);
  EXPECT_LT(together, errors.total);
  EXPECT_GT(together, 0.93 * errors.total);
}

/// Beams on both sides of azimuth 180 degrees are neighbours.
TEST(DirectionErrors, KnowThatTheCircleCloses) {
  Bundle truth, computed;
  for (int i = -20; i <= 20; ++i) {
    const double azimuth = kPi + 1e-3 * i;
    truth.push_back(direction_from_angles(SphericalAngles<double>{azimuth, 1.5 + 1e-3 * (i % 7)}));
    computed.push_back(
        direction_from_angles(SphericalAngles<double>{azimuth + 2e-3, 1.5 + 1e-3 * (i % 7)}));
  }
  EXPECT_NEAR(direction_errors(computed, truth).azimuth_rmse, 2e-3, 1e-12);
}

TEST(DirectionErrors, LeaveOutWhatDidNotGetThrough) {
  const Bundle truth = some_beams(50);
  const Bundle computed = turned(truth, {1e-4, 2e-4, -1e-4});
  Bundle truth_holes = truth, computed_holes = computed;
  truth_holes.insert(truth_holes.begin() + 10, {kNaN, kNaN, kNaN});
  computed_holes.insert(computed_holes.begin() + 10, {1, 0, 0});
  truth_holes.push_back({0, 1, 0});
  computed_holes.push_back({kNaN, kNaN, kNaN});
  const DirectionErrors whole = direction_errors(computed, truth);
  const DirectionErrors holes = direction_errors(computed_holes, truth_holes);
  EXPECT_EQ(holes.total, whole.total);
  EXPECT_EQ(holes.gauge, whole.gauge);
  EXPECT_EQ(holes.shape, whole.shape);
  EXPECT_EQ(holes.azimuth_bias, whole.azimuth_bias);
}

TEST(DirectionErrors, RefuseWhatCannotBeCompared) {
  const Bundle beams = some_beams(10);
  EXPECT_THROW(direction_errors(beams, some_beams(9)), InvalidArgument);
  EXPECT_THROW(direction_errors(some_beams(2), some_beams(2)), InvalidArgument);
  EXPECT_THROW(direction_errors(Bundle(10, {kNaN, kNaN, kNaN}), beams), InvalidArgument);
}

/// Root of a covariance with some correlation, of the size of a calibration's.
Eigen::MatrixXd some_root(Index n) {
  Eigen::MatrixXd root(n, n);
  const RandomStream entries(7, 1);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      root(i, j) = 2e-5 * entries.normal(static_cast<std::uint64_t>(i * n + j));
    }
  }
  return root;
}

Eigen::VectorXd white_noise(const RandomStream& draws, int draw, Index n) {
  Eigen::VectorXd white(n);
  draws.fill_normal(static_cast<std::uint64_t>(draw * n),
                    {white.data(), static_cast<std::size_t>(n)});
  return white;
}

/// Against draws from the covariance, each measured with the errors above.
TEST(FormalDatum, EqualsDrawsOfTheCovariance) {
  constexpr int kDraws = 5000;
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.3, 5);
  std::vector<std::string> names = testing::kTiltNames;
  names.push_back("wedge_angle_a_deg");
  PrismTrain shared = train;
  shared.set("refractive_index", 1.51);
  names.push_back("refractive_index");  // of two places
  const auto free = estimation::free_parameters(names, {2});
  const Index n = free.size();
  Eigen::MatrixXd root = some_root(n);
  root.row(n - 1) *= 0.3;
  const Eigen::MatrixXd covariance = root * root.transpose();
  const auto angles = some_angles(80, 4);
  const FormalDatum formal = BeamBundle(shared, free, angles).formal_datum(covariance);

  const Bundle truth = beams_of(shared, angles);
  const RandomStream draws(8, 1);
  double roll = 0, pitch = 0, yaw = 0, gauge = 0, shape = 0, total = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    PrismTrain off = shared;
    add_errors(off, free, root * white_noise(draws, draw, n));
    const DirectionErrors errors = direction_errors(beams_of(off, angles), truth);
    roll += errors.rotation.x * errors.rotation.x / kDraws;
    pitch += errors.rotation.y * errors.rotation.y / kDraws;
    yaw += errors.rotation.z * errors.rotation.z / kDraws;
    gauge += errors.gauge * errors.gauge / kDraws;
    shape += errors.shape * errors.shape / kDraws;
    total += errors.total * errors.total / kDraws;
  }
  EXPECT_NEAR(formal.sigma_roll / std::sqrt(roll), 1.0, 0.05);
  EXPECT_NEAR(formal.sigma_pitch / std::sqrt(pitch), 1.0, 0.05);
  EXPECT_NEAR(formal.sigma_yaw / std::sqrt(yaw), 1.0, 0.05);
  EXPECT_NEAR(formal.gauge / std::sqrt(gauge), 1.0, 0.05);
  EXPECT_NEAR(formal.shape / std::sqrt(shape), 1.0, 0.05);
  EXPECT_NEAR(formal.total / std::sqrt(total), 1.0, 0.05);
  // The three are of different size, so that none stands for another.
  EXPECT_GT(std::abs(formal.sigma_roll / formal.sigma_yaw - 1.0), 0.1);
  EXPECT_GT(formal.gauge / formal.shape, 1.2);
  const double together = std::hypot(formal.gauge, formal.shape);
  EXPECT_LT(together, formal.total);
  EXPECT_GT(together, 0.93 * formal.total);
}

// What was held moves the beams with a sigma of one; left out, it is as if nothing had been held.
TEST(BeamBundle, WhatWasHeldCountsUnlessItIsLeftOut) {
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.3, 5);
  const auto free = estimation::free_parameters(testing::kTiltNames, {2});
  const Index n = free.size();
  const Eigen::MatrixXd covariance = 4e-10 * Eigen::MatrixXd::Identity(n, n);
  const auto angles = some_angles(60, 4);
  HeldMovement held;
  held.train = Eigen::MatrixXd::Zero(train.parameters().size(), 1);
  held.rotation_angles = Eigen::MatrixXd::Zero(2, 1);
  held.turn = Eigen::MatrixXd::Zero(3, 1);
  held.turn(2, 0) = 1e-3;
  const BeamBundle alone(train, free, angles), together(train, free, angles, {}, held);
  const FormalDatum without = alone.formal_datum(covariance),
                    with = together.formal_datum(covariance);
  const FormalDatum left_out = together.formal_datum(covariance, HeldErrors::left_out);
  EXPECT_NEAR(with.sigma_yaw, std::hypot(without.sigma_yaw, 1e-3), 1e-12);
  EXPECT_NEAR(with.shape, without.shape, 1e-9);  // all beams together
  EXPECT_DOUBLE_EQ(left_out.total, without.total);
  EXPECT_DOUBLE_EQ(left_out.gauge, without.gauge);

  PrismTrain believed = train;
  add_errors(believed, free, Eigen::VectorXd::Constant(n, 2e-3));
  const PointingError a = alone.pointing_error(believed, covariance);
  const PointingError b = together.pointing_error(believed, covariance);
  EXPECT_DOUBLE_EQ(a.total_sigma, a.total_sigma_given_held);
  EXPECT_DOUBLE_EQ(b.total_sigma_given_held, a.total_sigma);
  EXPECT_GT(b.total_sigma, 2 * a.total_sigma);
  EXPECT_DOUBLE_EQ(better_probability(a), better_probability(b));
}

TEST(FormalDatum, OfNoBeamIsRefused) {
  const PrismTrain train(parse_face_order("PA-AP"));
  const auto free = estimation::free_parameters({"incident_beam_vertical_deg"}, {2});
  EXPECT_THROW(BeamBundle(train, free, {{}, {}}), InvalidArgument);
}

TEST(Datum, KindsHaveNames) {
  EXPECT_STREQ(to_string(DatumKind::none), "walls only");
  EXPECT_STREQ(to_string(DatumKind::planes), "known planes");
  EXPECT_STREQ(to_string(DatumKind::stations), "known stations");
  EXPECT_STREQ(to_string(DatumKind::both), "known planes and stations");
}

TEST(FormalDatum, AsksForACovarianceOfTheFreeParametersAndAnglesOfEveryPrism) {
  const PrismTrain train(parse_face_order("PA-AP"));
  const auto free = estimation::free_parameters({"refractive_index"}, {2});
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(1, 1);
  const auto run = [&](const Eigen::MatrixXd& covariance,
                       const std::vector<std::vector<double>>& angles) {
    return refusal([&] { return BeamBundle(train, free, angles).formal_datum(covariance); });
  };
  EXPECT_EQ(run(Eigen::MatrixXd::Identity(2, 2), {{1, 2}, {3, 4}}),
            "rows of the covariance has 2 values, expected 1");
  EXPECT_EQ(run(one, {{1, 2}}), "rotation_angles has 1 values, expected 2");
  EXPECT_EQ(run(one, {{1, 2}, {3}}), "rotation angles of a prism has 1 values, expected 2");
}

/// Total, gauge and shape scatter over draws of the calibration as they say, about what they are.
TEST(PointingError, ScatterOverDrawsAsTheirSigmasSay) {
  constexpr int kDraws = 2000;
  const PrismTrain truth = testing::imperfect_train("PA-AP", 0.3, 5);
  const auto free = estimation::free_parameters(testing::kTiltNames, {2});
  const Index n = free.size();
  const Eigen::MatrixXd root = some_root(n);
  const Eigen::MatrixXd covariance = root * root.transpose();
  const auto angles = some_angles(80, 4);
  PrismTrain believed = truth;
  add_errors(believed, free, Eigen::VectorXd::Constant(n, 2e-3));
  const PointingError exact = BeamBundle(truth, free, angles).pointing_error(believed, covariance);
  const DirectionErrors known =
      direction_errors(beams_of(believed, angles), beams_of(truth, angles));
  EXPECT_NEAR(exact.errors.total, known.total, 1e-12);
  EXPECT_NEAR(exact.errors.shape, known.shape, 1e-12);
  EXPECT_GT(exact.worst_shape, known.shape);
  EXPECT_LT(exact.worst_shape, 5 * known.shape);

  const RandomStream draws(8, 1);
  double total = 0, gauge = 0, shape = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    PrismTrain found = truth;
    add_errors(found, free, root * white_noise(draws, draw, n));
    const DirectionErrors errors =
        BeamBundle(found, free, angles).pointing_error(believed, covariance).errors;
    total += std::pow(errors.total - known.total, 2) / kDraws;
    gauge += std::pow(errors.gauge - known.gauge, 2) / kDraws;
    shape += std::pow(errors.shape - known.shape, 2) / kDraws;
  }
  EXPECT_NEAR(std::sqrt(total) / exact.total_sigma, 1, 0.06);
  EXPECT_NEAR(std::sqrt(gauge) / exact.gauge_sigma, 1, 0.06);
  EXPECT_NEAR(std::sqrt(shape) / exact.shape_sigma, 1, 0.06);
}

// Draws of the truth about what was found: how often is what was found nearer than what was
// believed?
TEST(PointingError, TellHowProbablyACalibrationIsBetter) {
  constexpr int kDraws = 4000;
  const PrismTrain found = testing::imperfect_train("PA-AP", 0.3, 5);
  const auto free = estimation::free_parameters(testing::kTiltNames, {2});
  const Index n = free.size();
  const auto angles = some_angles(40, 4);
  const Bundle calibrated = beams_of(found, angles);
  const RandomStream draws(8, 2);
  for (const double sigma : {1e-4, 2e-4, 5e-4}) {
    const Eigen::MatrixXd covariance = sigma * sigma * Eigen::MatrixXd::Identity(n, n);
    PrismTrain believed = found;
    add_errors(believed, free, Eigen::VectorXd::Constant(n, 3e-4));
    const Bundle reported = beams_of(believed, angles);
    double better = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      PrismTrain truth = found;
      add_errors(truth, free, sigma * white_noise(draws, draw, n));
      const Bundle beams = beams_of(truth, angles);
      better += direction_errors(calibrated, beams).total < direction_errors(reported, beams).total;
    }
    const double stated =
        better_probability(BeamBundle(found, free, angles).pointing_error(believed, covariance));
    EXPECT_NEAR(better / kDraws, stated, 0.025) << sigma;
  }
}

TEST(PointingError, RefuseAnotherSensor) {
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.3, 5);
  const PrismTrain three = testing::imperfect_train("PA-AP-PA", 0.3, 5);
  EXPECT_NE(refusal([&] {
              BeamBundle(train, {}, some_angles(5, 1)).pointing_error(three, Eigen::MatrixXd(0, 0));
            }).find("prisms of the believed train"),
            std::string::npos);
}

}  // namespace risley::calibration::datum_test
