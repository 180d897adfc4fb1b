// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/simulation_settings.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/moving_platform.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/sensors/range_values.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "jobs/checks.hpp"

namespace risley::jobs {
namespace {

void assign(sensors::Sensor& sensor, const ParameterValues& values) {
  for (const auto& [name, value] : values) {
    const ParameterInfo& parameter = find_parameter(name, sensor.shape());
    check_bounds(parameter, value);
    if (parameter.kind == ParameterKind::rotation_angle) {
      throw InvalidArgument(fmt::format("{}: set the rotation angles at the start with {}", name,
                                        name_of(kSetting.start_angles)));
    }
    sensor.set(name, value);
  }
}

/// Sets range errors, too.
void assign_truth(sensors::Sensor& sensor, const ParameterValues& values) {
  ParameterValues parameters;
  for (const auto& [name, value] : values) {
    if (name.starts_with("range_")) {
      sensors::set_range_value(sensor, name, value);
    } else {
      parameters.emplace_back(name, value);
    }
  }
  assign(sensor, parameters);
}

void check_moves(const SimulationOptions& options) {
  const std::pair<bool, Setting> only_moving[] = {
      {!options.mount.empty(), kSetting.mount},
      {!options.trajectory_errors.empty(), kSetting.trajectory_errors},
      {options.clock_drift.has_value(), kSetting.clock_drift},
      {options.start.has_value(), kSetting.start},
  };
  for (const auto& [given, setting] : only_moving) {
    if (!given) continue;
    throw InvalidArgument(fmt::format("{} needs {} or {}", name_of(setting),
                                      name_of(kSetting.trajectory), name_of(kSetting.flight)));
  }
}

/// Motion of the sensor, from a trajectory or a flight plan and a mount; nothing if it is
/// stationary.
std::optional<simulation::Platform> platform_from(const SimulationOptions& options,
                                                  const simulation::SimulationSettings& settings) {
  if (options.trajectory.empty() && options.flight.empty()) {
    check_moves(options);
    return std::nullopt;
  }
  if (!options.trajectory.empty() && !options.flight.empty()) {
    throw InvalidArgument(fmt::format("{} and {} cannot be combined", name_of(kSetting.trajectory),
                                      name_of(kSetting.flight)));
  }
  if (options.mount.empty()) {
    throw InvalidArgument(fmt::format(
        "{} is missing: a file that describes how the sensor is mounted on the moving platform",
        name_of(kSetting.mount)));
  }
  if (!settings.scene) {
    throw InvalidArgument(
        fmt::format("{} is missing: the scene of the moving sensor, for example a terrain",
                    name_of(kSetting.scene)));
  }
  simulation::Platform platform;
  if (!options.flight.empty()) {
    const trajectories::FlightPlan plan = trajectories::load_flight_plan(options.flight);
    trajectories::Flight flight = trajectories::fly(plan);
    platform.trajectory = std::make_shared<trajectories::Trajectory>(std::move(flight.trajectory));
    platform.strips = std::move(flight.strips);
    const auto& terrain = settings.scene->terrain;
    if (!terrain || !terrain->parts().origin) platform.map_origin = plan.origin;
  } else {
    platform.trajectory = std::make_shared<trajectories::Trajectory>(
        trajectory_of(options.trajectory, options.topic));
  }
  platform.mount = mount_of(options.mount);
  platform.clock_drift = options.clock_drift.value_or(0.0);
  if (options.start) {
    require_between(kSetting.start, *options.start, 0, 1e9);
    platform.begin_ns = platform.trajectory->time_ns.front() +
                        static_cast<std::int64_t>(std::llround(1e9 * *options.start));
  }
  if (!options.trajectory_errors.empty()) {
    platform.errors = trajectories::load_error_model(options.trajectory_errors);
  }
  platform.trajectory_ending = options.trajectory_ending;
  return platform;
}

}  // namespace

simulation::SimulationSettings simulation_settings(const SimulationOptions& options) {
  if (options.duration) require_positive(kSetting.duration, *options.duration);
  if (options.rate) require_positive(kSetting.rate, *options.rate);
  if (options.angle_noise) require_not_negative(kSetting.noise_angle, *options.angle_noise);
  if (options.range_noise) require_not_negative(kSetting.noise_range, *options.range_noise);
  simulation::SimulationSettings settings;
  settings.truth = load_result(options.sensor);
  assign_truth(settings.truth, options.set);
  if (!options.beam_origin) settings.truth.set_prism_geometry({});
  if (options.reported_nominal || !options.reported.empty()) {
    settings.reported = settings.truth;
    if (options.reported_nominal) {
      settings.reported->train = settings.reported->train.without_errors();
    }
    assign(*settings.reported, options.reported);
  }
  settings.rate = options.rate;
  settings.angle_noise = options.angle_noise;
  settings.range_noise = options.range_noise;
  settings.quantize = options.quantize;
  settings.rotor = options.rotor;
  settings.start_angles = options.start_angles;
  if (!options.scene.empty()) settings.scene = scenes::load_scene(options.scene);
  settings.station = options.station;
  settings.platform = platform_from(options, settings);
  settings.duration = options.duration ? *options.duration
                      : settings.platform
                          ? std::max(1e-3, simulation::longest_duration(*settings.platform))
                          : 1.0;
  settings.seed = options.seed;
  settings.threads = options.threads;
  return settings;
}

}  // namespace risley::jobs
