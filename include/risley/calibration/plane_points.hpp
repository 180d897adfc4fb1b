// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/core/columns.hpp"
#include "risley/core/vector3.hpp"
#include "risley/estimation/estimate.hpp"

namespace risley::calibration {

/// Shots with a range, as columns of one length: the input of a calibration. A shot is a range and
/// the rotation angles at which it was measured; the reported direction is not used further, so
/// that the sensor's own calibration cannot bend the new one.
struct RangedShots {
  std::vector<std::vector<double>> rotation_angle;  ///< [prisms][shots], rad, within half a turn
  /// Covariance of the rotation angles, upper triangle row by row [prisms (prisms+1)/2][shots],
  /// rad^2.
  std::vector<std::vector<float>> angle_covariance;
  std::vector<double> range;            ///< m, as measured
  std::vector<std::uint8_t> beam;       ///< emitter that fired, from 0; empty: all the first
  std::vector<std::uint8_t> intensity;  ///< as reported; empty: not known
  /// d range / d range error [terms][shots], see range_term_names(); empty: none is used.
  std::vector<std::vector<float>> range_terms;

  std::size_t size() const { return range.size(); }
  /// Number of columns of rotation angles.
  int prisms() const { return static_cast<int>(rotation_angle.size()); }
  /// @throws InvalidArgument for an unsupported number of prisms
  void resize(int prisms, std::size_t shots);
};

/// All columns.
inline constexpr ColumnPlace<RangedShots, std::vector<double>, std::vector<std::uint8_t>,
                             std::vector<std::vector<double>>, std::vector<std::vector<float>>>
    kRangedShotColumns[] = {&RangedShots::rotation_angle, &RangedShots::angle_covariance,
                            &RangedShots::range_terms,    &RangedShots::range,
                            &RangedShots::beam,           &RangedShots::intensity};

/// As many columns for another number of shots.
RangedShots columns_like(const RangedShots& shots, std::size_t size);

/// Some shots by their rows. @throws InvalidArgument for a row that does not exist
RangedShots rows_of(const RangedShots& shots, const std::vector<std::size_t>& rows);

/// One recording, prepared for a calibration.
struct RangedRecording {
  std::string name;    ///< for messages: its file
  std::string serial;  ///< of the sensor, empty when unknown
  RangedShots shots;
  std::vector<std::int64_t> time_ns;  ///< [shots]
  sensors::Sensor believed;  ///< as estimated: those with which the sensor computes its directions
  /// Information of the estimate on the believed parameters.
  std::vector<estimation::FreeParameter> free;
  Eigen::MatrixXd covariance;             ///< [free, free], SI units
  Eigen::MatrixXd angle_sensitivity;      ///< [prisms, free], see CommonAngleErrors
  Eigen::MatrixXd mean_angle_covariance;  ///< [prisms, prisms], rad^2, at given parameters
  /// Effect of possible errors of the parameters held in the estimate; empty: nothing.
  estimation::HeldChanges held_changes;
  bool unit_assumed = false;      ///< the file does not state the unit of the ranges
  std::size_t without_range = 0;  ///< shots with a direction but no range
  std::size_t outliers = 0;       ///< shots whose reported direction was an outlier
};

/// Selects the shots of an estimate with a range and a valid direction.
/// @param estimate  converged (or with its noise overstated: angles of a recording without noise
/// are
///                  good enough), by the batch estimator, of a series with ranges
/// @throws EstimationError when it did not converge or has no ranges, InvalidArgument for emitters
///         of another number of shots
RangedRecording ranged_recording(const estimation::Estimate& estimate, std::string name,
                                 std::string serial);

/// At most this many shots, evenly spread. @return their rows
std::vector<std::size_t> spread_rows(std::size_t shots, std::size_t most);

}  // namespace risley::calibration
