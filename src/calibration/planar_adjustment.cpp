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
#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "calibration/eigen_vectors.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

constexpr double kLeastDamping = 1e-12;
constexpr double kMostDamping = 1e12;
/// A step that is damped by more promises little wherever it stands.
constexpr double kMostConvergedDamping = 1e-3;
/// Steps that promise to lower the cost by less are taken unasked, in the unit of one squared
/// sigma: so near the minimum what the derivatives leave out (the beam's origin) decides what the
/// cost does, and not whether the step is right.
constexpr double kSmallPromise = 1e-2;
/// Steps with the walls' shape, and the squared length, in sigmas of all unknowns together, of one
/// that is small enough to be the last.
constexpr int kMostShapeSteps = 6;
constexpr double kSmallShapeStep = 1e-2;

/// Rotation by a vector: its direction is the axis, its length the angle.
Eigen::Matrix3d rotation(const Eigen::Vector3d& by) {
  const double angle = by.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, by / angle).toRotationMatrix();
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& matrix) {
  const Eigen::AngleAxisd turn(matrix);
  return turn.angle() * turn.axis();
}

/// Chi-square that a sound sample with so many degrees of freedom exceeds once in 10,000.
double critical_chi2(int degrees_of_freedom) {
  constexpr double kCritical[] = {0.0, 15.137, 18.421, 21.108};
  return kCritical[std::clamp(degrees_of_freedom, 0, 3)];
}

/// Where each unknown stands in the vector of all.
class Unknowns {
 public:
  explicit Unknowns(const PlanarProblem& p)
      : free_(static_cast<Index>(p.free.size())),
        normal_(p.walls.size(), -1),
        rotation_(p.stations.size(), -1),
        distance_(p.views.size(), -1) {
    Index next = free_;
    for (const SizePrior& size : p.sizes) size_.push_back(size.sigma > 0 ? next++ : -1);
    for (const RangeTerm& term : p.range_terms) term_.push_back(term.sigma > 0 ? next++ : -1);
    if (p.range_offset_sigma > 0) offset_ = next++;
    numbers_ = next - free_;
    for (std::size_t w = 0; w < p.walls.size(); ++w) {
      if (p.walls[w].normal_sigma == 0.0) continue;
      normal_[w] = next;
      next += 2;
    }
    for (std::size_t s = 0; s < p.stations.size(); ++s) {
      if (!p.stations_known || p.stations[s].sigma == 0.0) continue;
      rotation_[s] = next;
      next += 3;
    }
    for (Index& distance : distance_) distance = next++;
    all_ = next;
  }
  Index free() const { return free_; }
  Index size() const { return all_; }
  /// Sizes and range errors, which follow the free parameters.
  Index numbers() const { return numbers_; }
  /// Negative where the quantity is held.
  Index prism_size(std::size_t number) const { return size_[number]; }
  Index range_term(std::size_t number) const { return term_[number]; }
  Index range_offset() const { return offset_; }
  Index normal(std::size_t wall) const { return normal_[wall]; }
  Index rotation(std::size_t station) const { return rotation_[station]; }
  Index distance(std::size_t view) const { return distance_[view]; }

 private:
  Index free_ = 0, numbers_ = 0, offset_ = -1, all_ = 0;
  std::vector<Index> size_, term_, normal_, rotation_, distance_;
};

/// The columns of plane_equations() and the parameters behind them.
struct Places {
  std::vector<int> all;  ///< places of the flat vector, each once

  Places(const PlanarProblem& p, const HeldQuantities& held) {
    for (const auto* list : {&p.free, &p.considered}) {
      for (const estimation::FreeParameter& parameter : *list) {
        for (const int place : parameter.places) {
          add(place);
        }
      }
    }
    for (Index place = 0; place < held.train.rows(); ++place) {
      const bool any = held.train.cols() > 0 && (held.train.row(place).array() != 0.0).any();
      if (any) add(static_cast<int>(place));
    }
  }
  Index column(int place) const { return std::find(all.begin(), all.end(), place) - all.begin(); }

 private:
  void add(int place) {
    if (std::find(all.begin(), all.end(), place) == all.end()) all.push_back(place);
  }
};

/// Considered quantities: believed parameters, then the mean angles of every recording. Held ones
/// have the columns behind them.
Index considered_size(const PlanarProblem& p) {
  return static_cast<Index>(p.considered.size()) +
         static_cast<Index>(p.mean_angle_covariance.size()) * p.train.prisms();
}

Eigen::MatrixXd considered_covariance(const PlanarProblem& p) {
  const Index size = considered_size(p);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  Index at = static_cast<Index>(p.considered.size());
  if (at > 0) covariance.topLeftCorner(at, at) = p.considered_covariance;
  for (const Eigen::MatrixXd& own : p.mean_angle_covariance) {
    covariance.block(at, at, own.rows(), own.cols()) = own;
    at += own.rows();
  }
  return covariance;
}

/// d columns of one view / d unknowns, and d columns / d considered and held quantities.
struct Chain {
  Eigen::MatrixXd unknowns, considered;
};

Chain chain_of(const PlanarProblem& p, const HeldQuantities& held, const Unknowns& at,
               const Places& places, const PlaneView& plane, std::size_t view) {
  const WallView& seen = p.views[view];
  const PlaneColumns columns(plane);
  Chain chain{Eigen::MatrixXd::Zero(columns.size(), at.size()),
              Eigen::MatrixXd::Zero(columns.size(), considered_size(p) + held.count())};
  for (Index j = 0; j < at.free(); ++j) {
    for (const int place : p.free[static_cast<std::size_t>(j)].places) {
      chain.unknowns(places.column(place), j) = 1.0;
    }
  }
  for (std::size_t i = 0; i < p.sizes.size(); ++i) {
    const Index size = at.prism_size(i);
    if (size >= 0) chain.unknowns(columns.prism_size(static_cast<int>(i)), size) = 1.0;
  }
  for (std::size_t i = 0; i < p.range_terms.size(); ++i) {
    const Index term = at.range_term(i);
    if (term >= 0) chain.unknowns(columns.range_term(static_cast<int>(i)), term) = 1.0;
  }
  if (at.range_offset() >= 0) chain.unknowns(columns.range_offset(), at.range_offset()) = 1.0;
  // The tangents in the sensor's frame are those of the scene turned, see plane_view().
  const Wall& wall = p.walls[seen.wall];
  const auto [u1, u2] = tangents_of(wall.normal);
  if (const Index normal = at.normal(seen.wall); normal >= 0) {
    chain.unknowns(columns.normal(0), normal) = 1.0;
    chain.unknowns(columns.normal(1), normal + 1) = 1.0;
  }
  if (const Index turn = at.rotation(seen.recording); turn >= 0) {
    // A station turned by rho about the scene's axes sees the normal turned back: + n x rho.
    const Eigen::Vector3d n = eigen(wall.normal);
    chain.unknowns.block<1, 3>(columns.normal(0), turn) = eigen(u1).cross(n).transpose();
    chain.unknowns.block<1, 3>(columns.normal(1), turn) = eigen(u2).cross(n).transpose();
  }
  chain.unknowns(columns.distance(), at.distance(view)) = 1.0;
  const auto believed = static_cast<Index>(p.considered.size());
  for (Index j = 0; j < believed; ++j) {
    for (const int place : p.considered[static_cast<std::size_t>(j)].places) {
      // The other error parameters that the sensor believes in only act through the angles.
      if (is_held_material(place, p)) chain.considered(places.column(place), j) = 1.0;
    }
    if (p.angle_sensitivity.empty()) continue;
    for (int k = 0; k < p.train.prisms(); ++k) {
      chain.considered(columns.rotation_angle(k), j) = p.angle_sensitivity[seen.recording](k, j);
    }
  }
  if (!p.mean_angle_covariance.empty()) {
    const Index mine = believed + static_cast<Index>(seen.recording) * p.train.prisms();
    for (int k = 0; k < p.train.prisms(); ++k) {
      chain.considered(columns.rotation_angle(k), mine + k) = 1.0;
    }
  }
  if (held.count() > 0) {
    auto moved = chain.considered.rightCols(held.count());
    for (const int place : places.all) moved.row(places.column(place)) = held.train.row(place);
    for (int k = 0; k < p.train.prisms(); ++k) {
      moved.row(columns.rotation_angle(k)) = held.rotation_angles[seen.recording].row(k);
    }
  }
  return chain;
}

/// Sum of all normal equations and priors at one point.
struct System {
  Eigen::MatrixXd hessian;   ///< [unknowns, unknowns]
  Eigen::VectorXd gradient;  ///< [unknowns]
  /// J^T W d prediction / d considered and held quantities [unknowns, considered + held].
  Eigen::MatrixXd considered;
  double cost = 0;
  std::size_t shots = 0, lost = 0;
  std::vector<Eigen::MatrixXd> view_hessian;  ///< [views] of [unknowns, unknowns]
  std::vector<double> view_cost;              ///< [views]
  std::vector<std::size_t> view_shots;        ///< [views], that met their plane
  std::vector<WallSums>
      walls;  ///< [walls], where they are wanted: of unknowns, considered, residual
  std::vector<double> view_scatter;  ///< [views], chi2 of what cells scatter within themselves
};

/// Whether walls are summed cell by cell.
enum class WallCells { left_out, summed };

/// Adds the cells of one view to those of its wall.
void add_cells(const PlanarProblem& p, std::size_t view, const PlaneColumns& columns,
               const PlaneEquations& equations, const Chain& chain, System& system) {
  const WallView& seen = p.views[view];
  WallSums& sums = system.walls[seen.wall];
  const WallGrid& grid = sums.grid;
  const auto [u1, u2] = tangents_of(p.walls[seen.wall].normal);
  const Eigen::Vector3d& position = p.stations[seen.recording].position;
  const double stand_u = eigen(u1).dot(position), stand_v = eigen(u2).dot(position);
  const Index n = chain.unknowns.cols(), considered = chain.considered.cols();
  Eigen::MatrixXd to_system(columns.size(), n + considered);
  to_system << chain.unknowns, chain.considered;
  const auto cells = static_cast<Index>(grid.cells.size());
  // A shot's row by the wall's height, and that times its place against the middle of its cell:
  // u - middle = -side n1 / d + (stand - middle).
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = equations.cells;
  double within = equations.cost;
  for (Index cell = 0; cell < cells; ++cell) {
    const double off_u = stand_u - grid.middle_u(static_cast<std::size_t>(cell));
    const double off_v = stand_v - grid.middle_v(static_cast<std::size_t>(cell));
    auto d = rows.row(3 * cell), du = rows.row(3 * cell + 1), dv = rows.row(3 * cell + 2);
    const double all = d[columns.distance()];
    if (!(all > 0)) continue;
    within -= d[columns.size()] * d[columns.size()] / all;
    du = -du + seen.side * off_u * d;
    dv = -dv + seen.side * off_v * d;
    d *= seen.side;
    Eigen::Matrix3d weight;
    for (int a = 0; a < 3; ++a) {
      const auto row = rows.row(3 * cell + a);
      const double by_height = row[columns.distance()];
      weight.row(a) << seen.side * by_height,
          -row[columns.normal(0)] + seen.side * off_u * by_height,
          -row[columns.normal(1)] + seen.side * off_v * by_height;
    }
    sums.weight[static_cast<std::size_t>(cell)] += weight;
  }
  system.view_scatter[view] = within;
  sums.columns.leftCols(n + considered) += rows.leftCols(columns.size()) * to_system;
  sums.columns.rightCols(1) += rows.rightCols(1);
}

/// Moves a geometry whose sizes are all given by a change of one of them.
void add_size(PrismGeometry& geometry, const PrismSize& size, double change) {
  const auto add = [change](std::vector<double>& values, const std::vector<double>& rate) {
    for (std::size_t i = 0; i < rate.size(); ++i) values[i] += change * rate[i];
  };
  add(geometry.thickness, size.rate.thickness);
  add(geometry.spacing, size.rate.spacing);
}

/// Adjusted less stated normal, in the tangents of the adjusted one, rad.
Eigen::Vector2d misfit_of(const Wall& wall) {
  const auto [u1, u2] = tangents_of(wall.normal);
  const Vector3<double> difference = wall.normal - wall.stated;
  return {dot(u1, difference), dot(u2, difference)};
}

/// Adjusted after stated rotation, scene frame, rad.
Eigen::Vector3d misfit_of(const StationPose& station) {
  return rotation_vector(station.scene_from_sensor * station.stated.transpose());
}

/// What is known before.
void add_priors(const PlanarProblem& p, const Unknowns& at, System& system) {
  const auto tie = [&](Index unknown, double sigma, double off) {
    const double information = 1.0 / (sigma * sigma);
    system.hessian(unknown, unknown) += information;
    system.gradient[unknown] -= information * off;
    system.cost += information * off * off;
  };
  for (std::size_t j = 0; j < p.prior_sigma.size(); ++j) {
    if (!std::isfinite(p.prior_sigma[j])) continue;
    const int place = p.free[j].places.front();
    tie(static_cast<Index>(j), p.prior_sigma[j], p.train[place] - p.prior[place]);
  }
  if (at.range_offset() >= 0) tie(at.range_offset(), p.range_offset_sigma, p.range_offset);
  for (std::size_t i = 0; i < p.sizes.size(); ++i) {
    if (at.prism_size(i) < 0) continue;
    tie(at.prism_size(i), p.sizes[i].sigma,
        size_value(p.geometry, p.sizes[i].size) - p.sizes[i].value);
  }
  for (std::size_t i = 0; i < p.range_terms.size(); ++i) {
    if (at.range_term(i) < 0) continue;
    tie(at.range_term(i), p.range_terms[i].sigma, p.range_terms[i].value - p.range_terms[i].prior);
  }
  for (std::size_t w = 0; w < p.walls.size(); ++w) {
    if (!(p.walls[w].normal_sigma > 0)) continue;
    const Eigen::Vector2d off = misfit_of(p.walls[w]);
    for (Index i = 0; i < 2; ++i) tie(at.normal(w) + i, p.walls[w].normal_sigma, off[i]);
  }
  for (std::size_t s = 0; s < p.stations.size(); ++s) {
    if (at.rotation(s) < 0 || std::isinf(p.stations[s].sigma)) continue;
    const Eigen::Vector3d off = misfit_of(p.stations[s]);
    for (Index i = 0; i < 3; ++i) tie(at.rotation(s) + i, p.stations[s].sigma, off[i]);
  }
}

System build_system(const PlanarProblem& p, const HeldQuantities& held, const Unknowns& at,
                    const Places& places, InstructionSet set,
                    WallCells cells = WallCells::left_out) {
  System system;
  const Index n = at.size(), considered = considered_size(p) + held.count();
  system.hessian = Eigen::MatrixXd::Zero(n, n);
  system.gradient = Eigen::VectorXd::Zero(n);
  system.considered = Eigen::MatrixXd::Zero(n, considered);
  if (cells == WallCells::summed) {
    system.view_scatter.resize(p.views.size());
    for (const Wall& wall : p.walls) {
      WallSums& sums = system.walls.emplace_back();
      sums.grid = wall.grid;
      sums.weight.assign(wall.grid.cells.size(), Eigen::Matrix3d::Zero());
      sums.columns.setZero(3 * static_cast<Index>(wall.grid.cells.size()), n + considered + 1);
    }
  }
  for (std::size_t view = 0; view < p.views.size(); ++view) {
    PlaneView plane = plane_view(p, view);
    plane.places = places.all;
    const bool by_cells = cells == WallCells::summed && !p.views[view].cell_begin.empty();
    if (by_cells) plane.cell_begin = p.views[view].cell_begin;
    const PlaneEquations equations = plane_equations(*p.views[view].shots, plane, {}, set);
    const Chain chain = chain_of(p, held, at, places, plane, view);
    if (by_cells) add_cells(p, view, PlaneColumns(plane), equations, chain, system);
    system.view_hessian.push_back(algebra::pulled_back(chain.unknowns, equations.hessian));
    system.view_cost.push_back(equations.cost);
    system.view_shots.push_back(equations.shots);
    system.hessian += system.view_hessian.back();
    system.gradient += algebra::transposed_times(chain.unknowns, equations.gradient);
    system.considered += algebra::transposed_product(
        chain.unknowns, algebra::product(equations.hessian, chain.considered));
    system.cost += equations.cost;
    system.shots += equations.shots;
    system.lost += equations.lost;
  }
  add_priors(p, at, system);
  return system;
}

void move(PlanarProblem& p, const Unknowns& at, const Eigen::VectorXd& step) {
  for (Index j = 0; j < at.free(); ++j) {
    for (const int place : p.free[static_cast<std::size_t>(j)].places) {
      p.train.set_place(place, p.train[place] + step[j]);
    }
  }
  for (std::size_t i = 0; i < p.sizes.size(); ++i) {
    if (at.prism_size(i) >= 0) add_size(p.geometry, p.sizes[i].size, step[at.prism_size(i)]);
  }
  for (std::size_t i = 0; i < p.range_terms.size(); ++i) {
    if (at.range_term(i) >= 0) p.range_terms[i].value += step[at.range_term(i)];
  }
  if (at.range_offset() >= 0) p.range_offset += step[at.range_offset()];
  for (std::size_t w = 0; w < p.walls.size(); ++w) {
    if (at.normal(w) < 0) continue;
    Vector3<double>& normal = p.walls[w].normal;
    const auto [u1, u2] = tangents_of(normal);
    normal = normalized(normal + step[at.normal(w)] * u1 + step[at.normal(w) + 1] * u2);
  }
  for (std::size_t s = 0; s < p.stations.size(); ++s) {
    if (at.rotation(s) < 0) continue;
    Eigen::Matrix3d& turn = p.stations[s].scene_from_sensor;
    turn = rotation(step.segment<3>(at.rotation(s))) * turn;
  }
  for (std::size_t v = 0; v < p.views.size(); ++v) p.views[v].distance += step[at.distance(v)];
}

/// Information on the free parameters when everything else is unknown. Directions without any
/// information come out as zero, also where the others cannot be told apart.
Eigen::MatrixXd eliminated(const Eigen::MatrixXd& hessian, Index free) {
  const Index rest = hessian.rows() - free;
  if (rest <= 0) return hessian;
  const Eigen::MatrixXd inverse = algebra::pseudo_inverse(hessian.bottomRightCorner(rest, rest));
  return hessian.topLeftCorner(free, free) -
         algebra::pulled_back(hessian.bottomLeftCorner(rest, free), inverse);
}

/// @param shift  of all unknowns [unknowns, quantities]
SolutionResponse response_of(const Eigen::MatrixXd& shift, const Unknowns& at) {
  return {shift.topRows(at.free()), shift.middleRows(at.free(), at.numbers())};
}

PriorTest test_of(std::string name, bool station, const Eigen::VectorXd& misfit, double sigma,
                  const Eigen::MatrixXd& posterior, const Eigen::MatrixXd& considered) {
  PriorTest test;
  test.name = std::move(name);
  test.station = station;
  test.misfit = misfit.norm();
  // Covariance of prior less adjusted: what the data added, and what considered quantities make of
  // it. Directions in which the data say nothing have no misfit and are no degrees of freedom.
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
  const auto considered = static_cast<Index>(p.considered.size());
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

/// Whether any wall has a shape to be found.
bool has_shape(const PlanarProblem& p) {
  return !p.shape.parameters.empty() &&
         std::any_of(p.views.begin(), p.views.end(),
                     [](const WallView& view) { return !view.cell_begin.empty(); });
}

/// Cells that hold a shot of the view.
std::size_t used_cells(const WallView& view) {
  std::size_t used = 0;
  for (std::size_t cell = 0; cell + 1 < view.cell_begin.size(); ++cell) {
    used += view.cell_begin[cell + 1] > view.cell_begin[cell] ? 1 : 0;
  }
  return used;
}

/// J' W J of unknowns, considered quantities and the residual.
ShapeProblem shape_problem(const System& system) {
  const Index n = system.hessian.rows(), considered = system.considered.cols();
  ShapeProblem problem;
  problem.unknowns = n;
  problem.system = Eigen::MatrixXd::Zero(n + considered + 1, n + considered + 1);
  problem.system.topLeftCorner(n, n) = system.hessian;
  problem.system.block(0, n, n, considered) = system.considered;
  problem.system.block(n, 0, considered, n) = system.considered.transpose();
  problem.system.col(n + considered).head(n) = system.gradient;
  problem.system.row(n + considered).head(n) = system.gradient.transpose();
  problem.system(n + considered, n + considered) = system.cost;
  for (const WallSums& wall : system.walls) {
    if (!wall.grid.empty()) problem.walls.push_back(wall);
  }
  return problem;
}

/// Gauss-Newton with the walls' shape integrated out, from where flat walls have led.
/// @param[in,out] system  that of the last step when it returns
/// @return whether the steps became small
bool take_shape_steps(PlanarProblem& problem, const Unknowns& at, const Places& places,
                      const AdjustmentOptions& options, System& system, PlanarSolution& solution,
                      const Progress& progress) {
  const HeldQuantities none;
  for (int round = 0; round < kMostShapeSteps; ++round) {
    progress.check();
    system = build_system(problem, none, at, places, options.set, WallCells::summed);
    solution.shape = solve_with_shape(shape_problem(system), problem.shape);
    if (!solution.shape.positive) return false;
    const Eigen::VectorXd& step = solution.shape.step;
    if (options.most_iterations == 0) return true;
    move(problem, at, step);
    ++solution.iterations;
    problem.shape = likely_part(problem.shape, solution.shape);
    const double promised = step.dot(solution.shape.normal.selfadjointView<Eigen::Lower>() * step);
    if (promised < kSmallShapeStep) return true;
  }
  return false;
}

/// What was adjusted beside the parameters.
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
  solution.number_values =
      Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
  solution.number_covariance = covariance.block(at.free(), at.free(), at.numbers(), at.numbers());
  solution.number_cross_covariance = covariance.block(at.free(), 0, at.numbers(), at.free());
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
  Eigen::VectorXd information = Eigen::VectorXd::Zero(static_cast<Index>(problem.free.size()));
  for (std::size_t j = 0; j < problem.prior_sigma.size(); ++j) {
    information[static_cast<Index>(j)] = 1.0 / (problem.prior_sigma[j] * problem.prior_sigma[j]);
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
  System system;
  if (!shaped) system = build_system(problem, none, at, places, options.set);
  double damping = 1e-8;
  while (!shaped && solution.iterations < options.most_iterations) {
    const algebra::SymmetricSolver solver(system.hessian, damping);
    if (!solver.positive()) {  // flat in some direction
      damping = std::max(10.0 * damping, 1e-8);
      if (damping > kMostDamping) break;
      continue;
    }
    const Eigen::VectorXd step = solver.solve(system.gradient);
    const double promised = step.dot(system.gradient);
    if (promised <= options.tolerance) {
      // The step is right to second order and costs nothing more.
      move(problem, at, step);
      solution.converged = damping <= kMostConvergedDamping;
      break;
    }
    PlanarProblem trial = problem;
    move(trial, at, step);
    System next = build_system(trial, none, at, places, options.set);
    ++solution.iterations;
    progress.report(static_cast<double>(solution.iterations) / options.most_iterations);
    // Shots that lose their plane would make any step look good.
    const bool better =
        next.lost <= system.lost && (next.cost <= system.cost || promised < kSmallPromise);
    if (better) {
      problem = std::move(trial);
      system = std::move(next);
      damping = std::max(damping / 10.0, kLeastDamping);
    } else {
      damping = std::max(damping * 100.0, 1e-6);
      if (damping > kMostDamping) break;
    }
  }
  const Index free = at.free(), n = at.size();
  Eigen::MatrixXd covariance, shift, normal;
  bool positive = false;
  if (shaped) {
    solution.converged = take_shape_steps(problem, at, places, options, system, solution, progress);
    positive = solution.shape.positive;
    covariance = solution.shape.covariance;
    shift = solution.shape.response;
    normal = positive ? solution.shape.normal : system.hessian;
  } else {
    const algebra::SymmetricSolver solver(system.hessian, kLeastDamping);
    positive = solver.positive();
    normal = system.hessian;
    if (positive) {
      covariance = solver.inverse();
      shift = -algebra::product(covariance, system.considered);
    }
  }
  for (std::size_t view = 0; view < problem.views.size(); ++view) {
    if (system.view_shots[view] == 0) {
      throw EstimationError(fmt::format("no shot meets the plane of wall {}",
                                        problem.walls[problem.views[view].wall].name));
    }
  }
  if (!positive) {
    solution.converged = false;
    covariance = Eigen::MatrixXd::Constant(n, n, std::numeric_limits<double>::infinity());
    shift = Eigen::MatrixXd::Zero(n, considered_size(problem));
  }
  solution.cost = system.cost;
  solution.shots = system.shots;
  solution.lost = system.lost;
  solution.chi2 = shaped && positive ? system.view_scatter : system.view_cost;
  for (std::size_t view = 0; view < problem.views.size(); ++view) {
    const auto shots = static_cast<double>(system.view_shots[view]);
    double taken = shots;
    if (positive && shaped) {
      taken = static_cast<double>(used_cells(problem.views[view]));
    } else if (positive) {
      taken = covariance.cwiseProduct(system.view_hessian[view]).sum();
    }
    solution.redundancy.push_back(shots - taken);
  }
  normal.topLeftCorner(free, free) -= prior_information(problem);
  solution.information = eliminated(normal, free);
  solution.noise_covariance = covariance.topLeftCorner(free, free);
  // Errors of the considered quantities shift the solution by -N^-1 J^T W K.
  const auto believed = static_cast<Index>(problem.considered.size());
  solution.considered = response_of(shift.leftCols(believed), at);
  Eigen::MatrixXd of_considered = Eigen::MatrixXd::Zero(n, n);
  if (considered_size(problem) > 0 && positive) {
    of_considered = algebra::propagated(shift, considered_covariance(problem));
  }
  const auto test = [&](const std::string& name, bool station, const Eigen::VectorXd& misfit,
                        double sigma, Index first) {
    const Index size = misfit.size();
    solution.prior_tests.push_back(test_of(name, station, misfit, sigma,
                                           covariance.block(first, first, size, size),
                                           of_considered.block(first, first, size, size)));
  };
  for (std::size_t w = 0; w < problem.walls.size() && positive; ++w) {
    const Wall& wall = problem.walls[w];
    if (wall.normal_sigma > 0) {
      test(wall.name, false, misfit_of(wall), wall.normal_sigma, at.normal(w));
    }
  }
  for (std::size_t s = 0; s < problem.stations.size() && positive; ++s) {
    const StationPose& station = problem.stations[s];
    if (at.rotation(s) >= 0 && std::isfinite(station.sigma)) {
      test(station.name, true, misfit_of(station), station.sigma, at.rotation(s));
    }
  }
  covariance += of_considered;
  solution.covariance = covariance.topLeftCorner(free, free);
  fill_numbers(problem, at, covariance, solution);
  const auto sigma = [&](Index i) { return i < 0 ? 0.0 : std::sqrt(covariance(i, i)); };
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    solution.distance_sigma.push_back(sigma(at.distance(v)));
  }
  for (std::size_t w = 0; w < problem.walls.size(); ++w) {
    const Index unknown = at.normal(w);
    solution.normal_sigma.push_back(unknown < 0 ? 0.0
                                                : std::hypot(sigma(unknown), sigma(unknown + 1)));
  }
  solution.parameters = estimation::free_values(problem.train, problem.free);
  solution.problem = std::move(problem);
  return solution;
}

Index PlanarSolution::number(std::string_view name) const {
  const auto found = std::find(numbers.begin(), numbers.end(), name);
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
    require_length(what, static_cast<std::size_t>(found), static_cast<std::size_t>(expected));
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
  const System system =
      build_system(solved, held, at, places, set, shaped ? WallCells::summed : WallCells::left_out);
  if (shaped) {
    const ShapeSolution solution = solve_with_shape(shape_problem(system), solved.shape);
    if (!solution.positive) throw EstimationError("the walls do not determine all parameters");
    return response_of(solution.response.rightCols(held.count()), at);
  }
  const algebra::SymmetricSolver solver(system.hessian);
  if (!solver.positive()) throw EstimationError("the walls do not determine all parameters");
  return response_of(-solver.solve_columns(system.considered.rightCols(held.count()).eval()), at);
}

}  // namespace risley::calibration
