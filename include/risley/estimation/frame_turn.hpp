// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"

namespace risley::estimation {

/// Orientation of the frame of a recording relative to the sensor's: p_recording = Rz(yaw)
/// Ry(pitch) p_sensor, rad. The calibration of a hub or a vehicle turns clouds this way. The
/// sensor's optical axis then points to azimuth yaw and elevation -pitch. Directions alone cannot
/// distinguish a roll about that axis from other zeros of all rotation angles; it is taken as 0.
///
/// Of a sensor whose axis of rotation is its Z, yaw and pitch are about Z and Y of the train's
/// frame, which are the sensor's Y and X, and the axis is Z.
struct FrameTurn {
  double yaw = 0, pitch = 0;
  bool axis_up = false;  ///< of the sensor
};

/// Names of the turns of a FrameTurn, "yaw" and "pitch" or "pitch" and "roll": by the axes of the
/// sensor's frame, yaw about Z, pitch about Y, roll about X.
std::array<std::string, 2> turn_names(bool axis_up);

/// The axes of the train's frame, in which X is the axis of rotation, in the sensor's.
Eigen::Matrix3d sensor_from_train(bool axis_up);

/// Rotation that takes vectors of the sensor's frame to the recording's.
Eigen::Matrix3d recording_from_sensor(const FrameTurn& turn);

/// The rotation with the same axis as a rotation that may include a roll about it.
FrameTurn turn_of(const Eigen::Matrix3d& recording_from_sensor, bool axis_up);

/// A rotation followed by small turns as in a FrameTurn, without the resulting roll.
/// @param step  yaw and pitch, rad
Eigen::Matrix3d turned_further(const Eigen::Matrix3d& recording_from_sensor,
                               const Eigen::Vector2d& step, bool axis_up);

/// Turns all directions: v := rotation v. Rounding variances go along.
void turn(AngleSeries& series, const Eigen::Matrix3d& rotation);

/// A found turn with its covariance.
struct FrameEstimate {
  FrameTurn turn;
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< of yaw and pitch, rad^2
};

/// The last free parameters when the frame's turn is estimated too.
/// @param prior_sigma  of each, rad
std::vector<FreeParameter> frame_parameters(const TrainLayout& layout, double prior_sigma);

/// Drops the free parameters that a free turn of the frame replaces: a lean of the last axis, which
/// has the same effect.
void hold_last_bearing(const TrainLayout& layout, std::vector<FreeParameter>& free);

}  // namespace risley::estimation
