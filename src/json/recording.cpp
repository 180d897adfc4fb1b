// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <optional>
#include <string>

#include "risley/core/angle.hpp"
#include "risley/jobs/convert_recording.hpp"
#include "risley/jobs/inspect_recording.hpp"
#include "risley/json/results.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

using recordings::TimeAuditResult;
using recordings::ValueRange;

Json range_json(const std::optional<ValueRange>& range, double scale) {
  if (!range) return {{"min", nullptr}, {"max", nullptr}};
  return {{"min", range->min * scale}, {"max", range->max * scale}};
}

/// YAW,PITCH,ROLL as for --extrinsics.
std::array<double, 3> yaw_pitch_roll_deg(const recordings::Extrinsics& pose) {
  return {deg(pose.yaw), deg(pose.pitch), deg(pose.roll)};
}

/// Data reported only by sensors of the second generation.
Json numbered_json(const recordings::RecordingHeader& header, const recordings::Device& device,
                   const recordings::NumberedAudit& audit) {
  Json tags = Json::array();
  for (std::size_t tag = 0; tag < audit.observations_by_tag.size(); ++tag) {
    if (audit.observations_by_tag[tag] == 0) continue;
    tags.push_back(
        {{"tag", tag},
         {"observations", audit.observations_by_tag[tag]},
         {"words", recordings::livox::tag_words(device.type, static_cast<std::uint8_t>(tag))}});
  }
  return {{"address", device.address},
          {"firmware", header.device_detail(device, "firmware")},
          {"field_of_view", header.device_detail(device, "field_of_view")},
          {"outside_field_of_view", audit.outside_view},
          {"lost_packets", audit.lost_packets},
          {"tags", std::move(tags)}};
}

Json devices_json(const recordings::RecordingHeader& header, const TimeAuditResult& audit) {
  Json devices = Json::array();
  for (std::size_t i = 0; i < header.devices.size(); ++i) {
    const recordings::Device& device = header.devices[i];
    const auto pose = recordings::stored_extrinsics(device);
    devices.push_back(
        {{"type", recordings::device_type_name(device.type)},
         {"sensor", recordings::device_type_name(device.type)},
         {"serial", device.serial},
         {"topic", device.topic},
         {"hub_serial", device.hub_serial},
         {"extrinsics_deg", pose ? Json(yaw_pitch_roll_deg(*pose)) : Json()},
         {"translation_m",
          pose ? Json({pose->translation.x, pose->translation.y, pose->translation.z}) : Json()},
         {"observations", i < audit.rows_by_device.size() ? audit.rows_by_device[i] : 0}});
    if (i < audit.numbered_by_device.size() && audit.numbered_by_device[i]) {
      devices.back()["second_generation"] =
          numbered_json(header, device, *audit.numbered_by_device[i]);
    }
  }
  return devices;
}

/// Counts by number, without empty ones.
template <class Counts>
Json counts_json(const Counts& counts) {
  Json object = Json::object();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) object[std::to_string(i)] = counts[i];
  }
  return object;
}

Json excerpt_json(const recordings::Excerpt& excerpt) {
  const recordings::ExcerptContents contents = contents_of(excerpt);
  return {{"output", excerpt.path},
          {"observations", excerpt.observations},
          {"shots", excerpt.shots},
          {"no_return", excerpt.no_return},
          {"duration_s", excerpt.has_times ? Json(excerpt.duration) : Json()},
          {"has_range", excerpt.has_ranges},
          {"rounded", excerpt.rounded},
          {"holds", contents.holds},
          {"does_not_hold", contents.lacks}};
}

/// A reader's findings about a recording, and the quality of its times.
Json audit_json(const recordings::RecordingHeader& header, const TimeAuditResult& audit,
                std::optional<double> time_uncertainty = {}) {
  const auto if_times = [&header](auto value) { return header.has_times ? Json(value) : Json(); };
  return {{"observations", audit.observations},
          {"shots", audit.shots},
          {"no_return", audit.no_return},
          {"has_times", header.has_times},
          {"duration_s", if_times(audit.duration_s)},
          {"rate_hz", if_times(audit.rate_hz)},
          {"has_range", header.has_range},
          {"has_intensity", header.has_intensity},
          {"cartesian", header.cartesian},
          {"time_reference", to_string(header.time_reference)},
          {"first_time_ns", if_times(audit.first_time_ns)},
          {"last_time_ns", if_times(audit.last_time_ns)},
          {"gaps", audit.gaps.count},
          {"gaps_total_s", if_times(audit.gaps.total_s)},
          {"largest_gap_s", if_times(audit.gaps.largest_s)},
          {"largest_gap_after_ns", if_times(audit.gaps.largest_after_ns)},
          {"time_resets", audit.time_resets},
          {"time_uncertainty_s", time_uncertainty ? if_times(*time_uncertainty) : Json()},
          {"non_monotonic_packets", audit.non_monotonic_packets},
          {"pps_wraps", audit.pps_wraps},
          {"azimuth_deg", range_json(audit.azimuth, kDegreesPerRadian)},
          {"zenith_deg", range_json(audit.zenith, kDegreesPerRadian)},
          {"range_m", range_json(audit.range, 1.0)},
          {"returns", counts_json(audit.rows_by_return_number)},
          {"packets_by_data_type", counts_json(audit.packets_by_data_type)},
          {"imu_samples", audit.imu},
          {"devices", devices_json(header, audit)}};
}

}  // namespace

Json of(const jobs::InspectedRecording& found) {
  Json object = {{"format", found.header.format},
                 {"sensor", found.choice ? jobs::sensor_name(*found.choice)
                                         : jobs::sensor_name(found.header)}};
  object.update(audit_json(found.header, found.audit, found.time_uncertainty));
  object.update({{"frame", nullptr}, {"slips", nullptr}, {"warnings", of(found.warnings)}});
  if (found.choice) object.update(choice_json(*found.choice));
  if (found.excerpt) object["excerpt"] = excerpt_json(*found.excerpt);
  if (found.damage) object.update(of(*found.damage));
  return object;
}

Json of(const jobs::ReadRecording& recording) {
  Json object = {{"format", recording.header.format}};
  object.update(audit_json(recording.header, recording.audit));
  return object;
}

Json of(const jobs::ConvertedRecording& done) {
  Json object = {{"observations", done.observations - done.left_out},
                 {"left_out", done.left_out},
                 {"input_format", done.input_format},
                 {"time_uncertainty_s", done.time_uncertainty},
                 {"frame", nullptr},
                 {"slips", nullptr},
                 {"warnings", of(done.warnings)}};
  if (done.choice) {
    object["sensor_chosen_by"] = to_string(done.choice->chosen_by);
    object["sensor"] = jobs::sensor_name(*done.choice);
  }
  if (done.damage) object.update(of(*done.damage));
  return object;
}

}  // namespace risley::json
