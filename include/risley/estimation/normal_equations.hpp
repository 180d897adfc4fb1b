// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/angle_noise.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/packed_series.hpp"
#include "risley/estimation/rotor_trajectory.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley::estimation {

/// The weight of a shot. chi2 is the sum of its squared residuals over their variances.
struct ShotWeights {
  AngleNoise angle_noise;
  /// Geman-McClure: a shot weighs 1 / (1 + softening chi2)^2. 0 is least squares.
  double softening = 0;
  double cut = std::numeric_limits<double>::infinity();  ///< shots with more chi2 are outliers
};

/// Softening for residuals whose scale is this multiple of the stated noise: a shot at four of
/// these sigmas has a weight of a quarter.
constexpr double softening_at(double level) { return 1.0 / (16.0 * level * level); }

/// Destination of residuals (observed minus modelled, rad) and outlier flags of all shots; empty
/// spans are not written, and rows of shots without a knot are left unchanged.
struct ShotColumns {
  std::span<double> azimuth_residual, zenith_residual;
  std::span<unsigned char> outlier;
};

/// The normal equations of all shots at one linearisation, in the form for the smoother: rotor
/// states knot by knot, their coupling with the free parameters, and the parameters' own part.
struct NormalEquations {
  int prisms = 0;
  int free = 0;
  std::vector<double> curvature;   ///< [knots][prisms (prisms+1)/2][5] sums of products x time^0..4
  std::vector<double> coupling;    ///< [knots][prisms][3][free]
  std::vector<double> gradient;    ///< [knots][prisms][3]
  Eigen::MatrixXd static_hessian;  ///< [free, free]
  Eigen::VectorXd static_gradient;  ///< [free]
  double cost = 0;                  ///< sum of the shots' losses
  std::size_t shots = 0, outliers = 0;

  /// Number of knots; 0 without prisms.
  std::size_t knots() const {
    return prisms < 1 ? 0 : gradient.size() / static_cast<std::size_t>(3 * prisms);
  }

  /// Multiplies all information: 1/f means that every variance is f times as large.
  /// @throws InvalidArgument for a factor not above 0
  void scale(double factor);
};

/// Evaluates every shot of the knots and its derivatives with the batch model and sums them. The
/// sums do not depend on the number of threads.
/// @param train  linearisation point of the parameters
/// @param knots  linearisation point of the rotors
/// @param set    instruction set, for tests and benchmarks
/// @param[out] equations  keeps its memory between calls
/// @throws InvalidArgument for columns of other lengths, knots beyond the series or of another
/// train, free parameters beyond the flat vector, invalid noise, and as check_beams() and
/// check_available()
void accumulate(const AngleSeries& series, const RotorTrajectory& knots, const PrismTrain& train,
                const std::vector<FreeParameter>& free, const ShotWeights& weights,
                NormalEquations& equations, const ShotColumns& columns = {},
                InstructionSet set = best_instruction_set());

/// Shots that were evaluated together.
struct EvaluatedShots {
  const AngleSeries& shots;
  std::size_t first = 0;  ///< row of the series of the first of them
  std::span<const double> azimuth_residual, zenith_residual;  ///< rad; NaN without a knot
  std::span<const unsigned char> outlier;                     ///< not 0 also without a knot
};

/// Callbacks for the shots of a packed series while they are unpacked; either may be empty. Both
/// are called from several threads, for one block of shots at a time.
struct ShotLooks {
  /// Changes rows before they are evaluated.
  std::function<void(AngleSeries& rows)> prepare;
  /// Receives the results; the function that it returns is called by one thread at a time, in the
  /// order of the shots.
  std::function<std::function<void()>(const EvaluatedShots& shots)> look;
};

/// The same for a packed series, which is unpacked block by block.
/// @throws as above, for beams of all rows
void accumulate(const PackedSeries& series, const RotorTrajectory& knots, const PrismTrain& train,
                const std::vector<FreeParameter>& free, const ShotWeights& weights,
                NormalEquations& equations, const ShotLooks& looks = {});

}  // namespace risley::estimation
