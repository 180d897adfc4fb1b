// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recording_text.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

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

std::vector<std::string> warning_texts(const std::vector<recordings::ReadWarning>& warnings) {
  std::vector<std::string> texts;
  for (const recordings::ReadWarning& warning : warnings) {
    std::string text = warning.message;
    if (warning.place.byte_offset) text += fmt::format(" (at byte {})", *warning.place.byte_offset);
    if (warning.place.line) text += fmt::format(" (line {})", *warning.place.line);
    texts.push_back(std::move(text));
  }
  return texts;
}

Json warnings_json(const std::vector<recordings::ReadWarning>& warnings) {
  Json list = Json::array();
  const std::vector<std::string> texts = warning_texts(warnings);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    list.push_back({{"message", texts[i]}, {"lost_records", warnings[i].lost_records}});
  }
  return list;
}

void log_warnings(const std::string& file, const std::vector<recordings::ReadWarning>& warnings) {
  for (const std::string& text : warning_texts(warnings)) spdlog::warn("{}: {}", file, text);
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
