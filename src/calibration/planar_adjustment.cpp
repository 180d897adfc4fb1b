// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/planar_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/algebra/products.hpp"
#include "risley/algebra/rotation_vector.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "calibration/eigen_vectors.hpp"
#include "calibration/own_unknowns.hpp"
#include "calibration/planar_system.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

constexpr double kLeastDamping = 1e-12;
constexpr double kMostDamping = 1e12;
/// A step with more damping promises little anywhere.
constexpr double kMostConvergedDamping = 1e-3;
/// Steps that promise to lower the cost by less are taken without a check, in the unit of one
/// squared sigma: so near the minimum the terms omitted from the derivatives (the beam's origin)
/// determine the change of the cost, and not whether the step is right.
constexpr double kSmallPromise = 1e-2;
/// Number of steps with the walls' shape, and the squared length, in sigmas of all unknowns
/// together, of a step small enough to be the last.
constexpr int kMostShapeSteps = 6;
constexpr double kSmallShapeStep = 1e-2;

/// Chi-square that a correct sample with these degrees of freedom exceeds once in 10,000.
double critical_chi2(int degrees_of_freedom) {
  constexpr double kCritical[] = {0.0, 15.137, 18.421, 21.108};
  return kCritical[std::clamp(degrees_of_freedom, 0, 3)];
}

/// Moves a geometry whose sizes are all given by a change of one of them.
void add_size(PrismGeometry& geometry, const PrismSize& size, double change) {
  const auto add = [change](std::vector<double>& values, const std::vector<double>& rate) {
    for (std::size_t i = 0; i < rate.size(); ++i) values[i] += change * rate[i];
  };
  add(geometry.thickness, size.rate.thickness);
  add(geometry.spacing, size.rate.spacing);
}

/// A step of all unknowns.
struct Step {
  Eigen::VectorXd shared;
  std::vector<Eigen::VectorXd> own;  ///< [walls]
};

void move(PlanarProblem& p, const Unknowns& at, const Step& step) {
  for (Index j = 0; j < at.free(); ++j) {
    for (const int place : p.free[j].places) {
      p.train.set_place(place, p.train[place] + step.shared[j]);
    }
  }
  for (std::size_t i = 0; i < p.sizes.size(); ++i) {
    if (at.prism_size(i) >= 0) {
      add_size(p.geometry, p.sizes[i].size, step.shared[at.prism_size(i)]);
    }
  }
  for (std::size_t i = 0; i < p.range_terms.size(); ++i) {
    if (at.range_term(i) >= 0) p.range_terms[i].value += step.shared[at.range_term(i)];
  }
  if (at.range_offset() >= 0) p.range_offset += step.shared[at.range_offset()];
  for (std::size_t w = 0; w < p.walls.size(); ++w) {
    if (at.normal(w) < 0) continue;
    Vector3<double>& normal = p.walls[w].normal;
    const Eigen::VectorXd& own = step.own[w];
    const auto [u1, u2] = tangents_of(normal);
    normal = normalized(normal + own[at.normal(w)] * u1 + own[at.normal(w) + 1] * u2);
  }
  for (std::size_t s = 0; s < p.stations.size(); ++s) {
    if (at.rotation(s) < 0) continue;
    Eigen::Matrix3d& turn = p.stations[s].scene_from_sensor;
    turn = algebra::rotation_by(step.shared.segment<3>(at.rotation(s))) * turn;
  }
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    p.views[v].distance += step.own[p.views[v].wall][at.distance(v)];
  }
}

/// Walls that are planes.
struct FlatSolution {
  SharedSolution shared;
  std::vector<WithoutOwn> walls;
  double promised = 0;  ///< decrease of the cost by the step
  bool positive = true;

  Step step(const ShapeProblem& problem) const {
    Step step{shared.step, {}};
    for (std::size_t w = 0; w < walls.size(); ++w) {
      step.own.push_back(own_solution(walls[w], problem.walls[w].places, shared).step);
    }
    return step;
  }
};

/// @param damping  as a part of the diagonal
FlatSolution solve_flat(const ShapeProblem& problem, double damping = 0) {
  FlatSolution solution;
  Eigen::MatrixXd system = problem.system;
  Eigen::VectorXd diagonal = problem.system.diagonal().head(problem.unknowns);
  for (const WallSums& wall : problem.walls) {
    WithoutOwn& own = solution.walls.emplace_back(without_own(wall.system, wall.own, damping));
    solution.positive = solution.positive && own.positive;
    if (!solution.positive) return solution;
    for (std::size_t j = 0; j < wall.places.size() && wall.places[j] < problem.unknowns; ++j) {
      const Index column = wall.own + static_cast<Index>(j);
      diagonal[wall.places[j]] += wall.system(column, column);
    }
    add_at(wall.places, own.rest, system);
    solution.promised +=
        own.from_rest.rightCols(1).col(0).dot(wall.system.rightCols(1).col(0).head(wall.own));
  }
  const Eigen::MatrixXd normal = system.topLeftCorner(problem.unknowns, problem.unknowns);
  for (Index i = 0; i < problem.unknowns; ++i) {
    system(i, i) += damping * (diagonal[i] > 0 ? diagonal[i] : 1.0);
  }
  solution.shared = shared_solution(system, problem.unknowns);
  solution.shared.normal = normal;
  solution.positive = solution.shared.positive;
  if (solution.positive) {
    solution.promised +=
        solution.shared.step.dot(system.rightCols(1).col(0).head(problem.unknowns));
  }
  return solution;
}

/// Information on the free parameters when everything else is unknown. Directions without any
/// information come out as zero, even if the others cannot be separated.
Eigen::MatrixXd eliminated(const Eigen::MatrixXd& hessian, Index free) {
  const Index rest = hessian.rows() - free;
  if (rest <= 0) return hessian;
  const Eigen::MatrixXd inverse = algebra::pseudo_inverse(hessian.bottomRightCorner(rest, rest));
  return hessian.topLeftCorner(free, free) -
         algebra::pulled_back(hessian.bottomLeftCorner(rest, free), inverse);
}

/// @param shift  of the unknowns that walls share [unknowns, quantities]
SolutionResponse response_of(const Eigen::MatrixXd& shift, const Unknowns& at) {
  return {shift.topRows(at.free()), shift.middleRows(at.free(), at.numbers())};
}

PriorTest test_of(std::string name, bool station, const Eigen::VectorXd& misfit, double sigma,
                  const Eigen::MatrixXd& posterior, const Eigen::MatrixXd& considered) {
  PriorTest test;
  test.name = std::move(name);
  test.station = station;
  test.misfit = misfit.norm();
  // Covariance of prior less adjusted: contribution of the data and of considered quantities.
  // Directions without information in the data have no misfit and are not degrees of freedom.
  const Eigen::MatrixXd covariance =
      sigma * sigma * Eigen::MatrixXd::Identity(misfit.size(), misfit.size()) - posterior +
      considered;
  const algebra::PrincipalAxes axes = algebra::principal_axes(covariance);
  for (Index i = 0; i < misfit.size(); ++i) {
    if (axes.values[i] < 1e-3 * sigma * sigma) continue;
    const double part = axes.vectors.col(i).dot(misfit);
    test.chi2 += part * part / axes.values[i];
    ++test.degrees_of_freedom;
  }
  test.critical = critical_chi2(test.degrees_of_freedom);
  return test;
}

void check(const PlanarProblem& p) {
  if (p.views.empty()) throw EstimationError("no wall to calibrate on");
  if (p.free.empty()) throw InvalidArgument("no parameter is free: there is nothing to calibrate");
  if (!p.prior_sigma.empty() && p.prior_sigma.size() != p.free.size()) {
    throw InvalidArgument(fmt::format("{} prior sigmas given for {} free parameters",
                                      p.prior_sigma.size(), p.free.size()));
  }
  require_finite("range offset", p.range_offset, "m");
  require_not_below("sigma of the range offset", p.range_offset_sigma, 0, "m");
  for (const double sigma : p.prior_sigma) {
    if (!(sigma > 0)) {
      throw InvalidArgument(fmt::format("prior sigma = {}, allowed above 0", sigma));
    }
  }
  const auto expect = [](std::string_view what, const Eigen::MatrixXd& matrix, Index rows,
                         Index columns) {
    if (matrix.rows() == rows && matrix.cols() == columns) return;
    throw InvalidArgument(fmt::format("{} is {} x {}, expected {} x {}", what, matrix.rows(),
                                      matrix.cols(), rows, columns));
  };
  const Index considered = p.considered.size();
  if (considered > 0) {
    expect("considered_covariance", p.considered_covariance, considered, considered);
  }
  for (const auto* list : {&p.angle_sensitivity, &p.mean_angle_covariance}) {
    if (!list->empty() && list->size() != p.stations.size()) {
      throw InvalidArgument(fmt::format("common errors of {} recordings given, expected {}",
                                        list->size(), p.stations.size()));
    }
  }
  for (const auto& own : p.angle_sensitivity) {
    expect("angle_sensitivity", own, p.train.prisms(), considered);
  }
  for (const auto& own : p.mean_angle_covariance) {
    expect("mean_angle_covariance", own, p.train.prisms(), p.train.prisms());
  }
  for (const SizePrior& size : p.sizes) {
    require_finite(size.size.name, size.value, "m");
    require_not_below("sigma of " + size.size.name, size.sigma, 0, "m");
  }
  for (const RangeTerm& term : p.range_terms) {
    require_finite(term.name, term.value);
    require_not_below("sigma of " + term.name, term.sigma, 0);
  }
  for (const WallView& view : p.views) {
    if (!view.shots || view.shots->size() == 0) {
      throw InvalidArgument("a view of a wall has no shots");
    }
    require_place("recording of a view", view.recording, p.stations.size());
    require_place("wall of a view", view.wall, p.walls.size());
    require_above("range variance", view.range_variance, 0, "m^2");
    require_finite("distance", view.distance, "m");
  }
}

/// Whether any wall has an unknown shape.
bool has_shape(const PlanarProblem& p) {
  return !p.shape.parameters.empty() && std::ranges::any_of(p.views, [](const WallView& view) {
    return !view.cell_begin.empty();
  });
}

/// Cells that hold a shot of the view.
std::size_t used_cells(const WallView& view) {
  std::size_t used = 0;
  for (std::size_t cell = 0; cell + 1 < view.cell_begin.size(); ++cell) {
    used += view.cell_begin[cell + 1] > view.cell_begin[cell] ? 1 : 0;
  }
  return used;
}

/// Gauss-Newton with the walls' shape integrated out, from the solution with flat walls.
/// @param[in,out] system  that of the last step when it returns
/// @return whether the steps became small
bool take_shape_steps(PlanarProblem& problem, const Unknowns& at, const Places& places,
                      const AdjustmentOptions& options, PlanarSystem& system,
                      PlanarSolution& solution, const Progress& progress) {
  const HeldQuantities none;
  for (int round = 0; round < kMostShapeSteps; ++round) {
    progress.check();
    system = build_system(problem, none, at, places, options.set, WallCells::summed);
    solution.shape = solve_with_shape(system.problem, problem.shape);
    if (!solution.shape.positive) return false;
    if (options.most_iterations == 0) return true;
    Step step{solution.shape.step, {}};
    for (const OwnSolution& own : solution.shape.own) step.own.push_back(own.step);
    move(problem, at, step);
    ++solution.iterations;
    problem.shape = likely_part(problem.shape, solution.shape);
    if (solution.shape.promised < kSmallShapeStep) return true;
  }
  return false;
}

/// Contribution of one wall's views to their redundancy: the trace of covariance times normal
/// equations, view by view.
void take_redundancy(const PlanarSystem& system, const Eigen::MatrixXd& covariance,
                     const std::vector<std::size_t>& views, std::vector<double>& redundancy) {
  for (const std::size_t v : views) {
    const ViewSystem& view = system.views[v];
    double taken = 0;
    for (std::size_t j = 0; j < view.at.size(); ++j) {
      for (std::size_t i = 0; i < view.at.size(); ++i) {
        if (view.at[i] >= covariance.rows() || view.at[j] >= covariance.rows()) continue;
        taken += covariance(view.at[i], view.at[j]) * view.normal(i, j);
      }
    }
    redundancy[v] -= taken;
  }
}

/// Covariances and responses at the solution.
struct Uncertainty {
  Eigen::MatrixXd normal;        ///< of the unknowns that walls share, the others eliminated
  Eigen::MatrixXd covariance;    ///< of the same
  Eigen::MatrixXd response;      ///< of the same to the considered quantities
  std::vector<OwnSolution> own;  ///< [walls]
  bool positive = false;
};

/// Adjusted quantities other than the parameters.
void fill_numbers(const PlanarProblem& p, const Unknowns& at, const Eigen::MatrixXd& covariance,
                  PlanarSolution& solution) {
  std::vector<double> values;
  const auto add = [&](Index unknown, const std::string& name, double value) {
    if (unknown < 0) return;
    solution.numbers.push_back(name);
    values.push_back(value);
  };
  for (std::size_t i = 0; i < p.sizes.size(); ++i) {
    add(at.prism_size(i), p.sizes[i].size.name, size_value(p.geometry, p.sizes[i].size));
  }
  for (std::size_t i = 0; i < p.range_terms.size(); ++i) {
    add(at.range_term(i), p.range_terms[i].name, p.range_terms[i].value);
  }
  add(at.range_offset(), "range_offset_m", p.range_offset);
  solution.number_values = Eigen::Map<const Eigen::VectorXd>(values.data(), values.size());
  solution.number_covariance = covariance.block(at.free(), at.free(), at.numbers(), at.numbers());
  solution.number_cross_covariance = covariance.block(at.free(), 0, at.numbers(), at.free());
}

/// Nothing is known, as in directions without information.
Uncertainty no_information(const PlanarProblem& problem, const PlanarSystem& system) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const Index n = system.problem.unknowns, considered = considered_size(problem);
  Uncertainty result;
  // With as many of the walls' own unknowns eliminated as possible.
  Eigen::MatrixXd whole = system.problem.system;
  for (const WallSums& wall : system.problem.walls) {
    const Index others = wall.system.cols() - wall.own;
    const Eigen::MatrixXd shared = wall.system.topRightCorner(wall.own, others);
    Eigen::MatrixXd rest = wall.system.bottomRightCorner(others, others);
    if (wall.own > 0) {
      rest -= algebra::pulled_back(
          shared, algebra::pseudo_inverse(wall.system.topLeftCorner(wall.own, wall.own)));
    }
    add_at(wall.places, rest, whole);
    result.own.push_back({Eigen::VectorXd::Zero(wall.own),
                          Eigen::MatrixXd::Constant(wall.own, wall.own, kInfinite),
                          Eigen::MatrixXd::Zero(wall.own, considered)});
  }
  result.normal = whole.topLeftCorner(n, n);
  result.covariance = Eigen::MatrixXd::Constant(n, n, kInfinite);
  result.response = Eigen::MatrixXd::Zero(n, considered);
  return result;
}

/// Of walls that are planes. @param[in,out] solution  its views' redundancy, shots so far
Uncertainty uncertainty_of(const PlanarProblem& problem, const PlanarSystem& system,
                           PlanarSolution& solution) {
  const FlatSolution flat = solve_flat(system.problem, kLeastDamping);
  if (!flat.positive) return no_information(problem, system);
  const std::vector<std::vector<std::size_t>> views = views_of_walls(problem);
  Uncertainty result{flat.shared.normal, flat.shared.covariance, flat.shared.response, {}, true};
  for (std::size_t w = 0; w < flat.walls.size(); ++w) {
    const WallSums& wall = system.problem.walls[w];
    result.own.push_back(own_solution(flat.walls[w], wall.places, flat.shared));
    take_redundancy(system, joint_covariance(flat.walls[w], wall.places, result.covariance),
                    views[w], solution.redundancy);
  }
  return result;
}

/// Of walls with a shape: every cell takes one shot.
Uncertainty uncertainty_of(const PlanarProblem& problem, const ShapeSolution& shape,
                           const PlanarSystem& system, PlanarSolution& solution) {
  if (!shape.positive) return no_information(problem, system);
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    solution.redundancy[v] -= static_cast<double>(used_cells(problem.views[v]));
  }
  return {shape.normal, shape.covariance, shape.response, shape.own, true};
}

/// Adjusted quantities, their accuracy, and the test of prior knowledge.
void fill_uncertainty(const PlanarProblem& problem, const Unknowns& at,
                      const Uncertainty& uncertainty, PlanarSolution& solution) {
  const Index free = at.free();
  Eigen::MatrixXd normal = uncertainty.normal;
  normal.topLeftCorner(free, free) -= prior_information(problem);
  solution.information = eliminated(normal, free);
  solution.noise_covariance = uncertainty.covariance.topLeftCorner(free, free);
  // Errors of the considered quantities shift the solution by -N^-1 J^T W K.
  const Index believed = problem.considered.size();
  solution.considered = response_of(uncertainty.response.leftCols(believed), at);
  const Eigen::MatrixXd considered = considered_covariance(problem);
  const auto of_considered = [&](const Eigen::MatrixXd& response) -> Eigen::MatrixXd {
    const Index rows = response.rows();
    if (considered.size() == 0 || rows == 0) return Eigen::MatrixXd::Zero(rows, rows);
    return algebra::propagated(response, considered);
  };
  const Eigen::MatrixXd shared_considered = of_considered(uncertainty.response);
  std::vector<Eigen::MatrixXd> own_considered;
  for (const OwnSolution& own : uncertainty.own) {
    own_considered.push_back(of_considered(own.response));
  }
  for (std::size_t w = 0; w < problem.walls.size() && uncertainty.positive; ++w) {
    const Wall& wall = problem.walls[w];
    if (!(wall.normal_sigma > 0)) continue;
    const Index first = at.normal(w);
    solution.prior_tests.push_back(test_of(wall.name, false, misfit_of(wall), wall.normal_sigma,
                                           uncertainty.own[w].covariance.block(first, first, 2, 2),
                                           own_considered[w].block(first, first, 2, 2)));
  }
  for (std::size_t s = 0; s < problem.stations.size() && uncertainty.positive; ++s) {
    const StationPose& station = problem.stations[s];
    const Index first = at.rotation(s);
    if (first < 0 || !std::isfinite(station.sigma)) continue;
    solution.prior_tests.push_back(test_of(station.name, true, misfit_of(station), station.sigma,
                                           uncertainty.covariance.block(first, first, 3, 3),
                                           shared_considered.block(first, first, 3, 3)));
  }
  const Eigen::MatrixXd covariance = uncertainty.covariance + shared_considered;
  solution.covariance = covariance.topLeftCorner(free, free);
  fill_numbers(problem, at, covariance, solution);
  const auto sigma = [&](std::size_t wall, Index i) {
    return std::sqrt(uncertainty.own[wall].covariance(i, i) + own_considered[wall](i, i));
  };
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    solution.distance_sigma.push_back(sigma(problem.views[v].wall, at.distance(v)));
  }
  for (std::size_t w = 0; w < problem.walls.size(); ++w) {
    const Index unknown = at.normal(w);
    solution.normal_sigma.push_back(
        unknown < 0 ? 0.0 : std::hypot(sigma(w, unknown), sigma(w, unknown + 1)));
  }
}

}  // namespace

bool is_material(int place, int prisms) {
  if (place == place::refractive_index_air()) return true;
  for (int k = 0; k < prisms; ++k) {
    if (place == place::refractive_index(k) || place == place::wedge_angle(k)) return true;
  }
  return false;
}

std::pair<Vector3<double>, Vector3<double>> tangents_of(const Vector3<double>& normal) {
  // Across the axis that the normal is farthest from.
  const Vector3<double> axis =
      std::abs(normal.z) < 0.9 ? Vector3<double>{0, 0, 1} : Vector3<double>{1, 0, 0};
  const Vector3<double> first = normalized(cross(axis, normal));
  return {first, cross(normal, first)};
}

std::vector<double> prior_sigmas(const std::vector<estimation::FreeParameter>& free,
                                 TrainShape shape, std::optional<double> angle_sigma) {
  std::vector<double> sigmas;
  for (const estimation::FreeParameter& parameter : free) {
    const bool angle = find_parameter(parameter.name, shape).unit == "deg";
    sigmas.push_back(angle && angle_sigma ? *angle_sigma : std::numeric_limits<double>::infinity());
  }
  return sigmas;
}

Eigen::MatrixXd prior_information(const PlanarProblem& problem) {
  Eigen::VectorXd information = Eigen::VectorXd::Zero(problem.free.size());
  for (std::size_t j = 0; j < problem.prior_sigma.size(); ++j) {
    information[j] = 1.0 / (problem.prior_sigma[j] * problem.prior_sigma[j]);
  }
  return information.asDiagonal();
}

bool is_held_material(int place, const PlanarProblem& problem) {
  return is_material(place, problem.train.prisms()) &&
         !estimation::takes_place(problem.free, place);
}

double size_value(const PrismGeometry& geometry, const PrismSize& size) {
  double value = 0;
  for (std::size_t i = 0; i < size.rate.thickness.size(); ++i) {
    value += size.rate.thickness[i] * geometry.thickness[i];
  }
  for (std::size_t i = 0; i < size.rate.spacing.size(); ++i) {
    value += size.rate.spacing[i] * geometry.spacing[i];
  }
  return value;
}

PlaneView plane_view(const PlanarProblem& problem, std::size_t view) {
  const WallView& seen = problem.views[view];
  const Wall& wall = problem.walls[seen.wall];
  const Eigen::Matrix3d turn =
      seen.side * problem.stations[seen.recording].scene_from_sensor.transpose();
  const auto [u1, u2] = tangents_of(wall.normal);
  PlaneView plane;
  plane.train = problem.train;
  plane.geometry = problem.geometry;
  for (const SizePrior& size : problem.sizes) plane.sizes.push_back(size.size);
  for (const RangeTerm& term : problem.range_terms) plane.range_terms.push_back(term.value);
  plane.range_offset = problem.range_offset;
  plane.range_variance = seen.range_variance;
  plane.plane = {plain(turn * eigen(wall.normal)), seen.distance};
  plane.tangent_1 = plain(turn * eigen(u1));
  plane.tangent_2 = plain(turn * eigen(u2));
  return plane;
}

PlanarSolution adjust(PlanarProblem problem, const AdjustmentOptions& options,
                      const Progress& progress) {
  check(problem);
  const Unknowns at(problem);
  const HeldQuantities none;
  const Places places(problem, none);
  PlanarSolution solution;
  const bool shaped = has_shape(problem);
  PlanarSystem system;
  if (!shaped) system = build_system(problem, none, at, places, options.set);
  double damping = 1e-8;
  while (!shaped && solution.iterations < options.most_iterations) {
    const FlatSolution flat = solve_flat(system.problem, damping);
    if (!flat.positive) {  // flat in some direction
      damping = std::max(10.0 * damping, 1e-8);
      if (damping > kMostDamping) break;
      continue;
    }
    const Step step = flat.step(system.problem);
    if (flat.promised <= options.tolerance) {
      // The step is right to second order and costs nothing more.
      move(problem, at, step);
      solution.converged = damping <= kMostConvergedDamping;
      break;
    }
    PlanarProblem trial = problem;
    move(trial, at, step);
    PlanarSystem next = build_system(trial, none, at, places, options.set);
    ++solution.iterations;
    progress.report(static_cast<double>(solution.iterations) / options.most_iterations);
    // Shots that lose their plane would make any step look good.
    const bool better =
        next.lost <= system.lost && (next.cost <= system.cost || flat.promised < kSmallPromise);
    if (better) {
      problem = std::move(trial);
      system = std::move(next);
      damping = std::max(damping / 10.0, kLeastDamping);
    } else {
      damping = std::max(damping * 100.0, 1e-6);
      if (damping > kMostDamping) break;
    }
  }
  if (shaped) {
    solution.converged = take_shape_steps(problem, at, places, options, system, solution, progress);
  }
  for (std::size_t view = 0; view < problem.views.size(); ++view) {
    if (system.views[view].shots == 0) {
      throw EstimationError(fmt::format("no shot meets the plane of wall {}",
                                        problem.walls[problem.views[view].wall].name));
    }
    solution.redundancy.push_back(static_cast<double>(system.views[view].shots));
  }
  const Uncertainty uncertainty = shaped ? uncertainty_of(problem, solution.shape, system, solution)
                                         : uncertainty_of(problem, system, solution);
  if (!uncertainty.positive) solution.converged = false;
  solution.cost = system.cost;
  solution.shots = system.shots;
  solution.lost = system.lost;
  for (const ViewSystem& view : system.views) {
    solution.chi2.push_back(shaped && uncertainty.positive ? view.scatter : view.cost);
  }
  fill_uncertainty(problem, at, uncertainty, solution);
  solution.parameters = estimation::free_values(problem.train, problem.free);
  solution.problem = std::move(problem);
  return solution;
}

Index PlanarSolution::number(std::string_view name) const {
  const auto found = std::ranges::find(numbers, name);
  return found == numbers.end() ? -1 : found - numbers.begin();
}

double PlanarSolution::number_sigma(std::string_view name) const {
  const Index row = number(name);
  return row < 0 ? 0.0 : std::sqrt(number_covariance(row, row));
}

SolutionResponse held_response(const PlanarProblem& solved, const HeldQuantities& held,
                               InstructionSet set) {
  check(solved);
  const auto expect = [](const char* what, Index found, Index expected) {
    require_length(what, found, expected);
  };
  expect("places of the held quantities", held.train.rows(),
         static_cast<Index>(solved.train.parameters().size()));
  require_length("recordings of the held quantities", held.rotation_angles.size(),
                 solved.stations.size());
  for (const Eigen::MatrixXd& own : held.rotation_angles) {
    expect("prisms of the held quantities", own.rows(), solved.train.prisms());
    expect("held quantities of the rotation angles", own.cols(), held.count());
  }
  const Unknowns at(solved);
  const Places places(solved, held);
  const bool shaped = has_shape(solved);
  const PlanarSystem system =
      build_system(solved, held, at, places, set, shaped ? WallCells::summed : WallCells::left_out);
  if (shaped) {
    const ShapeSolution solution = solve_with_shape(system.problem, solved.shape);
    if (!solution.positive) throw EstimationError("the walls do not determine all parameters");
    return response_of(solution.response.rightCols(held.count()), at);
  }
  const FlatSolution solution = solve_flat(system.problem);
  if (!solution.positive) throw EstimationError("the walls do not determine all parameters");
  return response_of(solution.shared.response.rightCols(held.count()), at);
}

}  // namespace risley::calibration
