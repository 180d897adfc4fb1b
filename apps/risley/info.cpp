// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/inspect_recording.hpp"
#include "risley/jobs/inspect_trajectory.hpp"
#include "risley/jobs/prepared_recording.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"

#include "command.hpp"
#include "many_files.hpp"
#include "reading_options.hpp"
#include "table.hpp"
#include "trajectory_text.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

using jobs::InspectedRecording;
using recordings::Excerpt;
using recordings::TimeAuditResult;
using recordings::ValueRange;

struct InfoCommandOptions {
  jobs::ManyInputsOptions many;
  std::string input, share, accuracy, topic;
  bool share_ranges = false;
  ReadingWishes reading;
};

std::string range_text(const std::optional<ValueRange>& range, double scale, int decimals,
                       std::string_view unit) {
  if (!range) return "none";
  return fmt::format("{:.{}f} to {:.{}f} {}", range->min * scale, decimals, range->max * scale,
                     decimals, unit);
}

/// Properties that only sensors of the second generation report.
void add_numbered(const recordings::RecordingHeader& header, const recordings::Device& device,
                  const recordings::NumberedAudit& audit, Table& table) {
  const auto add_known = [&table](const char* name, const std::string& value) {
    if (!value.empty()) table.add({name, value});
  };
  add_known("address", device.address);
  add_known("firmware", header.device_detail(device, "firmware"));
  add_known("field of view", header.device_detail(device, "field_of_view"));
  if (audit.outside_view > 0) {
    table.add({"not looked at", grouped(audit.outside_view) + " shots outside the field of view"});
  }
  table.add({"lost packets", fmt::format("{}, by their numbers", audit.lost_packets)});
  for (std::size_t tag = 0; tag < audit.observations_by_tag.size(); ++tag) {
    if (audit.observations_by_tag[tag] == 0) continue;
    table.add(
        {fmt::format("tag 0x{:02X}", tag),
         fmt::format("{} observations: {}", grouped(audit.observations_by_tag[tag]),
                     recordings::livox::tag_words(device.type, static_cast<std::uint8_t>(tag)))});
  }
}

void print_audit(const InspectedRecording& found) {
  const recordings::RecordingHeader& header = found.header;
  const TimeAuditResult& audit = found.audit;
  Table table;
  table.add({"format", header.format});
  if (found.choice) {
    const std::string name = jobs::sensor_name(*found.choice);
    table.add(
        {"sensor", fmt::format("{}, {}{}", name,
                               found.choice->chosen_by == jobs::ChosenBy::guess && name != "unknown"
                                   ? "a guess "
                                   : "",
                               found.choice->words)});
  } else {
    table.add({"sensor", jobs::sensor_name(header)});
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
  if (header.devices.size() > 1) table.add({"sensors", recordings::devices_words(header)});
  for (const recordings::Device& device : header.devices) {
    if (!device.serial.empty()) table.add({"serial", device.serial});
    if (!device.hub_serial.empty()) table.add({"through the hub", device.hub_serial});
    if (const auto pose = recordings::stored_extrinsics(device)) {
      table.add({"states a pose", jobs::pose_text(*pose)});
    }
  }
  for (std::size_t i = 0; i < audit.numbered_by_device.size(); ++i) {
    if (audit.numbered_by_device[i]) {
      add_numbered(header, header.devices[i], *audit.numbered_by_device[i], table);
    }
  }
  table.add({"warnings", grouped(found.warnings.size())});
  table.print();
}

void print_excerpt(const Excerpt& excerpt) {
  const recordings::ExcerptContents contents = contents_of(excerpt);
  const std::string duration =
      excerpt.has_times ? fmt::format(" in {:.6g} s", excerpt.duration) : "";
  say("\n{}: {} shots{}, {} observations without return\n", excerpt.path, grouped(excerpt.shots),
      duration, grouped(excerpt.no_return));
  say("  holds: {}\n  does not hold: {}\n", fmt::join(contents.holds, "; "),
      fmt::join(contents.lacks, "; "));
  if (excerpt.rounded) {
    say("  Directions are rounded because coordinates in whole steps reveal the range; it\n  "
        "remains known to a factor of two.\n");
  }
}

ExitStatus run_trajectory_info(const InfoCommandOptions& options, const CommonOptions& common) {
  if (!options.share.empty()) throw InvalidArgument("--share is for recordings, not trajectories");
  jobs::InspectedTrajectory found;
  {
    ProgressBar bar("reading", common);
    found =
        jobs::inspect_trajectory({options.input, options.accuracy, options.topic}, bar.progress());
  }
  log_warnings(options.input, found.warnings);
  if (common.json) {
    print_json(common, json::of(found));
  } else {
    print_trajectory(found);
  }
  return kDone;
}

ExitStatus run_info(const InfoCommandOptions& options, const CommonOptions& common) {
  if (options.share_ranges && options.share.empty()) {
    throw InvalidArgument("--share-ranges needs --share: it sets the contents of an excerpt");
  }
  const recordings::ReadOptions reading = read_options(options.reading);
  if (jobs::is_trajectory({options.input, options.accuracy, options.topic}, reading,
                          cancellable())) {
    return run_trajectory_info(options, common);
  }
  InspectedRecording found;
  {
    ProgressBar bar("reading", common);
    found = jobs::inspect_recording(
        {options.input, reading, options.share, {.ranges = options.share_ranges}}, bar.progress());
  }
  log_warnings(options.input, found.warnings);
  if (found.damage) spdlog::error(found.damage->what());
  if (common.json) {
    print_json(common, json::with_status(json::of(found), found.damage));
  } else {
    print_audit(found);
    if (found.excerpt) print_excerpt(*found.excerpt);
  }
  return found.damage ? kBadFile : kDone;
}

}  // namespace

Run declare_info(CLI::App& verb) {
  const auto options = std::make_shared<InfoCommandOptions>();
  add_many_options(verb, options->many,
                   "Recordings, trajectories or accuracies (SMRMSG files) of any known format, or "
                   "ROS 2 bag folders (with metadata.yaml)");
  verb.add_option("--accuracy", options->accuracy, "Accuracies of the trajectory (SMRMSG file)")
      ->type_name("FILE");
  verb.add_option("--trajectory-topic", options->topic,
                  "Read a ROS bag as a trajectory: the poses of this topic")
      ->type_name("NAME");
  verb.add_option("--share", options->share,
                  "Write a small anonymous excerpt (.nc) to send to the developers: at most one "
                  "second, without serial number, date, intensities and ranges")
      ->type_name("OUT");
  verb.add_flag("--share-ranges", options->share_ranges,
                "Keep the ranges in the excerpt, which reveal the place of the recording; only "
                "calibrations on walls need them");
  add_reading_options(verb, options->reading);
  return [options, &verb](const CommonOptions& common) {
    require_apart(common, {options->share});
    const jobs::InputWork work = json::inspect_each(
        {read_options(options->reading), options->accuracy, options->topic}, log_words);
    const jobs::InputPlan plan = jobs::plan_inputs(options->many, work, cancellable());
    if (!options->share.empty() && plan.many) {
      throw InvalidArgument(
          fmt::format("--share is for one recording, and there are {}", plan.jobs.size()));
    }
    if (plan.many) return run_inputs(plan, work, options->many, verb, common);
    options->input = plan.jobs.front().input;
    return run_info(*options, common);
  };
}

}  // namespace risley::app
