// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "sensors/yaml_map.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/error.hpp"

namespace risley::sensors {
namespace {

std::size_t line_of(const YAML::Mark& mark) {
  return mark.is_null() ? 0 : static_cast<std::size_t>(mark.line) + 1;
}

std::string kind_of(const YAML::Node& node) {
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return "a list";
  if (node.IsScalar()) return fmt::format("\"{}\"", node.Scalar());
  return "nothing";
}

}  // namespace

YAML::Node parse_yaml(const std::string& text, const std::string& path) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    fail_at(path, line_of(error.mark), fmt::format("is not YAML: {}", error.msg));
  }
}

std::size_t yaml_line(const YAML::Node& node) { return line_of(node.Mark()); }

void fail_at(const std::string& path, std::size_t line, const std::string& problem) {
  FilePlace place;
  if (line > 0) place.line = line;
  throw FileError(path, place, problem);
}

long double yaml_number(const YAML::Node& node, const std::string& path, const std::string& field) {
  long double value = 0;
  const auto expected = [&] {
    fail_at(path, yaml_line(node),
            fmt::format("{}: expected a finite number, found {}", field, kind_of(node)));
  };
  if (!node.IsScalar()) expected();
  std::string_view text = node.Scalar();
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) expected();
  return value;
}

std::string yaml_text(const YAML::Node& node, const std::string& path, const std::string& field) {
  if (!node.IsScalar()) {
    fail_at(path, yaml_line(node),
            fmt::format("{}: expected text, found {}", field, kind_of(node)));
  }
  return node.Scalar();
}

YamlMap::YamlMap(const YAML::Node& node, std::string path, std::string field)
    : path_(std::move(path)), field_(std::move(field)), line_(yaml_line(node)) {
  const std::string called = field_.empty() ? "the file" : field_;
  if (!node.IsMap()) {
    fail_at(path_, line_, fmt::format("{}: expected a map, found {}", called, kind_of(node)));
  }
  for (const auto& item : node) {
    const std::size_t line = yaml_line(item.first);
    const std::string key = yaml_text(item.first, path_, fmt::format("a key of {}", called));
    if (find(key) != nullptr)
      fail_at(path_, line, fmt::format("{} stands twice", this->field(key)));
    entries_.push_back({key, line, item.second});
  }
}

void YamlMap::allow_only(std::initializer_list<std::string_view> keys) const {
  for (const Entry& entry : entries_) {
    if (std::find(keys.begin(), keys.end(), entry.key) != keys.end()) continue;
    fail_at(path_, entry.line,
            fmt::format("unknown field {}, allowed here: {}", field(entry.key),
                        fmt::join(keys.begin(), keys.end(), ", ")));
  }
}

const YamlMap::Entry* YamlMap::find(std::string_view key) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [key](const Entry& entry) { return entry.key == key; });
  return found == entries_.end() ? nullptr : &*found;
}

const YamlMap::Entry& YamlMap::at(std::string_view key) const {
  const Entry* entry = find(key);
  if (entry == nullptr) fail_at(path_, line_, fmt::format("{} is missing", field(key)));
  return *entry;
}

std::string YamlMap::text(std::string_view key) const {
  return yaml_text(at(key).value, path_, field(key));
}

long double YamlMap::number(std::string_view key, long double lower, long double upper,
                            std::string_view unit) const {
  const Entry& entry = at(key);
  const long double value = yaml_number(entry.value, path_, field(key));
  if (value < lower || value > upper) {
    fail_at(path_, entry.line,
            fmt::format("{} = {} {}, allowed {:g} to {:g}", field(key), entry.value.Scalar(), unit,
                        lower, upper));
  }
  return value;
}

int YamlMap::integer(std::string_view key, int lower, int upper) const {
  const Entry& entry = at(key);
  const long double value = yaml_number(entry.value, path_, field(key));
  if (value < lower || value > upper || value != std::floor(value)) {
    fail_at(path_, entry.line,
            fmt::format("{} = {}, allowed whole numbers {} to {}", field(key), entry.value.Scalar(),
                        lower, upper));
  }
  return static_cast<int>(value);
}

std::string YamlMap::field(std::string_view key) const {
  return field_.empty() ? std::string(key) : fmt::format("{}.{}", field_, key);
}

}  // namespace risley::sensors
