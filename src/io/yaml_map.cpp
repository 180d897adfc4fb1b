// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/yaml_map.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/anchor.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"

namespace risley::io {
namespace {

constexpr std::size_t kMostNodes = 1'000'000;

std::size_t line_of(const YAML::Mark& mark) {
  return mark.is_null() ? 0 : static_cast<std::size_t>(mark.line) + 1;
}

/// Builds the tree of one document from the events of the library's parser.
class TreeBuilder final : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const std::string& path) : path_(path) {}

  YamlNode take_root() { return std::move(root_); }
  /// Line on which the document begins.
  std::size_t line() const { return line_; }

  void OnDocumentStart(const YAML::Mark& mark) override { line_ = line_of(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add({node_of(YamlNode::Kind::nothing, mark), anchor, 1});
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                const std::string& value) override {
    YamlNode node = node_of(YamlNode::Kind::scalar, mark);
    node.scalar = value;
    add({std::move(node), anchor, 1});
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto known = anchored_.find(anchor);
    if (known == anchored_.end())
      fail_at(path_, line_of(mark), "an alias (*name) within the node that it names");
    count(line_of(mark), known->second.nodes);
    add({known->second.node, YAML::NullAnchor, known->second.nodes});
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open_.push_back({node_of(YamlNode::Kind::list, mark), anchor, 1});
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open_.push_back({node_of(YamlNode::Kind::map, mark), anchor, 1});
  }
  void OnMapEnd() override { close(); }

 private:
  struct Subtree {
    YamlNode node;
    YAML::anchor_t anchor = YAML::NullAnchor;
    std::size_t nodes = 0;
  };

  YamlNode node_of(YamlNode::Kind kind, const YAML::Mark& mark) {
    YamlNode node;
    node.kind = kind;
    node.line = line_of(mark);
    count(node.line, 1);
    return node;
  }
  void count(std::size_t line, std::size_t more) {
    nodes_ += more;
    if (nodes_ <= kMostNodes) return;
    fail_at(path_, line,
            fmt::format("has more values than {}, aliases (*name) included", kMostNodes));
  }
  void close() {
    Subtree whole = std::move(open_.back());
    open_.pop_back();
    add(std::move(whole));
  }
  void add(Subtree subtree) {
    if (subtree.anchor != YAML::NullAnchor) {
      count(subtree.node.line, subtree.nodes);  // anchors within anchors are copies of copies
      anchored_[subtree.anchor] = subtree;
    }
    if (open_.empty()) {
      root_ = std::move(subtree.node);
      return;
    }
    open_.back().nodes += subtree.nodes;
    open_.back().node.items.push_back(std::move(subtree.node));
  }

  const std::string& path_;
  std::vector<Subtree> open_;
  std::map<YAML::anchor_t, Subtree> anchored_;
  YamlNode root_;
  std::size_t nodes_ = 0, line_ = 0;
};

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
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    TreeBuilder first(path), second(path);
    if (!parser.HandleNextDocument(first)) return {};
    if (parser.HandleNextDocument(second)) {
      fail_at(path, second.line(), "a second document (after ---), expected one");
    }
    return first.take_root();
  } catch (const YAML::Exception& error) {
    fail_at(path, line_of(error.mark), fmt::format("is not valid YAML: {}", error.msg));
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
      fail_at(path_, line, fmt::format("{} appears twice", this->field(key)));
    entries_.push_back({key, line, node.items[i + 1]});
  }
}

void YamlMap::allow_only(const std::vector<std::string>& keys) const {
  for (const Entry& entry : entries_) {
    if (std::find(keys.begin(), keys.end(), entry.key) != keys.end()) continue;
    fail_at(path_, entry.line,
            fmt::format("unknown field {}{}, allowed here: {}", field(entry.key),
                        did_you_mean(entry.key, keys), fmt::join(keys, ", ")));
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

double YamlMap::real(std::string_view key, long double lower, long double upper,
                     std::string_view unit, std::optional<double> absent) const {
  if (absent && find(key) == nullptr) return *absent;
  return static_cast<double>(number(key, lower, upper, unit));
}

std::vector<double> YamlMap::reals(std::string_view key, std::size_t count, long double lower,
                                   long double upper, std::string_view unit) const {
  const Entry& entry = at(key);
  const std::vector<YamlNode>& items = entry.value.items;
  if (!entry.value.is_list() || (count == 0 ? items.empty() : items.size() != count)) {
    const std::string numbers = count == 0 ? "" : fmt::format(" of {} numbers", count);
    fail_at(path_, entry.line,
            fmt::format("{}: expected a list{} in {}", field(key), numbers, unit));
  }
  std::vector<double> values;
  for (const YamlNode& item : items) {
    const std::string name = fmt::format("{}[{}]", field(key), values.size());
    values.push_back(static_cast<double>(yaml_number(item, path_, name)));
    if (values.back() < lower || values.back() > upper) {
      fail_at(path_, entry.line,
              fmt::format("{} = {:g} {}, allowed {:g} to {:g}", name, values.back(), unit, lower,
                          upper));
    }
  }
  return values;
}

std::string YamlMap::words(std::string_view key) const {
  std::string text = this->text(key);
  if (text.empty()) fail_at(path_, at(key).line, field(key) + " is empty");
  return text;
}

YamlMap YamlMap::section(std::string_view key) const { return {at(key).value, path_, field(key)}; }

std::vector<YamlMap> YamlMap::maps(std::string_view key) const {
  std::vector<YamlMap> list;
  const Entry* entry = find(key);
  if (entry == nullptr) return list;
  if (!entry->value.is_list()) {
    fail_at(path_, entry->line, fmt::format("{}: expected a list", field(key)));
  }
  for (const YamlNode& item : entry->value.items) {
    list.emplace_back(item, path_, fmt::format("{}[{}]", field(key), list.size()));
  }
  return list;
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

bool YamlMap::yes(std::string_view key, bool absent) const {
  if (find(key) == nullptr) return absent;
  const std::string value = text(key);
  if (value != "yes" && value != "no") {
    fail_at(path_, at(key).line, fmt::format("{} = \"{}\", allowed yes and no", field(key), value));
  }
  return value == "yes";
}

std::string YamlMap::field(std::string_view key) const {
  return field_.empty() ? std::string(key) : fmt::format("{}.{}", field_, key);
}

}  // namespace risley::io
