// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/extrinsics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "recordings/reader_decorators.hpp"

namespace risley::recordings {
namespace {

void require_turn(const Extrinsics& pose) {
  require_finite("extrinsics.yaw", pose.yaw, "rad");
  require_finite("extrinsics.pitch", pose.pitch, "rad");
  require_finite("extrinsics.roll", pose.roll, "rad");
}

void require_pose(const Extrinsics& pose) {
  require_turn(pose);
  require_finite("extrinsics.translation.x", pose.translation.x, "m");
  require_finite("extrinsics.translation.y", pose.translation.y, "m");
  require_finite("extrinsics.translation.z", pose.translation.z, "m");
}

class SensorFrameReader final : public DecoratingReader {
 public:
  SensorFrameReader(std::unique_ptr<Reader> inner, const Extrinsics& pose)
      : DecoratingReader(std::move(inner)),
        axes_(sensor_axes(pose)),
        translation_(pose.translation),
        moves_(norm(pose.translation) > 0.0) {
    take_over();
  }

 private:
  void describe() override {
    if (header_.devices.size() > 1) {
      throw InvalidArgument(
          fmt::format("ReadOptions::extrinsics is given for a recording of {} sensors, allowed for "
                      "one: a pose belongs to one sensor",
                      header_.devices.size()));
    }
    for (Device& device : header_.devices) {
      device.extrinsic_enabled = false;
      device.roll_pitch_yaw_deg = device.translation_m = {};
    }
    if (not_moved_ == 0) return;
    warn(kWarning.pose_unused,
         "{} directions without a range were turned into the sensor's frame but not moved: the "
         "translation of {:.6g} {:.6g} {:.6g} m was not applied",
         not_moved_, translation_.x, translation_.y, translation_.z);
  }

  std::optional<FileError> change(Chunk& chunk) override {
    chunk.packets.clear();
    Observations& rows = chunk.observations;
    for (std::size_t row = 0; row < rows.size(); ++row) turn_back(rows, row);
    return std::nullopt;
  }

  void turn_back(Observations& rows, std::size_t row) {
    if (!std::isfinite(rows.azimuth[row]) || !std::isfinite(rows.zenith[row])) return;
    const auto beam = direction_from_angles<double>({rows.azimuth[row], rows.zenith[row]});
    const double sine = std::sin(rows.zenith[row]);
    const double range = rows.range[row];
    const bool has_point = range > 0.0 && std::isfinite(range);
    if (moves_ && std::isnan(range) && rows.valid[row] != 0) ++not_moved_;
    // Width of the rounding across and along the beam as recorded: rad, or m with a point.
    const double step = std::max(static_cast<double>(rows.azimuth_resolution[row]) * sine,
                                 static_cast<double>(rows.zenith_resolution[row])) *
                        (has_point ? range : 1.0);
    double across = step;
    Vector3<double> turned = beam;
    double distance = 1.0;
    if (has_point) {
      const Vector3<double> point = range * beam - translation_;
      distance = norm(point);
      const auto along = static_cast<double>(rows.range_resolution[row]);
      if (!(distance > along)) {
        make_null(rows, row);
        return;
      }
      turned = (1.0 / distance) * point;
      if (moves_) {
        const double cosine = dot(beam, turned), between = norm(cross(beam, turned));
        across = std::hypot(cosine * step, between * along);
        rows.range_resolution[row] = static_cast<float>(std::hypot(cosine * along, between * step));
      }
      rows.range[row] = distance;
    }
    const auto angles = angles_from_direction(
        Vector3<double>{dot(axes_[0], turned), dot(axes_[1], turned), dot(axes_[2], turned)});
    rows.azimuth[row] = angles.azimuth > -kPi ? angles.azimuth : kPi;
    rows.zenith[row] = angles.zenith;
    across /= distance;
    const double new_sine = std::sin(angles.zenith);
    // Close to the Z axis a step can turn the azimuth by any angle.
    rows.azimuth_resolution[row] = static_cast<float>(
        across < kTwoPi * new_sine ? across / new_sine : (across > 0.0 ? kTwoPi : 0.0));
    rows.zenith_resolution[row] = static_cast<float>(std::min(across, kPi));
  }

  /// A shot without return, whose origin was moved to the sensor's position.
  static void make_null(Observations& rows, std::size_t row) {
    rows.azimuth[row] = rows.zenith[row] = std::numeric_limits<double>::quiet_NaN();
    rows.azimuth_resolution[row] = rows.zenith_resolution[row] = 0.0F;
    rows.range[row] = 0.0;
    rows.valid[row] = 0;
  }

  std::array<Vector3<double>, 3> axes_;  ///< of the sensor in the recorded frame
  Vector3<double> translation_;
  bool moves_;
  std::uint64_t not_moved_ = 0;
};

}  // namespace

bool is_identity(const Extrinsics& pose) {
  return pose.yaw == 0 && pose.pitch == 0 && pose.roll == 0 && pose.translation.x == 0 &&
         pose.translation.y == 0 && pose.translation.z == 0;
}

std::array<Vector3<double>, 3> sensor_axes(const Extrinsics& pose) {
  require_turn(pose);
  const double cy = std::cos(pose.yaw), sy = std::sin(pose.yaw);
  const double cp = std::cos(pose.pitch), sp = std::sin(pose.pitch);
  const double cr = std::cos(pose.roll), sr = std::sin(pose.roll);
  return {Vector3<double>{cy * cp, sy * cp, -sp},
          Vector3<double>{cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr},
          Vector3<double>{cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr}};
}

std::optional<Extrinsics> stored_extrinsics(const Device& device) {
  const auto angle = [&](std::size_t i) {
    return radians_from_degrees(static_cast<double>(device.roll_pitch_yaw_deg[i]));
  };
  const auto metres = [&](std::size_t i) { return static_cast<double>(device.translation_m[i]); };
  const Extrinsics pose{angle(2), angle(1), angle(0), {metres(0), metres(1), metres(2)}};
  const double sum = pose.yaw + pose.pitch + pose.roll + pose.translation.x + pose.translation.y +
                     pose.translation.z;
  if (is_identity(pose) || !std::isfinite(sum)) return std::nullopt;
  return pose;
}

std::unique_ptr<Reader> in_sensor_frame(std::unique_ptr<Reader> reader, const Extrinsics& pose) {
  require_pose(pose);
  if (is_identity(pose)) return reader;
  return std::make_unique<SensorFrameReader>(std::move(reader), pose);
}

}  // namespace risley::recordings
