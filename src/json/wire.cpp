// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>

#include <nlohmann/json.hpp>

#include "risley/core/angle.hpp"
#include "risley/jobs/emulate_sensor.hpp"
#include "risley/jobs/record_sensors.hpp"
#include "risley/json/results.hpp"
#include "risley/optics/parameters.hpp"
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

const char* sync_name(std::uint8_t sync) {
  constexpr const char* kNames[] = {"none", "PTP", "GPS"};
  return sync < std::size(kNames) ? kNames[sync] : "unknown";
}

/// A report of a sensor of the second generation.
Json report_json(const wire::SensorReport& report) {
  return {
      {"work_state", report.work_state ? Json(wire::work_state_words(*report.work_state)) : Json()},
      {"time_sync", report.sync ? Json(sync_name(*report.sync)) : Json()},
      {"says", wire::trouble_words(report)}};
}

Json reports_json(const std::vector<jobs::RecordedReport>& reports) {
  Json json = Json::array();
  for (const jobs::RecordedReport& one : reports) {
    Json report = report_json(one.report);
    report["begin_s"] = one.begin;
    json.push_back(std::move(report));
  }
  return json;
}

/// In the unit that the parameter's name ends with.
double per_unit(const std::string& parameter) {
  const ParameterInfo* known = find_parameter_of_any_train(parameter);
  return known != nullptr ? known->si_per_unit : 1.0;
}

Json alarm_json(const estimation::OpticsAlarm& alarm) {
  const double unit = per_unit(alarm.parameter);
  return {{"kind", to_string(alarm.kind)}, {"sensor_time_ns", alarm.time_ns},
          {"after_s", alarm.time},         {"p_value", alarm.p_value},
          {"parameter", alarm.parameter},  {"difference", alarm.difference / unit},
          {"sigma", alarm.sigma / unit}};
}

/// State reported by a sensor, in words.
Json status_json(std::uint32_t status) {
  const auto level = [status](int bit) {
    constexpr const char* kNames[] = {"normal", "warning", "error", "unknown"};
    return kNames[status >> static_cast<unsigned>(bit) & 3U];
  };
  constexpr int kTemperature = 0, kVoltage = 2, kMotor = 4, kWindow = 6, kSystem = 30;
  return {{"temperature", level(kTemperature)},
          {"voltage", level(kVoltage)},
          {"motor", level(kMotor)},
          {"window", level(kWindow)},
          {"system", level(kSystem)}};
}

/// Least and greatest reported by the sensor.
Json temperature_json(const jobs::RecordedSensor& one) {
  if (!one.coldest) return {};
  return {{"min", *one.coldest}, {"max", *one.warmest}};
}

/// @param report  empty if there is none
Json live_report_json(const std::optional<wire::SensorReport>& report) {
  if (!report) return {};
  Json json = report_json(*report);
  json["temperature_deg_c"] =
      report->temperature_cdeg ? Json(1e-2 * *report->temperature_cdeg) : Json();
  return json;
}

/// @param optics  empty if they are not watched
Json optics_json(const std::optional<jobs::OpticsHealth>& optics) {
  if (!optics) return {};
  const estimation::RunningState& state = optics->state;
  Json parameters = Json::array(), speeds = Json::array();
  for (const estimation::RunningParameter& one : state.parameters) {
    const double unit = per_unit(one.name);
    parameters.push_back({{"name", one.name},
                          {"value", one.value / unit},
                          {"sigma", one.sigma / unit},
                          {"sigma_given_held", one.sigma_given_held / unit},
                          {"change", one.change / unit},
                          {"change_sigma", one.change_sigma / unit},
                          {"off_reference", one.off_sensor / unit},
                          {"off_reference_sigma", one.off_sensor_sigma / unit}});
  }
  for (const estimation::RunningSpeed& one : state.speeds) {
    speeds.push_back({{"deg_per_s", degrees_from_radians(one.value)},
                      {"sigma_deg_per_s", degrees_from_radians(one.sigma)}});
  }
  return {{"reference", optics->reference},
          {"is_reference", optics->is_reference},
          {"words", optics->words},
          {"phase", to_string(state.phase)},
          {"pieces", state.pieces},
          {"short_pieces", state.short_pieces},
          {"unfit_pieces", state.unfit_pieces},
          {"reason", state.reason},
          {"dropped_packets", optics->dropped_packets},
          {"window_s", state.window},
          {"angle_noise_deg", degrees_from_radians(state.angle_noise)},
          {"speeds", speeds},
          {"parameters", parameters},
          {"scatter_variance_factor", state.scatter_variance_factor},
          {"change_p_value", state.change_p_value},
          {"reference_p_value", optics->is_reference ? Json(state.unlike_p_value) : Json()},
          {"alarm_p_value", state.alarm_p_value},
          {"alarmed", state.alarmed},
          {"alarms", state.alarms},
          {"alarm", state.alarm ? alarm_json(*state.alarm) : Json()}};
}

/// Published points; null if none were requested.
Json published_json(const std::optional<jobs::PublishedPoints>& published) {
  return published ? Json(published->points) : Json();
}

Json milliseconds(const std::optional<double>& seconds) {
  return seconds ? Json(1e3 * *seconds) : Json();
}

/// Time within which 99 % of the frames of points followed their packets.
Json latency_json(const std::optional<jobs::PublishedPoints>& published) {
  return published ? milliseconds(published->latency) : Json();
}

/// Their further properties.
Json publishing_json(const std::optional<jobs::PublishedPoints>& published) {
  if (!published) return {};
  return {{"calibration", published->calibration},
          {"is_calibrated", published->is_calibrated},
          {"words", published->words},
          {"frames", published->frames},
          {"missing_packets", published->missing_packets},
          {"longest_latency_ms", milliseconds(published->longest_latency)}};
}

Json viewers_json(const std::optional<wire::FoxgloveCounts>& counts) {
  if (!counts) return {};
  return {{"connections", counts->connections},
          {"refused", counts->refused},
          {"sent_frames", counts->sent_messages},
          {"dropped_frames", counts->dropped_messages}};
}

/// Shots for drawing on a page: azimuth and zenith, deg, and range, m.
Json seen_json(const std::vector<jobs::SeenShot>& seen) {
  const auto hundredths = [](double value) { return std::round(100 * value) / 100; };
  Json shots = Json::array();
  for (const jobs::SeenShot& shot : seen) {
    shots.push_back({hundredths(degrees_from_radians(shot.azimuth)),
                     hundredths(degrees_from_radians(shot.zenith)), hundredths(shot.range)});
  }
  return shots;
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
                   {"status_changes", statuses_json(one.status_changes)},
                   {"reports", reports_json(one.reports)},
                   {"temperature_deg_c", temperature_json(one)},
                   {"output", recorded.files[one.file].path},
                   {"optics", optics_json(one.optics)},
                   {"published", published_json(one.published)},
                   {"latency_ms", latency_json(one.published)},
                   {"publishing", publishing_json(one.published)}});
    sensors.push_back(std::move(sensor));
  }
  std::uint64_t frames = 0, bytes = 0;
  for (const auto& file : recorded.files) {
    frames += file.frames;
    bytes += file.bytes;
  }
  return {
      {"output", recorded.files.front().path},
      {"interface", to_string(recorded.interface)},
      {"duration_s", recorded.duration},
      {"frames", frames},
      {"bytes", bytes},
      {"receive_buffer_bytes",
       {{"asked", recorded.receive_buffer_asked}, {"granted", recorded.receive_buffer_granted}}},
      {"strangers", recorded.strangers},
      {"viewers", viewers_json(recorded.viewers)},
      {"sensors", sensors}};
}

Json of(const jobs::LiveRecording& live) {
  Json sensors = Json::array();
  for (const jobs::LiveSensorState& one : live.sensors) {
    Json sensor = found_json(one.sensor);
    sensor.update({{"rows", one.counts.rows},
                   {"packets", one.counts.packets},
                   {"lost", one.counts.lost},
                   {"kernel_drops", one.kernel_drops},
                   {"rejected", one.rejected},
                   {"silent", one.silent},
                   {"status", one.status ? status_json(*one.status) : Json()},
                   {"report", live_report_json(one.report)},
                   {"optics", optics_json(one.optics)},
                   {"published", published_json(one.published)},
                   {"latency_ms", latency_json(one.published)},
                   {"publishing", publishing_json(one.published)},
                   {"seen", seen_json(one.seen)}});
    sensors.push_back(std::move(sensor));
  }
  return {{"duration_s", live.duration}, {"over", live.over}, {"sensors", sensors}};
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
                 {"bends", truth.bends},
                 {"behind_s", truth.behind}});
  return {{"duration_s", truth.duration}, {"sensors", Json::array({sensor})}};
}

}  // namespace risley::json
