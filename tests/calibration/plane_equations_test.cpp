// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/plane_equations.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <ceres/jet.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/optics/observation_model.hpp"

#include "optics/trains.hpp"
#include "parameter_name.hpp"

namespace risley::calibration::plane_equations_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRangeNoise = 0.02;
constexpr double kAngleNoise = radians_from_degrees(0.03);

/// A wall ahead of a train with every error, seen from where the beams leave the last prism.
PlaneView wall_view(const std::string& face_order, std::vector<int> places, unsigned seed) {
  PlaneView view;
  view.train = testing::imperfect_train(face_order, 0.5, seed);
  view.geometry = {{0.007}, {0.03}};
  view.places = std::move(places);
  view.range_offset = 0.013;
  view.range_variance = kRangeNoise * kRangeNoise;
  view.plane = plane_from_angles(
      SphericalAngles<double>{radians_from_degrees(10.0), radians_from_degrees(80.0)}, 30.0);
  view.tangent_1 = normalized(cross(Vector3<double>{0, 0, 1}, view.plane.normal));
  view.tangent_2 = cross(view.plane.normal, view.tangent_1);
  return view;
}

std::vector<double> angles_of(const RangedShots& shots, std::size_t shot) {
  std::vector<double> angles;
  for (const auto& column : shots.rotation_angle) angles.push_back(column[shot]);
  return angles;
}

/// Shots at random rotation angles, each with a covariance of its own.
RangedShots shoot(const PlaneView& view, std::size_t count, double range_noise, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-kPi, kPi);
  const auto prisms = static_cast<std::size_t>(view.train.prisms());
  RangedShots shots;
  shots.rotation_angle.resize(prisms);
  shots.angle_covariance.resize(prisms * (prisms + 1) / 2);
  for (std::size_t i = 0; i < count; ++i) {
    for (auto& column : shots.rotation_angle) column.push_back(uniform(generator));
    const Eigen::MatrixXd root =
        kAngleNoise * Eigen::MatrixXd::NullaryExpr(static_cast<int>(prisms),
                                                   static_cast<int>(prisms),
                                                   [&] { return normal(generator); });
    const Eigen::MatrixXd covariance = root * root.transpose();
    std::size_t pair = 0;
    for (Eigen::Index k = 0; k < covariance.rows(); ++k) {
      for (Eigen::Index l = k; l < covariance.cols(); ++l) {
        shots.angle_covariance[pair++].push_back(static_cast<float>(covariance(k, l)));
      }
    }
    const Ray ray = emergent_ray(view.train, view.geometry, angles_of(shots, i));
    const double range = ray.valid ? hit_distance(view.plane, ray.origin, ray.direction) : 1.0;
    shots.range.push_back(range + view.range_offset + range_noise * normal(generator));
  }
  return shots;
}

/// The same sums by scalar code: residuals from rays, derivatives by automatic differentiation of
/// everything but the beam's origin. The *_size hold the sums of the terms' magnitudes, which
/// rounding errors are relative to.
struct Reference {
  Eigen::MatrixXd hessian, hessian_size;
  Eigen::VectorXd gradient, gradient_size;
  double cost = 0;
  std::size_t lost = 0;
  std::vector<double> residual, variance;

  Reference(const RangedShots& shots, const PlaneView& view) {
    with_layout(view.train.layout(), [&]<TrainLayout N>() { fill<N>(shots, view); });
  }

 private:
  template <TrainLayout N>
  void fill(const RangedShots& shots, const PlaneView& view) {
    constexpr int kParameters = parameter_count(N);
    // Parameters, rotation angles, normal towards both tangents, distance.
    using Jet = ceres::Jet<double, kParameters + N + 3>;
    const auto lifted = [](const Vector3<double>& v) {
      return Vector3<Jet>{Jet(v.x), Jet(v.y), Jet(v.z)};
    };
    std::array<Jet, kParameters> parameters;
    for (int i = 0; i < kParameters; ++i) parameters[i] = Jet(view.train[i], i);
    const auto prepared = prepare<Jet, N>(parameters, face_order_array<N>(view.train));
    const Vector3<Jet> plane_normal = lifted(view.plane.normal) +
                                      Jet(0.0, kParameters + N) * lifted(view.tangent_1) +
                                      Jet(0.0, kParameters + N + 1) * lifted(view.tangent_2);
    const Jet plane_distance(view.plane.distance, kParameters + N + 2);

    const PlaneColumns columns(view);
    hessian = hessian_size = Eigen::MatrixXd::Zero(columns.size(), columns.size());
    gradient = gradient_size = Eigen::VectorXd::Zero(columns.size());
    for (std::size_t i = 0; i < shots.size(); ++i) {
      const std::vector<double> angles = angles_of(shots, i);
      const Ray ray = emergent_ray(view.train, view.geometry, angles);
      const double expected = hit_distance(view.plane, ray.origin, ray.direction);
      residual.push_back(kNaN);
      variance.push_back(kNaN);
      if (!ray.valid || dot(view.plane.normal, ray.direction) <= 1e-3 || !(expected > 0) ||
          !std::isfinite(shots.range[i])) {
        ++lost;
        continue;
      }
      residual[i] = shots.range[i] - view.range_offset - expected;

      std::array<Jet, N> angle_jets;
      for (int k = 0; k < N; ++k) {
        angle_jets[k] = Jet(angles[k], kParameters + k);
      }
      const Vector3<Jet> direction = trace(prepared, angle_jets).direction;
      const Jet range =
          (plane_distance - dot(plane_normal, lifted(ray.origin))) / dot(plane_normal, direction);
      Eigen::VectorXd row(columns.size());
      for (int c = 0; c < columns.places; ++c) {
        row[c] = range.v[view.places[c]];
      }
      for (int k = 0; k < N; ++k) row[columns.rotation_angle(k)] = range.v[kParameters + k];
      row[columns.range_offset()] = 1.0;
      row[columns.normal(0)] = range.v[kParameters + N];
      row[columns.normal(1)] = range.v[kParameters + N + 1];
      row[columns.distance()] = range.v[kParameters + N + 2];

      Eigen::MatrixXd covariance(int{N}, int{N});
      std::size_t pair = 0;
      for (int k = 0; k < N; ++k) {
        for (int l = k; l < N; ++l) {
          covariance(k, l) = covariance(l, k) =
              static_cast<double>(shots.angle_covariance[pair++][i]);
        }
      }
      const Eigen::VectorXd slopes = row.segment(columns.rotation_angle(0), int{N});
      variance[i] = view.range_variance + slopes.dot(covariance * slopes);
      const double weight = 1.0 / variance[i];
      cost += weight * residual[i] * residual[i];
      hessian += weight * row * row.transpose();
      gradient += weight * residual[i] * row;
      const Eigen::VectorXd size = row.cwiseAbs();
      hessian_size += weight * size * size.transpose();
      // A residual is the difference of two ranges.
      gradient_size += weight * (std::abs(residual[i]) + 1e-3 * expected) * size;
    }
  }
};

/// Largest difference as a share of the size of the entries; entries of size zero must be equal.
double difference(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected,
                  const Eigen::MatrixXd& size) {
  if (found.rows() != expected.rows() || found.cols() != expected.cols()) return kInfinity;
  double worst = 0;
  for (Eigen::Index i = 0; i < expected.rows(); ++i) {
    for (Eigen::Index j = 0; j < expected.cols(); ++j) {
      const double error = std::abs(found(i, j) - expected(i, j));
      if (std::isnan(error)) return error;
      if (error != 0) worst = std::max(worst, error / size(i, j));
    }
  }
  return worst;
}

/// Equations, residuals and variances of every instruction set.
/// @param tolerance  of residuals, m
void expect_reference(const RangedShots& shots, const PlaneView& view, double tolerance = 1e-12) {
  const Reference expected(shots, view);
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    std::vector<double> residual(shots.size(), 77.0), variance(shots.size(), 78.0);
    const PlaneEquations found = plane_equations(shots, view, {residual, variance}, set);
    EXPECT_EQ(found.lost, expected.lost);
    EXPECT_EQ(found.shots, shots.size() - expected.lost);
    EXPECT_LE(difference(found.hessian, expected.hessian, expected.hessian_size), 1e-11);
    EXPECT_LE(difference(found.gradient, expected.gradient, expected.gradient_size), 1e-11);
    EXPECT_EQ(found.hessian, found.hessian.transpose());
    EXPECT_NEAR(found.cost, expected.cost, 1e-10 * expected.cost + 1e-20);
    for (std::size_t i = 0; i < shots.size(); ++i) {
      ASSERT_EQ(std::isnan(residual[i]), std::isnan(expected.residual[i])) << i;
      ASSERT_EQ(std::isnan(variance[i]), std::isnan(expected.residual[i])) << i;
      if (std::isnan(residual[i])) continue;
      // Far away on a plane that is nearly parallel to the beam, rounding errors grow.
      const double size = std::max(1.0, std::abs(shots.range[i] - residual[i]) / 50.0);
      ASSERT_NEAR(residual[i], expected.residual[i], tolerance * size * size) << i;
      ASSERT_NEAR(variance[i], expected.variance[i], 1e-11 * expected.variance[i]) << i;
    }
  }
}

std::vector<int> all_places(int prisms) {
  std::vector<int> places;
  for (int place = 0; place < parameter_count(prisms); ++place) places.push_back(place);
  return places;
}

/// None, some in any order, and all of them.
std::vector<std::vector<int>> place_sets(int prisms) {
  std::vector<int> shuffled{place::wedge_angle(prisms - 1),  place::refractive_index_air(),
                            place::prism_tilt_horizontal(0), place::incident_beam_vertical(),
                            place::refractive_index(0),      place::bearing_tilt_horizontal(0)};
  return {{}, std::move(shuffled), all_places(prisms)};
}

class PlaneEquationsOfATrain : public ::testing::TestWithParam<std::string> {};

TEST_P(PlaneEquationsOfATrain, EqualTheScalarModel) {
  const int prisms = static_cast<int>(parse_face_order(GetParam()).size());
  for (const auto& places : place_sets(prisms)) {
    SCOPED_TRACE(places.size());
    PlaneView view = wall_view(GetParam(), places, 1);
    const RangedShots shots = shoot(view, 301, kRangeNoise, 2);
    // Linearised a little beside the truth.
    view.train.set_place(place::incident_beam_vertical(),
                         view.train[place::incident_beam_vertical()] + 3e-4);
    view.plane.distance += 0.01;
    expect_reference(shots, view);
  }
}

INSTANTIATE_TEST_SUITE_P(FaceOrders, PlaneEquationsOfATrain,
                         ::testing::Values("PA", "AP", "PA-AP", "AP-PA", "PA-AP-PA", "AP-AP-PA",
                                           "PA-AP-PA-AP"),
                         kByItself);

/// The shots of one emitter, as its own.
RangedShots shots_of_emitter(const RangedShots& shots, int beam) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (shots.beam[i] == beam) rows.push_back(i);
  }
  RangedShots own = rows_of(shots, rows);
  own.beam.assign(own.size(), 0);
  return own;
}

class PlaneEquationsOfEmitters : public ::testing::TestWithParam<std::string> {};

TEST_P(PlaneEquationsOfEmitters, AreTheSumOfThoseOfEach) {
  constexpr int kEmitters = 6;
  PlaneView view = wall_view(GetParam(), {}, 1);
  view.train = testing::imperfect_train(GetParam(), 0.5, 1, kEmitters);
  for (int at = 0; at < parameter_count(view.train.shape()); ++at) view.places.push_back(at);
  RangedShots shots = shoot(view, 301, kRangeNoise, 2);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    shots.beam.push_back(static_cast<std::uint8_t>(i * i % kEmitters));
  }
  view.plane.distance += 0.01;
  const int prisms = view.train.prisms();
  const PlaneColumns columns(view);
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(columns.size(), columns.size());
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(columns.size());
  double cost = 0;
  std::size_t lost = 0;
  for (int beam = 0; beam < kEmitters; ++beam) {
    PlaneView own = view;
    own.train = testing::train_of_emitter(view.train, beam);
    own.places.clear();
    std::vector<int> places_of_columns;
    for (const int at : view.places) {
      const int mine = testing::place_of_emitter(at, beam, prisms);
      if (mine < 0) continue;
      own.places.push_back(mine);
      places_of_columns.push_back(at);
    }
    for (int c = columns.places; c < columns.size(); ++c) places_of_columns.push_back(c);
    const PlaneEquations part =
        plane_equations(shots_of_emitter(shots, beam), own, {}, InstructionSet::baseline);
    for (std::size_t a = 0; a < places_of_columns.size(); ++a) {
      gradient[places_of_columns[a]] += part.gradient[a];
      for (std::size_t b = 0; b < places_of_columns.size(); ++b) {
        hessian(places_of_columns[a], places_of_columns[b]) += part.hessian(a, b);
      }
    }
    cost += part.cost;
    lost += part.lost;
  }
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    const PlaneEquations found = plane_equations(shots, view, {}, set);
    EXPECT_EQ(found.lost, lost);
    EXPECT_NEAR(found.cost, cost, 1e-10 * cost);
    EXPECT_LT((found.hessian - hessian).cwiseAbs().maxCoeff(),
              1e-11 * hessian.cwiseAbs().maxCoeff());
    EXPECT_LT((found.gradient - gradient).cwiseAbs().maxCoeff(),
              1e-10 * gradient.cwiseAbs().maxCoeff());
  }
  shots.beam[3] = kEmitters;
  EXPECT_THROW(plane_equations(shots, view), InvalidArgument);
  shots.beam.pop_back();
  EXPECT_THROW(plane_equations(shots, view), InvalidArgument);
}

INSTANTIATE_TEST_SUITE_P(FaceOrders, PlaneEquationsOfEmitters,
                         ::testing::Values("AP", "PA-AP", "AP-PA", "AP-PA-AP", "PA-AP-AP-PA"),
                         kByItself);

TEST(PlaneEquations, AnyNumberOfShotsWillDo) {
  const PlaneView view = wall_view("PA-AP", {1, 2, 6, 7, 8, 11, 12}, 3);
  const RangedShots all = shoot(view, 8192 + 131, kRangeNoise, 4);
  for (const std::size_t count : {0, 1, 2, 3, 7, 8, 9, 31, 32, 33, 127, 128, 129, 8192, 8323}) {
    SCOPED_TRACE(count);
    RangedShots shots = all;
    for (auto& column : shots.rotation_angle) column.resize(count);
    for (auto& column : shots.angle_covariance) column.resize(count);
    shots.range.resize(count);
    expect_reference(shots, view);
  }
}

TEST(PlaneEquations, ExactAnglesLeaveTheRangesVariance) {
  const PlaneView view = wall_view("PA-AP", {1}, 5);
  RangedShots shots = shoot(view, 50, kRangeNoise, 6);
  for (auto& column : shots.angle_covariance) std::ranges::fill(column, 0.0F);
  for (const InstructionSet set : available_instruction_sets()) {
    std::vector<double> variance(shots.size());
    plane_equations(shots, view, {{}, variance}, set);
    for (const double value : variance) EXPECT_EQ(value, view.range_variance);
  }
}

TEST(PlaneEquations, LostShotsAreCountedAndPoisonNothing) {
  PlaneView view = wall_view("PA-AP", all_places(2), 7);
  RangedShots shots = shoot(view, 333, kRangeNoise, 8);
  shots.range[0] = kNaN;
  shots.range[17] = kInfinity;
  shots.range[18] = -kInfinity;
  shots.rotation_angle[1][100] = kNaN;
  shots.range[332] = kNaN;
  {
    SCOPED_TRACE("single ones");
    EXPECT_EQ(Reference(shots, view).lost, 5u);
    expect_reference(shots, view);
  }
  {
    SCOPED_TRACE("a plane that only some beams meet");
    PlaneView edge = view;
    edge.plane = plane_from_angles(
        SphericalAngles<double>{radians_from_degrees(85.0), radians_from_degrees(100.0)}, 3.0);
    edge.tangent_1 = normalized(cross(Vector3<double>{0, 0, 1}, edge.plane.normal));
    edge.tangent_2 = cross(edge.plane.normal, edge.tangent_1);
    const Reference expected(shots, edge);
    EXPECT_GT(expected.lost, 50u);
    EXPECT_LT(expected.lost, 283u);
    expect_reference(shots, edge);
  }
  {
    SCOPED_TRACE("a parallel plane");
    PlaneView parallel = view;
    RangedShots same = shots;  // all along the axis of the beam
    for (auto& column : same.rotation_angle) std::ranges::fill(column, 0.25);
    std::ranges::fill(same.range, 30.0);
    const Ray ray = emergent_ray(view.train, view.geometry, angles_of(same, 0));
    parallel.plane.normal = normalized(cross(ray.direction, Vector3<double>{0, 0, 1}));
    parallel.tangent_1 = ray.direction;
    parallel.tangent_2 = cross(parallel.plane.normal, ray.direction);
    EXPECT_EQ(Reference(same, parallel).lost, same.size());
    expect_reference(same, parallel);
  }
  {
    SCOPED_TRACE("planes behind");
    PlaneView behind = view;
    behind.plane.distance = -30;
    EXPECT_EQ(Reference(shots, behind).lost, shots.size());
    expect_reference(shots, behind);
    behind = view;
    behind.plane.normal = -view.plane.normal;
    EXPECT_EQ(Reference(shots, behind).lost, shots.size());
    expect_reference(shots, behind);
  }
}

TEST(PlaneEquations, ABeamThatDoesNotGetThroughIsLost) {
  for (const auto& [face_order, wedge_deg] :
       {std::pair("PA", 40.0), std::pair("PA-PA", 34.0), std::pair("PA-PA-PA", 31.0)}) {
    SCOPED_TRACE(face_order);
    const int prisms = static_cast<int>(parse_face_order(face_order).size());
    PlaneView view = wall_view(face_order, all_places(prisms), 9);
    view.train.set_place(place::incident_beam_vertical(), radians_from_degrees(5.0));
    for (int k = 0; k < prisms; ++k) {  // steep: total reflection at some rotation angles
      view.train.set_place(place::wedge_angle(k), radians_from_degrees(wedge_deg));
    }
    const RangedShots shots = shoot(view, 350, kRangeNoise, 10);
    std::size_t stopped = 0;
    for (std::size_t i = 0; i < shots.size(); ++i) {
      stopped += !emergent_ray(view.train, view.geometry, angles_of(shots, i)).valid;
    }
    EXPECT_GT(stopped, 50u);
    EXPECT_LT(stopped, 300u);
    expect_reference(shots, view, 1e-10);  // rounding errors grow close to total reflection
  }
}

/// Signs: steps of hessian^-1 gradient lead from wrong parameters to those that the ranges were
/// made with, also over the derivative of the beam's origin that is left out.
TEST(PlaneEquations, StepsLeadToTheTruth) {
  const std::vector<int> places{place::incident_beam_horizontal(), place::incident_beam_vertical(),
                                place::prism_tilt_vertical(0), place::prism_tilt_horizontal(1)};
  const PlaneView truth = wall_view("PA-AP", places, 11);
  const RangedShots shots = shoot(truth, 5000, 0.0, 12);
  PlaneView view = truth;
  for (const int place : places) view.train.set_place(place, truth.train[place] + 2e-3);
  view.plane.distance += 0.2;
  view.plane.normal = normalized(view.plane.normal + 1e-3 * view.tangent_1);
  const PlaneColumns columns(view);
  std::vector<int> chosen{0, 1, 2, 3, columns.normal(0), columns.normal(1), columns.distance()};
  double cost = 0;
  for (int iteration = 0; iteration < 6; ++iteration) {
    view.tangent_1 = normalized(cross(Vector3<double>{0, 0, 1}, view.plane.normal));
    view.tangent_2 = cross(view.plane.normal, view.tangent_1);
    const PlaneEquations equations = plane_equations(shots, view);
    cost = equations.cost;
    const Eigen::VectorXd step =
        equations.hessian(chosen, chosen).eval().ldlt().solve(equations.gradient(chosen).eval());
    for (int i = 0; i < columns.places; ++i) {
      const int place = places[i];
      view.train.set_place(place, view.train[place] + step[i]);
    }
    view.plane.normal =
        normalized(view.plane.normal + step[4] * view.tangent_1 + step[5] * view.tangent_2);
    view.plane.distance += step[6];
  }
  EXPECT_LT(cost, 1e-12);
  for (const int place : places) EXPECT_NEAR(view.train[place], truth.train[place], 1e-9);
  EXPECT_NEAR(view.plane.distance, truth.plane.distance, 1e-8);
}

TEST(PlaneEquations, TheNumberOfThreadsChangesNoBit) {
  const PlaneView view = wall_view("PA-AP", {1, 2, 6, 7, 8, 11, 12}, 13);
  const RangedShots shots = shoot(view, 5 * 8192 + 11, kRangeNoise, 14);
  std::vector<double> residual_one(shots.size()), residual_two(shots.size());
  std::vector<double> variance_one(shots.size()), variance_two(shots.size());
  const auto with_threads = [&](std::size_t threads, const ResidualColumns& columns) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return plane_equations(shots, view, columns);
  };
  const PlaneEquations one = with_threads(1, {residual_one, variance_one});
  const PlaneEquations two = with_threads(2, {residual_two, variance_two});
  EXPECT_EQ(one.hessian, two.hessian);
  EXPECT_EQ(one.gradient, two.gradient);
  EXPECT_EQ(one.cost, two.cost);
  EXPECT_EQ(one.shots, two.shots);
  EXPECT_EQ(residual_one, residual_two);
  EXPECT_EQ(variance_one, variance_two);
  expect_reference(shots, view);  // chunks are put together as if they were one
}

/// Shots with terms of range errors and sizes of the prisms among the columns.
struct WithNumbers {
  PlaneView view = wall_view("PA-AP", {place::incident_beam_vertical()}, 1);
  RangedShots shots;

  WithNumbers() {
    view.geometry = {{0.007, 0.008}, {0.03}};
    view.sizes = own_prism_sizes(2);
    view.range_terms = {0.02, -0.01};
    shots = shoot(view, 500, kRangeNoise, 6);
    std::mt19937_64 generator(7);
    std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
    // Weights that do not depend on the geometry.
    for (auto& column : shots.angle_covariance) std::ranges::fill(column, 0.0F);
    shots.range_terms.resize(2);
    for (std::size_t i = 0; i < shots.size(); ++i) {
      for (auto& term : shots.range_terms) term.push_back(uniform(generator));
    }
  }
};

TEST(PlaneEquations, SizesAndRangeTermsHaveTheirDerivatives) {
  const WithNumbers at;
  for (const InstructionSet set : available_instruction_sets()) {
    const PlaneColumns columns(at.view);
    const PlaneEquations middle = plane_equations(at.shots, at.view, {}, set);
    // The cost is quadratic in these: half its slope is the gradient.
    const auto slope = [&](auto change) {
      constexpr double kStep = 1e-4;
      PlaneView forth = at.view, back = at.view;
      change(forth, kStep);
      change(back, -kStep);
      return (plane_equations(at.shots, forth, {}, set).cost -
              plane_equations(at.shots, back, {}, set).cost) /
             (2.0 * kStep);
    };
    for (int i = 0; i < columns.sizes; ++i) {
      const double found = slope([i](PlaneView& view, double step) {
        if (i < 2) {
          view.geometry.thickness[i] += step;
        } else {
          view.geometry.spacing[0] += step;
        }
      });
      EXPECT_NEAR(middle.gradient[columns.prism_size(i)], -0.5 * found, 1e-5 * std::abs(found))
          << i;
    }
    for (int i = 0; i < columns.terms; ++i) {
      const double found =
          slope([i](PlaneView& view, double step) { view.range_terms[i] += step; });
      EXPECT_NEAR(middle.gradient[columns.range_term(i)], -0.5 * found, 1e-5 * std::abs(found))
          << i;
    }
  }
}

TEST(PlaneEquations, CellsSumUpToAllShots) {
  WithNumbers at;
  const std::vector<std::uint32_t> cells{0, 3, 3, 70, 71, 300, 500};
  for (const InstructionSet set : available_instruction_sets()) {
    const PlaneColumns columns(at.view);
    at.view.cell_begin = {};
    const PlaneEquations all = plane_equations(at.shots, at.view, {}, set);
    EXPECT_EQ(all.cells.size(), 0);
    at.view.cell_begin = cells;
    const PlaneEquations by_cells = plane_equations(at.shots, at.view, {}, set);
    ASSERT_EQ(by_cells.cells.rows(), 18);
    const int rows[] = {columns.distance(), columns.normal(0), columns.normal(1)};
    for (int kind = 0; kind < 3; ++kind) {
      for (int column = 0; column <= columns.size(); ++column) {
        double sum = 0;
        for (int cell = 0; cell < 6; ++cell) sum += by_cells.cells(3 * cell + kind, column);
        const double expected =
            column < columns.size() ? all.hessian(rows[kind], column) : all.gradient[rows[kind]];
        EXPECT_NEAR(sum, expected,
                    1e-9 * std::sqrt(all.hessian(rows[kind], rows[kind])) *
                        std::sqrt(column < columns.size() ? all.hessian(column, column) : all.cost))
            << kind << ' ' << column;
      }
    }
    // A cell alone: the shots of the third one.
    EXPECT_TRUE((by_cells.cells.middleRows<3>(3).array() == 0).all());
  }
  const std::vector<std::uint32_t> wrong{0, 5, 3, 500}, short_by_one{0, 499};
  at.view.cell_begin = wrong;
  EXPECT_THROW(plane_equations(at.shots, at.view), InvalidArgument);
  at.view.cell_begin = short_by_one;
  EXPECT_THROW(plane_equations(at.shots, at.view), InvalidArgument);
}

}  // namespace risley::calibration::plane_equations_test
