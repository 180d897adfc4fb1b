// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/json/schema.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <regex>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "risley/core/error.hpp"

#include "json/schema_texts.hpp"

namespace risley::json {
namespace {

/// Texts beyond this length match no pattern: std::regex recurses once per character.
constexpr std::size_t kLongestName = 200;

struct Schema {
  const Json& words;
  std::string file;  ///< that its references are relative to
};

const Json& file_of(const std::string& name) {
  static const std::map<std::string, Json> files = {
      {"common.json", Json::parse(common_schema())},
      {"estimate.json", Json::parse(estimate_schema())},
      {"calibrate.json", Json::parse(calibrate_schema())},
      {"report_file.json", Json::parse(report_file_schema())}};
  return files.at(name);
}

/// A word of a schema, or null.
const Json& word(const Json& words, const char* name) {
  static const Json none;
  const auto found = words.find(name);
  return found == words.end() ? none : *found;
}

/// @param reference  "FILE#/POINTER", or "#/POINTER" within the same file
Schema resolved(const std::string& reference, const std::string& file) {
  const std::size_t mark = std::min(reference.find('#'), reference.size());
  const std::string name = mark == 0 ? file : reference.substr(0, mark);
  const std::string pointer = mark == reference.size() ? "" : reference.substr(mark + 1);
  return {file_of(name).at(Json::json_pointer(pointer)), name};
}

bool is_of_type(const Json& value, const std::string& type) {
  if (type == "number") return value.is_number();
  if (type == "integer") return value.is_number_integer();
  return type == value.type_name();  // null, boolean, string, array, object
}

bool matches(const std::string& text, const std::string& pattern) {
  return text.size() <= kLongestName && std::regex_search(text, std::regex(pattern));
}

std::string named(const std::string& place, const std::string& name) {
  return place.empty() ? name : place + "." + name;
}

using Problem = std::optional<std::string>;

Problem problem_of(const Json& value, const Schema& schema, const std::string& place);

Problem problem(const std::string& place, std::string_view expected, const Json& found) {
  const std::string shown =
      found.is_structured() || found.is_string() ? found.type_name() : found.dump();
  return fmt::format("{}: expected {}, found {}", place.empty() ? "the file" : place, expected,
                     shown);
}

Problem problem_of_object(const Json& value, const Schema& schema, const std::string& place) {
  const Json& words = schema.words;
  for (const Json& name : word(words, "required")) {
    if (!value.contains(name.get_ref<const std::string&>())) {
      return named(place, name.get<std::string>()) + " is missing";
    }
  }
  const Json& names = word(words, "propertyNames");
  const Json& known = word(words, "properties");
  const Json& rest = word(words, "additionalProperties");
  for (const auto& [name, one] : value.items()) {
    if (names.contains("pattern") && !matches(name, names["pattern"].get<std::string>())) {
      return fmt::format("{}: '{}' is not a known name there", place, name.substr(0, kLongestName));
    }
    const auto found = known.find(name);
    if (found == known.end() && !rest.is_object()) continue;
    const Json& own = found == known.end() ? rest : *found;
    if (Problem one_problem = problem_of(one, {own, schema.file}, named(place, name))) {
      return one_problem;
    }
  }
  return {};
}

Problem problem_of_list(const Json& value, const Schema& schema, const std::string& place) {
  const Json& words = schema.words;
  const std::size_t least = words.value("minItems", std::size_t{0});
  const std::size_t most = words.value("maxItems", value.size());
  if (value.size() < least || value.size() > most) {
    return fmt::format("{}: {} values, expected {}", place, value.size(), least);
  }
  if (!words.contains("items")) return {};
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string own = fmt::format("{}[{}]", place, i);
    if (Problem found = problem_of(value[i], {words["items"], schema.file}, own)) return found;
  }
  return {};
}

/// For the keywords that combine schemas.
Problem problem_of_parts(const Json& value, const Schema& schema, const std::string& place) {
  const Json& words = schema.words;
  const auto of = [&](const Json& part) { return problem_of(value, {part, schema.file}, place); };
  if (words.contains("$ref")) {
    const Schema other = resolved(words["$ref"].get<std::string>(), schema.file);
    if (Problem found = problem_of(value, other, place)) return found;
  }
  for (const Json& part : word(words, "allOf")) {
    if (Problem found = of(part)) return found;
  }
  if (words.contains("anyOf")) {
    Problem last;
    for (const Json& part : words["anyOf"]) {
      last = of(part);
      if (!last) break;
    }
    if (last) return last;
  }
  if (words.contains("if")) {
    const char* branch = of(words["if"]) ? "else" : "then";
    if (words.contains(branch)) return of(words[branch]);
  }
  return {};
}

Problem problem_of(const Json& value, const Schema& schema, const std::string& place) {
  const Json& words = schema.words;
  if (words.contains("type")) {
    const auto fits = [&](const Json& type) {
      return is_of_type(value, type.get_ref<const std::string&>());
    };
    const Json& types = words["type"];  // one, or a list
    if (std::none_of(types.begin(), types.end(), fits)) {
      std::string expected;
      for (const Json& type : types) {
        expected += (expected.empty() ? "" : " or ") + type.get<std::string>();
      }
      return problem(place, expected, value);
    }
  }
  if (words.contains("const") && value != words["const"]) {
    return problem(place, words["const"].dump(), value);
  }
  if (words.contains("enum")) {
    const Json& all = words["enum"];
    if (std::find(all.begin(), all.end(), value) == all.end()) {
      return problem(place, "one of " + all.dump(), value);
    }
  }
  if (value.is_number()) {
    const double number = value.get<double>();
    if (words.contains("minimum") && number < words["minimum"].get<double>()) {
      return problem(place, words["minimum"].dump() + " or more", value);
    }
    if (words.contains("maximum") && number > words["maximum"].get<double>()) {
      return problem(place, words["maximum"].dump() + " or less", value);
    }
  }
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    if (text.size() < words.value("minLength", std::size_t{0})) {
      return problem(place, "a text that is not empty", value);
    }
    if (words.contains("pattern") && !matches(text, words["pattern"].get<std::string>())) {
      return problem(place, words["pattern"].dump(), value);
    }
  }
  if (value.is_object()) {
    if (Problem found = problem_of_object(value, schema, place)) return found;
  }
  if (value.is_array()) {
    if (Problem found = problem_of_list(value, schema, place)) return found;
  }
  return problem_of_parts(value, schema, place);
}

}  // namespace

void require_schema(const Json& value, const std::string& schema, const std::string& path) {
  if (const Problem found = problem_of(value, resolved(schema, ""), "")) {
    throw FileError(path, {}, *found);
  }
}

}  // namespace risley::json
