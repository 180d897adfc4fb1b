// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include <Eigen/Core>

#include "risley/algebra/named_covariance.hpp"

namespace risley::trajectories {

/// A stated number with its uncertainty and source.
struct StatedValue {
  double value = 0, sigma = 0;  ///< in SI units
  std::string source;
};

/// Mounting of a sensor on a moving body. A point at p in the sensor's frame is at
///
///     position + R (lever_arm + nominal * boresight * p)
///
/// where position and R (frame from body) are the trajectory's at the time
/// recording's clock + clock_offset.
struct Mount {
  std::string name;             ///< of the platform or the flight; may be empty
  std::string reference_point;  ///< in words: the point of the body that the trajectory refers to
  /// Rotation [3, 3] from the sensor's axes (X along its optical axis, Y to the left, Z up) to the
  /// body's (x forward, y right, z down), as designed.
  Eigen::Matrix3d nominal = Eigen::Matrix3d::Identity();
  std::string nominal_source;
  /// Correction of the real rotation: a rotation vector along the axes of the sensor, rad.
  std::array<StatedValue, 3> boresight;
  /// From the reference point to the sensor's origin, along the axes of the body, m.
  std::array<StatedValue, 3> lever_arm;
  /// Offset added to the recording's clock to get the trajectory's time, s.
  StatedValue clock_offset;
  /// Of quantities of the mount and of its sensor from a common adjustment, SI units: names are
  /// those of mount_names() and of the sensor's calibration. The diagonal is the square of the
  /// sigmas above. Empty if they are independent.
  algebra::NamedCovariance covariance;
};

/// The quantities of a mount in addition to its nominal rotation, in this order: boresight x, y, z,
/// lever arm x, y, z, clock offset. Names end in the unit used in files.
inline constexpr std::size_t kMountQuantities = 7;
/// The names of these quantities, in that order: "boresight_x_deg" and so on.
const std::array<std::string, kMountQuantities>& mount_names();

/// Their standard deviations, rad, m and s.
std::array<double, kMountQuantities> mount_sigmas(const Mount& mount);

/// Whether the mount's covariance holds these quantities of a sensor, with the given covariance:
/// both come from one adjustment. A repeated calibration counts as another one.
bool found_together(const Mount& mount, const algebra::NamedCovariance& sensor);

/// Joint covariance of quantities of a sensor, followed by those of its mount that have a sigma.
/// If they do not come from one adjustment, mount and sensor are independent.
/// @throws InvalidArgument as require_mount
algebra::NamedCovariance joint_covariance(const algebra::NamedCovariance& sensor,
                                          const Mount& mount);

/// nominal * boresight: from the sensor's axes to the body's, [3, 3].
/// @throws InvalidArgument as require_mount
Eigen::Matrix3d body_from_sensor(const Mount& mount);

/// The lever arm as a vector [3], body axes, m. @throws InvalidArgument as require_mount
Eigen::Vector3d lever_arm(const Mount& mount);

/// @throws InvalidArgument for a nominal rotation that is not a right-handed rotation, values that
/// are not finite or beyond the range of mount_text, sigmas below 0, and a covariance that is
/// invalid or does not belong to them
void require_mount(const Mount& mount);

/// Reads
///
///     risley_mount: 1
///     name: hexacopter                       # optional
///     reference_point: centre of the IMU
///     sensor_axes: {x: down, y: left, z: forward, source: drawing}
///     boresight:                             # about the sensor's axes
///       x_deg: {value: 0, sigma: 3, source: as built}
///       y_deg: ...
///       z_deg: ...
///     lever_arm:                             # body: x forward, y right, z down
///       x_m: {value: 0.1, sigma: 0.01, source: tape}
///       y_m: ...
///       z_m: ...
///     clock_offset_s: {value: 0, sigma: 0.002, source: PPS}
///     covariance: {names: [...], matrix: [...]}   # optional, see io::read_covariance
///
/// or, in place of sensor_axes, body_from_sensor: {matrix: [[0, 0, 1], [0, -1, 0], [1, 0, 0]],
/// source: drawing}. A matrix with entries rounded to four or more decimals is orthonormalised.
/// @param path  for messages only
/// @throws FileError with the line for anything else
Mount parse_mount(const std::string& text, const std::string& path);

/// parse_mount of a file. @throws FileError
Mount load_mount(const std::string& path);

/// The file of a mount; reading it gives the same bits. @throws InvalidArgument as require_mount
std::string mount_text(const Mount& mount);

}  // namespace risley::trajectories
