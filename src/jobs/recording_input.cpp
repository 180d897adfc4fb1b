// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/recording_input.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/stored_pose.hpp"
#include "risley/jobs/sensor_choice.hpp"

#include "jobs/open_input.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

using estimation::StoredPoseUse;
using recordings::Extrinsics;

/// The pose that a roll about the optical axis amounts to: recorded = pose unrolled.
Extrinsics roll_about_axis(double roll, const estimation::FrameTurn& frame) {
  const Eigen::Matrix3d axis_frame = estimation::recording_from_sensor(frame);
  const Eigen::Matrix3d turn =
      axis_frame * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()) * axis_frame.transpose();
  // Of Rz(yaw) Ry(pitch) Rx(roll).
  return {std::atan2(turn(1, 0), turn(0, 0)),
          std::atan2(-turn(2, 0), std::hypot(turn(0, 0), turn(1, 0))),
          std::atan2(turn(2, 1), turn(2, 2)),
          {}};
}

std::string share_text(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

}  // namespace

SensorFrameRecording open_in_sensor_frame(const std::string& path,
                                          const recordings::ReadOptions& options,
                                          const std::optional<sensors::Sensor>& given,
                                          const Progress& progress) {
  progress.check();
  recordings::ReadOptions reading = options;
  SensorFrameRecording result{open_input(path, reading), {}, {}, reading.extrinsics.has_value()};
  recordings::require_times(result.reader->header());
  result.choice = choose_sensor(path, reading, result.reader->header(), given, progress);
  result.warnings = result.choice.warnings;
  const sensors::Sensor& sensor = result.choice.sensor;
  if (reading.shot_rate && sensor.train.emitters() > 1) {
    reading.emitters = sensor.train.emitters();
    reading.first_emitter = result.choice.order.first_emitter;
    reading.backwards = result.choice.order.backwards;
    result.reader = open_input(path, reading);
  }
  const recordings::RecordingHeader& header = result.reader->header();
  if (reading.extrinsics || header.devices.size() != 1) return result;
  const recordings::Device& device = header.devices.front();
  const std::optional<Extrinsics> pose = recordings::stored_extrinsics(device);
  recordings::ReadOptions turned_back = reading;
  if (!pose) {
    if (result.choice.roll == 0) return result;
    turned_back.extrinsics = roll_about_axis(result.choice.roll, result.choice.frame);
    result.reader = open_input(path, turned_back);
    result.turned_back = true;
    result.warnings.push_back(fmt::format(
        "the recording is rolled about the optical axis by {:.1f} deg, as the sensor's emitters "
        "show: the shots were turned back by that",
        degrees_from_radians(result.choice.roll)));
    return result;
  }
  turned_back.extrinsics = pose;
  const estimation::StoredPoseVerdict verdict = estimation::judge_stored_pose(
      first_second(path, reading, progress), first_second(path, turned_back, progress),
      sensor.field_of_view);
  const std::string found = fmt::format(
      "the recording states a pose of its sensor ({}); outside the sensor's field of "
      "view lie {} of the shots as recorded and {} after turning back",
      pose_text(*pose), share_text(verdict.outside_as_recorded),
      share_text(verdict.outside_turned_back));
  const bool by_hub =
      !device.hub_serial.empty() && verdict.outside_turned_back <= verdict.outside_as_recorded;
  const bool decided = verdict.use != StoredPoseUse::undecided;
  result.turned_back = decided ? verdict.use == StoredPoseUse::applied : by_hub;
  if (result.turned_back) result.reader = open_input(path, turned_back);
  if (decided && result.turned_back) {
    result.warnings.push_back(found + ": the shots were turned back into the sensor's frame");
  } else if (!decided) {
    result.warnings.push_back(fmt::format(
        "{}: that does not tell whether they were moved by it; {}. Option extrinsics says it: the "
        "pose, or 0,0,0 for shots in the sensor's frame",
        found,
        result.turned_back ? "they were turned back, because a hub recorded them"
                           : "they were taken as they are"));
  }
  return result;
}

EstimationInput read_for_estimation(const EstimationInputOptions& options,
                                    const Progress& progress) {
  const Stopwatch watch;
  const std::string& path = options.recording;
  SensorFrameRecording input =
      open_in_sensor_frame(path, options.reading, given_sensor(options.sensor), progress);
  recordings::Reader& reader = *input.reader;
  if (reader.header().devices.size() > 1) {
    throw InvalidArgument(
        fmt::format("{} holds {} sensors, an estimation takes the recording of one", path,
                    reader.header().devices.size()));
  }
  EstimationInput result;
  result.whole_steps = reader.header().cartesian && !input.turned_back;
  estimation::ShotSelector selector(options.selection);
  recordings::TimeAudit audit;
  recordings::Chunk chunk;
  while (reader.read(chunk)) {
    audit.add(chunk);
    selector.add(chunk.observations);
    progress.report(reader.fraction_read());
  }
  result.recording = {path, reader.header(), audit.result()};
  for (const auto& warning : reader.warnings()) result.warnings.push_back(warning_text(warning));
  result.warnings.insert(result.warnings.end(), input.warnings.begin(), input.warnings.end());
  result.choice = std::move(input.choice);
  result.counts = selector.counts();
  if (result.counts.clock_resets > 0) {
    result.warnings.push_back(
        fmt::format("the clock of the recording jumps back {} times: the "
                    "pieces share the parameters, and their rotors are found "
                    "anew",
                    result.counts.clock_resets));
  }
  result.head = selector.head();
  result.series = selector.take_series();
  result.reading_time = watch.seconds();
  return result;
}

std::string warning_text(const recordings::ReadWarning& warning) {
  std::string text = warning.message;
  if (warning.place.byte_offset) text += fmt::format(" (at byte {})", *warning.place.byte_offset);
  if (warning.place.line) text += fmt::format(" (line {})", *warning.place.line);
  return text;
}

std::string pose_text(const Extrinsics& pose) {
  return fmt::format("yaw {:.6g} pitch {:.6g} roll {:.6g} deg, translation {:.6g} {:.6g} {:.6g} m",
                     degrees_from_radians(pose.yaw), degrees_from_radians(pose.pitch),
                     degrees_from_radians(pose.roll), pose.translation.x, pose.translation.y,
                     pose.translation.z);
}

}  // namespace risley::jobs
