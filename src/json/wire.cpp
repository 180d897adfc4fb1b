// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "risley/jobs/emulate_sensor.hpp"
#include "risley/jobs/record_sensors.hpp"
#include "risley/json/results.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::json {
namespace {

Json found_json(const jobs::FoundSensor& sensor) {
  return {{"serial", sensor.serial},
          {"sensor", recordings::device_type_name(sensor.device_type)},
          {"address", to_string(sensor.address)}};
}

Json gaps_json(const std::vector<jobs::RecordedGap>& gaps) {
  Json json = Json::array();
  for (const jobs::RecordedGap& gap : gaps) {
    json.push_back({{"begin_s", gap.begin},
                    {"end_s", gap.end},
                    {"lost", gap.lost ? Json(*gap.lost) : Json()},
                    {"data", gap.imu ? "imu" : "points"}});
  }
  return json;
}

}  // namespace

Json of(const std::vector<jobs::FoundSensor>& found) {
  Json sensors = Json::array();
  for (const jobs::FoundSensor& sensor : found) sensors.push_back(found_json(sensor));
  return {{"sensors", sensors}};
}

Json of(const jobs::RecordedSensors& recorded) {
  Json sensors = Json::array();
  for (const jobs::RecordedSensor& one : recorded.sensors) {
    Json sensor = found_json(one.sensor);
    sensor.update({{"firmware", one.firmware.empty() ? Json() : Json(one.firmware)},
                   {"rows", one.counts.rows},
                   {"packets", one.counts.packets},
                   {"imu_samples", one.counts.imu_samples},
                   {"lost", one.counts.lost},
                   {"kernel_drops", one.kernel_drops},
                   {"rejected", one.rejected},
                   {"duplicates", one.counts.duplicates},
                   {"reordered", one.counts.reordered},
                   {"late", one.counts.late},
                   {"clock_jumps", one.counts.clock_jumps},
                   {"sessions", one.sessions},
                   {"gaps", gaps_json(one.gaps)},
                   {"statuses", one.statuses}});
    sensors.push_back(std::move(sensor));
  }
  return {
      {"output", recorded.output},
      {"interface", to_string(recorded.interface)},
      {"duration_s", recorded.duration},
      {"frames", recorded.frames},
      {"bytes", recorded.bytes},
      {"receive_buffer_bytes",
       {{"asked", recorded.receive_buffer_asked}, {"granted", recorded.receive_buffer_granted}}},
      {"strangers", recorded.strangers},
      {"sensors", sensors}};
}

Json of(const jobs::EmulatedSensor& truth) {
  Json sensor = found_json({truth.serial, truth.device_type, truth.address});
  sensor.update({{"rows", truth.rows},
                 {"packets", truth.packets},
                 {"imu_samples", truth.imu_samples},
                 {"lost", truth.lost},
                 {"lost_at_ends", truth.lost_at_ends},
                 {"unsent", truth.unsent},
                 {"kernel_drops", truth.kernel_drops},
                 {"rejected", truth.rejected},
                 {"duplicates", truth.duplicates},
                 {"reordered", truth.reordered},
                 {"wrong_checksums", truth.wrong_checksums},
                 {"sessions", truth.sessions},
                 {"restarts", truth.restarts},
                 {"behind_s", truth.behind}});
  return {{"duration_s", truth.duration}, {"sensors", Json::array({sensor})}};
}

}  // namespace risley::json
