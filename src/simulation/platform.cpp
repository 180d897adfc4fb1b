// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/platform.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

#include "simulation/platform_poses.hpp"

namespace risley::simulation {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr double kLargestDrift = 1e-3;

std::int64_t offset_ns_of(const Platform& platform) {
  return std::llround(static_cast<long double>(platform.mount.clock_offset.value) * 1e9L);
}

const trajectories::Trajectory& checked_trajectory(const Platform& platform) {
  if (platform.trajectory == nullptr) throw InvalidArgument("a platform needs a trajectory");
  return *platform.trajectory;
}

/// Time of the trajectory in s, with as many decimals as are significant.
std::string time_text(std::int64_t time_ns) {
  return fmt::format("{:.6f} s", static_cast<long double>(time_ns) * 1e-9L);
}

}  // namespace

std::int64_t first_clock_reading_ns(const Platform& platform) {
  trajectories::require_trajectory(checked_trajectory(platform));
  trajectories::require_mount(platform.mount);
  require_between("clock_drift", platform.clock_drift, -kLargestDrift, kLargestDrift, "s/s");
  const std::int64_t begin =
      platform.begin_ns.value_or(platform.trajectory->time_ns.front()) - offset_ns_of(platform);
  if (begin <= 0) return 0;  // clocks begin with 0
  const std::int64_t rest = begin % kMillisecond_ns;
  return rest == 0 ? begin : begin - rest + kMillisecond_ns;
}

double longest_duration(const Platform& platform) {
  const std::int64_t first = first_clock_reading_ns(platform) + offset_ns_of(platform);
  const auto span = static_cast<long double>(platform.trajectory->time_ns.back() - first);
  const long double drift = 1.0L + static_cast<long double>(platform.clock_drift);
  return std::max(0.0, static_cast<double>(span * 1e-9L / drift));
}

PlatformPoses::PlatformPoses(const Platform& platform, const scenes::Scene& scene,
                             std::int64_t last_shot_ns)
    : platform_(platform),
      poses_(checked_trajectory(platform_)),
      first_clock_ns_(first_clock_reading_ns(platform)),
      offset_ns_(offset_ns_of(platform)),
      body_from_sensor_(trajectories::body_from_sensor(platform.mount)),
      lever_arm_(trajectories::lever_arm(platform.mount)),
      scene_from_frame_(Eigen::Matrix3d::Identity()),
      origin_(Eigen::Vector3d::Zero()) {
  const auto& times = platform_.trajectory->time_ns;
  const std::int64_t begin = trajectory_time_ns(0), end = trajectory_time_ns(last_shot_ns);
  const std::string asked =
      fmt::format("the recording lasts from {} to {} of the trajectory's time", time_text(begin),
                  time_text(end));
  if (begin < times.front() || end > times.back()) {
    throw InvalidArgument(
        fmt::format("{}, and the trajectory from {} to {}; make the recording shorter, or begin "
                    "it at another time",
                    asked, time_text(times.front()), time_text(times.back())));
  }
  for (const trajectories::TrajectoryGap& gap : poses_.gaps()) {
    if (gap.end_ns <= begin || gap.begin_ns >= end) continue;
    throw InvalidArgument(fmt::format("{}, and the trajectory has no records from {} to {}", asked,
                                      time_text(gap.begin_ns), time_text(gap.end_ns)));
  }
  if (platform_.trajectory->frame == trajectories::Frame::local) return;
  std::optional<trajectories::Geodetic> place = platform_.map_origin;
  if (!place && scene.terrain && scene.terrain->parts().origin) {
    const scenes::MapOrigin& of_terrain = *scene.terrain->parts().origin;
    place = trajectories::Geodetic{of_terrain.latitude, of_terrain.longitude, of_terrain.height};
  }
  if (!place) {
    throw InvalidArgument(
        "the trajectory is geocentric, but the scene does not say where on the Earth it lies: give "
        "its terrain an origin: {latitude_deg, longitude_deg, ellipsoidal_height_m}");
  }
  origin_ = trajectories::geocentric_from_geodetic(*place);
  const Eigen::Matrix3d ned = trajectories::geocentric_from_ned(*place);
  scene_from_frame_.row(0) = ned.col(1).transpose();   // east
  scene_from_frame_.row(1) = ned.col(0).transpose();   // north
  scene_from_frame_.row(2) = -ned.col(2).transpose();  // up
}

std::int64_t PlatformPoses::trajectory_time_ns(std::int64_t shot_ns) const {
  const auto gained =
      static_cast<std::int64_t>(std::llround(platform_.clock_drift * static_cast<double>(shot_ns)));
  return first_clock_ns_ + shot_ns + offset_ns_ + gained;
}

Vector3<double> PlatformPoses::SensorPose::direction(const Vector3<double>& of_sensor) const {
  const Eigen::Vector3d turned = rotation * Eigen::Vector3d(of_sensor.x, of_sensor.y, of_sensor.z);
  return {turned.x(), turned.y(), turned.z()};
}

Vector3<double> PlatformPoses::SensorPose::point(const Vector3<double>& of_sensor) const {
  return Vector3<double>{position.x(), position.y(), position.z()} + direction(of_sensor);
}

PlatformPoses::SensorPose PlatformPoses::Cursor::at(std::int64_t shot_ns) {
  const auto pose = cursor_.at(poses_->trajectory_time_ns(shot_ns));
  if (!pose) {  // gaps and ends were rejected before
    throw InvalidArgument(fmt::format("the trajectory has no pose at {}",
                                      time_text(poses_->trajectory_time_ns(shot_ns))));
  }
  const Eigen::Matrix3d scene_from_body =
      poses_->scene_from_frame_ * pose->attitude.toRotationMatrix();
  return {scene_from_body * poses_->body_from_sensor_,
          poses_->scene_from_frame_ * (pose->position - poses_->origin_) +
              scene_from_body * poses_->lever_arm_};
}

}  // namespace risley::simulation
