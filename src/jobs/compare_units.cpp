// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/compare_units.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/tables/table_input.hpp"

namespace risley::jobs {
namespace {

namespace fs = std::filesystem;
using sensors::Sensor;

struct LoadedResults {
  std::vector<std::string> paths;
  std::vector<Sensor> sensors;
  bool any_table = false;

  void add(std::string path, Sensor sensor) {
    paths.push_back(std::move(path));
    sensors.push_back(std::move(sensor));
  }
};

std::string text_of(const tables::TableCell& cell) {
  const auto* text = std::get_if<std::string>(&cell);
  return text == nullptr ? std::string() : *text;
}

/// Names in a table are relative to its folder; a table and its results may have been moved
/// together.
std::string result_beside(const std::string& table, const std::string& output) {
  std::error_code ignored;
  if (fs::exists(output, ignored) || fs::path(output).is_absolute()) return output;
  const std::string beside = (fs::path(table).parent_path() / output).string();
  return fs::exists(beside, ignored) ? beside : output;
}

/// Whether a file or folder is in the folder of a table, or below, whatever links lead to it.
bool is_below_folder_of(const std::string& table, const std::string& path) {
  std::error_code code;
  const fs::path folder = fs::canonical(fs::absolute(table).parent_path(), code);
  if (code) return false;
  const fs::path found = fs::canonical(path, code);
  if (code) return false;
  return std::mismatch(folder.begin(), folder.end(), found.begin(), found.end()).first ==
         folder.end();
}

/// Follows one row to its result. @return reason if there is none, or nothing
std::optional<LeftOut> load_row(const std::string& table, std::size_t row,
                                const std::vector<tables::TableCell>& cells, bool anywhere,
                                LoadedResults& loaded) {
  const std::string input = text_of(cells[0]), output = text_of(cells[1]);
  const std::string name = input.empty() ? fmt::format("{} row {}", table, row) : input;
  const auto* status = std::get_if<std::int64_t>(&cells[2]);
  if (status != nullptr && *status != 0) {
    const std::string message = text_of(cells[3]);
    return LeftOut{
        name, message.empty() ? fmt::format("it failed with the exit status {}", *status) : message,
        false};
  }
  if (output.empty()) return LeftOut{name, "the table names no output for it", true};
  const std::string path = result_beside(table, output);
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return LeftOut{name, fmt::format("{} is missing", path), true};
  // A table may come from anyone: files that it names are not opened anywhere.
  if (!anywhere && !is_below_folder_of(table, path)) {
    return LeftOut{
        name,
        fmt::format(
            "{} is not in the folder of {}: results elsewhere are opened only on request ({})",
            path, table, name_of(kSetting.anywhere)),
        true};
  }
  if (!fs::is_directory(path, ignored) && !fs::is_regular_file(path, ignored)) {
    return LeftOut{name, fmt::format("{} is neither a file nor a folder", path), true};
  }
  try {
    if (fs::is_directory(path, ignored) && !calibration_in(path)) {
      return LeftOut{name, fmt::format("{} has no {}", path, kCalibrationFile), false};
    }
    loaded.add(path, load_result(path));
  } catch (const FileError& error) {
    return LeftOut{name, error.what(), true};
  }
  return std::nullopt;
}

void load_table(const std::string& table, bool anywhere, LoadedResults& loaded,
                std::vector<LeftOut>& left_out, const Progress& progress) {
  const std::vector<tables::TableColumn> columns = {
      {"input"}, {"output"}, {"exit_status", tables::CellKind::integer}, {"message"}};
  const std::size_t left_out_before = left_out.size();
  std::size_t row = 0;
  for (const auto& cells : tables::read_table(table, columns, progress)) {
    progress.check();
    if (std::optional<LeftOut> none = load_row(table, ++row, cells, anywhere, loaded)) {
      left_out.push_back(*std::move(none));
    }
  }
  if (row > left_out.size() - left_out_before) return;
  std::string first;
  if (row > 0) {
    const LeftOut& one = left_out[left_out_before];
    first = fmt::format(" (the first, {}: {})", one.name, one.reason);
  }
  throw FileError(table, {},
                  fmt::format("none of its {} rows leads to a result{}; expected a table of "
                              "estimates or calibrations that were written into an output folder",
                              row, first));
}

LoadedResults load(const CompareUnitsOptions& options, std::vector<LeftOut>& left_out,
                   const Progress& progress) {
  LoadedResults loaded;
  for (const GivenSensor& result : options.results) {
    progress.check();
    std::error_code ignored;
    const std::string path = result.path();
    if (!path.empty() && !fs::is_directory(path, ignored) && tables::is_table(path)) {
      loaded.any_table = true;
      load_table(path, options.anywhere, loaded, left_out, progress);
    } else {
      loaded.add(result.name(), load_result(result));
    }
  }
  return loaded;
}

std::vector<ComparedUnit> units_of(const LoadedResults& loaded, std::vector<LeftOut>& left_out) {
  std::set<std::string> serials;
  for (const Sensor& sensor : loaded.sensors) {
    if (!sensor.serial.empty()) serials.insert(sensor.serial);
  }
  const std::string only = serials.size() == 1 ? *serials.begin() : std::string();
  std::vector<ComparedUnit> units;
  std::map<std::string, std::size_t> places;
  for (std::size_t i = 0; i < loaded.paths.size(); ++i) {
    const Sensor& sensor = loaded.sensors[i];
    const std::string& serial = sensor.serial.empty() ? only : sensor.serial;
    if (serial.empty() && serials.size() > 1 && loaded.any_table) {
      left_out.push_back(
          {loaded.paths[i],
           fmt::format("it has no serial number and could be of any of {} units", serials.size()),
           false});
      continue;
    }
    const auto [place, is_new] = places.emplace(serial, units.size());
    if (is_new) units.push_back({serial, sensor.name, {}, false});
    units[place->second].results.push_back(i);
  }
  return units;
}

/// Units with one kind of optics and one name.
std::vector<std::vector<std::size_t>> kinds_of(const std::vector<ComparedUnit>& units,
                                               const std::vector<Sensor>& sensors) {
  std::vector<std::vector<std::size_t>> kinds;
  for (std::size_t i = 0; i < units.size(); ++i) {
    const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](const auto& one) {
      const ComparedUnit& like = units[one.front()];
      return like.sensor == units[i].sensor &&
             have_same_optics(sensors[like.results.back()], sensors[units[i].results.back()]);
    });
    if (kind == kinds.end()) {
      kinds.push_back({i});
    } else {
      kind->push_back(i);
    }
  }
  return kinds;
}

/// Each with the one before and, from the third on, with the first.
void add_pairs_along(const std::vector<std::size_t>& results, std::vector<ComparedPair>& pairs) {
  for (std::size_t k = 1; k < results.size(); ++k) {
    pairs.push_back({results[k - 1], results[k], {}, false});
    if (k > 1) pairs.push_back({results.front(), results[k], {}, false});
  }
}

void add_pairs_between(const std::vector<std::size_t>& kind, const std::vector<ComparedUnit>& units,
                       std::vector<ComparedPair>& pairs) {
  for (std::size_t b = 1; b < kind.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      const auto [first, second] =
          std::minmax(units[kind[a]].results.back(), units[kind[b]].results.back());
      pairs.push_back({first, second, {}, false});
    }
  }
}

/// A truth and a belief.
bool are_unlike(const Sensor& a, const Sensor& b) {
  using sensors::CalibrationReference;
  return a.reference != CalibrationReference::none && b.reference != CalibrationReference::none &&
         a.reference != b.reference;
}

/// @throws InvalidArgument if there was nothing else to compare
void leave_out_unlike(ComparedUnits& found, const std::vector<Sensor>& sensors) {
  const auto words = [&](const ComparedPair& pair) {
    const bool first = sensors[pair.a].reference == sensors::CalibrationReference::planes;
    return fmt::format(
        "{} is a calibration, which holds true directions, and {} an estimate of the sensor's own "
        "parameters: they differ even in a unit that never changed ({} compares them)",
        found.results[first ? pair.a : pair.b], found.results[first ? pair.b : pair.a],
        name_of(kSetting.unlike));
  };
  const std::size_t before = found.pairs.size();
  std::string first;
  std::erase_if(found.pairs, [&](const ComparedPair& pair) {
    if (!are_unlike(sensors[pair.a], sensors[pair.b])) return false;
    if (first.empty()) first = words(pair);
    found.left_out.push_back(
        {found.results[pair.a] + " and " + found.results[pair.b], words(pair), false});
    return true;
  });
  if (before > 0 && found.pairs.empty()) throw InvalidArgument(first);
}

void compare(ComparedUnits& found, const std::vector<Sensor>& sensors, const Progress& progress) {
  found.least_p_value =
      found.false_alarm / static_cast<double>(std::max<std::size_t>(found.pairs.size(), 1));
  parallel::for_each_job(
      found.pairs.size(),
      [&](std::size_t i) {
        ComparedPair& pair = found.pairs[i];
        pair.comparison = compare_results(sensors[pair.a], sensors[pair.b], OneUnit::caller);
        const std::string &serial_a = sensors[pair.a].serial, &serial_b = sensors[pair.b].serial;
        const bool others = !serial_a.empty() && !serial_b.empty() && serial_a != serial_b;
        pair.changed = !others && pair.comparison.change.degrees_of_freedom > 0 &&
                       pair.comparison.change.p_value < found.least_p_value;
      },
      progress);
  std::vector<std::size_t> unit_of(sensors.size());
  for (std::size_t i = 0; i < found.units.size(); ++i) {
    for (const std::size_t result : found.units[i].results) unit_of[result] = i;
  }
  for (const ComparedPair& pair : found.pairs) {
    ComparedUnit& unit = found.units[unit_of[pair.b]];
    unit.changed = unit.changed || (pair.changed && unit_of[pair.a] == unit_of[pair.b]);
  }
}

std::vector<std::int64_t> written_ms(const std::vector<std::string>& results) {
  using namespace std::chrono;
  std::vector<std::int64_t> times;
  for (const std::string& result : results) {
    std::error_code problem;
    const auto time = fs::last_write_time(calibration_in(result).value_or(result), problem);
    if (problem) return {};
    times.push_back(
        duration_cast<milliseconds>(file_clock::to_sys(time).time_since_epoch()).count());
  }
  return times;
}

}  // namespace

ComparedUnits compare_units(const CompareUnitsOptions& options, const Progress& progress) {
  require_between(kSetting.false_alarm, options.false_alarm, 0, 1);
  ComparedUnits found;
  found.false_alarm = options.false_alarm;
  LoadedResults loaded = load(options, found.left_out, progress);
  require_at_least("number of results", static_cast<long long>(loaded.paths.size()), 2);
  found.results = loaded.paths;
  found.written_ms = written_ms(found.results);
  found.units = units_of(loaded, found.left_out);
  found.is_one_series = !loaded.any_table || found.units.size() == 1;
  if (found.is_one_series) {
    std::vector<std::size_t> all(loaded.paths.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    add_pairs_along(all, found.pairs);
  } else {
    for (const ComparedUnit& unit : found.units) add_pairs_along(unit.results, found.pairs);
  }
  std::vector<std::vector<std::size_t>> fleets;
  for (std::vector<std::size_t>& kind : kinds_of(found.units, loaded.sensors)) {
    if (kind.size() >= kFewestUnitsOfFleet) {
      fleets.push_back(std::move(kind));
    } else if (loaded.any_table) {
      add_pairs_between(kind, found.units, found.pairs);
    }
  }
  if (!options.unlike) leave_out_unlike(found, loaded.sensors);
  if (found.pairs.empty() && fleets.empty()) {
    require_same_optics(loaded.sensors[0], loaded.sensors[1]);
    throw InvalidArgument(fmt::format(
        "no two of the {} results are of one unit or of one kind of sensor", loaded.paths.size()));
  }
  compare(found, loaded.sensors, progress);
  for (const std::vector<std::size_t>& kind : fleets) {
    progress.check();
    std::vector<Sensor> latest;
    latest.reserve(kind.size());
    for (const std::size_t unit : kind) {
      latest.push_back(loaded.sensors[found.units[unit].results.back()]);
    }
    // Several fleets share the probability of a false alarm.
    found.fleets.push_back(
        {kind, fleet_of(latest, options.false_alarm / static_cast<double>(fleets.size()))});
  }
  return found;
}

std::string answer_words(const ComparedPair& pair) {
  if (pair.comparison.change.degrees_of_freedom == 0) return "no sigmas to test with";
  if (are_two_units(pair.comparison)) return "two units";
  return pair.changed ? "changed" : "no change seen";
}

}  // namespace risley::jobs
