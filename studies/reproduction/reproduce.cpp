// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reproduction/reproduce.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "risley/sensors/preset.hpp"

#include "reproduction/runs.hpp"
#include "reproduction/triple_unit.hpp"

namespace risley::reproduction {
namespace {

void add(Reproduction& all, Reproduction more) {
  std::move(more.tables.begin(), more.tables.end(), std::back_inserter(all.tables));
  std::move(more.figures.begin(), more.figures.end(), std::back_inserter(all.figures));
}

}  // namespace

ReproduceOptions::ReproduceOptions()
    : type(sensors::load_sensor("mid-40")),
      unit(sensors::load_sensor("mid-40-table3")),
      triple_type(sensors::load_sensor("horizon")),
      triple_unit(triple_type) {
  for (const TripleParameter& one : kTripleUnit) {
    triple_unit.set(one.name, printed(one.known).value *
                                  find_parameter(one.name, triple_unit.shape()).si_per_unit);
  }
}

std::size_t row_count(const Reproduction& reproduction) {
  std::size_t rows = 0;
  for (const Table& table : reproduction.tables) rows += table.rows.size();
  return rows;
}

std::size_t passed_count(const Reproduction& reproduction) {
  std::ptrdiff_t rows = 0;
  for (const Table& table : reproduction.tables) {
    rows += std::count_if(table.rows.begin(), table.rows.end(),
                          [](const Row& row) { return passes(row); });
  }
  return static_cast<std::size_t>(rows);
}

Reproduction reproduce(const ReproduceOptions& options, const Progress& progress) {
  Reproduction result;
  add(result, specifications(options));
  add(result, scan_pattern(options));
  progress.report(0.01);
  add(result, observability(options, progress.part(0.01, 0.12)));
  add(result, zero_position(options));
  progress.report(0.14);
  add(result, stationary_unit(options, progress.part(0.14, 0.3)));
  add(result, simulated_unit(options, progress.part(0.3, 0.6)));
  add(result, incorrect_calibration(options, progress.part(0.6, 0.9)));
  add(result, beam_origin_errors(options));
  add(result, triple_prism(options, progress.part(0.9, 1.0)));
  progress.report(1.0);
  return result;
}

}  // namespace risley::reproduction
