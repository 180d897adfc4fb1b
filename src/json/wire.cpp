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

const char* cause_name(recordings::livox::GapCause cause) {
  switch (cause) {
    case recordings::livox::GapCause::clock:
      return "clock";
    case recordings::livox::GapCause::session:
      return "session";
    case recordings::livox::GapCause::loss:
      break;
  }
  return "loss";
}

Json gaps_json(const std::vector<jobs::RecordedGap>& gaps) {
  Json json = Json::array();
  for (const jobs::RecordedGap& gap : gaps) {
    json.push_back({{"begin_s", gap.begin},
                    {"end_s", gap.end},
                    {"lost", gap.lost ? Json(*gap.lost) : Json()},
                    {"data", gap.imu ? "imu" : "points"},
                    {"cause", cause_name(gap.cause)}});
  }
  return json;
}

Json clocks_json(const std::vector<jobs::RecordedClock>& clocks) {
  Json json = Json::array();
  for (const jobs::RecordedClock& clock : clocks) {
    const auto& drift = clock.drift;
    json.push_back({{"source", to_string(clock.source)},
                    {"begin_s", clock.begin},
                    {"end_s", clock.end},
                    {"offset_s", {{"min", clock.least_offset}, {"max", clock.greatest_offset}}},
                    {"drift_ppm", drift ? Json(drift->ppm) : Json()},
                    {"drift_sigma_ppm", drift ? Json(drift->sigma_ppm) : Json()}});
  }
  return json;
}

Json statuses_json(const std::vector<jobs::RecordedStatus>& statuses) {
  Json json = Json::array();
  for (const jobs::RecordedStatus& one : statuses) {
    json.push_back({{"begin_s", one.begin},
                    {"status", one.status},
                    {"says", recordings::livox::status_words(one.status)}});
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
                   {"statuses", one.statuses},
                   {"clocks", clocks_json(one.clocks)},
                   {"status_changes", statuses_json(one.status_changes)}});
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
                 {"clock_jumps", truth.clock_jumps},
                 {"behind_s", truth.behind}});
  return {{"duration_s", truth.duration}, {"sensors", Json::array({sensor})}};
}

}  // namespace risley::json
