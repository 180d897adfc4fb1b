// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Trajectories, their accuracies, mounts and statements of errors.
#include <cstdint>
#include <cstdio>
#include <string>

#include "risley/core/error.hpp"
#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/interpolation.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory_audit.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "fuzz/invariants.hpp"
#include "fuzz/memory_file.hpp"
#include "fuzz/targets.hpp"
#include "io/test_folder.hpp"

namespace risley::fuzz {
namespace {

using trajectories::Trajectory;

std::string yaml_of(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

/// A trajectory that is read is sound, can be audited and interpolated, and comes back from CSV.
void run_trajectory(std::span<const std::uint8_t> bytes) {
  static const io::TestFolder folder;
  const MemoryFile file(bytes);
  Trajectory trajectory;
  try {
    trajectory = trajectories::load_trajectory(file.path());
  } catch (const Error&) {
    return;
  }
  try {
    trajectories::audit_trajectory(trajectory);
    const trajectories::Interpolation interpolation(trajectory);
    const std::int64_t first = trajectory.time_ns.front(), last = trajectory.time_ns.back();
    for (int i = 0; i <= 100; ++i) {
      const auto pose = interpolation.at(first + (last - first) / 100 * i);
      require(!pose || pose->position.allFinite(), "poses are finite");
    }
    const std::string path = folder.file("again.csv");
    trajectories::write_trajectory(path, trajectory);
    const Trajectory again = trajectories::load_trajectory(path);
    require(again.time_ns == trajectory.time_ns, "times come back from CSV");
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    require(false, "a trajectory that was read can be audited, written and read");
  }
}

void run_accuracies(std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  try {
    trajectories::audit_accuracies(trajectories::load_accuracies(file.path()));
  } catch (const FileError&) {  // refused
  }
}

void run_mount(std::span<const std::uint8_t> bytes) {
  std::string once;
  try {
    once = trajectories::mount_text(trajectories::parse_mount(yaml_of(bytes), "fuzz.yaml"));
  } catch (const FileError&) {
    return;
  }
  require(once == trajectories::mount_text(trajectories::parse_mount(once, "fuzz.yaml")),
          "a mount that is written twice is the same");
}

void run_error_model(std::span<const std::uint8_t> bytes) {
  try {
    trajectories::parse_error_model(yaml_of(bytes), "fuzz.yaml");
  } catch (const FileError&) {  // refused
  }
}

/// A plan that is accepted is flown, where that does not take long.
void run_flight_plan(std::span<const std::uint8_t> bytes) {
  trajectories::FlightPlan plan;
  try {
    plan = trajectories::parse_flight_plan(yaml_of(bytes), "fuzz.yaml");
  } catch (const FileError&) {
    return;
  }
  double seconds = 2 * plan.lead;
  for (const auto& strip : plan.strips) seconds += plan.turn_duration + strip.length / strip.speed;
  if (seconds * plan.rate * (1 + plan.attitude.sinusoids + plan.velocity.sinusoids) > 1e6) return;
  trajectories::require_trajectory(trajectories::fly(plan).trajectory);
}

}  // namespace

std::vector<Target> trajectory_targets() {
  return {{"trajectory", run_trajectory},
          {"accuracies", run_accuracies},
          {"mount", run_mount},
          {"trajectory-errors", run_error_model},
          {"flight-plan", run_flight_plan}};
}

}  // namespace risley::fuzz
