// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/plane_points.hpp"
#include "risley/core/plane.hpp"
#include "risley/optics/batch.hpp"

namespace risley::calibration {

/// The quantities that predict the range of every shot: the sensor's optics and one plane.
struct PlaneView {
  PrismTrain train;
  PrismGeometry geometry;
  std::vector<int> places;       ///< of the flat parameter vector: those to differentiate by
  std::vector<PrismSize> sizes;  ///< of the prisms: those to differentiate by
  double range_offset = 0;       ///< offset added to a true range, m
  /// Of the further errors, with every shot's share in RangedShots::range_terms [terms].
  std::vector<double> range_terms;
  double range_variance = 0;             ///< of one range, rounding included, m^2
  Plane plane;                           ///< sensor frame
  Vector3<double> tangent_1, tangent_2;  ///< unit vectors that make an orthogonal triad with normal
  /// First shot of every cell and the end of the last [cells + 1], if shots are sorted by cells and
  /// must be summed by cells, too; empty: not.
  std::span<const std::uint32_t> cell_begin;
};

/// Columns of the normal equations of one plane.
///   0 .. places-1    parameters of the train, in the order of PlaneView::places
///   + rotor          rotation angle of that rotor, the same shift at every shot
///   + prisms         sizes of the prisms, m, in the order of PlaneView::sizes
///   + sizes          terms of the range errors, in the order of PlaneView::range_terms
///   + terms          range offset
///   + 1, 2           normal towards tangent 1 and 2, rad
///   + 3              distance of the plane
struct PlaneColumns {
  int places = 0, prisms = 0, sizes = 0, terms = 0;

  explicit PlaneColumns(const PlaneView& view)
      : places(static_cast<int>(view.places.size())),
        prisms(view.train.prisms()),
        sizes(static_cast<int>(view.sizes.size())),
        terms(static_cast<int>(view.range_terms.size())) {}

  int rotation_angle(int rotor) const { return places + rotor; }         ///< a shift at all shots
  int prism_size(int number) const { return places + prisms + number; }  ///< m
  /// Factor of its term: m, or for the incidence without a unit.
  int range_term(int number) const { return places + prisms + sizes + number; }
  int range_offset() const { return range_term(terms); }  ///< of the sensor, m
  /// Towards tangent 1, which has the number 0, or tangent 2.
  int normal(int tangent) const { return range_offset() + 1 + tangent; }
  int distance() const { return range_offset() + 3; }  ///< of the plane, m
  int size() const { return range_offset() + 4; }
};

/// Sums over the shots of one plane.
struct PlaneEquations {
  Eigen::MatrixXd hessian;   ///< [columns, columns], J^T W J
  Eigen::VectorXd gradient;  ///< [columns], J^T W residual
  /// Rows distance, normal 1 and normal 2 of J^T W [J, residual], summed separately for every cell
  /// [3 cells, columns + 1]; empty without cells.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> cells;
  double cost = 0;        ///< sum of squared residuals over their variances
  std::size_t shots = 0;  ///< that were used
  std::size_t lost = 0;   ///< whose beam does not meet the plane in front of the sensor
};

/// Residuals of single shots; empty spans are not written. A lost shot is NaN.
struct ResidualColumns {
  std::span<double> residual;  ///< measured minus predicted range, m
  std::span<double> variance;  ///< of the residual, m^2
};

/// Residual and derivatives of every shot, summed. The residual of a shot is its range less the one
/// predicted from plane, optics and rotation angles,
///   r = (d - n.o) / (n.L)
/// with beam origin o and direction L, so the derivatives hold the predicted range. (Eq. 32's
/// point-to-plane distances contain the measured one, whose noise then biases the solution.) The
/// variance of a residual is that of the range plus the contribution of the rotation angles'
/// covariance, which grows with the angle of incidence: the Gauss-Helmert model with the condition
/// solved for the range. The derivative of the beam's origin is left out: a few thousandths of the
/// rest, and the residuals themselves are exact. docs/theory/calibration.md The sums do not depend
/// on the number of threads.
/// @param set  instruction set, for tests and benchmarks
/// @throws InvalidArgument for columns of other lengths, places or emitters that the train does not
/// have, non-finite numbers, and as check_available()
PlaneEquations plane_equations(const RangedShots& shots, const PlaneView& view,
                               const ResidualColumns& columns = {},
                               InstructionSet set = best_instruction_set());

}  // namespace risley::calibration
