// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>

#include "risley/core/vector3.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings {

/// Pose of a sensor in the frame of a hub or a vehicle, as in LVX: p_recorded = R p_sensor + t with
/// R = Rz(yaw) Ry(pitch) Rx(roll), each by the right-hand rule.
struct Extrinsics {
  double yaw = 0, pitch = 0, roll = 0;  ///< rad
  Vector3<double> translation;          ///< t, m
};

/// Whether the frame is the sensor's own.
bool is_identity(const Extrinsics& pose);

/// X, Y and Z of the sensor as unit vectors of the frame it is posed in: the columns of R.
/// @throws InvalidArgument for an angle that is not finite
std::array<Vector3<double>, 3> sensor_axes(const Extrinsics& pose);

/// The pose of a sensor in a recording's header; empty when all its numbers are 0, or when one is
/// not finite. It does not show whether the recorded points were moved by it.
std::optional<Extrinsics> stored_extrinsics(const Device& device);

}  // namespace risley::recordings
