// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/paper_adjustment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/calibration/fitted_plane.hpp"
#include "risley/core/error.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

constexpr std::size_t kAdjustedBlock = 4096;
constexpr double kStandsStill = 1e-10;  // relative change of the standard deviation of unit weight

/// Points of one view and the derivatives of their distances from a plane to be fitted.
struct Cloud {
  std::vector<Vector3<double>> points;
  Plane plane;
};

/// Sums of one view with the plane's unknowns still in: [free, offset along the normal, two tilts].
struct Sums {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
  double squares = 0;

  explicit Sums(Index size = 0)
      : hessian(Eigen::MatrixXd::Zero(size, size)), gradient(Eigen::VectorXd::Zero(size)) {}

  /// @param row  derivatives of a point's residual, its negated distance
  void add(const Eigen::VectorXd& row, double distance) {
    for (Index j = 0; j < row.size(); ++j) {
      for (Index i = 0; i < row.size(); ++i) hessian(i, j) += row[i] * row[j];
      gradient[j] -= distance * row[j];
    }
    squares += distance * distance;
  }
  void add(const Sums& other) {
    hessian += other.hessian;
    gradient += other.gradient;
    squares += other.squares;
  }
};

template <TrainLayout N>
class View {
 public:
  View(const PlanarProblem& p, const RangedShots& shots) : p_(p), shots_(shots) {
    check_beams(p.train, shots.beam, shots.size());
    const auto order = face_order_array<N>(p.train);
    for (int emitter = 0; emitter < p.train.emitters(); ++emitter) {
      const auto parameters = parameter_array<N>(p.train, emitter);
      prepared_.push_back(prepare<double, N>(parameters, order));
      derivatives_.push_back(prepare_derivatives<double, N>(parameters, order));
    }
    const auto positions = face_positions(p.train.face_order(), p.geometry);
    std::ranges::copy(positions, face_position_.begin());
  }

  Cloud cloud() const {
    Cloud cloud;
    cloud.points.resize(shots_.size());
    parallel::for_each(blocks(), [&](std::size_t block) {
      for (std::size_t i = begin(block); i < end(block); ++i) {
        const auto trace = trace_forward(prepared_[beam(i)], angles(i));
        cloud.points[i] = beam_origin(trace, face_position_) + shots_.range[i] * trace.direction();
      }
    });
    std::vector<std::size_t> all(cloud.points.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    cloud.plane = fitted_plane(cloud.points, all);
    return cloud;
  }

  Sums sums(const Cloud& cloud) const {
    const auto free = std::ssize(p_.free), size = free + 3;
    const auto [t1, t2] = tangents_of(cloud.plane.normal);
    std::vector<Sums> parts(blocks());
    parallel::for_each(blocks(), [&, t1 = t1, t2 = t2](std::size_t block) {
      Sums& part = parts[block];
      part = Sums(size);
      Eigen::VectorXd row(size);
      for (std::size_t i = begin(block); i < end(block); ++i) {
        const std::size_t emitter = beam(i);
        const auto trace = trace_forward(prepared_[emitter], angles(i));
        const auto gradient =
            trace_adjoint(prepared_[emitter], derivatives_[emitter], trace,
                          std::array<Vector3<double>, 1>{shots_.range[i] * cloud.plane.normal});
        for (Index j = 0; j < free; ++j) {
          row[j] = 0;
          for (const int place : p_.free[j].places) {
            row[j] += derivative_by(gradient[0], place, static_cast<int>(emitter));
          }
        }
        const double distance = signed_distance(cloud.plane, cloud.points[i]);
        row[free] = -1.0;
        row[free + 1] = dot(cloud.points[i], t1);
        row[free + 2] = dot(cloud.points[i], t2);
        part.add(row, distance);
      }
    });
    Sums sum(size);
    for (const Sums& part : parts) sum.add(part);
    return sum;
  }

 private:
  std::size_t blocks() const { return (shots_.size() + kAdjustedBlock - 1) / kAdjustedBlock; }
  std::size_t begin(std::size_t block) const { return block * kAdjustedBlock; }
  std::size_t end(std::size_t block) const {
    return std::min(begin(block) + kAdjustedBlock, shots_.size());
  }
  std::array<double, N> angles(std::size_t i) const {
    std::array<double, N> result;
    for (std::size_t k = 0; k < N; ++k) result[k] = shots_.rotation_angle[k][i];
    return result;
  }

  std::size_t beam(std::size_t i) const { return shots_.beam.empty() ? 0 : shots_.beam[i]; }

  const PlanarProblem& p_;
  const RangedShots& shots_;
  std::vector<PreparedTrain<double, N>> prepared_;           // [emitters]
  std::vector<PreparedDerivatives<double, N>> derivatives_;  // [emitters]
  std::array<double, 2 * N> face_position_{};
};

}  // namespace

PlanarSolution adjust_as_paper(PlanarProblem problem, int most_iterations,
                               const Progress& progress) {
  if (problem.views.empty()) throw EstimationError("no wall to calibrate on");
  const Index free = problem.free.size();
  // Every view is a separate wall in the sensor's frame.
  std::vector<Wall> walls;
  for (WallView& view : problem.views) {
    walls.push_back(problem.walls[view.wall]);
    view.wall = walls.size() - 1;
    view.side = 1.0;
  }
  problem.walls = std::move(walls);
  for (StationPose& station : problem.stations) station.scene_from_sensor.setIdentity();
  PlanarSolution solution;
  for (const WallView& view : problem.views) solution.shots += view.shots->size();
  const double redundancy = static_cast<double>(solution.shots) - static_cast<double>(free) -
                            3.0 * static_cast<double>(problem.views.size());
  double unit_weight = 0;
  while (true) {
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(free, free);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(free);
    double squares = 0;
    for (std::size_t v = 0; v < problem.views.size(); ++v) {
      WallView& view = problem.views[v];
      const auto [plane, sums] = with_layout(problem.train.layout(), [&]<TrainLayout N>() {
        const View<N> one(problem, *view.shots);
        const Cloud cloud = one.cloud();
        return std::pair{cloud.plane, one.sums(cloud)};
      });
      const algebra::SymmetricSolver own(sums.hessian.bottomRightCorner(3, 3));
      const Eigen::MatrixXd cross = sums.hessian.bottomLeftCorner(3, free);
      hessian += sums.hessian.topLeftCorner(free, free) -
                 algebra::transposed_product(cross, own.solve_columns(cross));
      gradient += sums.gradient.head(free) -
                  algebra::transposed_times(cross, own.solve(sums.gradient.tail(3)));
      squares += sums.squares;
      problem.walls[view.wall].normal = plane.normal;
      view.distance = plane.distance;
    }
    const double before = std::exchange(unit_weight, std::sqrt(squares / redundancy));
    solution.cost = squares;
    solution.information = hessian / (unit_weight * unit_weight);
    const algebra::SymmetricSolver solver(hessian);
    solution.covariance = solver.inverse() * (unit_weight * unit_weight);
    if (std::abs(before - unit_weight) <= kStandsStill * unit_weight) {
      solution.converged = true;
      break;
    }
    if (solution.iterations >= most_iterations) break;
    const Eigen::VectorXd step = solver.solve(gradient);
    if (!step.allFinite()) break;
    for (Index j = 0; j < free; ++j) {
      for (const int place : problem.free[j].places) {
        problem.train.set_place(place, problem.train[place] + step[j]);
      }
    }
    ++solution.iterations;
    progress.report(static_cast<double>(solution.iterations) / most_iterations);
  }
  solution.noise_covariance = solution.covariance;
  solution.parameters.resize(free);
  for (Index j = 0; j < free; ++j) {
    solution.parameters[j] = problem.train[problem.free[j].places.front()];
  }
  solution.chi2.clear();
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    const RangedShots& own = *problem.views[v].shots;
    const auto shots = static_cast<double>(own.size());
    solution.redundancy.push_back(shots * redundancy / static_cast<double>(solution.shots));
    solution.distance_sigma.push_back(unit_weight / std::sqrt(shots));
    // As ranges, as in every other adjustment.
    const PlaneEquations equations = plane_equations(own, plane_view(problem, v));
    solution.chi2.push_back(equations.cost);
    solution.lost += equations.lost;
  }
  solution.problem = std::move(problem);
  return solution;
}

}  // namespace risley::calibration
