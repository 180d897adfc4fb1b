// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/paper_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "calibration/walls.hpp"
#include "optics/trains.hpp"

namespace risley::calibration::paper_adjustment_test {

using Eigen::Index;
using testing::add_errors;
using testing::normal_vector;
using testing::planar_problem;
using testing::wall;

constexpr double kDegree = kRadiansPerDegree;
constexpr double kRangeNoise = 0.02;

/// Best-fit plane by singular values, normal outwards.
struct SvdPlane {
  Eigen::Vector3d normal;
  double distance = 0;
  Eigen::VectorXd residuals;

  explicit SvdPlane(const std::vector<Vector3<double>>& points) {
    Eigen::MatrixXd rows(points.size(), 3);
    for (std::size_t i = 0; i < points.size(); ++i) {
      rows.row(i) = testing::eigen(points[i]);
    }
    const Eigen::Vector3d mean = rows.colwise().mean();
    rows.rowwise() -= mean.transpose();
    normal = Eigen::JacobiSVD<Eigen::MatrixXd>(rows, Eigen::ComputeThinV).matrixV().col(2);
    if (normal.dot(mean) < 0) normal = -normal;
    distance = normal.dot(mean);
    residuals = rows * normal;
  }
};

/// Distances of all points from the planes fitted to them.
Eigen::VectorXd distances(const PlanarProblem& p, const Eigen::VectorXd& parameters) {
  PrismTrain train = p.train;
  for (std::size_t j = 0; j < p.free.size(); ++j) {
    for (const int at : p.free[j].places) {
      train.set_place(at, parameters[j]);
    }
  }
  Eigen::VectorXd all(0);
  for (const WallView& view : p.views) {
    const SvdPlane plane(testing::points_of(train, p.geometry, *view.shots));
    const Index before = all.size();
    all.conservativeResize(before + plane.residuals.size());
    all.tail(plane.residuals.size()) = plane.residuals;
  }
  return all;
}

/// The minimum of the sum of their squares, with numeric derivatives that see the planes move.
struct BruteForce {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd covariance;
  double sigma0 = 0, squares = 0;

  BruteForce(const PlanarProblem& p, const Eigen::VectorXd& start) : parameters(start) {
    const Index free = start.size();
    Eigen::MatrixXd jacobian, normal;
    for (int iteration = 0; iteration < 12; ++iteration) {
      const Eigen::VectorXd now = distances(p, parameters);
      jacobian.resize(now.size(), free);
      for (Index j = 0; j < free; ++j) {
        const Eigen::VectorXd step = 1e-5 * Eigen::VectorXd::Unit(free, j);
        jacobian.col(j) =
            (distances(p, parameters + step) - distances(p, parameters - step)) / 2e-5;
      }
      normal = jacobian.transpose() * jacobian;
      const Eigen::VectorXd step = -normal.ldlt().solve(jacobian.transpose() * now);
      parameters += step;
      if (step.norm() < 1e-13) break;
    }
    squares = distances(p, parameters).squaredNorm();
    sigma0 =
        std::sqrt(squares / static_cast<double>(jacobian.rows() - free - 3 * std::ssize(p.views)));
    covariance = sigma0 * sigma0 * normal.inverse();
  }
};

/// Walls seen once each, parameters a few tenths of a degree off.
PlanarProblem problem_of(const scenes::Scene& scene, const PrismGeometry& geometry,
                         std::size_t shots) {
  PlanarProblem p = planar_problem(testing::imperfect_train("PA-AP", 0.3, 5), geometry, scene,
                                   kRangeNoise, {shots, kRangeNoise, 0, 0, 31});
  add_errors(p.train, p.free, normal_vector(p.free.size(), 0.3 * kDegree, 32));
  return p;
}

scenes::Scene one_wall() { return {{wall("wall", 10, 80, 30)}, {}}; }
scenes::Scene corner() { return {{wall("left", 40, 88, 10), wall("right", -45, 85, 12)}, {}}; }

/// @param sigma_tolerance  of the parameters, in sigmas
void expect_brute_force(const PlanarProblem& p, double sigma_tolerance) {
  const PlanarSolution solution = adjust_as_paper(p);
  ASSERT_TRUE(solution.converged);
  const BruteForce expected(p,
                            solution.parameters + normal_vector(p.free.size(), 0.02 * kDegree, 33));
  for (Index j = 0; j < solution.parameters.size(); ++j) {
    EXPECT_NEAR(solution.parameters[j], expected.parameters[j],
                sigma_tolerance * std::sqrt(expected.covariance(j, j)))
        << j;
    for (Index i = 0; i < solution.parameters.size(); ++i) {
      EXPECT_NEAR(solution.covariance(i, j), expected.covariance(i, j),
                  0.01 * std::sqrt(expected.covariance(i, i) * expected.covariance(j, j)));
    }
  }
  EXPECT_NEAR(solution.cost, expected.squares,
              (1e-9 + sigma_tolerance * sigma_tolerance) * expected.squares);
  const double redundancy =
      std::accumulate(solution.redundancy.begin(), solution.redundancy.end(), 0.0);
  EXPECT_NEAR(std::sqrt(solution.cost / redundancy), expected.sigma0,
              (1e-9 + sigma_tolerance * sigma_tolerance) * expected.sigma0);
  // The data alone, and nothing else.
  const Eigen::MatrixXd inverse = solution.covariance.inverse();
  EXPECT_LT((solution.information - inverse).norm(), 1e-6 * inverse.norm());
}

TEST(PaperAdjustment, FindsTheMinimumOfOneWall) {
  expect_brute_force(problem_of(one_wall(), {}, 400), 1e-5);
}

TEST(PaperAdjustment, FindsTheMinimumOfSeveralWalls) {
  const PlanarProblem p = problem_of(corner(), {}, 800);
  ASSERT_EQ(p.views.size(), 2u);
  expect_brute_force(p, 1e-5);
}

/// Beams that start beside the axis: their derivative is left out.
TEST(PaperAdjustment, FindsItAlmostWithBeamsThatStartBesideTheAxis) {
  expect_brute_force(problem_of(corner(), {{0.007, 0.007}, {0.03}}, 800), 5e-2);
}

TEST(PaperAdjustment, ParametersOfSeveralPlacesMoveTogether) {
  PlanarProblem p = problem_of(corner(), {}, 800);
  p.train.set("refractive_index", 1.508);
  p.free.push_back(estimation::free_parameters({"refractive_index"}, {2}).front());
  expect_brute_force(p, 1e-5);
  const PlanarSolution solution = adjust_as_paper(p);
  EXPECT_EQ(solution.problem.train[place::refractive_index(0)],
            solution.problem.train[place::refractive_index(1)]);
}

TEST(PaperAdjustment, LeavesThePlanesItFitted) {
  const PlanarProblem p = problem_of(corner(), {{0.007, 0.007}, {0.03}}, 800);
  const PlanarSolution solution = adjust_as_paper(p);
  EXPECT_GT(solution.iterations, 1);
  EXPECT_LT(solution.iterations, 15);
  std::size_t shots = 0;
  double redundancy = 0, noise = 0;
  for (std::size_t v = 0; v < 2; ++v) {
    const WallView& view = solution.problem.views[v];
    const SvdPlane plane(testing::points_of(solution.problem.train, p.geometry, *view.shots));
    EXPECT_NEAR(view.distance, plane.distance, 1e-7);
    const Vector3<double>& normal = solution.problem.walls[view.wall].normal;
    EXPECT_LT((testing::eigen(normal) - plane.normal).norm(), 1e-8);
    shots += view.shots->size();
    redundancy += solution.redundancy[v];
    double chi2 = 0;
    for (std::size_t i = 0; i < view.shots->size(); ++i) {
      const Ray ray =
          emergent_ray(solution.problem.train, p.geometry, testing::angles_of(*view.shots, i));
      const double range =
          hit_distance({testing::plain(plane.normal), plane.distance}, ray.origin, ray.direction);
      chi2 += std::pow((view.shots->range[i] - range) / kRangeNoise, 2);
      noise += std::pow(kRangeNoise * dot(normal, ray.direction), 2);  // less along the normal
    }
    EXPECT_NEAR(solution.chi2[v], chi2, 1e-4 * chi2);  // of ranges, not of distances
  }
  EXPECT_EQ(solution.shots, shots);
  EXPECT_NEAR(redundancy, static_cast<double>(shots) - 7 - 3 * 2, 1e-9);
  EXPECT_NEAR(solution.cost, noise, 0.15 * noise);
}

TEST(PaperAdjustment, StopsWhenItIsTold) {
  const PlanarSolution solution = adjust_as_paper(problem_of(corner(), {}, 800), 1);
  EXPECT_FALSE(solution.converged);
  EXPECT_EQ(solution.iterations, 1);
}

TEST(PaperAdjustment, RefusesALineAndNothing) {
  PlanarProblem p = problem_of(one_wall(), {}, 100);
  auto shots = std::make_shared<RangedShots>(*p.views[0].shots);
  for (auto& column : shots->rotation_angle) std::ranges::fill(column, 0.3);
  p.views[0].shots = shots;
  EXPECT_THROW(adjust_as_paper(p), EstimationError);
  p.views.clear();
  EXPECT_THROW(adjust_as_paper(p), EstimationError);
}

}  // namespace risley::calibration::paper_adjustment_test
