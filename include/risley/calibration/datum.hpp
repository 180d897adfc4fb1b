// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "risley/core/vector3.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley::calibration {

/// Errors of directions, split into the rotation common to all beams (the gauge, which only an
/// external datum can determine) and the rest (the shape of the beam bundle, which walls reveal).
struct DirectionErrors {
  double azimuth_rmse = 0, zenith_rmse = 0;  ///< rad
  double azimuth_bias = 0, zenith_bias = 0;  ///< mean, rad
  double total = 0;                          ///< sqrt(azimuth_rmse^2 + zenith_rmse^2), rad
  double gauge = 0;          ///< RMS over the beams of the best-fitting rigid rotation, rad
  double shape = 0;          ///< RMS of the remainder, rad
  Vector3<double> rotation;  ///< the best-fitting one: roll, pitch, yaw about X, Y, Z, rad
};

/// @param computed, truth  unit vectors of the same beams; pairs with a NaN are skipped
DirectionErrors direction_errors(std::span<const Vector3<double>> computed,
                                 std::span<const Vector3<double>> truth);

/// Effect of a parameter covariance on the beams. A shot's own rotation angles add their noise to
/// its direction; it is not included here.
struct FormalDatum {
  double sigma_roll = 0, sigma_pitch = 0, sigma_yaw = 0;  ///< of the shared rotation, rad
  double gauge = 0, shape = 0, total = 0;                 ///< expected RMS over the beams, rad
};

/// Effect of independent held quantities on the beams, each for an error of one sigma: on the
/// train, its free parameters included, on the rotation angles, and on all beams together.
struct HeldMovement {
  Eigen::MatrixXd train;            ///< flat vector [places, held], SI
  Eigen::MatrixXd rotation_angles;  ///< [prisms, held], rad
  Eigen::MatrixXd turn;  ///< rotation of the bundle about X, Y, Z [3, held], rad; empty: none
};

/// Errors of the reported directions according to a calibration.
struct PointingError {
  DirectionErrors errors;  ///< reported minus calibrated
  /// Of errors.total, gauge and shape, to first order in the covariance of the calibration, rad.
  double total_sigma = 0, gauge_sigma = 0, shape_sigma = 0;
  double total_sigma_given_held = 0;  ///< as if held values were exact, rad
  /// Of the beam with the largest, without the rotation common to all, rad.
  double worst_shape = 0, worst_shape_sigma = 0;
};

/// Whether errors of held quantities are included.
enum class HeldErrors { included, left_out };

/// Beams that get through a train, and the derivatives of their directions with respect to free
/// parameters and held quantities.
class BeamBundle {
 public:
  /// @param rotation_angles  [prisms][beams], rad
  /// @param emitter          of every beam, from 0; empty: all the first
  /// @param held             without columns: nothing was
  /// @throws InvalidArgument if lengths do not match or no beam passes the prisms
  BeamBundle(const PrismTrain& train, const std::vector<estimation::FreeParameter>& free,
             const std::vector<std::vector<double>>& rotation_angles,
             std::span<const std::uint8_t> emitter = {}, const HeldMovement& held = {});

  /// Effect of a covariance on the beams.
  /// @param covariance  of the free parameters [free, free], SI
  FormalDatum formal_datum(const Eigen::MatrixXd& covariance,
                           HeldErrors held = HeldErrors::included) const;

  /// @param believed  with which the sensor computes directions
  /// @param covariance  of the free parameters [free, free], SI
  /// @throws InvalidArgument as direction_errors()
  PointingError pointing_error(const PrismTrain& believed, const Eigen::MatrixXd& covariance) const;

 private:
  struct Beam {
    std::vector<double> rotation_angles;  ///< [prisms]
    std::uint8_t emitter = 0;
    Eigen::Vector3d direction;
    Eigen::Matrix<double, 3, Eigen::Dynamic> jacobian;   ///< of the direction [3, free + held]
    Eigen::Matrix<double, 2, Eigen::Dynamic> of_angles;  ///< of azimuth and zenith [2, free + held]
  };

  template <TrainLayout N>
  void add_beams(const PrismTrain& train, const std::vector<estimation::FreeParameter>& free,
                 const std::vector<std::vector<double>>& rotation_angles,
                 std::span<const std::uint8_t> emitter, const HeldMovement& held);
  Eigen::MatrixXd covariance_of_all(const Eigen::MatrixXd& covariance, HeldErrors held) const;
  Eigen::MatrixXd rest(const Beam& beam) const;
  double count() const { return static_cast<double>(beams_.size()); }

  int prisms_ = 0, emitters_ = 0;
  Eigen::Index free_ = 0, held_ = 0;  ///< quantities
  std::vector<Beam> beams_;
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd turn_;  ///< the shared rotation due to each quantity [3, free + held]
};

/// Probability that the calibration's directions are nearer to the truth than the reported ones, if
/// held values are exact. Where these differ by d, the calibration is worse when its own error
/// along d is below -d / 2.
double better_probability(const PointingError& error);

/// Probability that a root mean square error exceeds the tolerance.
/// @param error, sigma, tolerance  rad
double beyond_probability(double error, double sigma, double tolerance);

/// The external reference of the calibrated beams' frame.
enum class DatumKind {
  none,      ///< walls of unknown orientation: boresight only through the bundle's shape
  planes,    ///< normals of walls known in the sensor's frame
  stations,  ///< rotations of the sensor between recordings known
  both,
};

/// @param planes, stations  whether such statements tie the frame
DatumKind datum_kind(bool planes, bool stations);

/// "walls only", "known planes", "known stations", "known planes and stations".
const char* to_string(DatumKind kind);

}  // namespace risley::calibration
