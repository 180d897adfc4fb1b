// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/planar_system.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "risley/algebra/products.hpp"
#include "risley/algebra/rotation_vector.hpp"

#include "calibration/eigen_vectors.hpp"

namespace risley::calibration {

using Eigen::Index;

namespace {

/// Columns of one wall's sums: its own unknowns, and then those of the whole system coupled with
/// its views.
class WallLayout {
 public:
  WallLayout(const PlanarProblem& p, const HeldQuantities& held, const Unknowns& at,
             std::size_t wall, const std::vector<std::size_t>& recordings)
      : own_(at.own(wall)), first_of_recording_(p.stations.size(), -1) {
    const auto add = [this](Index first, Index count) {
      const Index local = own_ + std::ssize(places_);
      for (Index i = 0; i < count; ++i) places_.push_back(first + i);
      return local;
    };
    add(0, at.free() + at.numbers());
    std::vector<Index> turns;
    for (const std::size_t recording : recordings) {
      const Index turn = at.rotation(recording);
      turns.push_back(turn < 0 ? -1 : add(turn, 3));
    }
    rotation_.assign(p.stations.size(), -1);
    for (std::size_t i = 0; i < recordings.size(); ++i) rotation_[recordings[i]] = turns[i];
    const Index believed = p.considered.size();
    believed_ = add(at.shared(), believed);
    if (!p.mean_angle_covariance.empty()) {
      for (const std::size_t recording : recordings) {
        first_of_recording_[recording] =
            add(at.shared() + believed + static_cast<Index>(recording) * p.train.prisms(),
                p.train.prisms());
      }
    }
    held_ = add(at.shared() + considered_size(p), held.count());
    residual_ = add(at.shared() + considered_size(p) + held.count(), 1);
  }

  const std::vector<Index>& places() const { return places_; }
  Index own() const { return own_; }
  Index size() const { return own_ + std::ssize(places_); }
  /// Of an unknown common to all walls: a parameter or a number.
  Index shared(Index unknown) const { return own_ + unknown; }
  /// Negative where it is held.
  Index rotation(std::size_t recording) const { return rotation_[recording]; }
  Index believed() const { return believed_; }
  /// Negative where nothing is considered.
  Index mean_angles(std::size_t recording) const { return first_of_recording_[recording]; }
  Index held() const { return held_; }
  Index residual() const { return residual_; }

 private:
  Index own_, believed_ = 0, held_ = 0, residual_ = 0;
  std::vector<Index> places_, rotation_, first_of_recording_;
};

/// d columns of one view's equations / d the coupled columns of its wall.
struct Chain {
  std::vector<Index> at;  ///< columns of the wall
  Eigen::MatrixXd to;     ///< [columns of the view, at]
};

/// Registers columns as they are added.
class ChainBuilder {
 public:
  explicit ChainBuilder(Index rows) : rows_(rows) {}

  /// A column of the wall. @return its place in the chain
  Index add(Index at) {
    chain_.at.push_back(at);
    return std::ssize(chain_.at) - 1;
  }
  void set(Index row, Index column, double value) { entries_.push_back({row, column, value}); }
  Chain take() {
    chain_.to = Eigen::MatrixXd::Zero(rows_, chain_.at.size());
    for (const Entry& entry : entries_) chain_.to(entry.row, entry.column) = entry.value;
    return std::move(chain_);
  }

 private:
  struct Entry {
    Index row, column;
    double value;
  };
  Index rows_;
  Chain chain_;
  std::vector<Entry> entries_;
};

Chain chain_of(const PlanarProblem& p, const HeldQuantities& held, const Unknowns& at,
               const Places& places, const WallLayout& layout, const PlaneColumns& columns,
               std::size_t view) {
  const WallView& seen = p.views[view];
  ChainBuilder chain(columns.size());
  for (Index j = 0; j < at.free(); ++j) {
    const Index own = chain.add(layout.shared(j));
    for (const int place : p.free[j].places) {
      chain.set(places.column(place), own, 1.0);
    }
  }
  const auto number = [&](Index unknown, Index row) {
    if (unknown >= 0) chain.set(row, chain.add(layout.shared(unknown)), 1.0);
  };
  for (std::size_t i = 0; i < p.sizes.size(); ++i) {
    number(at.prism_size(i), columns.prism_size(static_cast<int>(i)));
  }
  for (std::size_t i = 0; i < p.range_terms.size(); ++i) {
    number(at.range_term(i), columns.range_term(static_cast<int>(i)));
  }
  number(at.range_offset(), columns.range_offset());
  // The tangents in the sensor's frame are the rotated ones of the scene, see plane_view().
  const Wall& wall = p.walls[seen.wall];
  const auto [u1, u2] = tangents_of(wall.normal);
  if (const Index normal = at.normal(seen.wall); normal >= 0) {
    for (int i = 0; i < 2; ++i) chain.set(columns.normal(i), chain.add(normal + i), 1.0);
  }
  if (const Index turn = layout.rotation(seen.recording); turn >= 0) {
    // A station turned by rho about the scene's axes sees the normal turned back: + n x rho.
    const Eigen::Vector3d n = eigen(wall.normal);
    const Eigen::Vector3d by_turn_1 = eigen(u1).cross(n), by_turn_2 = eigen(u2).cross(n);
    for (Index i = 0; i < 3; ++i) {
      const Index own = chain.add(turn + i);
      chain.set(columns.normal(0), own, by_turn_1[i]);
      chain.set(columns.normal(1), own, by_turn_2[i]);
    }
  }
  chain.set(columns.distance(), chain.add(at.distance(view)), 1.0);
  for (Index j = 0; j < std::ssize(p.considered); ++j) {
    const Index own = chain.add(layout.believed() + j);
    for (const int place : p.considered[j].places) {
      // The sensor's other error parameters only act through the angles.
      if (is_held_material(place, p)) chain.set(places.column(place), own, 1.0);
    }
    if (p.angle_sensitivity.empty()) continue;
    for (int k = 0; k < p.train.prisms(); ++k) {
      chain.set(columns.rotation_angle(k), own, p.angle_sensitivity[seen.recording](k, j));
    }
  }
  if (const Index mine = layout.mean_angles(seen.recording); mine >= 0) {
    for (int k = 0; k < p.train.prisms(); ++k) {
      chain.set(columns.rotation_angle(k), chain.add(mine + k), 1.0);
    }
  }
  for (Index h = 0; h < held.count(); ++h) {
    const Index own = chain.add(layout.held() + h);
    for (const int place : places.all()) {
      chain.set(places.column(place), own, held.train(place, h));
    }
    for (int k = 0; k < p.train.prisms(); ++k) {
      chain.set(columns.rotation_angle(k), own, held.rotation_angles[seen.recording](k, h));
    }
  }
  return chain.take();
}

/// Adds the cells of one view to those of its wall.
/// @return chi2 of the scatter within them
double add_cells(const PlanarProblem& p, std::size_t view, const PlaneColumns& columns,
                 const PlaneEquations& equations, const Chain& chain, WallSums& sums) {
  const WallView& seen = p.views[view];
  const WallGrid& grid = sums.grid;
  const auto [u1, u2] = tangents_of(p.walls[seen.wall].normal);
  const Eigen::Vector3d& position = p.stations[seen.recording].position;
  const double stand_u = eigen(u1).dot(position), stand_v = eigen(u2).dot(position);
  const Index cells = grid.cells.size();
  // A shot's row by the wall's height, and that times its place relative to the middle of its cell:
  // u - middle = -side n1 / d + (stand - middle).
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = equations.cells;
  double within = equations.cost;
  for (Index cell = 0; cell < cells; ++cell) {
    const double off_u = stand_u - grid.middle_u(cell);
    const double off_v = stand_v - grid.middle_v(cell);
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
    sums.weight[cell] += weight;
  }
  const Eigen::MatrixXd own = algebra::product(rows.leftCols(columns.size()), chain.to);
  for (std::size_t j = 0; j < chain.at.size(); ++j) {
    sums.columns.col(chain.at[j]) += own.col(j);
  }
  sums.columns.rightCols(1) += rows.rightCols(1);
  return within;
}

/// Adds the equations of one view to those of its wall.
ViewSystem add_view(const PlanarProblem& p, std::size_t view, const PlaneColumns& columns,
                    const PlaneEquations& equations, Chain chain, WallCells cells, WallSums& sums) {
  ViewSystem own;
  if (cells == WallCells::summed && !p.views[view].cell_begin.empty()) {
    own.scatter = add_cells(p, view, columns, equations, chain, sums);
  }
  own.normal = algebra::pulled_back(chain.to, equations.hessian);
  const Eigen::VectorXd gradient = algebra::transposed_times(chain.to, equations.gradient);
  const Index residual = sums.system.cols() - 1;
  for (std::size_t j = 0; j < chain.at.size(); ++j) {
    for (std::size_t i = 0; i < chain.at.size(); ++i) {
      sums.system(chain.at[i], chain.at[j]) += own.normal(i, j);
    }
    sums.system(chain.at[j], residual) += gradient[j];
    sums.system(residual, chain.at[j]) += gradient[j];
  }
  sums.system(residual, residual) += equations.cost;
  own.cost = equations.cost;
  own.shots = equations.shots;
  own.at = std::move(chain.at);
  return own;
}

/// Adds prior knowledge of an unknown to normal equations whose residual is last.
void tie(Index unknown, double sigma, double off, Eigen::MatrixXd& system) {
  const double information = 1.0 / (sigma * sigma);
  const Index residual = system.cols() - 1;
  system(unknown, unknown) += information;
  system(unknown, residual) -= information * off;
  system(residual, unknown) -= information * off;
  system(residual, residual) += information * off * off;
}

/// Prior knowledge of the unknowns that walls share.
void add_priors(const PlanarProblem& p, const Unknowns& at, Eigen::MatrixXd& system) {
  for (std::size_t j = 0; j < p.prior_sigma.size(); ++j) {
    if (!std::isfinite(p.prior_sigma[j])) continue;
    const int place = p.free[j].places.front();
    tie(j, p.prior_sigma[j], p.train[place] - p.prior[place], system);
  }
  if (at.range_offset() >= 0) tie(at.range_offset(), p.range_offset_sigma, p.range_offset, system);
  for (std::size_t i = 0; i < p.sizes.size(); ++i) {
    if (at.prism_size(i) < 0) continue;
    tie(at.prism_size(i), p.sizes[i].sigma,
        size_value(p.geometry, p.sizes[i].size) - p.sizes[i].value, system);
  }
  for (std::size_t i = 0; i < p.range_terms.size(); ++i) {
    if (at.range_term(i) < 0) continue;
    tie(at.range_term(i), p.range_terms[i].sigma, p.range_terms[i].value - p.range_terms[i].prior,
        system);
  }
  for (std::size_t s = 0; s < p.stations.size(); ++s) {
    if (at.rotation(s) < 0 || std::isinf(p.stations[s].sigma)) continue;
    const Eigen::Vector3d off = misfit_of(p.stations[s]);
    for (Index i = 0; i < 3; ++i) tie(at.rotation(s) + i, p.stations[s].sigma, off[i], system);
  }
}

}  // namespace

Unknowns::Unknowns(const PlanarProblem& p)
    : free_(p.free.size()),
      rotation_(p.stations.size(), -1),
      own_(p.walls.size(), 0),
      normal_(p.walls.size(), -1),
      distance_(p.views.size(), -1) {
  Index next = free_;
  for (const SizePrior& size : p.sizes) size_.push_back(size.sigma > 0 ? next++ : -1);
  for (const RangeTerm& term : p.range_terms) term_.push_back(term.sigma > 0 ? next++ : -1);
  if (p.range_offset_sigma > 0) offset_ = next++;
  numbers_ = next - free_;
  for (std::size_t s = 0; s < p.stations.size(); ++s) {
    if (!p.stations_known || p.stations[s].sigma == 0.0) continue;
    rotation_[s] = next;
    next += 3;
  }
  shared_ = next;
  for (std::size_t w = 0; w < p.walls.size(); ++w) {
    if (p.walls[w].normal_sigma == 0.0) continue;
    normal_[w] = 0;
    own_[w] = 2;
  }
  for (std::size_t v = 0; v < p.views.size(); ++v) distance_[v] = own_[p.views[v].wall]++;
}

Places::Places(const PlanarProblem& p, const HeldQuantities& held) {
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

Index Places::column(int place) const { return std::ranges::find(all_, place) - all_.begin(); }

void Places::add(int place) {
  if (std::ranges::find(all_, place) == all_.end()) all_.push_back(place);
}

Index considered_size(const PlanarProblem& p) {
  return std::ssize(p.considered) + std::ssize(p.mean_angle_covariance) * p.train.prisms();
}

Eigen::MatrixXd considered_covariance(const PlanarProblem& p) {
  const Index size = considered_size(p);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  Index at = std::ssize(p.considered);
  if (at > 0) covariance.topLeftCorner(at, at) = p.considered_covariance;
  for (const Eigen::MatrixXd& own : p.mean_angle_covariance) {
    covariance.block(at, at, own.rows(), own.cols()) = own;
    at += own.rows();
  }
  return covariance;
}

std::vector<std::vector<std::size_t>> views_of_walls(const PlanarProblem& p) {
  std::vector<std::vector<std::size_t>> views(p.walls.size());
  for (std::size_t v = 0; v < p.views.size(); ++v) views[p.views[v].wall].push_back(v);
  return views;
}

Eigen::Vector2d misfit_of(const Wall& wall) {
  const auto [u1, u2] = tangents_of(wall.normal);
  const Vector3<double> difference = wall.normal - wall.stated;
  return {dot(u1, difference), dot(u2, difference)};
}

Eigen::Vector3d misfit_of(const StationPose& station) {
  return algebra::rotation_vector(station.scene_from_sensor * station.stated.transpose());
}

PlanarSystem build_system(const PlanarProblem& p, const HeldQuantities& held, const Unknowns& at,
                          const Places& places, InstructionSet set, WallCells cells) {
  PlanarSystem system;
  system.views.resize(p.views.size());
  ShapeProblem& problem = system.problem;
  problem.unknowns = at.shared();
  const Index size = at.shared() + considered_size(p) + held.count() + 1;
  problem.system = Eigen::MatrixXd::Zero(size, size);
  add_priors(p, at, problem.system);
  system.cost = problem.system(size - 1, size - 1);
  const std::vector<std::vector<std::size_t>> views = views_of_walls(p);
  for (std::size_t w = 0; w < p.walls.size(); ++w) {
    std::vector<std::size_t> recordings;
    for (const std::size_t view : views[w]) recordings.push_back(p.views[view].recording);
    std::ranges::sort(recordings);
    recordings.erase(std::unique(recordings.begin(), recordings.end()), recordings.end());
    const WallLayout layout(p, held, at, w, recordings);
    WallSums& sums = problem.walls.emplace_back();
    sums.own = layout.own();
    sums.places = layout.places();
    sums.system = Eigen::MatrixXd::Zero(layout.size(), layout.size());
    if (cells == WallCells::summed && !p.walls[w].grid.empty()) {
      sums.grid = p.walls[w].grid;
      sums.weight.assign(sums.grid.cells.size(), Eigen::Matrix3d::Zero());
      sums.columns.setZero(3 * std::ssize(sums.grid.cells), layout.size());
    }
    for (const std::size_t view : views[w]) {
      PlaneView plane = plane_view(p, view);
      plane.places = places.all();
      if (cells == WallCells::summed) plane.cell_begin = p.views[view].cell_begin;
      const PlaneColumns columns(plane);
      const PlaneEquations equations = plane_equations(*p.views[view].shots, plane, {}, set);
      system.views[view] =
          add_view(p, view, columns, equations,
                   chain_of(p, held, at, places, layout, columns, view), cells, sums);
      system.shots += equations.shots;
      system.lost += equations.lost;
    }
    if (p.walls[w].normal_sigma > 0) {
      const Eigen::Vector2d off = misfit_of(p.walls[w]);
      for (Index i = 0; i < 2; ++i) {
        tie(at.normal(w) + i, p.walls[w].normal_sigma, off[i], sums.system);
      }
    }
    system.cost += sums.system(layout.residual(), layout.residual());
  }
  return system;
}

}  // namespace risley::calibration
