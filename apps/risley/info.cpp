// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/recordings/time_audit.hpp"

#include "command.hpp"
#include "recording_input.hpp"
#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using recordings::TimeAuditResult;
using recordings::ValueRange;

Json range_json(const std::optional<ValueRange>& range, double scale) {
  if (!range) return {{"min", nullptr}, {"max", nullptr}};
  return {{"min", range->min * scale}, {"max", range->max * scale}};
}

std::string range_text(const std::optional<ValueRange>& range, double scale, int decimals,
                       std::string_view unit) {
  if (!range) return "none";
  return fmt::format("{:.{}f} to {:.{}f} {}", range->min * scale, decimals, range->max * scale,
                     decimals, unit);
}

/// YAW,PITCH,ROLL as --extrinsics takes them.
std::array<double, 3> yaw_pitch_roll_deg(const recordings::Extrinsics& pose) {
  return {degrees_from_radians(pose.yaw), degrees_from_radians(pose.pitch),
          degrees_from_radians(pose.roll)};
}

Json devices_json(const recordings::RecordingHeader& header, const TimeAuditResult& audit) {
  Json devices = Json::array();
  for (std::size_t i = 0; i < header.devices.size(); ++i) {
    const recordings::Device& device = header.devices[i];
    const auto pose = recordings::stored_extrinsics(device);
    devices.push_back(
        {{"type", recordings::device_type_name(device.type)},
         {"serial", device.serial},
         {"hub_serial", device.hub_serial},
         {"extrinsics_deg", pose ? Json(yaw_pitch_roll_deg(*pose)) : Json()},
         {"translation_m",
          pose ? Json({pose->translation.x, pose->translation.y, pose->translation.z}) : Json()},
         {"observations", i < audit.rows_by_device.size() ? audit.rows_by_device[i] : 0}});
  }
  return devices;
}

/// Counts by number, the empty ones left out.
template <class Counts>
Json counts_json(const Counts& counts) {
  Json object = Json::object();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) object[std::to_string(i)] = counts[i];
  }
  return object;
}

Json audit_json(const recordings::Reader& reader, const TimeAuditResult& audit) {
  const recordings::RecordingHeader& header = reader.header();
  const auto if_times = [&header](auto value) { return header.has_times ? Json(value) : Json(); };
  return {{"format", header.format},
          {"sensor", sensor_name(header)},
          {"observations", audit.observations},
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
          {"non_monotonic_packets", audit.non_monotonic_packets},
          {"pps_wraps", audit.pps_wraps},
          {"azimuth_deg", range_json(audit.azimuth, kDegreesPerRadian)},
          {"zenith_deg", range_json(audit.zenith, kDegreesPerRadian)},
          {"range_m", range_json(audit.range, 1.0)},
          {"returns", counts_json(audit.rows_by_return_number)},
          {"packets_by_data_type", counts_json(audit.packets_by_data_type)},
          {"imu_samples", audit.imu},
          {"devices", devices_json(header, audit)},
          {"warnings", warnings_json(reader.warnings())}};
}

void print_audit(const recordings::Reader& reader, const TimeAuditResult& audit) {
  const recordings::RecordingHeader& header = reader.header();
  Table table;
  table.add({"format", header.format});
  table.add({"sensor", sensor_name(header)});
  table.add({"observations", grouped(audit.observations)});
  if (audit.shots != audit.observations) table.add({"shots", grouped(audit.shots)});
  table.add({"no return", grouped(audit.no_return)});
  std::string gaps = grouped(audit.gaps.count);
  if (header.has_times) {
    table.add({"duration", fmt::format("{:.6g} s", audit.duration_s)});
    table.add({"rate", fmt::format("{:.6g} Hz", audit.rate_hz)});
    table.add({"time from", to_string(header.time_reference)});
  } else {
    table.add({"times", "none of single shots: --shot-rate-hz counts them"});
    gaps += " in the shot numbers";
  }
  if (header.has_times && audit.gaps.count > 0) {
    gaps += fmt::format(", {:.4g} s together, the largest {:.4g} s after {:.6f} s",
                        audit.gaps.total_s, audit.gaps.largest_s,
                        1e-9 * double(audit.gaps.largest_after_ns - audit.first_time_ns));
  }
  table.add({"gaps", gaps});
  table.add({"time resets", grouped(audit.time_resets)});
  if (audit.pps_wraps > 0) table.add({"PPS seconds", grouped(audit.pps_wraps)});
  table.add({"azimuth", range_text(audit.azimuth, kDegreesPerRadian, 3, "deg")});
  table.add({"zenith", range_text(audit.zenith, kDegreesPerRadian, 3, "deg")});
  table.add({"range", header.has_range ? range_text(audit.range, 1.0, 3, "m") : "not recorded"});
  if (audit.imu > 0) table.add({"inertial samples", grouped(audit.imu)});
  for (const recordings::Device& device : header.devices) {
    if (!device.serial.empty()) table.add({"serial", device.serial});
    if (!device.hub_serial.empty()) table.add({"through the hub", device.hub_serial});
    if (const auto pose = recordings::stored_extrinsics(device)) {
      table.add({"states a pose", pose_text(*pose)});
    }
  }
  table.add({"warnings", grouped(reader.warnings().size())});
  table.print();
}

}  // namespace

Run declare_info(CLI::App& verb) {
  const auto input = std::make_shared<std::string>();
  const auto reading = std::make_shared<ReadingWishes>();
  verb.add_option("INPUT", *input, "Recording, of any known format")->required();
  add_reading_options(verb, *reading);
  return [input, reading](const CommonOptions& common) {
    const auto reader = open_input(*input, *reading);
    recordings::TimeAudit audit;
    std::optional<FileError> damage;
    {
      ProgressBar bar("reading", common);
      recordings::Chunk chunk;
      try {
        while (reader->read(chunk)) {
          audit.add(chunk);
          bar.show(reader->fraction_read());
        }
      } catch (const FileError& error) {
        damage = error;  // what was sound before is still told
      }
    }
    TimeAuditResult result = audit.result();
    result.pps_wraps = reader->clock_wraps();
    log_warnings(*input, reader->warnings());
    if (damage) spdlog::error(damage->what());
    if (common.json) {
      Json object = audit_json(*reader, result);
      if (damage) object.update(damage_json(*damage));
      print_json(object);
    } else {
      print_audit(*reader, result);
    }
    return damage ? kBadFile : kDone;
  };
}

}  // namespace risley::app
