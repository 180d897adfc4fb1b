// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/jobs/inspect_recording.hpp"
#include "risley/jobs/inspect_trajectory.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "command.hpp"
#include "reading_options.hpp"
#include "recording_text.hpp"
#include "table.hpp"
#include "trajectory_text.hpp"

namespace risley::app {
namespace {

using jobs::InspectedRecording;
using recordings::Excerpt;
using recordings::TimeAuditResult;
using recordings::ValueRange;

struct InfoCommandOptions {
  std::string input, share, accuracy, topic;
  bool share_ranges = false;
  ReadingWishes reading;
};

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

Json audit_json(const InspectedRecording& found) {
  const recordings::RecordingHeader& header = found.header;
  const TimeAuditResult& audit = found.audit;
  const auto if_times = [&header](auto value) { return header.has_times ? Json(value) : Json(); };
  return {{"format", header.format},
          {"sensor", found.choice ? sensor_name(*found.choice) : sensor_name(header)},
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
          {"time_uncertainty_s", if_times(found.time_uncertainty)},
          {"non_monotonic_packets", audit.non_monotonic_packets},
          {"pps_wraps", audit.pps_wraps},
          {"azimuth_deg", range_json(audit.azimuth, kDegreesPerRadian)},
          {"zenith_deg", range_json(audit.zenith, kDegreesPerRadian)},
          {"range_m", range_json(audit.range, 1.0)},
          {"returns", counts_json(audit.rows_by_return_number)},
          {"packets_by_data_type", counts_json(audit.packets_by_data_type)},
          {"imu_samples", audit.imu},
          {"devices", devices_json(header, audit)},
          {"frame", nullptr},
          {"slips", nullptr},
          {"warnings", warnings_json(found.warnings)}};
}

void print_audit(const InspectedRecording& found) {
  const recordings::RecordingHeader& header = found.header;
  const TimeAuditResult& audit = found.audit;
  Table table;
  table.add({"format", header.format});
  if (found.choice) {
    const std::string name = sensor_name(*found.choice);
    table.add(
        {"sensor", fmt::format("{}, {}{}", name,
                               found.choice->chosen_by == jobs::ChosenBy::guess && name != "unknown"
                                   ? "a guess "
                                   : "",
                               found.choice->words)});
  } else {
    table.add({"sensor", sensor_name(header)});
  }
  table.add({"observations", grouped(audit.observations)});
  if (audit.shots != audit.observations) table.add({"shots", grouped(audit.shots)});
  table.add({"no return", grouped(audit.no_return)});
  std::string gaps = grouped(audit.gaps.count);
  if (header.has_times) {
    table.add({"duration", fmt::format("{:.6g} s", audit.duration_s)});
    table.add({"rate", fmt::format("{:.6g} Hz", audit.rate_hz)});
    table.add({"time from", to_string(header.time_reference)});
    if (found.time_uncertainty > 0) {
      table.add(
          {"guessed times", fmt::format("off by up to {:.2g} ms", 1e3 * found.time_uncertainty)});
    }
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
      table.add({"states a pose", jobs::pose_text(*pose)});
    }
  }
  table.add({"warnings", grouped(found.warnings.size())});
  table.print();
}

/// What an excerpt holds, and what of a recording it does not.
struct ExcerptContents {
  std::vector<std::string> holds, lacks;
};

ExcerptContents contents_of(const Excerpt& excerpt) {
  ExcerptContents contents;
  contents.holds = {excerpt.rounded ? "directions and their resolution, rounded" : "directions",
                    excerpt.has_times ? "times from 0" : "shot numbers from 0",
                    "shots without return in their places", "return numbers, tags and beams",
                    "the type of the sensor and the format of the recording"};
  contents.lacks = {"serial numbers",   "date and time of day", "file names",    "intensities",
                    "inertial samples", "extrinsics",           "packet headers"};
  auto& ranges = excerpt.has_ranges ? contents.holds : contents.lacks;
  ranges.insert(ranges.begin() + 1, "ranges");
  return contents;
}

Json excerpt_json(const std::string& path, const Excerpt& excerpt) {
  const ExcerptContents contents = contents_of(excerpt);
  return {{"output", path},
          {"observations", excerpt.observations},
          {"shots", excerpt.shots},
          {"no_return", excerpt.no_return},
          {"duration_s", excerpt.has_times ? Json(excerpt.duration) : Json()},
          {"has_range", excerpt.has_ranges},
          {"rounded", excerpt.rounded},
          {"holds", contents.holds},
          {"does_not_hold", contents.lacks}};
}

void print_excerpt(const std::string& path, const Excerpt& excerpt) {
  const ExcerptContents contents = contents_of(excerpt);
  const std::string duration =
      excerpt.has_times ? fmt::format(" in {:.6g} s", excerpt.duration) : "";
  say("\n{}: {} shots{}, {} observations without return\n", path, grouped(excerpt.shots), duration,
      grouped(excerpt.no_return));
  say("  holds: {}\n  does not hold: {}\n", fmt::join(contents.holds, "; "),
      fmt::join(contents.lacks, "; "));
  if (excerpt.rounded) {
    say("  Directions are rounded because coordinates in whole steps give away their range; "
        "it is left\n  known to a factor of two.\n");
  }
}

ExitStatus run_trajectory_info(const InfoCommandOptions& options, const CommonOptions& common) {
  if (!options.share.empty()) throw InvalidArgument("--share is for recordings, not trajectories");
  require_no_reading_options(options.reading, "trajectories");
  jobs::InspectedTrajectory found;
  {
    ProgressBar bar("reading", common);
    found =
        jobs::inspect_trajectory({options.input, options.accuracy, options.topic}, bar.progress());
  }
  log_warnings(options.input, found.warnings);
  if (common.json) {
    print_json(common, trajectory_json(found));
  } else {
    print_trajectory(found);
  }
  return kDone;
}

ExitStatus run_info(const InfoCommandOptions& options, const CommonOptions& common) {
  if (options.share_ranges && options.share.empty()) {
    throw InvalidArgument("--share-ranges needs --share: it says what an excerpt holds");
  }
  const bool is_trajectory =
      !options.topic.empty() || trajectories::trajectory_file_kind(options.input, cancellable()) !=
                                    trajectories::TrajectoryFileKind::none;
  if (is_trajectory) return run_trajectory_info(options, common);
  if (!options.accuracy.empty()) {
    throw InvalidArgument(
        fmt::format("--accuracy goes with a trajectory, and {} is none", options.input));
  }
  InspectedRecording found;
  {
    ProgressBar bar("reading", common);
    found = jobs::inspect_recording({options.input,
                                     read_options(options.reading),
                                     options.share,
                                     {.ranges = options.share_ranges}},
                                    bar.progress());
  }
  log_warnings(options.input, found.warnings);
  if (found.choice) {
    for (const std::string& warning : found.choice->warnings) {
      spdlog::warn("{}: {}", options.input, with_flags(warning));
    }
  }
  if (found.damage) spdlog::error(found.damage->what());
  if (common.json) {
    Json object = audit_json(found);
    if (found.choice) object.update(choice_json(*found.choice));
    if (found.excerpt) object["excerpt"] = excerpt_json(options.share, *found.excerpt);
    if (found.damage) object.update(damage_json(*found.damage));
    print_json(common, object);
  } else {
    print_audit(found);
    if (found.excerpt) print_excerpt(options.share, *found.excerpt);
  }
  return found.damage ? kBadFile : kDone;
}

}  // namespace

Run declare_info(CLI::App& verb) {
  const auto options = std::make_shared<InfoCommandOptions>();
  verb.add_option(
          "INPUT", options->input,
          "Recording, trajectory or accuracies (SMRMSG file) of any known format, or a ROS 2 "
          "bag folder (with metadata.yaml)")
      ->required();
  verb.add_option("--accuracy", options->accuracy, "Accuracies of the trajectory (SMRMSG file)")
      ->type_name("FILE");
  verb.add_option("--trajectory-topic", options->topic,
                  "Look at a ROS bag as a trajectory: at the poses of this topic")
      ->type_name("NAME");
  verb.add_option(
          "--share", options->share,
          "Write a small anonymous excerpt (.nc) that can be sent to the developers: at most "
          "one second, where most shots have a return, without serial number, date, "
          "intensities and ranges")
      ->type_name("OUT");
  verb.add_flag("--share-ranges", options->share_ranges,
                "Keep the ranges in the excerpt. They are left out otherwise because they show the "
                "place of the recording; only calibrations on walls need them");
  add_reading_options(verb, options->reading);
  return [options](const CommonOptions& common) {
    require_apart(common, {options->share});
    return run_info(*options, common);
  };
}

}  // namespace risley::app
