// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/page_parts.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Woverlength-strings"  // Chart.js is one string
#include "report/chart_js.hpp"
#pragma GCC diagnostic pop
#include "report/html.hpp"
#include "report/page_assets.hpp"

namespace risley::report {

std::string symbol_html(const std::string& symbol) {
  const std::size_t underscore = symbol.find('_');
  if (underscore == std::string::npos) return escape_html(symbol);
  return fmt::format("{}<sub>{}</sub>", escape_html(symbol.substr(0, underscore)),
                     escape_html(symbol.substr(underscore + 1)));
}

std::string parameter_head(const ParameterInfo& parameter) {
  return fmt::format("<th scope=\"row\">{}, {}<span class=\"name\">{}</span></th>",
                     escape_html(parameter.long_name), symbol_html(parameter.symbol),
                     escape_html(parameter.name));
}

std::string list_html(const std::vector<std::string>& items) {
  std::string html = "<ul>";
  for (const std::string& item : items) html += fmt::format("<li>{}</li>", escape_html(item));
  return html + "</ul>";
}

std::string finite_text(std::string_view format, double value) {
  if (!std::isfinite(value)) return "–";
  return fmt::vformat(format, fmt::make_format_args(value));
}

std::string verdict_html(const Verdict& verdict) {
  std::string kind = "ok", title = verdict.healthy, advice;
  const std::string warnings = verdict.warnings.empty() ? "" : list_html(verdict.warnings);
  if (!verdict.converged) {
    kind = "bad";
    title = "Not converged: do not use these numbers.";
    advice = fmt::format("<p><b>Why:</b> {}</p><p><b>What to do:</b> {}</p>{}",
                         escape_html(verdict.reason), verdict.mend_html, warnings);
  } else if (!verdict.warnings.empty() || !verdict.care_html.empty()) {
    kind = "care";
    title = "Converged: usable, with care.";
    advice = warnings + verdict.care_html;
  } else {
    advice = fmt::format("<p><b>What to do:</b> {}</p>", verdict.use_html);
  }
  return fmt::format("<section class=\"verdict {}\"><strong>{}</strong><p>{}</p>{}</section>\n",
                     kind, escape_html(title), escape_html(verdict.facts), advice);
}

std::string correlation_html(const std::vector<estimation::FreeParameter>& free,
                             const Eigen::MatrixXd& covariance, int prisms) {
  if (free.empty()) return "";
  std::string html =
      "<h2>Correlations of the parameters</h2>\n<div class=\"wide\">"
      "<table class=\"heat\"><thead><tr><th></th>";
  std::vector<const ParameterInfo*> infos;
  for (const auto& parameter : free) {
    infos.push_back(&find_parameter(parameter.name, prisms));
    html += fmt::format("<th scope=\"col\">{}</th>", symbol_html(infos.back()->symbol));
  }
  html += "</tr></thead><tbody>\n";
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    html += fmt::format("<tr>{}", parameter_head(*infos[static_cast<std::size_t>(i)]));
    for (Eigen::Index j = 0; j < covariance.cols(); ++j) {
      double r = covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j));
      if (!std::isfinite(r)) {
        html += "<td>–</td>";
        continue;
      }
      if (std::abs(r) < 0.005) r = 0;  // not "-0.00"
      html += fmt::format("<td style=\"background:rgba(var(--{}),{:.2f})\">{:.2f}</td>",
                          r < 0 ? "minus" : "plus", 0.75 * std::min(std::abs(r), 1.0), r);
    }
    html += "</tr>\n";
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">Blue: the two rise together. Red: one "
         "rises where the other falls. Near ±1 only their sum or difference is well "
         "known.</p>\n";
}

std::string provenance_html(const std::vector<std::pair<std::string, std::string>>& provenance) {
  std::string html = "<h2>How to make it again</h2>\n<dl>\n";
  for (const auto& [name, value] : provenance) {
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_html(name), escape_html(value));
  }
  return html + "</dl>\n";
}

std::string Figures::add(const Chart& chart) {
  if (number_ > 0) data_ += ",\n";
  data_ += chart_json(chart, number_);
  return figure_html(chart, number_++);
}

std::string page_html(const std::string& title, const std::string& lead,
                      const std::string& body_html, const Figures& figures) {
  std::string page = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n<h1>{}</h1>\n"
      "<p class=\"lead\">{}</p>\n",
      escape_html(title), page_style(), escape_html(title), escape_html(lead));
  page += body_html;
  page += "</main>\n<script>";
  page += kChartJs;
  page += "</script>\n<script type=\"application/json\" id=\"page-data\">\n" + figures.data();
  page += "\n</script>\n<script>\n";
  page += page_script();
  page += "</script>\n</body>\n</html>\n";
  return page;
}

}  // namespace risley::report
