// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reproduction/reproduction_page.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::reproduction {
namespace {

using report::escape_html;

/// Enough digits to compare with the paper's.
std::string ours_text(const Row& row) {
  if (!std::isfinite(row.ours)) return "–";
  if (row.ours == std::round(row.ours)) return fmt::format("{:.0f}", row.ours);
  if (!row.paper) return fmt::format("{:.4g}", row.ours);
  const double digits = std::round(-std::log10(2.0 * row.paper->half_digit));
  const int decimals = static_cast<int>(std::clamp(digits, 0.0, 12.0)) + 2;
  return fmt::format("{:.{}f}", row.ours, decimals);
}

std::string row_html(const Row& row) {
  const bool pass = passes(row);
  return fmt::format(
      "<tr><th scope=\"row\">{}</th><td class=\"text{}\">{}</td><td>{}</td><td>{}</td><td>{}</td>"
      "<td>{}</td><td class=\"text says\">{}</td><td class=\"text says\">{}{}</td></tr>\n",
      escape_html(row.term), pass ? "" : " far", pass ? "✓ passes" : "✗ does not pass",
      row.paper ? escape_html(row.paper->text) : "–", ours_text(row),
      row.sigma ? fmt::format("{:.2g}", *row.sigma) : "",
      row.unit == "1" ? "" : escape_html(row.unit), escape_html(bound_text(row)),
      escape_html(reason_text(row)), row.note.empty() ? "" : "<br>" + escape_html(row.note));
}

std::string table_html(const Table& table) {
  std::string html = fmt::format(
      "<p>{}</p>\n<div class=\"wide\"><table><thead><tr><th>term</th>"
      "<th class=\"text\">verdict</th><th>paper</th><th>ours</th><th>± σ</th><th>unit</th><th "
      "class=\"text\">what must hold</th>"
      "<th class=\"text\">what was found</th></tr></thead><tbody>\n",
      escape_html(table.method));
  for (const Row& row : table.rows) html += row_html(row);
  return html + "</tbody></table></div>\n";
}

std::string verdict_html(const Reproduction& all) {
  const std::size_t rows = row_count(all), passed = passed_count(all);
  std::vector<std::string> failed;
  for (const Table& table : all.tables) {
    for (const Row& row : table.rows) {
      if (passes(row)) continue;
      failed.push_back(fmt::format("{}, {}: {}", table.name, row.term, reason_text(row)));
    }
  }
  return fmt::format(
      "<section class=\"verdict {}\"><strong>{} of {} rows pass</strong>"
      "<p>{}</p>{}</section>\n",
      passed == rows ? "ok" : "bad", passed, rows,
      passed == rows ? "Every number of the paper that can be worked out again holds within its "
                       "stated bound."
                     : "These do not:",
      failed.empty() ? "" : report::list_html(failed));
}

}  // namespace

std::string reproduction_page(const Reproduction& reproduction,
                              const std::vector<std::pair<std::string, std::string>>& provenance) {
  report::Figures figures;
  const std::string head =
      verdict_html(reproduction) +
      "<p>Bounds say what must hold for a row to pass. Where the paper shows one random draw, ours "
      "is the median of many and the bound is on where the paper's falls among them. Drawings "
      "without numbers (Figs. 1 and 3 to 6) are left out.</p>\n";
  report::Sections sections;
  for (const Table& table : reproduction.tables) {
    std::string html = table_html(table);
    for (const Figure& figure : reproduction.figures) {
      if (figure.table != table.name) continue;
      html += fmt::format("<h3 id=\"{}_diagrams\">{}</h3>\n", escape_html(figure.name),
                          escape_html(figure.title));
      html += report::charts_html(figure.charts, figures);
    }
    const auto good = std::count_if(table.rows.begin(), table.rows.end(),
                                    [](const Row& row) { return passes(row); });
    sections.add(table.title, html, table.name,
                 fmt::format("{} of {} rows pass", good, table.rows.size()));
  }
  sections.add(report::kHowToRepeat, report::provenance_html(provenance));
  return report::page_html("The paper again",
                           "Brazeal, Wilkinson & Hochmair 2021, Sensors 21(14), 4722: every table "
                           "and figure that holds numbers, the paper's beside ours.",
                           head, sections, figures);
}

}  // namespace risley::reproduction
