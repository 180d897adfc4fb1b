// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/planar_adjustment.hpp"

namespace risley::calibration {

/// Positions of the unknowns: those common to all walls in one vector, and those of a single wall
/// (its normal, and its distance from every recording that sees it) in one vector per wall.
class Unknowns {
 public:
  explicit Unknowns(const PlanarProblem& problem);

  Eigen::Index free() const { return free_; }
  /// Those that walls share.
  Eigen::Index shared() const { return shared_; }
  /// Sizes and range errors, which follow the free parameters.
  Eigen::Index numbers() const { return numbers_; }
  /// Negative if the quantity is held.
  Eigen::Index prism_size(std::size_t number) const { return size_[number]; }
  Eigen::Index range_term(std::size_t number) const { return term_[number]; }
  Eigen::Index range_offset() const { return offset_; }
  Eigen::Index rotation(std::size_t station) const { return rotation_[station]; }
  /// Of the wall's own.
  Eigen::Index own(std::size_t wall) const { return own_[wall]; }
  Eigen::Index normal(std::size_t wall) const { return normal_[wall]; }
  Eigen::Index distance(std::size_t view) const { return distance_[view]; }

 private:
  Eigen::Index free_ = 0, numbers_ = 0, offset_ = -1, shared_ = 0;
  std::vector<Eigen::Index> size_, term_, rotation_;
  std::vector<Eigen::Index> own_, normal_, distance_;
};

/// Places of the flat parameter vector by which plane_equations() differentiates.
class Places {
 public:
  Places(const PlanarProblem& problem, const HeldQuantities& held);

  const std::vector<int>& all() const { return all_; }  ///< each once
  /// Of the normal equations of a plane.
  Eigen::Index column(int place) const;

 private:
  void add(int place);
  std::vector<int> all_;
};

/// Considered quantities: believed parameters, then the mean angles of every recording. Held ones
/// have the columns after them.
Eigen::Index considered_size(const PlanarProblem& problem);
Eigen::MatrixXd considered_covariance(const PlanarProblem& problem);

/// Rows of the views of every wall [walls].
std::vector<std::vector<std::size_t>> views_of_walls(const PlanarProblem& problem);

/// Adjusted less stated normal, in the tangents of the adjusted one, rad.
Eigen::Vector2d misfit_of(const Wall& wall);
/// Adjusted after stated rotation, scene frame, rad.
Eigen::Vector3d misfit_of(const StationPose& station);

/// Information of one view on its unknowns.
struct ViewSystem {
  std::vector<Eigen::Index> at;  ///< their columns in the sums of the wall
  Eigen::MatrixXd normal;        ///< J' W J of them
  double cost = 0;
  double scatter = 0;     ///< chi2 of the scatter within cells, if they are summed
  std::size_t shots = 0;  ///< that met their plane
};

/// Sum of all normal equations and priors at one point.
struct PlanarSystem {
  ShapeProblem problem;  ///< its walls are those of the planar problem
  std::vector<ViewSystem> views;
  double cost = 0;
  std::size_t shots = 0, lost = 0;
};

/// Whether walls are summed cell by cell.
enum class WallCells { left_out, summed };

PlanarSystem build_system(const PlanarProblem& problem, const HeldQuantities& held,
                          const Unknowns& at, const Places& places, InstructionSet set,
                          WallCells cells = WallCells::left_out);

}  // namespace risley::calibration
