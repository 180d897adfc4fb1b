// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "python/results.hpp"

#include <cmath>

#include <fmt/format.h>

#include "risley/core/number_text.hpp"
#include "risley/report/html.hpp"

#include "python/names.hpp"

namespace risley::python {
namespace {

void add(ValueTable& table, const std::string& file_name, const std::string& unit, double value,
         double sigma, double sigma_given_held) {
  table.names.push_back(si_name(file_name));
  table.file_names.push_back(file_name);
  table.units.push_back(unit);
  table.values.push_back(value);
  table.sigmas.push_back(sigma);
  table.sigmas_given_held.push_back(sigma_given_held);
}

/// Free parameters with their covariance; values where they are known.
template <class Found>
void add_free(ValueTable& table, const Found& found, TrainShape shape) {
  table.covariance = found.covariance;
  for (std::size_t j = 0; j < found.free.size(); ++j) {
    table.covariance_names.push_back(si_name(found.free[j].name));
    const auto at = static_cast<Eigen::Index>(j);
    const double given_held = std::sqrt(found.covariance(at, at));
    const std::string unit = si_unit(find_parameter(found.free[j].name, shape).unit);
    if constexpr (requires { found.total_sigma(j); }) {
      add(table, found.free[j].name, unit, found.parameters[at], found.total_sigma(j), given_held);
    } else {
      add(table, found.free[j].name, unit, std::nan(""), given_held, given_held);
    }
  }
}

void add_unknowns(ValueTable& table, const calibration::FlightJudgement& judgement,
                  TrainShape shape) {
  table.covariance = judgement.covariance;
  for (const calibration::FlightUnknown& unknown : judgement.unknowns) {
    add(table, unknown.name, si_unit(calibration::file_unit(unknown, shape)), unknown.value,
        unknown.sigma, unknown.sigma);
    table.covariance_names.push_back(table.names.back());
  }
}

}  // namespace

ValueTable table_of(const jobs::EstimatedRecording& found) {
  const estimation::Estimate& e = found.estimate;
  ValueTable table;
  for (const estimation::EstimatedValue& value : e.values) {
    add(table, value.name, si_unit(find_parameter(value.name, e.sensor.shape()).unit), value.value,
        value.sigma, value.sigma_given_held);
  }
  table.covariance = e.covariance;
  for (const auto& free : e.free) table.covariance_names.push_back(si_name(free.name));
  return table;
}

ValueTable table_of(const jobs::CalibratedRecordings& found) {
  ValueTable table;
  const calibration::Calibration& c = found.calibration;
  add_free(table, c, c.sensor.shape());
  for (const calibration::CalibratedNumber& number : c.numbers) {
    add(table, number.name, number.name == "range_incidence" ? "1" : "m", number.value,
        number.total_sigma, number.sigma);
  }
  return table;
}

ValueTable table_of(const jobs::PlannedCalibration& planned) {
  ValueTable table;
  add_free(table, planned.forecast, planned.shape);
  return table;
}

ValueTable table_of(const jobs::CalibratedFlight& found) {
  ValueTable table;
  add_unknowns(table, found.calibration, found.calibration.sensor.shape());
  return table;
}

ValueTable table_of(const jobs::PlannedFlightResult& planned) {
  ValueTable table;
  add_unknowns(table, planned.forecast, planned.sensor.shape());
  for (double& value : table.values) value = std::nan("");
  return table;
}

std::string html_of(const std::string& code, const std::string& words, const ValueTable& table) {
  std::string html = fmt::format(
      "<p><b>{}</b>: {}</p><table><tr><th>parameter</th><th>value</th><th>&plusmn; sigma</th>"
      "<th>unit</th></tr>",
      code, report::escape_html(words));
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    const FileUnit unit = file_unit(table.units[i]);
    const NumberText text =
        number_text(table.values[i] / unit.si_per_unit, table.sigmas[i] / unit.si_per_unit);
    html += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                        table.file_names[i], text.value, text.sigma, unit.name);
  }
  return html + "</table>";
}

}  // namespace risley::python
