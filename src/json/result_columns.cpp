// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/json/result_columns.hpp"

#include <algorithm>
#include <initializer_list>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace risley::json {
namespace {

using tables::CellKind;
using tables::TableCell;

constexpr int kMostPrisms = 4;

/// Nothing, where a result does not have such a value.
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

/// The unit that a parameter's name ends with.
std::string unit_of(std::string_view name) {
  if (name.ends_with("_deg_per_s")) return "deg/s";
  if (name.ends_with("_deg")) return "deg";
  if (name.ends_with("_m")) return "m";
  return "1";
}

}  // namespace

ResultColumns::ResultColumns() {
  const auto add = [](std::vector<Column>& columns, CellKind kind, std::string name,
                      std::string unit, std::string description,
                      std::initializer_list<const char*> places) {
    columns.push_back({{std::move(name), kind, std::move(unit), std::move(description)},
                       {places.begin(), places.end()},
                       false});
  };
  const auto text = [&](const char* name, const char* description,
                        std::initializer_list<const char*> places) {
    add(before_, CellKind::text, name, "", description, places);
  };
  const auto count = [&](const char* name, const char* description, const char* place) {
    add(before_, CellKind::integer, name, "1", description, {place});
  };
  const auto real = [&](std::vector<Column>& columns, const std::string& name, const char* unit,
                        const std::string& description, const std::string& place) {
    add(columns, CellKind::real, name, unit, description, {place.c_str()});
  };
  text("input", "path of the input", {"/input"});
  text("sha256", "SHA-256 of the input, of each of its files", {"/sha256"});
  text("output", "path of the result", {"/output"});
  count("exit_status", "as of the command, had the input been the only one", "/status");
  text("message", "why it failed", {"/message"});
  for (std::size_t i : {0U, 1U, 3U, 4U}) before_[i].used = true;
  text("format", "of the file that was read, or of the cloud that was written",
       {"/format", "/input_format"});
  text("serial", "serial number of the sensor", {"/serial", "/devices/0/serial"});
  text("sensor", "manufacturer and model", {"/sensor"});
  text("preset", "name of the sensor's preset or calibration", {"/preset"});
  text("sensor_chosen_by", "who said which sensor it was", {"/sensor_chosen_by"});
  text("verdict", "code of the verdict", {"/verdict/code"});
  text("calibration", "what sends the beams", {"/calibration/path"});
  count("converged", "1: estimate or calibration converged, 0: it did not", "/converged");
  text("method", "of the estimate or calibration", {"/method"});
  count("observations", "rows of the recording, or rows that were written", "/observations");
  count("records", "of a trajectory", "/records");
  count("shots", "of the recording", "/shots");
  count("no_return", "observations without a return", "/no_return");
  count("points", "of the cloud, or on the planes of a calibration", "/points");
  count("left_out", "what the format has no place for", "/left_out");
  count("observations_used", "by the estimate", "/observations_used");
  count("planes", "on which the sensor was calibrated", "/planes");
  count("outliers", "observations that the model does not describe", "/outliers");
  count("without_rotation_angle", "points left out", "/without_rotation_angle");
  count("without_pose", "points left out, outside the trajectory", "/without_pose");
  count("has_range", "1: the recording has ranges", "/has_range");
  count("first_time_ns", "time of the first shot", "/first_time_ns");
  before_.back().shown.unit = "ns";
  real(before_, "duration_s", "s", "from the first shot to the last", "/duration_s");
  real(before_, "rate_hz", "Hz", "shots per second", "/rate_hz");
  count("gaps", "in the times", "/gaps");
  real(before_, "gaps_total_s", "s", "all gaps together", "/gaps_total_s");
  real(before_, "largest_gap_s", "s", "the largest gap", "/largest_gap_s");
  count("time_resets", "how often the clock went back", "/time_resets");
  for (const char* angle : {"azimuth", "zenith"}) {
    for (const char* end : {"min", "max"}) {
      real(before_, fmt::format("{}_{}_deg", angle, end), "deg", "of all directions",
           fmt::format("/{}_deg/{}", angle, end));
    }
  }
  count("combination", "speed combination of a sensor with two prisms", "/combination");
  count("mirrored", "1: the elevation in the file has the opposite sign", "/mirrored");

  real(after_, "range_offset_m", "m", "of the ranges", "/range_offset_m/value");
  real(after_, "sigma_range_offset_m", "m", "its standard deviation", "/range_offset_m/sigma");
  for (const auto& [figure, words] : {std::pair{"total", "of the reported directions"},
                                      std::pair{"shared", "of them, the rotation that all share"},
                                      std::pair{"shape", "of them, the rest"},
                                      std::pair{"worst", "the rest where it is largest"}}) {
    const std::string place = fmt::format("/pointing_error/{}_deg/", figure);
    const std::string name = fmt::format("pointing_error_{}_deg", figure);
    real(after_, name, "deg", words, place + "value");
    real(after_, "sigma_" + name, "deg", "its standard deviation", place + "sigma");
  }
  real(after_, "better_probability", "1", "that calibrated directions are nearer to the truth",
       "/better_probability");
  real(after_, "tolerance_deg", "deg", "error of directions that is tolerated", "/tolerance_deg");
  real(after_, "beyond_tolerance_probability", "1", "that reported directions are off by more",
       "/beyond_tolerance_probability");
  real(after_, "plane_rms_before_m", "m", "distance of the points from their planes",
       "/before/plane_rms_m");
  real(after_, "plane_rms_after_m", "m", "the same after the calibration", "/after/plane_rms_m");
  for (const char* angle : {"azimuth", "zenith"}) {
    const std::string name = fmt::format("noise_{}_deg", angle);
    const std::string place = fmt::format("/noise/{}_deg/", angle);
    real(after_, name, "deg", "noise before rounding", place + "value");
    real(after_, "sigma_" + name, "deg", "its standard deviation", place + "sigma");
  }
  for (const char* angle : {"azimuth", "zenith"}) {
    real(after_, fmt::format("residual_{}_rms_deg", angle), "deg", "rms of the residuals",
         fmt::format("/residuals/{}_deg/rms", angle));
  }
  real(after_, "expected_residual_rms_deg", "deg", "by noise and rounding",
       "/residuals/expected_rms_deg");
  real(after_, "unit_variance", "1", "of the residuals over what was stated",
       "/residuals/unit_variance");
  real(after_, "autocorrelation", "1", "of residuals of neighbouring shots",
       "/residuals/autocorrelation");
  for (int i = 0; i < kMostPrisms; ++i) {
    const char letter = static_cast<char>('a' + i);
    const std::string rotor = fmt::format("of rotor {}", static_cast<char>('A' + i));
    real(after_, fmt::format("process_noise_{}_deg_per_s_per_sqrt_s", letter), "deg/s/sqrt(s)",
         "random walk of the speed " + rotor,
         fmt::format("/process_noise_deg_per_s_per_sqrt_s/{}", i));
    real(after_, fmt::format("process_jerk_{}_deg_per_s2_per_sqrt_s", letter), "deg/s2/sqrt(s)",
         "random walk of the acceleration " + rotor,
         fmt::format("/process_jerk_deg_per_s2_per_sqrt_s/{}", i));
    real(after_, fmt::format("residuals_over_angle_chi2_{}", letter), "1",
         "chi squared per bin of residuals over the rotation angle " + rotor,
         fmt::format("/residuals_over_angle_chi2_per_bin/{}", letter));
  }
  real(after_, "speed_factor", "1", "of all rotors against the type's",
       "/shot_clock/speed_factor/value");
  real(after_, "sigma_speed_factor", "1", "its standard deviation",
       "/shot_clock/speed_factor/sigma");
  for (const char* angle : {"yaw", "pitch"}) {
    real(after_, fmt::format("frame_{}_deg", angle), "deg",
         "of the recording's frame against the sensor's",
         fmt::format("/frame/{}_deg/value", angle));
  }
  real(after_, "repointing_rms_deg", "deg", "of the points' directions against the reported ones",
       "/repointing_deg/rms");
  add(after_, CellKind::integer, "start_time_ns", "ns", "time that rotation angles are of",
      {"/rotation_angle_time_ns"});
  add(after_, CellKind::integer, "iterations", "1", "of the estimate", {"/iterations"});
  add(after_, CellKind::integer, "warnings", "1", "how many there were", {"/warnings"});
  real(after_, "seconds_read", "s", "time for reading", "/seconds/read");
  real(after_, "seconds_solve", "s", "time for solving", "/seconds/solve");
  real(after_, "seconds_total", "s", "time for this input", "/elapsed_s");
  add(after_, CellKind::text, "version", "", "of risley that made the result", {"/version"});
}

void ResultColumns::note_parameters(const Json& result) {
  const auto found = result.find("parameters");
  if (found == result.end() || !found->is_object()) return;
  for (const auto& parameter : found->items()) {
    const std::string& name = parameter.key();
    const std::string place = fmt::format("/parameters/{}", name);
    const bool known = std::any_of(parameters_.begin(), parameters_.end(),
                                   [&](const Column& one) { return one.shown.name == name; });
    if (known) continue;
    parameters_.push_back(
        {{name, CellKind::real, unit_of(name), "estimated"}, {place + "/value"}, true});
    parameters_.push_back(
        {{"sigma_" + name, CellKind::real, unit_of(name), "its standard deviation"},
         {place + "/sigma"},
         true});
  }
}

void ResultColumns::note(const Json& result) {
  for (std::vector<Column>* columns : {&before_, &after_}) {
    for (Column& column : *columns) {
      column.used = column.used || value_at(result, column.places) != nullptr;
    }
  }
  note_parameters(result);
}

std::vector<tables::TableColumn> ResultColumns::columns() const {
  std::vector<tables::TableColumn> shown;
  for (const std::vector<Column>* columns : {&before_, &parameters_, &after_}) {
    for (const Column& column : *columns) {
      if (column.used) shown.push_back(column.shown);
    }
  }
  return shown;
}

std::vector<TableCell> ResultColumns::cells(const Json& result) const {
  std::vector<TableCell> cells;
  for (const std::vector<Column>* columns : {&before_, &parameters_, &after_}) {
    for (const Column& column : *columns) {
      if (column.used) {
        cells.push_back(cell_of(value_at(result, column.places), column.shown.kind));
      }
    }
  }
  return cells;
}

}  // namespace risley::json
