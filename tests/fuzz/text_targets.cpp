// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Presets, scenes, reports, plans of campaigns, tables of results.
#include <cstddef>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/jobs/campaign_plan.hpp"
#include "risley/report/report_file.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/tables/table_input.hpp"

#include "fuzz/invariants.hpp"
#include "fuzz/memory_file.hpp"
#include "fuzz/targets.hpp"

namespace risley::fuzz {
namespace {

std::string text_of(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

/// What a preset says can be written and read again, and is then the same.
void run_preset(std::span<const std::uint8_t> bytes) {
  std::string once;
  try {
    once = sensors::preset_text(sensors::parse_preset(text_of(bytes), "fuzz.yaml"));
  } catch (const Error&) {
    return;
  }
  try {
    const std::string twice = sensors::preset_text(sensors::parse_preset(once, "fuzz.yaml"));
    require(once == twice, "a preset that is written twice is the same");
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n%s\n", error.what(), once.c_str());
    require(false, "a preset that was written can be read");
  }
}

/// Rays in a scene that is accepted end, and on a surface that has a name.
void run_scene(std::span<const std::uint8_t> bytes) {
  scenes::Scene scene;
  try {
    scene = scenes::parse_scene(text_of(bytes), "fuzz.yaml");
  } catch (const Error&) {  // refused
    return;
  }
  for (const Vector3<double>& direction :
       {Vector3<double>{0, 0, -1}, {0.6, 0, -0.8}, {0, 1, 0}, {-0.48, 0.64, 0.6}}) {
    const auto hit = scenes::nearest_hit(scene, {1, 2, 80}, direction);
    if (!hit) continue;
    require(hit->range > 0 && hit->cosine >= 0 && hit->cosine <= 1, "a hit is in front");
    scene.surface_name(hit->surface);
  }
}

/// A plan that is accepted has settings and seeds, and its cells name them.
void run_campaign_plan(std::span<const std::uint8_t> bytes) {
  jobs::CampaignPlan plan;
  try {
    plan = jobs::parse_campaign_plan(text_of(bytes), "fuzz.yaml");
  } catch (const Error&) {  // refused
    return;
  }
  require(!plan.settings.empty() && plan.seeds > 0, "a plan has cells");
  const jobs::CampaignCell last = plan.cell(plan.cells() - 1);
  require(last.setting + 1 == plan.settings.size() && last.seed + 1 == plan.first_seed + plan.seeds,
          "the last cell is of the last setting and seed");
  for (const jobs::CampaignSetting& setting : plan.settings) {
    require(!setting.simulations.empty(), "a setting is simulated");
  }
}

/// Cells of a table that is accepted are of their columns' kinds, and no more than its bytes hold.
void run_table(std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  const std::vector<tables::TableColumn> columns = {{"input"},
                                                    {"exit_status", tables::CellKind::integer},
                                                    {"wedge_angle_deg", tables::CellKind::real}};
  try {
    tables::is_table(file.path());
    const auto rows = tables::read_table(file.path(), columns);
    require(rows.size() <= bytes.size(), "a row has a byte at least");
    for (const auto& row : rows) {
      require(row.size() == columns.size(), "a row has all columns");
      for (std::size_t k = 0; k < row.size(); ++k) {
        require(
            row[k].index() == 0 || row[k].index() == (k == 0 ? tables::TableCell("").index() : k),
            "a cell is of its column's kind");
      }
    }
  } catch (const Error&) {  // refused
  }
}

/// A report that is accepted is drawn without a fault.
void run_report(std::span<const std::uint8_t> bytes) {
  const MemoryFile file(bytes);
  try {
    const std::string page = report::report_page(report::read_report(file.path()));
    require(page.find("</html>") != std::string::npos, "a page is whole");
  } catch (const Error&) {  // refused
  }
}

}  // namespace

std::vector<Target> text_targets() {
  return {{"preset", run_preset},
          {"scene", run_scene},
          {"report", run_report},
          {"campaign", run_campaign_plan},
          {"table", run_table}};
}

}  // namespace risley::fuzz
