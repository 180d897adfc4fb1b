// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reading_options.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"

namespace risley::app {
namespace {

/// Of YAW,PITCH,ROLL in degrees.
recordings::Extrinsics extrinsics_from(const std::string& text) {
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
      throw InvalidArgument(fmt::format(
          "--extrinsics = '{}': '{}' is not an angle; expected YAW,PITCH,ROLL in deg, each "
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

}  // namespace

void add_reading_options(CLI::App& verb, ReadingWishes& wishes) {
  verb.add_option("--device", wishes.device,
                  "One sensor of a recording of several: its serial number, topic, or number in "
                  "the list of info, from 0 (default: the only one)")
      ->type_name("SERIAL|TOPIC|INDEX");
  verb.add_option(
      "--shot-rate-hz", wishes.shot_rate_hz,
      "Shots per second, Hz, for recordings with missing or bad times: times are counted from the "
      "shots, including those without a return (default: the times in the file)");
  verb.add_option("--extrinsics", wishes.extrinsics_deg,
                  "Rotation of the sensor in the recording's frame, deg: recorded = Rz(yaw) "
                  "Ry(pitch) Rx(roll) sensor. The shots are rotated back by it; 0,0,0 leaves them "
                  "unchanged (default: as stated in the recording)")
      ->type_name("YAW,PITCH,ROLL");
}

void add_every_device(CLI::App& verb, ReadingWishes& wishes) {
  verb.add_flag("--every-device", wishes.every_device,
                "Write one file for each sensor of a recording of several, with its serial number "
                "or number in the name")
      ->excludes("--device");
}

void split_by_device(const ReadingWishes& wishes, jobs::InputPlan& plan) {
  if (!wishes.every_device) return;
  std::vector<jobs::InputJob> split;
  for (const jobs::InputJob& job : plan.jobs) {
    const auto devices = recordings::open_recording(job.input, {}, cancellable())->header().devices;
    for (std::size_t i = 0; i < devices.size(); ++i) {
      jobs::InputJob one = job;
      if (devices.size() > 1) {
        one.device = std::to_string(i);
        const std::string name = "-" + (devices[i].serial.empty() ? one.device : devices[i].serial);
        const std::filesystem::path output(job.output);
        one.output =
            (output.parent_path() / output.stem()).string() + name + output.extension().string();
        one.place += name;
        plan.many = true;
      }
      split.push_back(std::move(one));
    }
  }
  plan.jobs = std::move(split);
}

recordings::ReadOptions read_options(const ReadingWishes& wishes) {
  recordings::ReadOptions options;
  options.device = wishes.device;
  if (wishes.shot_rate_hz) require_positive(kSetting.shot_rate, *wishes.shot_rate_hz);
  options.shot_rate = wishes.shot_rate_hz;
  if (!wishes.extrinsics_deg.empty()) options.extrinsics = extrinsics_from(wishes.extrinsics_deg);
  return options;
}

}  // namespace risley::app
