// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "trajectory_text.hpp"

#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/trajectories/trajectory_audit.hpp"

#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using trajectories::AngleSpread;
using trajectories::Extent;
using trajectories::PoseAccuracy;
using trajectories::RecordTimes;
using trajectories::Trajectory;
using trajectories::TrajectoryAudit;
using trajectories::TrajectoryWarning;

constexpr double kSecondsPerNanosecond = 1e-9;

std::string text_of(const TrajectoryWarning& warning) {
  std::string text = warning.message;
  if (warning.place.byte_offset) text += fmt::format(" (at byte {})", *warning.place.byte_offset);
  if (warning.place.line) text += fmt::format(" (line {})", *warning.place.line);
  return text;
}

Json extent_json(const std::optional<Extent>& extent, double scale) {
  if (!extent) return nullptr;
  return {{"min", extent->min * scale}, {"max", extent->max * scale}};
}

std::string extent_text(const Extent& extent, double scale, int decimals, std::string_view unit) {
  return fmt::format("{:.{}f} to {:.{}f} {}", extent.min * scale, decimals, extent.max * scale,
                     decimals, unit);
}

Json accuracy_json(const std::optional<PoseAccuracy>& accuracy) {
  if (!accuracy) return nullptr;
  return {{"north_m", accuracy->position.x()},
          {"east_m", accuracy->position.y()},
          {"down_m", accuracy->position.z()},
          {"roll_deg", degrees_from_radians(accuracy->roll)},
          {"pitch_deg", degrees_from_radians(accuracy->pitch)},
          {"heading_deg", degrees_from_radians(accuracy->heading)},
          {"heading_words", trajectories::angle_words(accuracy->heading)}};
}

void times_json(const RecordTimes& times, Json& object) {
  Json places = Json::array();
  for (const trajectories::TrajectoryGap& gap : times.gaps) {
    constexpr std::size_t kMostTold = 100;
    if (places.size() == kMostTold) break;
    places.push_back(
        {{"after_s", kSecondsPerNanosecond * static_cast<double>(gap.begin_ns)},
         {"length_s", kSecondsPerNanosecond * static_cast<double>(gap.end_ns - gap.begin_ns)}});
  }
  object["records"] = times.records;
  object["rate_hz"] = times.rate_hz;
  object["duration_s"] = times.duration_s;
  object["first_time_ns"] = times.first_ns;
  object["last_time_ns"] = times.last_ns;
  object["gaps"] = times.gaps.size();
  object["gaps_total_s"] = times.gaps_total_s;
  object["gap_places"] = std::move(places);
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

Json poses_json(const Trajectory& trajectory, const TrajectoryAudit& audit) {
  Json object = {{"format", trajectory.format}, {"kind", "trajectory"}};
  times_json(audit.times, object);
  const auto& velocity = trajectory.velocity_frame;
  object["time_scale"] = to_string(trajectory.time_scale);
  object["source"] = trajectory.source;
  object["gps_week"] = trajectory.gps_week ? Json(*trajectory.gps_week) : Json();
  object["week_crossings"] = trajectory.week_crossings;
  object["records_out_of_order"] = trajectory.time_order.moved;
  object["records_repeated"] = trajectory.time_order.repeated;
  object["frame"] = to_string(trajectory.frame);
  object["velocity_frame"] = velocity ? velocity->name : "none";
  object["velocity_frame_reason"] = velocity ? velocity->reason : "";
  Json residual;
  if (velocity && velocity->residual) {
    residual = {{"north", 1e3 * velocity->residual->x()},
                {"east", 1e3 * velocity->residual->y()},
                {"down", 1e3 * velocity->residual->z()}};
  }
  object["velocity_residual_mm_per_s"] = std::move(residual);
  const std::optional<AngleSpread>& wander = trajectory.wander;
  object["wander_deg"] = wander ? Json(degrees_from_radians(wander->median)) : Json();
  object["wander_range_deg"] =
      wander ? extent_json(Extent{wander->least, wander->greatest}, kDegreesPerRadian) : Json();
  object["latitude_deg"] = extent_json(audit.latitude, kDegreesPerRadian);
  object["longitude_deg"] = extent_json(audit.longitude, kDegreesPerRadian);
  object["height_m"] = extent_json(audit.height, 1);
  object["roll_deg"] = extent_json(audit.roll, kDegreesPerRadian);
  object["pitch_deg"] = extent_json(audit.pitch, kDegreesPerRadian);
  object["fastest_m_per_s"] = audit.fastest;
  object["fastest_turning_deg_per_s"] = degrees_from_radians(audit.fastest_turning);
  object["accuracy"] = accuracy_json(audit.accuracy);
  return object;
}

void print_poses(const Trajectory& trajectory, const TrajectoryAudit& audit, Table& table) {
  table.add({"format", trajectory.format});
  if (!trajectory.source.empty()) table.add({"source", trajectory.source});
  add_times(audit.times, table);
  std::string times = to_string(trajectory.time_scale);
  if (trajectory.gps_week) times += fmt::format(", GPS week {}", *trajectory.gps_week);
  table.add({"times",
             fmt::format("{:.6f} to {:.6f} s, {}",
                         kSecondsPerNanosecond * static_cast<double>(audit.times.first_ns),
                         kSecondsPerNanosecond * static_cast<double>(audit.times.last_ns), times)});
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

Json warnings_json(const std::vector<TrajectoryWarning>& warnings) {
  Json list = Json::array();
  for (const TrajectoryWarning& warning : warnings) {
    list.push_back({{"message", text_of(warning)}});
  }
  return list;
}

void log_warnings(const std::string& file, const std::vector<TrajectoryWarning>& warnings) {
  for (const TrajectoryWarning& warning : warnings) {
    spdlog::warn("{}: {}", file, text_of(warning));
  }
}

Json trajectory_json(const jobs::InspectedTrajectory& found) {
  Json object;
  if (found.trajectory) {
    object = poses_json(*found.trajectory, *found.audit);
  } else {
    object = {{"format", "smrmsg"}, {"kind", "accuracies"}};
    times_json(found.accuracies->times, object);
    object["accuracy"] = accuracy_json(found.accuracies->median);
    object["worst_accuracy"] = accuracy_json(found.accuracies->worst);
  }
  object["warnings"] = warnings_json(found.warnings);
  return object;
}

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
