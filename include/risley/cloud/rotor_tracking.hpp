// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/batch_map.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/recordings/observations.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::cloud {

/// Properties of the sensor determined from its recording.
struct SensorBelief {
  sensors::Sensor sensor;  ///< with the parameters that its reported directions are computed with
  std::vector<estimation::FreeParameter> free;
  Eigen::MatrixXd covariance;         ///< of the free parameters, SI [free, free]
  Eigen::MatrixXd angle_sensitivity;  ///< [prisms, free], see estimation::CommonAngleErrors
  std::vector<estimation::RotorProcess> rotor_process;
  estimation::Start start;
  double angle_noise = 0;  ///< rad
  /// Mean square of the residuals over their stated variance, not below 1.
  double residual_variance_factor = 1;
  bool mirrored = false;  ///< the recording's elevation has the other sign
  std::vector<Warning> warnings;
};

/// Determined from the beginning of a recording.
/// @param calibration  start values, and which parameters are free
/// @param angle_noise  rad; empty: the calibration's
/// @throws EstimationError naming yaw and pitch when shots lie outside the sensor's field of view,
///         as points would be put together from two frames, and when its directions do not fit the
///         calibration's sensor; InvalidArgument for angle noise that is not above 0
SensorBelief sensor_belief(const estimation::AngleSeries& beginning,
                           const estimation::AngleSeries& head, const sensors::Sensor& calibration,
                           std::optional<double> angle_noise, const Progress& progress = {});

/// Rotation angles of a long recording piece by piece, with parameters held at the belief's.
class RotorTracker {
 public:
  /// @param rate  directions per second that the angles are found from; empty: all
  /// @throws InvalidArgument for a rate or angle noise that is not above 0, or process noise of
  ///         another number of rotors
  RotorTracker(const SensorBelief& belief, std::optional<double> rate);

  /// Finds the motion over a piece of a recording that overlaps the piece before.
  /// @param rows  directions as the belief has them (turned when mirrored)
  /// @throws EstimationError if none can be found
  void track(const recordings::Observations& rows);

  /// Rotation angles and their covariance at given parameters, of rows of the last piece in
  /// ascending order; NaN where they are not known.
  /// @param[out] angle, covariance  [prisms], [prisms (prisms + 1) / 2], of so many rows
  /// @throws InvalidArgument for columns of other lengths, or rows beyond the piece
  void angles(const recordings::Observations& piece, std::span<const std::size_t> rows,
              std::vector<std::vector<double>>& angle,
              std::vector<std::vector<double>>& covariance) const;

 private:
  estimation::Start start_of(const estimation::AngleSeries& series,
                             const estimation::AngleSeries& head) const;

  /// Distance from a knot within which its parabola is trusted, s.
  double reach() const;

  const SensorBelief& belief_;
  std::optional<double> rate_;
  double knot_interval_;  ///< s
  estimation::Solution solution_;
  std::vector<std::size_t> first_row_;  ///< of the piece, of each knot's first shot
};

}  // namespace risley::cloud
