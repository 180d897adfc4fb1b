// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recording_text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/jobs/recording_input.hpp"

namespace risley::app {

std::string sensor_name(const recordings::RecordingHeader& header) {
  std::vector<std::string> names;
  for (const recordings::Device& device : header.devices) {
    const std::string name = recordings::device_type_name(device.type);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string sensor_name(const jobs::SensorChoice& choice) {
  const bool unknown = choice.chosen_by == jobs::ChosenBy::guess && choice.fits == false;
  return unknown ? "unknown"
                 : fmt::format("{} {}", choice.sensor.manufacturer, choice.sensor.model);
}

Json choice_json(const jobs::SensorChoice& choice) {
  std::vector<std::string> warnings = choice.warnings;
  put_flags(warnings);
  Json misfits = Json::array();
  for (const jobs::PresetMisfit& one : choice.misfits) {
    const bool has_lines = std::isfinite(one.misfit);
    misfits.push_back(
        {{"preset", one.preset},
         {"misfit_deg", has_lines ? Json(degrees_from_radians(one.misfit)) : Json()}});
  }
  return {{"sensor", sensor_name(choice)},
          {"preset", choice.sensor.name},
          {"sensor_chosen_by", to_string(choice.chosen_by)},
          {"sensor_choice",
           {{"words", choice.words},
            {"fits", choice.fits ? Json(*choice.fits) : Json()},
            {"misfits", misfits},
            {"warnings", warnings}}}};
}

Json value_json(double value, double sigma) {
  return {{"value", degrees_from_radians(value)}, {"sigma", degrees_from_radians(sigma)}};
}

Json frame_json(const std::optional<estimation::FrameEstimate>& turn) {
  const estimation::FrameEstimate frame = turn.value_or(estimation::FrameEstimate{});
  return {{"yaw_deg", value_json(frame.turn.yaw, std::sqrt(frame.covariance(0, 0)))},
          {"pitch_deg", value_json(frame.turn.pitch, std::sqrt(frame.covariance(1, 1)))},
          {"estimated", turn.has_value()}};
}

Json slips_json(const std::vector<recordings::ShotSlip>& slips) {
  Json list = Json::array();
  for (const recordings::ShotSlip& slip : slips) {
    list.push_back({{"row", slip.row}, {"shots", nullptr}});
    if (slip.counted) list.back()["shots"] = slip.shots;
  }
  return list;
}

Json warnings_json(const std::vector<recordings::ReadWarning>& warnings) {
  Json list = Json::array();
  for (const recordings::ReadWarning& warning : warnings) {
    list.push_back(
        {{"message", jobs::warning_text(warning)}, {"lost_records", warning.lost_records}});
  }
  return list;
}

void log_warnings(const std::string& file, const std::vector<recordings::ReadWarning>& warnings) {
  for (const recordings::ReadWarning& warning : warnings) {
    spdlog::warn("{}: {}", file, jobs::warning_text(warning));
  }
}

Json damage_json(const FileError& damage) {
  Json object = {{"error", damage.what()},
                 {"exit_status", static_cast<int>(kBadFile)},
                 {"file", damage.path()}};
  if (damage.place().byte_offset) object["byte_offset"] = *damage.place().byte_offset;
  if (damage.place().line) object["line"] = *damage.place().line;
  return object;
}

std::string grouped(std::uint64_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ' ';
    text += digits[i];
  }
  return text;
}

}  // namespace risley::app
