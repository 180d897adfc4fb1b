// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/json/result_columns.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "json/schema_texts.hpp"

namespace risley::json {
namespace {

using tables::CellKind;
using tables::TableCell;

/// Nothing if a result has no such value.
const Json* value_at(const Json& result, const std::vector<std::string>& places) {
  for (const std::string& place : places) {
    const Json::json_pointer pointer(place);
    if (result.contains(pointer) && !result.at(pointer).is_null()) return &result.at(pointer);
  }
  return nullptr;
}

TableCell cell_of(const Json* value, CellKind kind) {
  if (value == nullptr) return {};
  if (kind == CellKind::text)
    return value->is_string() ? TableCell(value->get<std::string>()) : TableCell();
  if (value->is_array()) return static_cast<std::int64_t>(value->size());  // how many
  if (value->is_boolean()) return static_cast<std::int64_t>(value->get<bool>());
  if (value->is_number_integer()) return value->get<std::int64_t>();
  if (value->is_number_float() && kind == CellKind::real) return value->get<double>();
  return {};
}

CellKind kind_of(const std::string& type) {
  if (type == "string") return CellKind::text;
  return type == "integer" ? CellKind::integer : CellKind::real;
}

/// The unit that a parameter's name ends with.
std::string unit_of(std::string_view name) {
  if (name.ends_with("_deg_per_s")) return "deg/s";
  if (name.ends_with("_deg")) return "deg";
  if (name.ends_with("_m")) return "m";
  return "1";
}

}  // namespace

ResultColumns::ResultColumns() {
  const Json schema = Json::parse(columns_schema());
  for (const auto& [name, words] : schema["properties"].items()) {
    if (name == "parameters") {
      parameters_at_ = columns_.size();
      continue;
    }
    columns_.push_back({{name, kind_of(words["type"]), words.value("unit", ""),
                         words["description"].get<std::string>()},
                        words["from"].get<std::vector<std::string>>(),
                        words.value("always", false)});
  }
}

void ResultColumns::note_parameters(const Json& result) {
  const auto found = result.find("parameters");
  if (found == result.end() || !found->is_object()) return;
  for (const auto& parameter : found->items()) {
    const std::string& name = parameter.key();
    const std::string place = fmt::format("/parameters/{}", name);
    const auto first = columns_.begin() + static_cast<std::ptrdiff_t>(parameters_at_);
    const auto last = first + static_cast<std::ptrdiff_t>(parameters_);
    const bool known =
        std::any_of(first, last, [&](const Column& one) { return one.shown.name == name; });
    if (known) continue;
    const Column value{
        {name, CellKind::real, unit_of(name), "estimated"}, {place + "/value"}, true};
    const Column sigma{{"sigma_" + name, CellKind::real, unit_of(name), "its standard deviation"},
                       {place + "/sigma"},
                       true};
    columns_.insert(last, {value, sigma});
    parameters_ += 2;
  }
}

void ResultColumns::note(const Json& result) {
  for (Column& column : columns_) {
    column.used = column.used || value_at(result, column.places) != nullptr;
  }
  note_parameters(result);
}

std::vector<tables::TableColumn> ResultColumns::columns() const {
  std::vector<tables::TableColumn> shown;
  for (const Column& column : columns_) {
    if (column.used) shown.push_back(column.shown);
  }
  return shown;
}

std::vector<TableCell> ResultColumns::cells(const Json& result) const {
  std::vector<TableCell> cells;
  for (const Column& column : columns_) {
    if (column.used) cells.push_back(cell_of(value_at(result, column.places), column.shown.kind));
  }
  return cells;
}

}  // namespace risley::json
