// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Presets by the name of a built-in one or by the path of a file.
#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/text.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"
#include "risley/io/yaml_output.hpp"
#include "risley/sensors/preset.hpp"

#include "sensors/builtin_presets.hpp"

namespace risley::sensors {
namespace {

/// Text of a preset and its name in messages.
struct PresetSource {
  std::string text, path;
};

[[noreturn]] void fail_unknown(const std::string& name, const char* is_neither) {
  const std::vector<std::string> known = builtin_preset_names();
  throw InvalidArgument(fmt::format("sensor \"{}\" {}{}; known presets: {}", name, is_neither,
                                    did_you_mean(name, known), fmt::join(known, ", ")));
}

const BuiltinPreset* find_builtin(const std::string& name) {
  const auto& presets = builtin_presets();
  const auto found = std::find_if(presets.begin(), presets.end(),
                                  [&](const BuiltinPreset& preset) { return preset.name == name; });
  return found == presets.end() ? nullptr : &*found;
}

PresetSource source_of(const std::string& name_or_path) {
  if (const BuiltinPreset* preset = find_builtin(name_or_path)) {
    return {preset->text, fmt::format("built-in preset {}", preset->name)};
  }
  const std::filesystem::path path(name_or_path);
  if (path.extension() == ".yaml" || path.extension() == ".yml" || std::filesystem::exists(path)) {
    return {io::read_text_file(name_or_path), name_or_path};
  }
  fail_unknown(name_or_path, "is neither a file nor a known preset");
}

}  // namespace

std::vector<std::string> builtin_preset_names() {
  std::vector<std::string> names;
  for (const BuiltinPreset& preset : builtin_presets()) names.emplace_back(preset.name);
  std::sort(names.begin(), names.end());
  return names;
}

std::string builtin_preset_text(const std::string& name) {
  const BuiltinPreset* preset = find_builtin(name);
  if (preset == nullptr) fail_unknown(name, "is not a known preset");
  return preset->text;
}

std::string copied_preset_text(const std::string& name_or_path, const std::string& new_name) {
  constexpr std::string_view kAllowed =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
  constexpr std::size_t kLongest = 64;
  if (new_name.empty() || new_name.size() > kLongest ||
      new_name.find_first_not_of(kAllowed) != std::string::npos) {
    throw InvalidArgument(fmt::format(
        "name \"{}\" of a preset, allowed 1 to {} letters, digits, hyphens, underscores and points",
        new_name, kLongest));
  }
  PresetSource source = source_of(name_or_path);
  parse_preset(source.text, source.path);
  const std::string& text = source.text;
  std::size_t line = 0;
  while (line < text.size() && text.compare(line, 5, "name:") != 0) {
    const std::size_t end = text.find('\n', line);
    line = end == std::string::npos ? text.size() : end + 1;
  }
  if (line >= text.size()) {
    io::fail_at(source.path, 0, "expected a line that begins with name:");
  }
  const std::size_t end = std::min(text.find('\n', line), text.size());
  return text.substr(0, line) + "name: " + io::yaml_quoted(new_name) + text.substr(end);
}

Sensor load_sensor(const std::string& name_or_path) {
  const PresetSource source = source_of(name_or_path);
  return parse_preset(source.text, source.path);
}

}  // namespace risley::sensors
