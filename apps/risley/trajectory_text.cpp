// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "trajectory_text.hpp"

#include <string>
#include <string_view>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/text.hpp"
#include "risley/trajectories/trajectory_audit.hpp"

#include "command.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using trajectories::Extent;
using trajectories::PoseAccuracy;
using trajectories::RecordTimes;
using trajectories::Trajectory;
using trajectories::TrajectoryAudit;

std::string extent_text(const Extent& extent, double scale, int decimals, std::string_view unit) {
  return fmt::format("{:.{}f} to {:.{}f} {}", extent.min * scale, decimals, extent.max * scale,
                     decimals, unit);
}

void add_times(const RecordTimes& times, Table& table) {
  table.add({"records", grouped(times.records)});
  table.add({"duration", fmt::format("{:.6g} s", times.duration_s)});
  table.add({"rate", times.rate_hz > 0 ? fmt::format("{:.6g} Hz", times.rate_hz) : "unknown"});
  std::string gaps = grouped(times.gaps.size());
  if (!times.gaps.empty()) gaps += fmt::format(", {:.4g} s together", times.gaps_total_s);
  table.add({"gaps", gaps});
}

void add_accuracy(std::string_view name, const PoseAccuracy& accuracy, Table& table) {
  table.add({fmt::format("{} position", name),
             fmt::format("north {:.3f}, east {:.3f}, down {:.3f} m", accuracy.position.x(),
                         accuracy.position.y(), accuracy.position.z())});
  table.add({fmt::format("{} roll", name), trajectories::angle_words(accuracy.roll)});
  table.add({fmt::format("{} pitch", name), trajectories::angle_words(accuracy.pitch)});
  table.add({fmt::format("{} heading", name), trajectories::angle_words(accuracy.heading)});
}

void print_poses(const Trajectory& trajectory, const TrajectoryAudit& audit, Table& table) {
  table.add({"format", trajectory.format});
  if (!trajectory.source.empty()) table.add({"source", trajectory.source});
  add_times(audit.times, table);
  std::string times = to_string(trajectory.time_scale);
  if (trajectory.gps_week) times += fmt::format(", GPS week {}", *trajectory.gps_week);
  table.add({"times",
             fmt::format("{:.6f} to {:.6f} s, {}", 1e-9 * static_cast<double>(audit.times.first_ns),
                         1e-9 * static_cast<double>(audit.times.last_ns), times)});
  table.add({"frame", to_string(trajectory.frame)});
  if (audit.latitude) {
    table.add({"latitude", extent_text(*audit.latitude, kDegreesPerRadian, 7, "deg")});
    table.add({"longitude", extent_text(*audit.longitude, kDegreesPerRadian, 7, "deg")});
  }
  table.add({"height", extent_text(audit.height, 1, 2, "m")});
  table.add({"roll", extent_text(audit.roll, kDegreesPerRadian, 2, "deg")});
  table.add({"pitch", extent_text(audit.pitch, kDegreesPerRadian, 2, "deg")});
  table.add({"fastest", fmt::format("{:.1f} m/s, {:.1f} deg/s", audit.fastest,
                                    degrees_from_radians(audit.fastest_turning))});
  if (const auto& velocity = trajectory.velocity_frame) {
    table.add({"velocities", velocity->name});
    if (velocity->residual) {
      table.add(
          {"against positions",
           fmt::format("north {:.1f}, east {:.1f}, down {:.1f} mm/s", 1e3 * velocity->residual->x(),
                       1e3 * velocity->residual->y(), 1e3 * velocity->residual->z())});
    }
  }
  if (const auto& wander = trajectory.wander) {
    table.add({"wander angle", fmt::format("{:.4f} deg, {}", degrees_from_radians(wander->median),
                                           extent_text({wander->least, wander->greatest},
                                                       kDegreesPerRadian, 4, "deg"))});
  }
  if (audit.accuracy) {
    add_accuracy("median", *audit.accuracy, table);
  } else {
    table.add({"accuracies", "none"});
  }
}

}  // namespace

void print_trajectory(const jobs::InspectedTrajectory& found) {
  Table table;
  if (found.trajectory) {
    print_poses(*found.trajectory, *found.audit, table);
  } else {
    table.add({"format", "smrmsg (accuracies)"});
    add_times(found.accuracies->times, table);
    add_accuracy("median", found.accuracies->median, table);
    add_accuracy("worst", found.accuracies->worst, table);
  }
  table.add({"warnings", grouped(found.warnings.size())});
  table.print();
}

}  // namespace risley::app
