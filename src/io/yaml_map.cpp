// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/yaml_map.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "risley/core/error.hpp"

namespace risley::io {
namespace {

constexpr std::size_t kMostNodes = 1'000'000;

std::size_t line_of(const YAML::Mark& mark) {
  return mark.is_null() ? 0 : static_cast<std::size_t>(mark.line) + 1;
}

/// The tree of a parsed text without its library. @param nodes  how many there are so far
YamlNode copied(const YAML::Node& node, const std::string& path, std::size_t& nodes) {
  YamlNode copy;
  copy.line = line_of(node.Mark());
  if (++nodes > kMostNodes) {
    fail_at(path, copy.line,
            fmt::format("has more values than {}, aliases (*name) included", kMostNodes));
  }
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      copy.kind = YamlNode::Kind::scalar;
      copy.scalar = node.Scalar();
      break;
    case YAML::NodeType::Sequence:
      copy.kind = YamlNode::Kind::list;
      for (const auto& item : node) copy.items.push_back(copied(item, path, nodes));
      break;
    case YAML::NodeType::Map:
      copy.kind = YamlNode::Kind::map;
      for (const auto& item : node) {
        copy.items.push_back(copied(item.first, path, nodes));
        copy.items.push_back(copied(item.second, path, nodes));
      }
      break;
    default:
      break;
  }
  return copy;
}

std::string kind_of(const YamlNode& node) {
  switch (node.kind) {
    case YamlNode::Kind::map:
      return "a map";
    case YamlNode::Kind::list:
      return "a list";
    case YamlNode::Kind::scalar:
      return fmt::format("\"{}\"", node.scalar);
    case YamlNode::Kind::nothing:
      break;
  }
  return "nothing";
}

}  // namespace

YamlNode parse_yaml(const std::string& text, const std::string& path) {
  try {
    std::size_t nodes = 0;
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    if (documents.empty()) return {};
    if (documents.size() > 1) {
      fail_at(
          path, line_of(documents[1].Mark()),
          fmt::format("a second document (after ---), expected one: {} of them", documents.size()));
    }
    return copied(documents.front(), path, nodes);
  } catch (const YAML::Exception& error) {
    fail_at(path, line_of(error.mark), fmt::format("is not YAML: {}", error.msg));
  }
}

void fail_at(const std::string& path, std::size_t line, const std::string& problem) {
  FilePlace place;
  if (line > 0) place.line = line;
  throw FileError(path, place, problem);
}

long double yaml_number(const YamlNode& node, const std::string& path, const std::string& field) {
  long double value = 0;
  const auto expected = [&] {
    fail_at(path, node.line,
            fmt::format("{}: expected a finite number, found {}", field, kind_of(node)));
  };
  if (node.kind != YamlNode::Kind::scalar) expected();
  std::string_view text = node.scalar;
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) expected();
  return value;
}

std::string yaml_text(const YamlNode& node, const std::string& path, const std::string& field) {
  if (node.kind != YamlNode::Kind::scalar) {
    fail_at(path, node.line, fmt::format("{}: expected text, found {}", field, kind_of(node)));
  }
  return node.scalar;
}

YamlMap::YamlMap(const YamlNode& node, std::string path, std::string field)
    : path_(std::move(path)), field_(std::move(field)), line_(node.line) {
  const std::string called = field_.empty() ? "the file" : field_;
  if (node.kind != YamlNode::Kind::map) {
    fail_at(path_, line_, fmt::format("{}: expected a map, found {}", called, kind_of(node)));
  }
  for (std::size_t i = 0; i < node.items.size(); i += 2) {
    const std::size_t line = node.items[i].line;
    const std::string key = yaml_text(node.items[i], path_, fmt::format("a key of {}", called));
    if (!places_.emplace(key, entries_.size()).second)
      fail_at(path_, line, fmt::format("{} stands twice", this->field(key)));
    entries_.push_back({key, line, node.items[i + 1]});
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
  const auto found = places_.find(key);
  return found == places_.end() ? nullptr : &entries_[found->second];
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
            fmt::format("{} = {} {}, allowed {:g} to {:g}", field(key), entry.value.scalar, unit,
                        lower, upper));
  }
  return value;
}

int YamlMap::integer(std::string_view key, int lower, int upper) const {
  const Entry& entry = at(key);
  const long double value = yaml_number(entry.value, path_, field(key));
  if (value < lower || value > upper || value != std::floor(value)) {
    fail_at(path_, entry.line,
            fmt::format("{} = {}, allowed whole numbers {} to {}", field(key), entry.value.scalar,
                        lower, upper));
  }
  return static_cast<int>(value);
}

std::string YamlMap::field(std::string_view key) const {
  return field_.empty() ? std::string(key) : fmt::format("{}.{}", field_, key);
}

}  // namespace risley::io
