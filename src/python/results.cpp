// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "python/results.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "risley/core/number_text.hpp"
#include "risley/report/html.hpp"

#include "python/names.hpp"

namespace risley::python {

using json::Json;

namespace {

double number_of(const Json& object, const char* key) {
  return object.contains(key) && object[key].is_number() ? object[key].get<double>() : std::nan("");
}

/// Name, value, sigma, sigma given the held values, and unit, in the units of files.
using Row = std::array<std::string, 5>;

std::vector<Row> rows_of(const ValueTable& table) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    const FileUnit unit = file_unit(table.units[i]);
    const double value = table.values[i] / unit.si_per_unit;
    const NumberText text = number_text(value, table.sigmas_given_held[i] / unit.si_per_unit);
    rows.push_back({table.file_names[i], text.value,
                    number_text(value, table.sigmas[i] / unit.si_per_unit).sigma, text.sigma,
                    unit.name});
  }
  return rows;
}

}  // namespace

ValueTable table_of(const Json& result) {
  ValueTable table;
  const auto add = [&](const std::string& file_name, const Json& one) {
    const std::string unit = si_unit(unit_of(file_name));
    const double si = file_unit(unit).si_per_unit, sigma = si * number_of(one, "sigma");
    table.names.push_back(si_name(file_name));
    table.file_names.push_back(file_name);
    table.units.push_back(unit);
    table.values.push_back(si * number_of(one, "value"));
    table.sigmas.push_back(sigma);
    table.sigmas_given_held.push_back(
        one.contains("sigma_given_held") ? si * number_of(one, "sigma_given_held") : sigma);
  };
  const char* const values = result.contains("unknowns") ? "unknowns" : "parameters";
  for (const auto& [name, one] : result.at(values).items()) add(name, one);
  const Json none = Json::object();
  const auto part = [&](const char* name) -> const Json& {
    return result.contains(name) ? result.at(name) : none;
  };
  for (const auto& [name, one] : part("sizes").items()) add(name, one);
  for (const auto& [name, one] : part("ranges").items()) {
    add(name == "constant_m" ? "range_offset_m" : "range_" + name, one);
  }
  return table;
}

std::string html_of(const Json& result) {
  const Json& verdict = result.at("verdict");
  std::string html = fmt::format(
      "<p><b>{}</b>: {}</p><table><tr><th>parameter</th><th>value</th><th>&plusmn; sigma</th>"
      "<th>unit</th></tr>",
      verdict.at("code").get<std::string>(),
      report::escape_html(verdict.at("words").get<std::string>()));
  for (const Row& row : rows_of(table_of(result))) {
    html += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>", row[0], row[1],
                        row[2], row[4]);
  }
  return html + "</table>";
}

std::string text_of(const Json& result) {
  const Json& verdict = result.at("verdict");
  const ValueTable table = table_of(result);
  const bool any_held = table.sigmas != table.sigmas_given_held;
  std::vector<Row> rows = rows_of(table);
  rows.insert(rows.begin(), {"parameter", "value", "+- sigma", "given held", "unit"});
  std::array<std::size_t, 5> width{};
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < width.size(); ++i) width[i] = std::max(width[i], row[i].size());
  }
  std::string text = fmt::format("{}\nwhat to do: {}\n", verdict.at("words").get<std::string>(),
                                 verdict.at("to_do").get<std::string>());
  for (const Row& row : rows) {
    std::string line = fmt::format("{:<{}}", row[0], width[0]);
    for (std::size_t i = 1; i < width.size(); ++i) {
      if (i != 3 || any_held) line += fmt::format("  {:>{}}", row[i], width[i]);
    }
    text += "\n" + line;
    if (&row == &rows.front()) text += "\n" + std::string(line.size(), '-');
  }
  return text;
}

}  // namespace risley::python
