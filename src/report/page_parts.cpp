// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/page_parts.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/text.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/report/html.hpp"
#include "risley/report/point_viewer.hpp"

#include "report/page_assets.hpp"
#include "report/view.hpp"

namespace risley::report {

using json::Json;

namespace {

/// The largest text of a page, and its colour.
struct Headline {
  const char *code, *kind, *words;
};

constexpr Headline kHeadlines[] = {
    {"consistent", "ok", "The sensor's directions agree with its own optical parameters."},
    {"unusual", "care", "The model describes this recording, but something about it is unusual."},
    {"as_believed", "ok", "The sensor's directions are correct."},
    {"off_within_tolerance", "ok",
     "The sensor's directions are off, but within the tolerance; this calibration improves its "
     "clouds."},
    {"bent", "care", "The sensor's directions are wrong: use this calibration."},
    {"not_better", "bad",
     "This calibration is no better than the sensor's own parameters: do not use it."},
};

/// Before anything is drawn, so that a dark page never flashes.
constexpr std::string_view kFirstScript =
    "document.documentElement.dataset.theme = "
    "matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';";

/// ECharts GL makes functions of texts such as "[width * 1.0 / 2, height / 2]", the sizes of its
/// textures, which a page with a policy against eval must interpret itself.
constexpr std::string_view kSizesScript = R"js(
(function () {
  'use strict';
  const term = /^(width|height)(?: \* 1\.0)?(?: \/ (\d+))?$/;
  const sizes = (text) => {
    const list = /^\[(.*)\]$/.exec(text);
    const terms = (list ? list[1] : text).split(',').map((one) => {
      const found = term.exec(one.trim());
      if (!found) throw new Error('no size of a texture: ' + one);
      return [found[1], Number(found[2] || 1)];
    });
    return (width, height) => {
      const values = terms.map(([side, parts]) => (side === 'width' ? width : height) / parts);
      return list ? values : values[0];
    };
  };
  window.Function = new Proxy(window.Function, {
    construct: (target, words) => (words[0] === 'width' && words.length === 4
      ? sizes(words[3].replace('return', '').trim()) : Reflect.construct(target, words)),
  });
})();
)js";

/// Permissions of a page in the browser: run its own scripts and use its own style sheets, and
/// nothing that a name in its texts could smuggle in. Widths and colours of cells are attributes;
/// pictures are those saved by diagrams.
std::string policy(const std::vector<std::string_view>& styles,
                   const std::vector<std::string_view>& scripts) {
  const auto hashes_of = [](const std::vector<std::string_view>& texts) {
    std::string all;
    for (const std::string_view text : texts) {
      all += fmt::format(" 'sha256-{}'", hashes::sha256_base64(text));
    }
    return all;
  };
  return fmt::format(
      "default-src 'none'; script-src{}; style-src-elem{}; style-src-attr 'unsafe-inline'; "
      "img-src data: blob:; base-uri 'none'; form-action 'none'",
      hashes_of(scripts), hashes_of(styles));
}

/// Adds texts to a page, each in a separate element.
void add_elements(std::string& page, const char* name, const std::vector<std::string_view>& texts) {
  for (const std::string_view text : texts) {
    page += fmt::format("<{}>", name);
    page += text;
    page += fmt::format("</{}>\n", name);
  }
}

/// The points of some nodes. @param first, end  numbers of the nodes
void add_nodes(std::string& page, const PointViewer& viewer, std::size_t first, std::size_t end) {
  for (std::size_t i = first; i < end; ++i) {
    page += fmt::format("<script type=\"text/plain\" id=\"node-{}\">", i);
    page += viewer.nodes()[i];
    page += "</script>\n";
  }
}

}  // namespace

std::string symbol_html(const std::string& symbol) {
  const std::size_t underscore = symbol.find('_');
  if (underscore == std::string::npos) return escape_html(symbol);
  return fmt::format("{}<sub>{}</sub>", escape_html(symbol.substr(0, underscore)),
                     escape_html(symbol.substr(underscore + 1)));
}

std::string parameter_head(const std::string& long_name, const std::string& symbol,
                           const std::string& name) {
  return fmt::format("<th scope=\"row\">{}, {}<span class=\"name\">{}</span></th>",
                     escape_html(long_name), symbol_html(symbol), escape_html(name));
}

std::string parameter_head(const ParameterInfo& parameter) {
  return parameter_head(parameter.long_name, parameter.symbol, parameter.name);
}

std::string angle_with_sigma(double value, double sigma) {
  const NumberText text = number_text(degrees_from_radians(value), degrees_from_radians(sigma));
  return is_sigma(sigma) ? fmt::format("{}° ± {}°", text.value, text.sigma)
                         : plain_text(degrees_from_radians(value), 3) + "°";
}

std::string list_html(const std::vector<std::string>& items) {
  std::string html = "<ul>";
  for (const std::string& item : items) html += fmt::format("<li>{}</li>", escape_html(item));
  return html + "</ul>";
}

std::string care_html(const std::vector<std::string>& reasons) {
  if (reasons.empty()) return "";
  return "<section class=\"verdict care\"><strong>With care:</strong>" + list_html(reasons) +
         "</section>\n";
}

std::string care_html(const std::vector<Warning>& warnings) {
  std::vector<std::string> texts;
  std::ranges::transform(warnings, std::back_inserter(texts), warning_text);
  return care_html(texts);
}

std::string verdict_html(const Verdict& verdict) {
  const auto found =
      std::find_if(std::begin(kHeadlines), std::end(kHeadlines),
                   [&](const Headline& headline) { return headline.code == verdict.code; });
  std::string kind = "ok", title = "Converged.", html;
  if (!verdict.converged) {
    kind = "bad";
    title = "Not converged: do not use these numbers.";
    html = fmt::format("<p><b>Why:</b> {}</p>", escape_html(verdict.reason));
  } else {
    if (found != std::end(kHeadlines)) {
      kind = found->kind;
      title = found->words;
    } else if (!verdict.code.empty()) {  // undecided
      kind = "care";
      title = "Converged, but not to be trusted.";
    }
    if (!verdict.warnings.empty() || !verdict.care_html.empty()) {
      if (kind == "ok") kind = "care";
    }
    if (!verdict.words.empty()) {
      html = fmt::format("<p><b>Found:</b> {}.</p>", escape_html(verdict.words));
    }
  }
  html += fmt::format("<p>{}</p>", escape_html(verdict.facts));
  std::vector<std::string> to_do;
  if (!verdict.to_do.empty()) to_do.push_back(verdict.to_do);
  if (!verdict.converged && !verdict.mend.empty()) to_do.push_back(verdict.mend);
  if (!to_do.empty()) {
    html += fmt::format("<p><b>What to do:</b> {}.</p>",
                        escape_html(fmt::format("{}", fmt::join(to_do, "; "))));
  }
  if (!verdict.warnings.empty()) html += "<p><b>With care:</b></p>" + list_html(verdict.warnings);
  if (verdict.converged) html += verdict.care_html;
  const std::string code =
      verdict.code.empty() ? "" : fmt::format(" <code>{}</code>", escape_html(verdict.code));
  return fmt::format("<section class=\"verdict {}\"><strong>{}</strong>{}{}</section>\n", kind,
                     escape_html(title), code, html);
}

std::string correlation_html(const std::vector<CorrelationHead>& heads, const View& matrix) {
  if (heads.empty()) return "";
  std::string html = "<div class=\"wide\"><table class=\"heat\"><thead><tr><th></th>";
  for (const CorrelationHead& head : heads) {
    html += fmt::format("<th scope=\"col\">{}</th>", head.symbol_html);
  }
  html += "</tr></thead><tbody>\n";
  const std::vector<View> rows = matrix.list();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    html += fmt::format("<tr>{}", heads[i].row_html);
    for (double r : rows[i].numbers()) {
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
         "</tbody></table></div>\n<p class=\"note\">Red: the two rise together. Blue: one rises "
         "when the other falls. Near ±1 only their sum or difference is well known.</p>\n";
}

std::string time_audit_html(const View& recordings) {
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>recording</th>"
      "<th>format</th><th>time from</th><th>shots</th><th>without return</th><th>duration, s</th>"
      "<th>rate, Hz</th><th>gaps</th><th>missing, s</th><th>longest, s</th><th>clock resets</th>"
      "<th>late packets</th><th>PPS seconds</th></tr></thead><tbody>\n";
  for (const View& one : recordings.list()) {
    const auto cell = [](const std::string& text, bool alarming = false) {
      return fmt::format("<td{}>{}</td>", alarming ? " class=\"far\"" : "", text);
    };
    const auto count = [&](const char* key) { return one[key].count(); };
    const auto alarm = [&](const char* key) {
      return cell(std::to_string(count(key)), count(key) > 0);
    };
    html += fmt::format("<tr><th scope=\"row\">{}</th>", escape_html(one["name"].text()));
    html += cell(escape_html(one["format"].text())) +
            cell(escape_html(one["time_reference"].text())) + cell(count_text(count("shots"))) +
            cell(count_text(count("no_return"))) +
            cell(finite_text("{:.6g}", one["duration_s"].number())) +
            cell(finite_text("{:.6g}", one["rate_hz"].number())) + alarm("gaps") +
            cell(finite_text("{:.4g}", one["gaps_total_s"].number())) +
            cell(finite_text("{:.4g}", one["largest_gap_s"].number())) + alarm("time_resets") +
            alarm("non_monotonic_packets") + cell(std::to_string(count("pps_wraps"))) + "</tr>\n";
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">Gaps: steps longer than 1.8 times the usual "
         "one. Clock resets: the clock jumps back or changes to another source of time. In 10 µs "
         "a prism turns by up to half a degree, so the estimate depends on sound times.</p>\n";
}

std::string provenance_html(const jobs::Provenance& provenance) {
  std::string html = "<dl>\n";
  for (const auto& [name, value] : provenance) {
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_html(name), escape_html(value));
  }
  return html + "</dl>\n";
}

std::string Figures::add(const Json& chart) {
  if (number_ > 0) data_ += ",\n";
  data_ += script_text(chart, number_);
  has_space_ = has_space_ || chart["kind"] == "space";
  return figure_html(chart, number_++);
}

std::string Figures::add(const Chart& chart) { return add(chart_json(chart)); }

std::string charts_html(const Json& charts, Figures& figures, std::size_t first) {
  const auto is_square = [](const Json& chart) {
    return chart["kind"] == "map" || chart["kind"] == "ground" || chart["kind"] == "two_turns";
  };
  std::string html;
  for (std::size_t last = first; first < charts.size(); first = last) {
    // Rows of one height: square diagrams are grouped, three in a row if that leaves none over.
    while (last < charts.size() && is_square(charts[last]) == is_square(charts[first])) ++last;
    const bool three = is_square(charts[first]) && (last - first) % 3 == 0;
    html += three ? "<div class=\"charts three\">\n" : "<div class=\"charts\">\n";
    for (std::size_t i = first; i < last; ++i) html += figures.add(charts[i]);
    html += "</div>\n";
  }
  return html;
}

std::string charts_html(const std::vector<Chart>& charts, Figures& figures, std::size_t first) {
  return charts_html(charts_json(charts), figures, first);
}

std::string overview_html(const std::vector<KeyNumber>& numbers, const Json& charts,
                          Figures& figures) {
  std::string html = "<div class=\"overview\">\n<dl class=\"numbers\">\n";
  for (const KeyNumber& number : numbers) {
    html += fmt::format("<div><dd>{}</dd><dt>{}</dt></div>\n", escape_html(number.text),
                        escape_html(number.words));
  }
  html += "</dl>\n";
  if (!charts.empty()) html += figures.add(charts.front());
  return html + "</div>\n";
}

std::string overview_html(const std::vector<KeyNumber>& numbers, const std::vector<Chart>& charts,
                          Figures& figures) {
  return overview_html(numbers, charts_json(charts), figures);
}

void Sections::add(const std::string& title, const std::string& html, Shown shown) {
  std::string id;
  for (const char c : lower_case(title)) {
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
      id += c;
    } else if (!id.empty() && id.back() != '-') {
      id += '-';
    }
  }
  add(title, html, id, "", shown);
}

void Sections::add(const std::string& title, const std::string& html, const std::string& id,
                   const std::string& remark) {
  add(title, html, id, ": " + remark, Shown::folded);
}

void Sections::add(const std::string& title, const std::string& html, const std::string& id,
                   const std::string& remark, Shown shown) {
  if (html.empty()) return;
  contents_ += fmt::format("<li><a href=\"#{}\">{}</a>{}</li>\n", escape_html(id),
                           escape_html(title), escape_html(remark));
  sections_ += fmt::format(
      "<details class=\"section\" id=\"{}\"{}>\n<summary><h2>{}</h2></summary>\n{}</details>\n",
      escape_html(id), shown == Shown::unfolded ? " open" : "", escape_html(title), html);
}

std::string Sections::html() const {
  if (sections_.empty()) return {};
  return fmt::format(
      "<nav class=\"contents\" aria-label=\"Contents\">\n<ul>\n{}</ul>\n"
      "<button id=\"unfold\" type=\"button\">Unfold all</button>\n</nav>\n{}",
      contents_, sections_);
}

std::string page_html(const std::string& title, const std::string& lead,
                      const std::string& head_html, const Sections& sections,
                      const Figures& figures, const PointViewer* viewer) {
  std::vector<std::string_view> styles = {page_style()};
  std::vector<std::string_view> viewing, drawing = {echarts_script()};  // scripts in their order
  std::string credits = "Diagrams by Apache ECharts (Apache License 2.0)";
  if (viewer) {
    styles.push_back(viewer_style());
    viewing = {three_script(), viewer_script()};
    credits += "; points by three.js (MIT License)";
  }
  if (figures.has_space()) {
    drawing.insert(drawing.end(), {kSizesScript, echarts_gl_script()});
    credits += " and ECharts GL (BSD 3-Clause License)";
  }
  drawing.push_back(page_script());
  std::vector<std::string_view> scripts = {kFirstScript};
  scripts.insert(scripts.end(), viewing.begin(), viewing.end());
  scripts.insert(scripts.end(), drawing.begin(), drawing.end());
  std::string page = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<link rel=\"icon\" "
      "href=\"data:,\">\n<title>{}</title>\n",
      policy(styles, scripts), escape_html(title));
  add_elements(page, "style", styles);
  add_elements(page, "script", {kFirstScript});
  page += "</head>\n<body>\n";
  if (viewer) page += viewer_stage();
  page += fmt::format(
      "<main{}>\n<button id=\"theme\" type=\"button\">Light / dark</button>\n<h1>{}</h1>\n"
      "<p class=\"lead\">{}</p>\n"
      "<noscript><p class=\"verdict care\">The diagrams need JavaScript, which is disabled here. "
      "Texts and tables are complete.</p></noscript>\n",
      viewer ? " id=\"words\"" : "", escape_html(title), escape_html(lead));
  if (viewer) page += "<p><a href=\"#viewer\">↑ The points</a></p>\n";
  page += head_html;
  page +=
      "<details class=\"help\"><summary>How to use the diagrams, with mouse or "
      "keyboard</summary>\n<p>Point at a diagram to read values; drag a box to zoom in, "
      "double-click to show everything; <kbd>Ctrl</kbd> and the wheel zoom, <kbd>Shift</kbd> and "
      "dragging pan. In three dimensions drag to rotate; the wheel moves closer. With the "
      "keyboard: <kbd>Tab</kbd> goes to a diagram, <kbd>+</kbd> and <kbd>-</kbd> zoom, the arrow "
      "keys pan or rotate, <kbd>0</kbd> shows everything, <kbd>n</kbd> and <kbd>p</kbd> step "
      "through the points of the first series.</p></details>\n";
  page += sections.html();
  page += fmt::format(
      "<div id=\"spoken\" class=\"hidden\" aria-live=\"polite\"></div>\n"
      "<footer>{}.</footer>\n</main>\n",
      credits);
  // The first picture of the points waits only for the first of them, not for the rest.
  if (viewer) {
    constexpr std::size_t kFirstNodes = 9;  // the whole and its eighths
    const std::size_t first = std::min(kFirstNodes, viewer->nodes().size());
    page += "<script type=\"application/json\" id=\"viewer-data\">\n" + viewer->json() +
            "\n</script>\n";
    add_nodes(page, *viewer, 0, first);
    add_elements(page, "script", viewing);
    add_nodes(page, *viewer, first, viewer->nodes().size());
  }
  page +=
      "<script type=\"application/json\" id=\"page-data\">\n" + figures.data() + "\n</script>\n";
  add_elements(page, "script", drawing);
  return page + "</body>\n</html>\n";
}

}  // namespace risley::report
