// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/planar_adjustment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/optics/observation_model.hpp"

#include "calibration/walls.hpp"
#include "optics/trains.hpp"

namespace risley::calibration::planar_adjustment_test {

using Eigen::Index;
using testing::add_errors;
using testing::normal_vector;
using testing::planar_problem;
using testing::ShotSettings;
using testing::start_from_points;
using testing::station;
using testing::wall;

constexpr double kDegree = kRadiansPerDegree;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRangeNoise = 0.02;
const PrismGeometry kGeometry{{0.007}, {0.03}};

/// The wall of section 3.3 of the paper.
scenes::Scene one_wall() { return {{wall("wall", 10, 80, 30)}, {}}; }

/// A corner seen upright and flipped, from places that differ.
scenes::Scene corner() {
  return {
      {wall("left", 40, 88, 10), wall("right", -45, 85, 12)},
      {station("upright", 0, 0, 0, 0.05), station("flipped", 180, 0, -10, 0.08, {0.5, 0.2, 0.1})}};
}

PrismTrain some_train() { return testing::imperfect_train("PA-AP", 0.3, 5); }

Eigen::Matrix3d turn_by(const Eigen::Vector3d& by) {
  return Eigen::AngleAxisd(by.norm(), by.normalized()).toRotationMatrix();
}

/// Everything that a solution says of the problem, in one vector: parameters, range offset and
/// distances.
Eigen::VectorXd flat(const PlanarSolution& solution) {
  const PlanarProblem& p = solution.problem;
  Eigen::VectorXd values(solution.parameters.size() + 1 + std::ssize(p.views));
  values.head(solution.parameters.size()) = solution.parameters;
  Index next = solution.parameters.size();
  values[next++] = p.range_offset;
  for (const WallView& view : p.views) values[next++] = view.distance;
  return values;
}

// ---------------------------------------------------------------- the referee: Ceres

constexpr int kFree = 8;
using Positions = std::array<double, 4>;

template <class T>
Vector3<T> lifted(const Vector3<double>& v) {
  return {T(v.x), T(v.y), T(v.z)};
}

/// Range to a plane, in any scalar.
template <class T>
T predicted(const std::array<T, parameter_count(2)>& parameters,
            const std::vector<FaceOrder>& face_order, const Positions& positions,
            const std::array<T, 2>& angles, const Vector3<T>& normal, const T& distance) {
  const auto prepared = prepare<T, 2>(parameters, {face_order[0], face_order[1]});
  const auto beam = trace_forward(prepared, angles);
  std::array<T, 4> faces;
  for (std::size_t i = 0; i < 4; ++i) faces[i] = T(positions[i]);
  return (distance - dot(normal, beam_origin(beam, faces))) / dot(normal, beam.direction());
}

/// One shot: parameters, range offset, azimuth and zenith of the normal in the scene, rotation
/// vector of the station about what was stated of it, distance.
struct RangeResidual {
  const PlanarProblem* problem;
  const WallView* view;
  std::size_t shot;
  Positions positions;
  double sigma;

  template <class T>
  bool operator()(const T* free, const T* offset, const T* angles, const T* turn, const T* distance,
                  T* residual) const {
    std::array<T, parameter_count(2)> parameters;
    for (int i = 0; i < parameter_count(2); ++i) {
      parameters[i] = T(problem->train[i]);
    }
    for (std::size_t j = 0; j < problem->free.size(); ++j) {
      for (const int at : problem->free[j].places) {
        parameters[at] = free[j];
      }
    }
    const Vector3<T> scene_normal = direction_from_angles(SphericalAngles<T>{angles[0], angles[1]});
    const T back[] = {-turn[0], -turn[1], -turn[2]};
    const T before[] = {scene_normal.x, scene_normal.y, scene_normal.z};
    T turned[3];
    ceres::AngleAxisRotatePoint(back, before, turned);
    const Eigen::Matrix3d& stated = problem->stations[view->recording].stated;
    T normal[3];
    for (int i = 0; i < 3; ++i) {
      normal[i] = stated(0, i) * turned[0] + stated(1, i) * turned[1] + stated(2, i) * turned[2];
    }
    const T expected = predicted<T>(
        parameters, problem->train.face_order(), positions,
        {T(view->shots->rotation_angle[0][shot]), T(view->shots->rotation_angle[1][shot])},
        {normal[0], normal[1], normal[2]}, distance[0]);
    residual[0] = (view->shots->range[shot] - offset[0] - expected) / sigma;
    return true;
  }
};

/// A number off a given one, over a sigma.
struct Tie {
  std::vector<double> stated, sigma;
  template <class T>
  bool operator()(const T* values, T* residual) const {
    for (std::size_t i = 0; i < stated.size(); ++i)
      residual[i] = (values[i] - stated[i]) / sigma[i];
    return true;
  }
};

/// Sine of the angle between a normal and the stated one.
struct NormalTie {
  Vector3<double> stated;
  double sigma;
  template <class T>
  bool operator()(const T* angles, T* residual) const {
    const Vector3<T> normal = direction_from_angles(SphericalAngles<T>{angles[0], angles[1]});
    const Vector3<T> off = cross(normal, lifted<T>(stated));
    residual[0] = off.x / sigma;
    residual[1] = off.y / sigma;
    residual[2] = off.z / sigma;
    return true;
  }
};

/// Minimum of the same sum of squares. The variances of the shots are those at a given solution.
class Referee {
 public:
  explicit Referee(const PlanarProblem& solved) : p_(solved) {
    const auto positions = face_positions(p_.train.face_order(), p_.geometry);
    std::ranges::copy(positions, positions_.begin());
    for (std::size_t j = 0; j < p_.free.size(); ++j) {
      free_[j] = p_.train[p_.free[j].places.front()];
    }
    offset_ = p_.range_offset;
    for (const Wall& wall : p_.walls) {
      const auto angles = angles_from_direction(wall.normal);
      normals_.push_back({angles.azimuth, angles.zenith});
    }
    turns_.resize(p_.stations.size());
    for (std::size_t s = 0; s < turns_.size(); ++s) {
      const Eigen::AngleAxisd turn(p_.stations[s].scene_from_sensor *
                                   p_.stations[s].stated.transpose());
      Eigen::Map<Eigen::Vector3d>(turns_[s].data()) = turn.angle() * turn.axis();
    }
    for (const WallView& view : p_.views) distances_.push_back(view.distance);
    build();
  }

  /// Starts off the given solution.
  void minimise() {
    for (std::size_t j = 0; j < free_.size(); ++j) free_[j] += j == 7 ? 2e-4 : 1e-3;
    for (double& distance : distances_) distance += 0.01;
    for (auto& normal : normals_) normal[0] += 1e-3;
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 200;
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-18;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    cost = 2.0 * summary.final_cost;
  }

  /// Covariance of parameters, range offset and distances, and of azimuth and zenith of normals.
  void invert() {
    std::vector<const double*> blocks{free_.data(), &offset_};
    for (double& distance : distances_) blocks.push_back(&distance);
    for (auto& normal : normals_) blocks.push_back(normal.data());
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::DENSE_SVD;
    ceres::Covariance inverse(options);
    ASSERT_TRUE(inverse.Compute(blocks, &problem_));
    Eigen::Matrix<double, kFree, kFree, Eigen::RowMajor> free;
    ASSERT_TRUE(inverse.GetCovarianceBlock(free_.data(), free_.data(), free.data()));
    covariance = free;
    double variance = 0;
    ASSERT_TRUE(inverse.GetCovarianceBlock(&offset_, &offset_, &variance));
    offset_sigma = std::sqrt(variance);
    for (double& distance : distances_) {
      ASSERT_TRUE(inverse.GetCovarianceBlock(&distance, &distance, &variance));
      distance_sigma.push_back(std::sqrt(variance));
    }
    for (auto& normal : normals_) {
      Eigen::Matrix2d both;
      ASSERT_TRUE(inverse.GetCovarianceBlock(normal.data(), normal.data(), both.data()));
      const double sine = std::sin(normal[1]);
      normal_sigma.push_back(std::sqrt(sine * sine * both(0, 0) + both(1, 1)));
    }
  }

  double parameter(Index j) const { return free_[j]; }
  double range_offset() const { return offset_; }
  double distance(std::size_t view) const { return distances_[view]; }
  Vector3<double> normal(std::size_t wall) const {
    return direction_from_angles(SphericalAngles<double>{normals_[wall][0], normals_[wall][1]});
  }
  Eigen::Matrix3d rotation(std::size_t s) const {
    return turn_by(Eigen::Map<const Eigen::Vector3d>(turns_[s].data())) * p_.stations[s].stated;
  }

  double cost = 0;
  Eigen::MatrixXd covariance;
  double offset_sigma = 0;
  std::vector<double> distance_sigma, normal_sigma;

 private:
  /// 1 sigma of a range at the solution, by automatic differentiation.
  double sigma_of(const WallView& view, std::size_t shot) const {
    using Jet = ceres::Jet<double, 2>;
    std::array<Jet, parameter_count(2)> parameters;
    for (int i = 0; i < parameter_count(2); ++i) {
      parameters[i] = Jet(p_.train[i]);
    }
    const Eigen::Vector3d normal = p_.stations[view.recording].scene_from_sensor.transpose() *
                                   testing::eigen(p_.walls[view.wall].normal);
    const Jet range = predicted<Jet>(
        parameters, p_.train.face_order(), positions_,
        {Jet(view.shots->rotation_angle[0][shot], 0), Jet(view.shots->rotation_angle[1][shot], 1)},
        lifted<Jet>(testing::plain(normal)), Jet(view.distance));
    double variance = view.range_variance;
    const auto& c = view.shots->angle_covariance;
    variance += range.v[0] * range.v[0] * static_cast<double>(c[0][shot]) +
                2.0 * range.v[0] * range.v[1] * static_cast<double>(c[1][shot]) +
                range.v[1] * range.v[1] * static_cast<double>(c[2][shot]);
    return std::sqrt(variance);
  }

  void build() {
    for (const WallView& view : p_.views) {
      double* distance = &distances_[&view - p_.views.data()];
      for (std::size_t i = 0; i < view.shots->size(); ++i) {
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<RangeResidual, 1, kFree, 1, 2, 3, 1>(
                new RangeResidual{&p_, &view, i, positions_, sigma_of(view, i)}),
            nullptr, free_.data(), &offset_, normals_[view.wall].data(),
            turns_[view.recording].data(), distance);
      }
    }
    Tie parameters;
    for (std::size_t j = 0; j < kFree; ++j) {
      parameters.stated.push_back(p_.prior[p_.free[j].places.front()]);
      parameters.sigma.push_back(p_.prior_sigma[j]);
    }
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Tie, kFree, kFree>(new Tie(parameters)), nullptr,
        free_.data());
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Tie, 1, 1>(new Tie{{0.0}, {p_.range_offset_sigma}}),
        nullptr, &offset_);
    for (std::size_t w = 0; w < p_.walls.size(); ++w) {
      if (!(p_.walls[w].normal_sigma > 0)) continue;
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<NormalTie, 3, 2>(
                                    new NormalTie{p_.walls[w].stated, p_.walls[w].normal_sigma}),
                                nullptr, normals_[w].data());
    }
    for (std::size_t s = 0; s < turns_.size(); ++s) {
      const double sigma = p_.stations[s].sigma;
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<Tie, 3, 3>(new Tie{{0, 0, 0}, {sigma, sigma, sigma}}),
          nullptr, turns_[s].data());
    }
  }

  PlanarProblem p_;
  Positions positions_{};
  std::array<double, kFree> free_{};
  double offset_ = 0;
  std::vector<std::array<double, 2>> normals_;
  std::vector<std::array<double, 3>> turns_;
  std::vector<double> distances_;
  ceres::Problem problem_;
};

/// A corner from two stations with everything that can be known before, none of it exactly right.
PlanarProblem everything(const PrismGeometry& geometry) {
  scenes::Scene scene = corner();
  scene.planes[0].normal_sigma = 0.1 * kDegree;
  PlanarProblem p = planar_problem(some_train(), geometry, scene, kRangeNoise,
                                   {600, kRangeNoise, 0.05 * kDegree, 0.02, 3});
  std::vector<std::string> names = testing::kTiltNames;
  names.push_back("refractive_index");  // of both prisms: two places
  p.train.set("refractive_index", 1.509);
  p.free = estimation::free_parameters(names, {2});
  p.prior = p.train;
  p.prior_sigma = {0.3 * kDegree, 0.3 * kDegree, 0.2 * kDegree, 0.3 * kDegree,
                   0.3 * kDegree, 1.0 * kDegree, kInfinity,     1e-3};
  Eigen::VectorXd errors = normal_vector(kFree, 0.2 * kDegree, 4);
  errors[7] = 5e-4;
  add_errors(p.prior, p.free, errors);
  p.range_offset_sigma = 0.03;
  p.walls[0].stated = normalized(p.walls[0].stated + Vector3<double>{0.001, 0.0, 0.002});
  p.stations[0].stated = turn_by({3e-4, -6e-4, 5e-4}) * p.stations[0].stated;
  p.stations[1].stated = turn_by({-9e-4, 4e-4, 1e-3}) * p.stations[1].stated;
  // Starts that differ from what is stated.
  p.range_offset = 0.1;
  p.train = p.prior;
  return p;
}

double in_sigmas(double a, double b, double sigma) { return std::abs(a - b) / sigma; }

void expect_ceres(const PrismGeometry& geometry, double cost_tolerance, double sigma_tolerance,
                  double covariance_tolerance) {
  const PlanarSolution solution = adjust(everything(geometry));
  ASSERT_TRUE(solution.converged);
  EXPECT_EQ(solution.lost, 0u);
  Referee referee(solution.problem);
  referee.minimise();
  EXPECT_NEAR(solution.cost, referee.cost, cost_tolerance * referee.cost);
  for (Index j = 0; j < kFree; ++j) {
    EXPECT_LT(in_sigmas(solution.parameters[j], referee.parameter(j),
                        std::sqrt(solution.covariance(j, j))),
              sigma_tolerance)
        << j;
  }
  EXPECT_LT(in_sigmas(solution.problem.range_offset, referee.range_offset(),
                      solution.number_sigma("range_offset_m")),
            sigma_tolerance);
  for (std::size_t v = 0; v < solution.problem.views.size(); ++v) {
    EXPECT_LT(in_sigmas(solution.problem.views[v].distance, referee.distance(v),
                        solution.distance_sigma[v]),
              sigma_tolerance);
  }
  for (std::size_t w = 0; w < 2; ++w) {
    EXPECT_LT(angle_between(solution.problem.walls[w].normal, referee.normal(w)),
              sigma_tolerance * solution.normal_sigma[w]);
  }
  for (std::size_t s = 0; s < 2; ++s) {
    EXPECT_LT(Eigen::AngleAxisd(solution.problem.stations[s].scene_from_sensor.transpose() *
                                referee.rotation(s))
                  .angle(),
              sigma_tolerance * 0.05 * kDegree);
  }
  referee.invert();
  for (Index i = 0; i < kFree; ++i) {
    for (Index j = 0; j < kFree; ++j) {
      const double size = std::sqrt(referee.covariance(i, i) * referee.covariance(j, j));
      EXPECT_NEAR(solution.covariance(i, j), referee.covariance(i, j), covariance_tolerance * size);
    }
  }
  EXPECT_NEAR(solution.number_sigma("range_offset_m") / referee.offset_sigma, 1.0,
              covariance_tolerance);
  for (std::size_t v = 0; v < solution.problem.views.size(); ++v) {
    EXPECT_NEAR(solution.distance_sigma[v] / referee.distance_sigma[v], 1.0, covariance_tolerance);
  }
  for (std::size_t w = 0; w < 2; ++w) {
    EXPECT_NEAR(solution.normal_sigma[w] / referee.normal_sigma[w], 1.0, covariance_tolerance);
  }
}

TEST(PlanarAdjustment, FindsTheMinimumThatCeresFinds) { expect_ceres({}, 1e-9, 1e-4, 1e-3); }

/// The derivative of the beam's origin is left out, so near by the answer is off by some hundredths
/// of a sigma, and the variances of shots by a hundred-thousandth.
TEST(PlanarAdjustment, FindsItAlmostWithBeamsThatStartBesideTheAxis) {
  expect_ceres(kGeometry, 2e-5, 5e-2, 1e-2);
}

// ---------------------------------------------------------------- convergence

TEST(PlanarAdjustment, FindsEveryParameterOfExactRanges) {
  for (const scenes::Scene& scene : {one_wall(), corner()}) {
    const PrismTrain truth = some_train();
    PlanarProblem p = planar_problem(truth, kGeometry, scene, 1e-5, {2000});
    add_errors(p.train, p.free, normal_vector(p.free.size(), 0.4 * kDegree, 8));
    start_from_points(p);
    const PlanarSolution solution = adjust(p);
    EXPECT_TRUE(solution.converged);
    for (const estimation::FreeParameter& free : p.free) {
      const int at = free.places.front();
      EXPECT_NEAR(solution.problem.train[at], truth[at], 1e-11 * kDegree) << free.name;
    }
  }
}

TEST(PlanarAdjustment, ConvergesFromZeroForAnySensor) {
  int converged = 0, most_iterations = 0;
  double chi2 = 0;
  constexpr int kSeeds = 100;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    PrismTrain truth(parse_face_order("PA-AP"));
    PlanarProblem p;
    p.free = estimation::free_parameters(testing::kTiltNames, {2});
    add_errors(truth, p.free, normal_vector(p.free.size(), 1.0 * kDegree, seed));
    p = planar_problem(truth, kGeometry, one_wall(), kRangeNoise, {5000, kRangeNoise, 0, 0, seed});
    p.train = truth.without_errors();
    start_from_points(p);
    const PlanarSolution solution = adjust(p);
    converged += solution.converged;
    most_iterations = std::max(most_iterations, solution.iterations);
    Eigen::VectorXd error = solution.parameters;
    for (Index j = 0; j < error.size(); ++j) {
      error[j] -= truth[p.free[j].places.front()];
    }
    chi2 += error.dot(solution.covariance.ldlt().solve(error)) / kSeeds;
  }
  EXPECT_EQ(converged, kSeeds);
  EXPECT_LE(most_iterations, 9);
  // And the errors are those of the covariance: chi2 of 7 degrees of freedom, three sigmas wide.
  EXPECT_NEAR(chi2, 7.0, 3.0 * std::sqrt(14.0 / kSeeds));
}

/// From a normal so far off, steps that lose the plane would leave nothing to fit.
TEST(PlanarAdjustment, ShotsThatLoseThePlaneMakeNoStepGood) {
  PlanarProblem p = planar_problem(some_train(), kGeometry, {{wall("steep", 60, 90, 15)}, {}},
                                   kRangeNoise, {500, kRangeNoise, 0, 0, 1});
  p.walls[0].normal =
      testing::plain(turn_by({0, 0, -20 * kDegree}) * testing::eigen(p.walls[0].normal));
  const PlanarSolution solution = adjust(p);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(solution.lost, 0u);
  EXPECT_EQ(solution.shots, 500u);
  EXPECT_LT(solution.cost, 600.0);
}

/// What was stated stays stated, also when the start is the solution.
TEST(PlanarAdjustment, ItsOwnResultIsWhereItStays) {
  const PlanarSolution first = adjust(everything({}));
  const PlanarSolution second = adjust(first.problem);
  EXPECT_TRUE(second.converged);
  EXPECT_LE(second.iterations, 1);
  EXPECT_NEAR(second.cost, first.cost, 1e-9 * first.cost);
  for (Index j = 0; j < kFree; ++j) {
    EXPECT_NEAR(second.parameters[j], first.parameters[j],
                1e-5 * std::sqrt(first.covariance(j, j)));
  }
  EXPECT_NEAR(second.problem.range_offset, first.problem.range_offset,
              1e-5 * first.number_sigma("range_offset_m"));
  ASSERT_EQ(second.prior_tests.size(), first.prior_tests.size());
  for (std::size_t i = 0; i < first.prior_tests.size(); ++i) {
    EXPECT_NEAR(second.prior_tests[i].misfit, first.prior_tests[i].misfit, 1e-9);
    EXPECT_NEAR(second.prior_tests[i].chi2, first.prior_tests[i].chi2, 1e-5);
  }
}

TEST(PlanarAdjustment, EveryInstructionSetGivesTheSame) {
  const PlanarSolution best = adjust(everything(kGeometry));
  for (const InstructionSet set : available_instruction_sets()) {
    AdjustmentOptions options;
    options.set = set;
    const PlanarSolution other = adjust(everything(kGeometry), options);
    EXPECT_NEAR(other.cost, best.cost, 1e-9 * best.cost);
    EXPECT_LT((other.parameters - best.parameters).norm(), 1e-9);
  }
}

// ---------------------------------------------------------------- what comes with the solution

TEST(PlanarAdjustment, CountsWhatItUsed) {
  const PlanarProblem p =
      planar_problem(some_train(), kGeometry, corner(), kRangeNoise, {1000, kRangeNoise, 0, 0, 12});
  const PlanarSolution solution = adjust(p);
  std::size_t shots = 0;
  for (const WallView& view : p.views) shots += view.shots->size();
  EXPECT_EQ(solution.shots, shots);
  ASSERT_EQ(solution.redundancy.size(), p.views.size());
  ASSERT_EQ(solution.chi2.size(), p.views.size());
  double chi2 = 0, redundancy = 0;
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    chi2 += solution.chi2[v];
    redundancy += solution.redundancy[v];
    EXPECT_NEAR(solution.chi2[v] / solution.redundancy[v], 1.0, 0.25);
  }
  double ties = 0;
  for (const PriorTest& test : solution.prior_tests) {
    ties += std::pow(test.misfit / (test.name == "upright" ? 0.05 : 0.08) / kDegree, 2);
  }
  EXPECT_NEAR(solution.cost, chi2 + ties, 1e-6 * chi2);
  // Seven parameters, two normals and four distances. What is known of the stations pays for a part
  // of the rotation of one against the other; the rotation of all is free.
  EXPECT_GT(redundancy, static_cast<double>(shots) - 7 - 4 - 4 - 3);
  EXPECT_LT(redundancy, static_cast<double>(shots) - 7 - 4 - 4 + 1);
}

TEST(PlanarAdjustment, EveryUnknownTakesAShot) {
  scenes::Scene scene = corner();
  scene.stations.clear();
  PlanarProblem p =
      planar_problem(some_train(), kGeometry, scene, kRangeNoise, {1000, kRangeNoise, 0, 0, 12});
  ASSERT_EQ(p.views.size(), 2u);
  const PlanarSolution solution = adjust(p);
  EXPECT_NEAR(solution.redundancy[0] + solution.redundancy[1],
              static_cast<double>(solution.shots) - 7 - 4 - 2, 1e-6);
}

/// An emitter whose shots met no wall stays unknown and does not harm the others.
TEST(PlanarAdjustment, AParameterThatNoShotTellsLeavesTheOthersAlone) {
  const scenes::Scene scene = corner();
  PlanarProblem one =
      planar_problem(some_train(), kGeometry, scene, kRangeNoise, {1000, kRangeNoise, 0, 0, 14});
  PlanarProblem two = one;
  two.train = PrismTrain(one.train.face_order(), 2);
  for (int place = 0; place < static_cast<int>(one.train.parameters().size()); ++place) {
    two.train.set_place(place, one.train[place]);
  }
  two.prior = two.train;
  two.free.push_back(
      estimation::free_parameters({"incident_beam_2_vertical_deg"}, two.train.shape()).front());
  const PlanarSolution all = adjust(one), mute = adjust(two);
  const Index n = all.parameters.size();
  ASSERT_EQ(mute.parameters.size(), n + 1);
  for (Index j = 0; j < n; ++j) {
    const double sigma = std::sqrt(all.covariance(j, j));
    EXPECT_NEAR(mute.parameters[j], all.parameters[j], 1e-6 * sigma);
    EXPECT_NEAR(std::sqrt(mute.covariance(j, j)), sigma, 1e-6 * sigma);
  }
  EXPECT_GT(mute.covariance(n, n), 1e6);
  EXPECT_EQ(mute.information.row(n).norm(), 0.0);
  for (std::size_t v = 0; v < all.redundancy.size(); ++v) {
    EXPECT_NEAR(mute.redundancy[v], all.redundancy[v], 1e-6);
  }
}

/// Walls and stations that are known count, what is known of the parameters themselves does not.
TEST(PlanarAdjustment, InformationLeavesOutThePriorsOfParameters) {
  scenes::Scene upright = corner();
  upright.stations.clear();
  PlanarProblem without =
      planar_problem(some_train(), kGeometry, upright, kRangeNoise, {1000, kRangeNoise, 0, 0, 13});
  PlanarProblem with = without;
  with.prior_sigma.assign(with.free.size(), 0.01 * kDegree);
  with.prior_sigma[2] = kInfinity;
  for (const PlanarProblem& p : {without, with, everything(kGeometry)}) {
    const PlanarSolution solution = adjust(p);
    Eigen::MatrixXd expected = solution.covariance.inverse();
    for (std::size_t j = 0; j < p.prior_sigma.size(); ++j) {
      expected(static_cast<Index>(j), static_cast<Index>(j)) -=
          1.0 / (p.prior_sigma[j] * p.prior_sigma[j]);
    }
    EXPECT_LT((solution.information - expected).norm(), 1e-6 * expected.norm());
  }
}

/// A plane across the beam determines the shape of the bundle of beams, not where it points.
TEST(PlanarAdjustment, APlaneAcrossTheBeamLeavesDirectionsUnknown) {
  PlanarProblem p = planar_problem(some_train(), kGeometry, {{wall("across", 0, 90, 30)}, {}},
                                   kRangeNoise, {5000, kRangeNoise, 0, 0, 14});
  p.prior_sigma.assign(p.free.size(), 1.0 * kDegree);
  const PlanarSolution solution = adjust(p);
  EXPECT_TRUE(solution.converged);
  EXPECT_TRUE(solution.covariance.allFinite());
  EXPECT_TRUE(solution.parameters.allFinite());
  for (Index j = 0; j < solution.covariance.rows(); ++j) {
    EXPECT_GT(solution.covariance(j, j), 0.0);
    EXPECT_LT(solution.covariance(j, j), 1.001 * kDegree * kDegree);
  }
  const auto weak = estimation::weak_directions(solution.information, p.free, 0.5);
  ASSERT_GE(weak.size(), 1u);
  std::string names;
  for (const auto& direction : weak) names += estimation::direction_text(direction) + "\n";
  EXPECT_THAT(names, ::testing::HasSubstr("incident_beam_horizontal_deg"));
  EXPECT_THAT(names, ::testing::HasSubstr("incident_beam_vertical_deg"));
  // A tilted one has none of them.
  const PlanarSolution tilted = adjust(planar_problem(some_train(), kGeometry, one_wall(),
                                                      kRangeNoise, {5000, kRangeNoise, 0, 0, 14}));
  EXPECT_TRUE(estimation::weak_directions(tilted.information, p.free, 0.5).empty());
}

// ---------------------------------------------------------------- common errors

/// Two stations with a prior, exact ranges: what moves the solution is what we change. All beams
/// start at the origin, so that the derivatives are exact.
PlanarProblem exact_corner() {
  PlanarProblem p = planar_problem(some_train(), {}, corner(), 1e-4, {1000});
  p.prior_sigma.assign(p.free.size(), 0.05 * kDegree);
  p.range_offset_sigma = 1e-3;
  return p;
}

/// Adds to the rotation angles of one recording.
void shift_angles(PlanarProblem& p, std::size_t recording, const Eigen::VectorXd& by) {
  for (WallView& view : p.views) {
    if (view.recording != recording) continue;
    auto shots = std::make_shared<RangedShots>(*view.shots);
    for (std::size_t k = 0; k < shots->rotation_angle.size(); ++k) {
      for (double& angle : shots->rotation_angle[k]) angle += by[k];
    }
    view.shots = std::move(shots);
  }
}

/// How the solution follows a change of the problem, by central differences.
Eigen::VectorXd response(const PlanarProblem& p,
                         const std::function<void(PlanarProblem&, double)>& change) {
  constexpr double kStep = 2e-6;
  PlanarProblem up = p, down = p;
  change(up, kStep);
  change(down, -kStep);
  return (flat(adjust(up)) - flat(adjust(down))) / (2.0 * kStep);
}

/// What common errors add to the variances, against responses times their covariance.
void expect_added(const PlanarProblem& with, const Eigen::MatrixXd& responses,
                  const Eigen::MatrixXd& covariance) {
  PlanarProblem without = with;
  without.considered.clear();
  without.angle_sensitivity.clear();
  without.mean_angle_covariance.clear();
  const PlanarSolution a = adjust(without), b = adjust(with);
  EXPECT_EQ(a.parameters, b.parameters);
  EXPECT_EQ(a.covariance, a.noise_covariance);
  EXPECT_EQ(a.covariance, b.noise_covariance);
  const Eigen::MatrixXd expected = responses * covariance * responses.transpose();
  const Index n = a.parameters.size();
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const double size = std::sqrt(expected(i, i) * expected(j, j));
      EXPECT_NEAR(b.covariance(i, j) - a.covariance(i, j), expected(i, j), 0.01 * size)
          << i << ' ' << j;
    }
  }
  const auto added = [](double sigma_b, double sigma_a) {
    return sigma_b * sigma_b - sigma_a * sigma_a;
  };
  EXPECT_NEAR(added(b.number_sigma("range_offset_m"), a.number_sigma("range_offset_m")),
              expected(n, n), 0.01 * expected(n, n));
  for (std::size_t v = 0; v < with.views.size(); ++v) {
    const double variance = expected(n + 1 + static_cast<Index>(v), n + 1 + static_cast<Index>(v));
    EXPECT_NEAR(added(b.distance_sigma[v], a.distance_sigma[v]), variance, 0.01 * variance);
  }
}

TEST(CommonErrors, OfAllAnglesOfARecordingReachTheResult) {
  PlanarProblem p = exact_corner();
  Eigen::Matrix2d first, second;
  first << 4e-8, -1e-8, -1e-8, 9e-8;
  second << 1e-8, 5e-9, 5e-9, 3e-8;
  p.mean_angle_covariance = {first, second};
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(4, 4);
  covariance.topLeftCorner(2, 2) = first;
  covariance.bottomRightCorner(2, 2) = second;
  Eigen::MatrixXd responses(p.free.size() + 1 + p.views.size(), 4);
  for (Index i = 0; i < 4; ++i) {
    responses.col(i) = response(p, [i](PlanarProblem& changed, double step) {
      shift_angles(changed, i / 2, step * Eigen::Vector2d::Unit(i % 2));
    });
  }
  expect_added(p, responses, covariance);
}

/// The rotation angles follow the parameters that they were computed with. Those that both share,
/// such as the index, act directly too, as long as the adjustment does not find them itself.
TEST(CommonErrors, OfBelievedParametersReachTheResult) {
  const std::vector<std::string> names{"refractive_index", "incident_beam_vertical_deg",
                                       "prism_tilt_a_horizontal_deg", "wedge_angle_b_deg"};
  for (const bool index_free : {false, true}) {
    SCOPED_TRACE(index_free);
    PlanarProblem p = exact_corner();
    p.considered = estimation::free_parameters(names, {2});
    p.considered_covariance = Eigen::MatrixXd::Constant(4, 4, 3e-9);
    p.considered_covariance += Eigen::Vector4d{1e-8, 4e-8, 3e-8, 2e-8}.asDiagonal();
    Eigen::MatrixXd upright(2, 4), flipped(2, 4);
    upright << 0.3, -0.7, 0.8, 0.1, 0.9, 0.4, 0.1, -0.2;
    flipped << 0.5, -0.6, 0.7, 0.4, 0.7, 0.2, 0.2, 0.3;
    p.angle_sensitivity = {upright, flipped};
    if (index_free) {
      p.free.push_back(estimation::free_parameters({"refractive_index"}, {2}).front());
      p.prior_sigma.push_back(1e-4);
    }
    Eigen::MatrixXd responses(p.free.size() + 1 + p.views.size(), 4);
    for (Index i = 0; i < 4; ++i) {
      responses.col(i) = response(p, [&, i](PlanarProblem& changed, double step) {
        if ((i == 0 && !index_free) || i == 3) {
          for (const int at : p.considered[i].places) {
            changed.train.set_place(at, changed.train[at] + step);
          }
        }
        shift_angles(changed, 0, step * upright.col(i));
        shift_angles(changed, 1, step * flipped.col(i));
      });
    }
    expect_added(p, responses, p.considered_covariance);
  }
}

/// What was held moves parameters and offset as an adjustment that holds something else does.
TEST(HeldResponse, IsHowTheSolutionFollowsWhatIsHeld) {
  const PlanarProblem p = exact_corner();
  const int tilt = place::prism_tilt_horizontal(0), wedge = place::wedge_angle(1);
  HeldQuantities held;
  held.train = Eigen::MatrixXd::Zero(p.train.parameters().size(), 3);
  held.train(tilt, 0) = 1.0;
  held.train(wedge, 1) = 0.5;
  held.train(tilt, 1) = -2.0;
  Eigen::MatrixXd upright = Eigen::MatrixXd::Zero(2, 3), flipped = upright;
  upright << 0, 0.3, 0.9, 0, -0.2, 0.1;
  flipped << 0, 0.2, 0.7, 0, 0.4, 0.2;
  held.rotation_angles = {upright, flipped};
  const PlanarSolution solution = adjust(p);
  const SolutionResponse found = held_response(solution.problem, held);
  const Index n = solution.parameters.size();
  ASSERT_EQ(found.parameters.rows(), n);
  ASSERT_EQ(found.numbers.rows(), 1);
  ASSERT_EQ(found.numbers.cols(), 3);
  for (Index i = 0; i < 3; ++i) {
    const Eigen::VectorXd expected = response(p, [&, i](PlanarProblem& changed, double step) {
      for (Index at = 0; at < held.train.rows(); ++at) {
        const auto place = static_cast<int>(at);
        changed.train.set_place(place, changed.train[place] + step * held.train(at, i));
      }
      shift_angles(changed, 0, step * upright.col(i));
      shift_angles(changed, 1, step * flipped.col(i));
    });
    EXPECT_LT((found.parameters.col(i) - expected.head(n)).norm(), 0.01 * expected.head(n).norm());
    EXPECT_NEAR(found.numbers(0, i), expected[n], 0.01 * std::abs(expected[n]) + 1e-6);
  }
  EXPECT_EQ(held_response(solution.problem, {Eigen::MatrixXd(held.train.rows(), 0),
                                             {Eigen::MatrixXd(2, 0), Eigen::MatrixXd(2, 0)}})
                .parameters.cols(),
            0);
  held.rotation_angles.pop_back();
  EXPECT_THROW((void)held_response(solution.problem, held), InvalidArgument);
}

/// Both kinds together, and materials without any effect on the angles.
TEST(CommonErrors, AddUp) {
  PlanarProblem p = exact_corner();
  p.considered = estimation::free_parameters({"refractive_index_a"}, {2});
  p.considered_covariance = Eigen::MatrixXd::Constant(1, 1, 1e-8);
  const Eigen::Index size = static_cast<Index>(p.free.size() + 1 + p.views.size());
  Eigen::MatrixXd responses(size, 1);
  responses.col(0) = response(p, [](PlanarProblem& changed, double step) {
    const int at = place::refractive_index(0);
    changed.train.set_place(at, changed.train[at] + step);
  });
  expect_added(p, responses, p.considered_covariance);

  PlanarProblem angles = exact_corner(), both = p;
  angles.mean_angle_covariance =
      both.mean_angle_covariance = {Eigen::Matrix2d(1e-8 * Eigen::Matrix2d::Identity()),
                                    Eigen::Matrix2d(2e-8 * Eigen::Matrix2d::Identity())};
  const Eigen::MatrixXd none = adjust(exact_corner()).covariance;
  const Eigen::MatrixXd sum = adjust(p).covariance - none + adjust(angles).covariance - none;
  const Eigen::MatrixXd together = adjust(both).covariance - none;
  EXPECT_LT((together - sum).norm(), 1e-6 * sum.norm());
}

// ---------------------------------------------------------------- prior knowledge

PriorTest test_of(const PlanarSolution& solution, const std::string& name) {
  const auto found = std::ranges::find_if(solution.prior_tests,
                                          [&](const PriorTest& test) { return test.name == name; });
  EXPECT_NE(found, solution.prior_tests.end()) << name;
  return *found;
}

TEST(PriorTests, NameAStationThatStoodOtherwise) {
  PlanarProblem p =
      planar_problem(some_train(), kGeometry, corner(), kRangeNoise, {5000, kRangeNoise, 0, 0, 21});
  const PlanarSolution sound = adjust(p);
  ASSERT_EQ(sound.prior_tests.size(), 2u);
  for (const PriorTest& test : sound.prior_tests) {
    EXPECT_TRUE(test.station);
    EXPECT_EQ(test.degrees_of_freedom, 3);
    EXPECT_LT(test.chi2, test.critical);
  }
  p.stations[1].stated = turn_by({0, 0, 1.0 * kDegree}) * p.stations[1].stated;
  p.stations[0].sigma = 0.001 * kDegree;  // the other one is sure
  const PlanarSolution wrong = adjust(p);
  const PriorTest flipped = test_of(wrong, "flipped");
  EXPECT_GT(flipped.chi2, 3.0 * flipped.critical);
  EXPECT_GT(flipped.misfit, 0.3 * kDegree);  // the beam's tilt takes some of it
  const PriorTest upright = test_of(wrong, "upright");
  EXPECT_LT(upright.misfit, 0.01 * kDegree);
}

TEST(PriorTests, NameAWallThatStandsOtherwise) {
  scenes::Scene scene{{wall("left", 40, 88, 10, 0.0), wall("right", -45, 85, 12, 0.05)}, {}};
  PlanarProblem p = planar_problem(some_train(), kGeometry, scene, 0.005, {5000, 0.005, 0, 0, 22});
  const PlanarSolution sound = adjust(p);
  ASSERT_EQ(sound.prior_tests.size(), 1u);  // what is held is not tested
  EXPECT_EQ(sound.prior_tests[0].name, "right");
  EXPECT_FALSE(sound.prior_tests[0].station);
  EXPECT_EQ(sound.prior_tests[0].degrees_of_freedom, 2);
  EXPECT_LT(sound.prior_tests[0].chi2, sound.prior_tests[0].critical);
  EXPECT_EQ(angle_between(sound.problem.walls[0].normal, p.walls[0].normal), 0.0);
  EXPECT_EQ(sound.normal_sigma[0], 0.0);
  p.walls[1].stated =
      testing::plain(turn_by({0, 0, 1.0 * kDegree}) * testing::eigen(p.walls[1].stated));
  const PriorTest wrong = adjust(p).prior_tests.at(0);
  EXPECT_GT(wrong.chi2, 2.0 * wrong.critical);
}

/// One wall does not show how the sensor is turned about its normal.
TEST(PriorTests, CountOnlyWhatTheDataCanContradict) {
  scenes::Scene scene{{wall("wall", 60, 90, 15, 0.0)}, {station("only", 0, 0, 0, 1.0)}};
  PlanarProblem p =
      planar_problem(some_train(), kGeometry, scene, kRangeNoise, {5000, kRangeNoise, 0, 0, 23});
  p.prior_sigma.assign(p.free.size(), 0.01 * kDegree);
  const PlanarSolution one = adjust(p);
  ASSERT_EQ(one.prior_tests.size(), 1u);
  EXPECT_EQ(one.prior_tests[0].degrees_of_freedom, 2);
  scene.planes.push_back(wall("other", -60, 90, 15, 0.0));
  p = planar_problem(some_train(), kGeometry, scene, kRangeNoise, {5000, kRangeNoise, 0, 0, 23});
  p.prior_sigma.assign(p.free.size(), 0.01 * kDegree);
  EXPECT_EQ(adjust(p).prior_tests.at(0).degrees_of_freedom, 3);
}

/// Sound prior knowledge gives chi-square of its degrees of freedom.
TEST(PriorTests, AreDistributedAsChiSquare) {
  constexpr int kDraws = 150;
  scenes::Scene scene = corner();
  scene.planes[0].normal_sigma = 0.1 * kDegree;
  const PlanarProblem exact = planar_problem(some_train(), {}, scene, kRangeNoise, {1000});
  double sum[3] = {}, expected[3] = {};
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    PlanarProblem p = exact;
    const RandomStream noise(draw, 77);
    std::uint64_t next = 0;
    for (WallView& view : p.views) {
      auto shots = std::make_shared<RangedShots>(*view.shots);
      for (double& range : shots->range) range += kRangeNoise * noise.normal(next++);
      view.shots = std::move(shots);
    }
    const Eigen::VectorXd off = normal_vector(8, 1.0, 1000 + draw);
    for (std::size_t s = 0; s < 2; ++s) {
      StationPose& pose = p.stations[s];
      pose.stated = turn_by(pose.sigma * off.segment<3>(3 * s)) * pose.stated;
    }
    const auto [u1, u2] = tangents_of(p.walls[0].stated);
    p.walls[0].stated =
        normalized(p.walls[0].stated + 0.1 * kDegree * off[6] * u1 + 0.1 * kDegree * off[7] * u2);
    const PlanarSolution solution = adjust(p);
    ASSERT_EQ(solution.prior_tests.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      sum[i] += solution.prior_tests[i].chi2;
      expected[i] += solution.prior_tests[i].degrees_of_freedom;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GE(expected[i], 2.0 * kDraws);
    EXPECT_NEAR(sum[i], expected[i], 3.5 * std::sqrt(2.0 * expected[i])) << i;
  }
}

/// Chi-square of one to three degrees of freedom in closed form.
TEST(PriorTests, CriticalValuesAreExceededOnceInTenThousand) {
  const auto beyond = [](const PriorTest& test) {
    const double half = 0.5 * test.critical;
    switch (test.degrees_of_freedom) {
      case 2:
        return std::exp(-half);
      case 3:
        return std::erfc(std::sqrt(half)) + 2.0 * std::sqrt(half / kPi) * std::exp(-half);
      default:
        return 0.0;
    }
  };
  const PlanarSolution solution = adjust(everything({}));
  ASSERT_EQ(solution.prior_tests.size(), 3u);
  for (const PriorTest& test : solution.prior_tests) EXPECT_NEAR(beyond(test), 1e-4, 1e-7);
}

// ---------------------------------------------------------------- pieces

TEST(PlanarAdjustment, TangentsAreARightHandedTriad) {
  for (const Vector3<double>& n : {Vector3<double>{1, 0, 0},
                                   {0, 0, 1},
                                   {0, 0, -1},
                                   {0, 1, 0},
                                   {0.6, 0, 0.8},
                                   {-0.8, 0.6, 0},
                                   {0.1, 0.1, std::sqrt(0.98)}}) {
    const auto [a, b] = tangents_of(n);
    EXPECT_NEAR(norm(a), 1.0, 1e-15);
    EXPECT_NEAR(norm(b), 1.0, 1e-15);
    EXPECT_NEAR(dot(a, n), 0.0, 1e-15);
    EXPECT_NEAR(dot(b, n), 0.0, 1e-15);
    EXPECT_NEAR(norm(cross(a, b) - n), 0.0, 1e-15);
  }
}

TEST(PlanarAdjustment, KnowsWhatIsMaterial) {
  std::vector<int> material;
  for (int at = 0; at < parameter_count(3); ++at) {
    if (is_material(at, 3)) material.push_back(at);
  }
  EXPECT_EQ(material, (std::vector<int>{place::refractive_index_air(), place::refractive_index(0),
                                        place::wedge_angle(0), place::refractive_index(1),
                                        place::wedge_angle(1), place::refractive_index(2),
                                        place::wedge_angle(2)}));
}

TEST(PlanarAdjustment, ViewsAreTurnedIntoTheSensorsFrame) {
  PlanarProblem p = planar_problem(some_train(), kGeometry, corner(), kRangeNoise, {300});
  const std::size_t last = p.views.size() - 1;
  ASSERT_EQ(p.views[last].recording, 1u);
  const PlaneView view = plane_view(p, last);
  // Its shots lie on it.
  const auto points = testing::points_of(p.train, p.geometry, *p.views[last].shots);
  for (const auto& point : points) EXPECT_NEAR(signed_distance(view.plane, point), 0.0, 1e-12);
  EXPECT_NEAR(norm(cross(view.tangent_1, view.tangent_2) - view.plane.normal), 0.0, 1e-14);
  EXPECT_EQ(view.range_variance, kRangeNoise * kRangeNoise);
}

TEST(PlanarAdjustment, ReportsItsProgress) {
  double last = 0;
  adjust(everything({}), {}, [&](double part) {
    EXPECT_GE(part, last);
    last = part;
  });
  EXPECT_GT(last, 0.0);
}

TEST(PlanarAdjustment, RefusesWhatMakesNoSense) {
  const PlanarProblem sound = everything({});
  const std::function<void(PlanarProblem&)> damages[] = {
      [](auto& p) {
        p.free.clear();
        p.prior_sigma.clear();
      },
      [](auto& p) { p.views[1].shots = nullptr; },
      [](auto& p) { p.views[1].shots = std::make_shared<const RangedShots>(); },
      [](auto& p) { p.prior_sigma.pop_back(); },
      [](auto& p) { p.views[0].wall = 2; },
      [](auto& p) { p.views[0].recording = 2; },
      [](auto& p) { p.views[0].range_variance = 0; },
      [](auto& p) { p.prior_sigma[0] = 0; },
      [](auto& p) { p.considered = p.free; },  // without a covariance
      [](auto& p) { p.mean_angle_covariance.assign(2, Eigen::MatrixXd::Zero(1, 1)); },
      [](auto& p) { p.angle_sensitivity.assign(2, Eigen::MatrixXd::Zero(5, 1)); }};
  for (std::size_t i = 0; i < std::size(damages); ++i) {
    PlanarProblem p = sound;
    damages[i](p);
    EXPECT_THROW(adjust(p), InvalidArgument) << i;
  }
  PlanarProblem empty = sound, behind = sound;
  empty.views.clear();
  EXPECT_THROW(adjust(empty), EstimationError);
  behind.walls[0].normal = -behind.walls[0].normal;  // met by no shot
  EXPECT_THROW(adjust(behind), EstimationError);
}

TEST(PlanarAdjustment, LostShotsAddNoRedundancy) {
  PlanarProblem p =
      planar_problem(some_train(), kGeometry, corner(), kRangeNoise, {1000, kRangeNoise, 0, 0, 12});
  const double whole = adjust(p).redundancy[0];
  auto shots = std::make_shared<RangedShots>(*p.views[0].shots);
  for (std::size_t i = 0; i < 50; ++i) shots->range[i] = std::nan("");
  p.views[0].shots = shots;
  const PlanarSolution solution = adjust(p);
  EXPECT_EQ(solution.lost, 50u);
  EXPECT_NEAR(solution.redundancy[0], whole - 50.0, 1.0);
}

}  // namespace risley::calibration::planar_adjustment_test
