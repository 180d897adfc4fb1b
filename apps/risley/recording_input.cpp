// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recording_input.hpp"

#include <cmath>
#include <cstdlib>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/stored_pose.hpp"

namespace risley::app {
namespace {

using estimation::StoredPoseUse;
using recordings::Extrinsics;

/// Of YAW,PITCH,ROLL in degrees.
Extrinsics extrinsics_from(const std::string& text) {
  constexpr double kFullTurn = 360.0;
  std::vector<double> angles;
  std::size_t begin = 0;
  for (bool more = true; more;) {
    const std::size_t comma = text.find(',', begin);
    more = comma != std::string::npos;
    const std::string number = text.substr(begin, more ? comma - begin : comma);
    char* end = nullptr;
    const double value = std::strtod(number.c_str(), &end);
    if (number.empty() || *end != '\0' || !(std::abs(value) <= kFullTurn)) {
      throw InvalidArgument(
          fmt::format("--extrinsics = '{}', '{}' is no angle; expected YAW,PITCH,ROLL in deg, each "
                      "-360 to 360",
                      text, number));
    }
    angles.push_back(radians_from_degrees(value));
    begin = comma + 1;
  }
  if (angles.size() != 3) {
    throw InvalidArgument(fmt::format(
        "--extrinsics = '{}' has {} angles, expected YAW,PITCH,ROLL in deg", text, angles.size()));
  }
  return {angles[0], angles[1], angles[2], {}};
}

std::unique_ptr<recordings::Reader> open_with(const std::string& path,
                                              const recordings::ReadOptions& options) {
  if (!options.extrinsics) return recordings::open_recording(path, options);
  try {
    return recordings::open_recording(path, options);
  } catch (const InvalidArgument& error) {  // several sensors
    throw InvalidArgument(fmt::format("--extrinsics, {}: {}", path, error.what()));
  }
}

/// Shots of the first second.
estimation::AngleSeries first_second(const std::string& path,
                                     const recordings::ReadOptions& options) {
  estimation::ShotSelector selector({1.0, false, false});  // one shot a second, and all of the head
  try {
    const auto reader = recordings::open_recording(path, options);
    recordings::Chunk chunk;
    while (selector.series().size() < 2 && reader->read(chunk)) {
      selector.add(chunk.observations);
      check_interrupt();
    }
  } catch (const FileError&) {  // who reads on is told of it
  }
  return selector.head();
}

std::string share_text(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

}  // namespace

void add_reading_options(CLI::App& verb, ReadingWishes& wishes) {
  verb.add_option("--shot-rate-hz", wishes.shot_rate_hz,
                  "Shots per second of a recording without times, or with bad ones: times are "
                  "counted, shots without return keep their places");
  verb.add_option("--extrinsics", wishes.extrinsics_deg,
                  "Pose of the sensor in the frame that the recording stands in, deg: recorded = "
                  "Rz(yaw) Ry(pitch) Rx(roll) sensor. Shots are turned back; 0,0,0 leaves them as "
                  "they are, whatever pose the recording states")
      ->type_name("YAW,PITCH,ROLL");
}

recordings::ReadOptions read_options(const ReadingWishes& wishes) {
  recordings::ReadOptions options;
  if (wishes.shot_rate_hz) check_positive(*wishes.shot_rate_hz, "--shot-rate-hz", "Hz");
  options.shot_rate = wishes.shot_rate_hz;
  if (!wishes.extrinsics_deg.empty()) options.extrinsics = extrinsics_from(wishes.extrinsics_deg);
  return options;
}

std::unique_ptr<recordings::Reader> open_input(const std::string& path,
                                               const ReadingWishes& wishes) {
  auto reader = open_with(path, read_options(wishes));
  spdlog::debug("{} is {}", path, reader->header().format);
  return reader;
}

SensorFrameInput open_in_sensor_frame(
    const std::string& path, const ReadingWishes& wishes,
    const std::function<double(const recordings::RecordingHeader&)>& field_of_view) {
  SensorFrameInput result{open_input(path, wishes), {}, !wishes.extrinsics_deg.empty()};
  const recordings::RecordingHeader& header = result.reader->header();
  recordings::require_times(header);
  if (!wishes.extrinsics_deg.empty() || header.devices.size() != 1) return result;
  const recordings::Device& device = header.devices.front();
  const std::optional<Extrinsics> pose = recordings::stored_extrinsics(device);
  if (!pose) return result;
  recordings::ReadOptions options = read_options(wishes);
  const estimation::AngleSeries as_recorded = first_second(path, options);
  options.extrinsics = pose;
  const estimation::StoredPoseVerdict verdict = estimation::judge_stored_pose(
      as_recorded, first_second(path, options), field_of_view(header));
  const std::string found = fmt::format(
      "the recording states a pose of its sensor ({}); outside the sensor's field of "
      "view lie {} of the shots as recorded and {} after turning back",
      pose_text(*pose), share_text(verdict.outside_as_recorded),
      share_text(verdict.outside_turned_back));
  spdlog::debug("{}: {}", path, found);
  const bool by_hub =
      !device.hub_serial.empty() && verdict.outside_turned_back <= verdict.outside_as_recorded;
  const bool decided = verdict.use != StoredPoseUse::undecided;
  const bool turn_back = decided ? verdict.use == StoredPoseUse::applied : by_hub;
  if (turn_back) result.reader = open_with(path, options);
  result.turned_back = turn_back;
  if (decided && turn_back) {
    result.warnings.push_back(found + ": the shots were turned back into the sensor's frame");
  } else if (!decided) {
    result.warnings.push_back(fmt::format(
        "{}: that does not tell whether they were moved by it; {}. --extrinsics says it: the pose, "
        "or 0,0,0 for shots in the sensor's frame",
        found,
        turn_back ? "they were turned back, because a hub recorded them"
                  : "they were taken as they are"));
  }
  return result;
}

std::string pose_text(const Extrinsics& pose) {
  return fmt::format("yaw {:.6g} pitch {:.6g} roll {:.6g} deg, translation {:.6g} {:.6g} {:.6g} m",
                     degrees_from_radians(pose.yaw), degrees_from_radians(pose.pitch),
                     degrees_from_radians(pose.roll), pose.translation.x, pose.translation.y,
                     pose.translation.z);
}

}  // namespace risley::app
