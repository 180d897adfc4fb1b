// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <optional>
#include <string>

#include "risley/core/angle.hpp"
#include "risley/jobs/convert_trajectory.hpp"
#include "risley/jobs/inspect_trajectory.hpp"
#include "risley/json/results.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

using trajectories::AngleSpread;
using trajectories::Extent;
using trajectories::PoseAccuracy;
using trajectories::RecordTimes;
using trajectories::Trajectory;
using trajectories::TrajectoryAudit;

constexpr double kSecondsPerNanosecond = 1e-9;

Json extent_json(const std::optional<Extent>& extent, double scale) {
  if (!extent) return nullptr;
  return {{"min", extent->min * scale}, {"max", extent->max * scale}};
}

Json accuracy_json(const std::optional<PoseAccuracy>& accuracy) {
  if (!accuracy) return nullptr;
  return {{"north_m", accuracy->position.x()},
          {"east_m", accuracy->position.y()},
          {"down_m", accuracy->position.z()},
          {"roll_deg", deg(accuracy->roll)},
          {"pitch_deg", deg(accuracy->pitch)},
          {"heading_deg", deg(accuracy->heading)},
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
  object["wander_deg"] = wander ? Json(deg(wander->median)) : Json();
  object["wander_range_deg"] =
      wander ? extent_json(Extent{wander->least, wander->greatest}, kDegreesPerRadian) : Json();
  object["latitude_deg"] = extent_json(audit.latitude, kDegreesPerRadian);
  object["longitude_deg"] = extent_json(audit.longitude, kDegreesPerRadian);
  object["height_m"] = extent_json(audit.height, 1);
  object["roll_deg"] = extent_json(audit.roll, kDegreesPerRadian);
  object["pitch_deg"] = extent_json(audit.pitch, kDegreesPerRadian);
  object["fastest_m_per_s"] = audit.fastest;
  object["fastest_turning_deg_per_s"] = deg(audit.fastest_turning);
  object["accuracy"] = accuracy_json(audit.accuracy);
  return object;
}

}  // namespace

Json of(const jobs::InspectedTrajectory& found) {
  Json object;
  if (found.trajectory) {
    object = poses_json(*found.trajectory, *found.audit);
  } else {
    object = {{"format", "smrmsg"}, {"kind", "accuracies"}};
    times_json(found.accuracies->times, object);
    object["accuracy"] = accuracy_json(found.accuracies->median);
    object["worst_accuracy"] = accuracy_json(found.accuracies->worst);
  }
  object["warnings"] = of(found.warnings);
  return object;
}

Json of(const jobs::ConvertedTrajectory& done) {
  return {{"records", done.records},
          {"left_out", done.left_out},
          {"input_format", done.input_format},
          {"warnings", of(done.warnings)}};
}

}  // namespace risley::json
