// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_adjustment.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/angle.hpp"

#include "calibration/flights.hpp"
#include "refusal.hpp"

namespace risley::calibration::flight_adjustment_test {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::FlightSettings;
using testing::SimulatedFlight;

/// A short flight over a village whose planes are known which shot has met.
struct KnownPlanes {
  FlightSettings settings;
  SimulatedFlight flight;
  trajectories::Interpolation interpolation;
  FlightModel model;
  FlightPriors priors;
  FlightWeights weights;
  PlaneOfShot plane;
  ShotPoses poses;

  static FlightSettings noise_free() {
    FlightSettings settings;
    settings.strip_length = 30;
    settings.shot_rate = 1500;
    settings.range_noise = 0;
    settings.trajectory_errors = false;
    settings.boresight_deg = {0.5, -0.4, 0.3};
    return settings;
  }

  explicit KnownPlanes(const FlightSettings& wanted = noise_free(), double knots = 1)
      : settings(wanted),
        flight(settings),
        interpolation(flight.trajectory),
        priors{.process = {settings.errors, flight.trajectory}, .mean = {}, .information = {}} {
    model.train = sensors::load_sensor("mid-40").train;
    for (const char* name : {"refractive_index"}) model.train.set(name, flight.sensor.get(name));
    model.geometry = flight.sensor.geometry;
    std::vector<std::string> names = estimation::default_free_names(model.train.shape());
    std::erase(names, "refractive_index");
    model.free = estimation::free_parameters(names, model.train.shape());
    model.nominal = flight.nominal;
    model.lever_arm = settings.lever_arm + Eigen::Vector3d(0.01, -0.01, 0.01);
    model.range_offset = 0;
    model.clock_offset = 0;
    model.knots = make_knots(flight.shots, knots);
    model.corrections = MatrixXd::Zero(6, model.knots.size());
    model.planes = flight.true_planes();
    for (GroundPlane& ground : model.planes) {
      ground.centre += Eigen::Vector3d(0.02, 0, 0.03);
      ground.normal = (ground.normal + Eigen::Vector3d(0.01, 0.01, 0)).normalized();
    }
    for (const std::size_t met : flight.met) plane.push_back(static_cast<std::int32_t>(met));
    priors.mean = unknown_values(model);
    priors.information = MatrixXd::Zero(model.unknowns().size(), model.unknowns().size());
    weights.range_variance = 4e-4;
    poses = poses_of(flight.shots, interpolation, 0);
  }

  VectorXd truth() const {
    FlightModel true_model = model;
    true_model.train = flight.sensor.train;
    true_model.boresight = flight.boresight;
    true_model.lever_arm = settings.lever_arm;
    true_model.range_offset = settings.range_offset;
    true_model.clock_offset = settings.clock_offset;
    return unknown_values(true_model);
  }
};

TEST(FlightAdjustment, RecoversEverythingFromANoiseFreeFlight) {
  KnownPlanes known;
  FlightAdjustmentOptions options;
  options.tolerance = 0;
  FlightModel model = known.model;
  for (int round = 0; round < 3; ++round) {
    options.most_steps = 3;
    const FlightAdjustment found = adjust_flight(known.flight.shots, known.poses, known.plane,
                                                 model, known.weights, known.priors, options);
    EXPECT_EQ(found.lost, 0U);
    model = found.model;
    known.poses = poses_of(known.flight.shots, known.interpolation, model.clock_offset);
  }
  const VectorXd off = unknown_values(model) - known.truth();
  // Times are whole nanoseconds, and 0.5 ns of turning by 0.3 rad/s are 1e-10 rad.
  EXPECT_LT(off.head<3>().cwiseAbs().maxCoeff(), 2e-8);
  EXPECT_LT(off.segment<3>(3).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(std::abs(off[FlightUnknowns::range_offset()]), 1e-6);
  EXPECT_LT(std::abs(off[FlightUnknowns::clock_offset()]), 1e-8);
  EXPECT_LT(off.tail(off.size() - 8).cwiseAbs().maxCoeff(), 2e-8);
  EXPECT_LT(model.corrections.topRows(3).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(model.corrections.bottomRows(3).cwiseAbs().maxCoeff(), 1e-8);
  const auto truth = known.flight.true_planes();
  for (std::size_t p = 0; p < truth.size(); ++p) {
    if (std::ranges::count(known.plane, static_cast<std::int32_t>(p)) < 20) continue;
    EXPECT_LT((model.planes[p].normal - truth[p].normal).norm(), 1e-6);
    EXPECT_LT(std::abs(truth[p].normal.dot(model.planes[p].centre - truth[p].centre)), 1e-5);
  }
}

// Eight steps do not still the hundreds of corrections of a long flight that shots at the gate move
// by a hair each; what counts is that the calibration does not move any more.
TEST(FlightAdjustment, HasSettledWhenOnlyCorrectionsStillMoveByAHair) {
  KnownPlanes known(KnownPlanes::noise_free(), 0.25);
  known.priors.information = VectorXd::Constant(known.model.unknowns().size(), 100).asDiagonal();
  FlightAdjustmentOptions options;
  options.most_steps = 6;
  const FlightModel settled = adjust_flight(known.flight.shots, known.poses, known.plane,
                                            known.model, known.weights, known.priors, options)
                                  .model;
  options.most_steps = 1;
  options.tolerance = 0.01;
  const auto next = [&](const FlightModel& model) {
    return adjust_flight(known.flight.shots, known.poses, known.plane, model, known.weights,
                         known.priors, options);
  };
  FlightModel shaken = settled;
  const auto shake = [&](double by) {
    for (Index k = 0; k < shaken.corrections.cols(); ++k) {
      shaken.corrections(4, k) = settled.corrections(4, k) + (k % 2 == 0 ? by : -by);
    }
    return next(shaken);
  };
  const double once = shake(1e-6).promised;
  const FlightAdjustment hair = shake(1e-6 * std::sqrt(0.1 / once));
  EXPECT_GT(hair.promised, 5 * options.tolerance);
  EXPECT_TRUE(hair.converged) << hair.promised;
  EXPECT_FALSE(shake(1e-6 * std::sqrt(2 / once)).converged) << "more than a hair";
  // As little, but of the boresight.
  FlightModel turned = settled;
  const auto turn = [&](double by) {
    turned.boresight = settled.boresight * Eigen::AngleAxisd(by, Eigen::Vector3d::UnitX());
    return next(turned);
  };
  const FlightAdjustment moved = turn(1e-6 * std::sqrt(0.1 / turn(1e-6).promised));
  EXPECT_NEAR(moved.promised, 0.1, 0.02);
  EXPECT_FALSE(moved.converged);
}

TEST(FlightAdjustment, RecoversTheTrajectorysCorrections) {
  FlightSettings settings = KnownPlanes::noise_free();
  settings.trajectory_errors = true;
  for (trajectories::ErrorTerm& term : settings.errors.terms) term.white = 0;
  settings.error_knots = 3.5;  // two lines a strip, from half a second before its shots
  KnownPlanes known(settings, 0.25);
  known.weights.range_variance = 1e-6;
  FlightAdjustmentOptions options;
  options.most_steps = 4;
  FlightModel model = known.model;
  for (int round = 0; round < 2; ++round) {
    model = adjust_flight(known.flight.shots, known.poses, known.plane, model, known.weights,
                          known.priors, options)
                .model;
    known.poses = poses_of(known.flight.shots, known.interpolation, model.clock_offset);
  }
  // Differences between strips are determined, what they have in common is not.
  VectorXd before = VectorXd::Zero(6), after = VectorXd::Zero(6);
  const auto& knots = model.knots;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const auto& times = known.flight.trajectory.time_ns;
    const auto at =
        static_cast<std::size_t>(std::ranges::lower_bound(times, knots.time_ns[k]) - times.begin());
    const Eigen::Matrix<double, 6, 1> truth = known.flight.error[std::min(at, times.size() - 1)];
    before += truth.cwiseAbs2();
    after += (model.corrections.col(k) - truth).cwiseAbs2();
  }
  for (int c = 3; c < 6; ++c) EXPECT_LT(after[c], 0.25 * before[c]) << c;
  EXPECT_LT(after.head<3>().sum(), before.head<3>().sum());
}

/// Everything in one dense system, planes included.
MatrixXd dense_equations(const FlightEquations& equations, const FlightModel& model,
                         VectorXd& right) {
  const Index knots = 6 * std::ssize(model.knots), g = model.unknowns().size();
  const Index size = knots + g + 3 * std::ssize(model.planes);
  MatrixXd all = MatrixXd::Zero(size, size);
  right = VectorXd::Zero(size);
  all.block(knots, knots, g, g) = equations.hessian;
  right.segment(knots, g) = equations.gradient;
  for (std::size_t i = 0; i < model.knots.intervals.size(); ++i) {
    const Index at = 6 * model.knots.intervals[i].knot;
    all.block(at, at, 12, 12) += equations.knot_hessian[i];
    all.block(knots, at, g, 12) += equations.knot_global[i].transpose();
    all.block(at, knots, 12, g) += equations.knot_global[i];
    right.segment(at, 12) += equations.knot_gradient[i];
  }
  for (const PlaneBlock& block : equations.plane_blocks) {
    const Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>> rows(
        equations.plane_products.data() + block.at, 3, g + 16);
    const Index plane = knots + g + 3 * block.plane;
    const Index at = 6 * model.knots.intervals[block.interval].knot;
    all.block(plane, knots, 3, g) += rows.leftCols(g);
    all.block(knots, plane, g, 3) += rows.leftCols(g).transpose();
    all.block(plane, at, 3, 12) += rows.middleCols(g, 12);
    all.block(at, plane, 12, 3) += rows.middleCols(g, 12).transpose();
    all.block(plane, plane, 3, 3) += rows.rightCols(3);
    right.segment(plane, 3) += rows.col(g + 12);
  }
  for (Index p = 0; p < std::ssize(model.planes); ++p) {
    const Index at = knots + g + 3 * p;
    all(at, at) += 1e-2;
    all(at + 1, at + 1) += 1e-2;
    all(at + 2, at + 2) += 1e-6;
  }
  return all;
}

/// Adds what is known of a plane: its place, and how it leans.
void add_plane_prior(const PlanePrior& prior, const FlightModel& model, MatrixXd& all,
                     VectorXd& right) {
  const GroundPlane& plane = model.planes[prior.plane];
  const auto [first, second] = tangents_of({plane.normal.x(), plane.normal.y(), plane.normal.z()});
  const Eigen::Vector3d tilt = *prior.normal / prior.normal->dot(plane.normal) - plane.normal;
  const Eigen::Vector3d off(tilt.dot(Eigen::Vector3d(first.x, first.y, first.z)),
                            tilt.dot(Eigen::Vector3d(second.x, second.y, second.z)),
                            plane.normal.dot(prior.place - plane.centre));
  const Index at = all.rows() - 3 * std::ssize(model.planes) + 3 * prior.plane;
  for (Index k = 0; k < 3; ++k) {
    const double sigma = k < 2 ? prior.normal_sigma : prior.sigma;
    all(at + k, at + k) += 1 / (sigma * sigma) - (k < 2 ? 1e-2 : 1e-6);
    right[at + k] += off[k] / (sigma * sigma);
  }
}

TEST(FlightAdjustment, EliminatesPlanesWithoutLoss) {
  KnownPlanes known(KnownPlanes::noise_free(), 2);
  known.priors.information.diagonal().setConstant(10);
  known.priors.mean.array() += 0.001;
  known.model.corrections.setConstant(1e-4);
  known.priors.held.assign(known.model.unknowns().size(), false);
  known.priors.held[FlightUnknowns::lever_arm(2)] = true;
  known.priors.planes.push_back({.plane = 0,
                                 .place = {3, 4, 0.01},
                                 .sigma = 0.005,
                                 .normal = Eigen::Vector3d(0.002, -0.001, 1).normalized(),
                                 .normal_sigma = 0.001});
  const FlightEquations equations =
      flight_equations(known.flight.shots, known.poses, known.plane, known.model, known.weights);
  VectorXd right;
  MatrixXd all = dense_equations(equations, known.model, right);
  add_plane_prior(known.priors.planes.front(), known.model, all, right);
  const Index knots = 6 * std::ssize(known.model.knots), g = known.model.unknowns().size();
  const MatrixXd rates = value_rates(known.model);
  all.block(knots, knots, g, g) += 10 * rates.transpose() * rates;
  right.segment(knots, g) +=
      10 * rates.transpose() * (known.priors.mean - unknown_values(known.model));
  for (int c = 0; c < 6; ++c) {
    const KnotInformation chain = knot_information(known.model.knots, known.priors.process, c);
    for (Index k = 0; 6 * k < knots; ++k) {
      all(6 * k + c, 6 * k + c) += chain.diagonal[k];
      right[6 * k + c] -= 1e-4 * chain.diagonal[k];
      if (6 * (k + 1) == knots) continue;
      all(6 * k + c, 6 * (k + 1) + c) += chain.next[k];
      all(6 * (k + 1) + c, 6 * k + c) += chain.next[k];
      right[6 * k + c] -= 1e-4 * chain.next[k];
      right[6 * (k + 1) + c] -= 1e-4 * chain.next[k];
    }
  }
  const Index held = knots + FlightUnknowns::lever_arm(2);
  const VectorXd held_column = all.col(held);
  all.row(held).setZero();
  all.col(held).setZero();
  all(held, held) = 1;
  right[held] = 0;
  const VectorXd scale = all.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<MatrixXd> dense(MatrixXd(scale.asDiagonal() * all * scale.asDiagonal()));
  const auto solved = [&](const VectorXd& b) -> VectorXd {
    return scale.asDiagonal() * dense.solve(VectorXd(scale.asDiagonal() * b));
  };
  const auto near = [](const MatrixXd& a, const MatrixXd& b) {
    return (a - b).cwiseAbs().maxCoeff() < 1e-6 * b.cwiseAbs().maxCoeff();
  };
  const FlightSystem system(equations, known.model, known.priors);
  const FlightSystem::Step step = system.step();
  const VectorXd expected = solved(right);
  EXPECT_TRUE(near(step.unknowns.head(knots), expected.head(knots)));
  EXPECT_TRUE(near(step.unknowns.tail(g), expected.segment(knots, g)));
  EXPECT_TRUE(near(Eigen::Map<const VectorXd>(step.planes.data(), step.planes.size()),
                   expected.tail(step.planes.size())));
  EXPECT_EQ(step.unknowns[held], 0);
  // The inverse, its diagonal, and what the planes follow by.
  const Index one = knots + 1;
  const VectorXd column = solved(VectorXd::Unit(all.rows(), one));
  const MatrixXd unit = VectorXd::Unit(system.size(), one);
  EXPECT_TRUE(near(system.solve(unit), column.head(system.size())));
  EXPECT_TRUE(near(system.planes_of(system.solve(unit)), column.tail(step.planes.size())));
  EXPECT_TRUE(near(system.inverse().col(one), column.head(system.size())));
  const VectorXd diagonal = system.inverse_diagonal();
  EXPECT_TRUE(near(diagonal, system.inverse().diagonal()));
  EXPECT_EQ(diagonal[held], 0);
  VectorXd moved = -held_column;
  moved[held] = 0;
  EXPECT_TRUE(near(system.held_changes(), solved(moved).head(system.size())));
}

TEST(FlightAdjustment, CovarianceIsTheInverseWhereWeightsTellTheTruth) {
  KnownPlanes known;
  known.priors.information = VectorXd::Constant(known.model.unknowns().size(), 100).asDiagonal();
  const auto process_lasting = [&](double correlation_time) {
    trajectories::ErrorModel model = known.settings.errors;
    for (trajectories::ErrorTerm& term : model.terms) term.correlation_time = correlation_time;
    return trajectories::ErrorProcess(model, known.flight.trajectory);
  };
  known.priors.process = process_lasting(1e9);  // nothing happens between knots
  const FlightEquations equations =
      flight_equations(known.flight.shots, known.poses, known.plane, known.model, known.weights);
  const FlightSystem system(equations, known.model, known.priors);
  const Index g = system.globals();
  MatrixXd functionals = MatrixXd::Zero(system.size(), g);
  functionals.bottomRows(g).setIdentity();
  const MatrixXd expected = system.solve(functionals).bottomRows(g);
  const auto covariance_with = [&](const FlightWeights& weights) {
    return flight_covariance(known.flight.shots, known.poses, known.plane, known.model, weights,
                             known.priors, system, functionals);
  };
  const MatrixXd found = covariance_with(known.weights);
  const VectorXd sigma = expected.diagonal().cwiseSqrt();
  const MatrixXd correlation_off =
      sigma.cwiseInverse().asDiagonal() * (found - expected) * sigma.cwiseInverse().asDiagonal();
  EXPECT_LT(correlation_off.cwiseAbs().maxCoeff(), 1e-3);
  // A process that moves between knots, and noise that shots share, both add to it.
  known.priors.process = process_lasting(5);
  const MatrixXd moving = covariance_with(known.weights);
  EXPECT_GT((moving - found).diagonal().minCoeff(), -1e-18);
  EXPECT_GT(moving(1, 1), 1.05 * found(1, 1));
}

TEST(FlightAdjustment, KnownGroundIsPartOfTheCovariance) {
  KnownPlanes known;
  known.priors.information = VectorXd::Constant(known.model.unknowns().size(), 100).asDiagonal();
  trajectories::ErrorModel still = known.settings.errors;
  for (trajectories::ErrorTerm& term : still.terms) term.correlation_time = 1e9;
  known.priors.process = trajectories::ErrorProcess(still, known.flight.trajectory);
  for (std::size_t p = 0; p < known.model.planes.size(); ++p) {
    known.priors.planes.push_back({.plane = p,
                                   .place = known.model.planes[p].centre,
                                   .sigma = 0.003,
                                   .normal = known.model.planes[p].normal,
                                   .normal_sigma = 0.0005});
  }
  const auto covariance = [&](bool inverse) {
    const FlightSystem system(
        flight_equations(known.flight.shots, known.poses, known.plane, known.model, known.weights),
        known.model, known.priors);
    const Index g = system.globals();
    MatrixXd functionals = MatrixXd::Zero(system.size(), g);
    functionals.bottomRows(g).setIdentity();
    if (inverse) return MatrixXd(system.solve(functionals).bottomRows(g));
    return flight_covariance(known.flight.shots, known.poses, known.plane, known.model,
                             known.weights, known.priors, system, functionals);
  };
  const MatrixXd expected = covariance(true), found = covariance(false);
  const VectorXd scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((scale.asDiagonal() * (found - expected) * scale.asDiagonal()).cwiseAbs().maxCoeff(),
            1e-3);
  known.priors.planes.clear();
  // Tied to the trajectory's heights and the ranges' offset, and still better known.
  EXPECT_LT(expected(FlightUnknowns::lever_arm(2), FlightUnknowns::lever_arm(2)),
            0.95 * covariance(true)(FlightUnknowns::lever_arm(2), FlightUnknowns::lever_arm(2)));
}

TEST(FlightAdjustment, RefusesWhatDoesNotFit) {
  KnownPlanes known;
  const auto refused = [&](const auto& damage) {
    FlightPriors priors = known.priors;
    damage(priors);
    return refusal([&] {
      adjust_flight(known.flight.shots, known.poses, known.plane, known.model, known.weights,
                    priors);
    });
  };
  EXPECT_NE(refused([](FlightPriors& p) { p.mean.resize(3); }), "");
  EXPECT_NE(refused([](FlightPriors& p) { p.information.resize(3, 3); }), "");
  EXPECT_NE(refused([](FlightPriors& p) { p.mean[0] = std::nan(""); }), "");
  EXPECT_NE(refused([](FlightPriors& p) { p.held = {true}; }), "");
  FlightAdjustmentOptions options;
  options.most_steps = 0;
  EXPECT_NE(refusal([&] {
              adjust_flight(known.flight.shots, known.poses, known.plane, known.model,
                            known.weights, known.priors, options);
            }),
            "");
}

}  // namespace risley::calibration::flight_adjustment_test
