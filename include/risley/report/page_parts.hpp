// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/warning.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/report/chart.hpp"

namespace risley::report {

class PointViewer;
class View;

/// Errors beyond this many sigmas are highlighted.
inline constexpr double kFarOff = 3.0;

/// "Δφ_L0" with a lowered index.
std::string symbol_html(const std::string& symbol);

/// Head of a parameter's row: its name in words, its symbol and its name in files.
std::string parameter_head(const std::string& long_name, const std::string& symbol,
                           const std::string& name);
/// As above, of one parameter of a train.
std::string parameter_head(const ParameterInfo& parameter);

/// "0.4034° ± 0.0007°"; without a sigma, three digits. @param value, sigma  rad
std::string angle_with_sigma(double value, double sigma);

/// Texts as the items of a bulleted list.
std::string list_html(const std::vector<std::string>& items);
/// A box of reasons for care; empty if there are none.
std::string care_html(const std::vector<std::string>& reasons);
/// As above, in the words of warnings.
std::string care_html(const std::vector<Warning>& warnings);

/// What a page says first.
struct Verdict {
  bool converged = false;
  std::string reason;                 ///< why not converged
  std::string code, words, to_do;     ///< as results have them
  std::vector<std::string> warnings;  ///< any of them makes a converged result one to use with care
  std::string facts;
  std::string mend;  ///< further advice if it did not converge; empty: none
  /// A warning that needs more than a line: paragraphs, or nothing.
  std::string care_html;
};
/// The box at the top of a page that states whether the result can be used, and why not.
std::string verdict_html(const Verdict& verdict);

/// Labels of a row and a column of correlations.
struct CorrelationHead {
  std::string row_html, symbol_html;
};

/// Headings of sections that several pages have.
inline constexpr const char* kCorrelations = "Correlations of the parameters";
/// Section on the regularity of the recordings' times.
inline constexpr const char* kTimes = "Times of the recording";
/// Section with the command that made the page, and its inputs.
inline constexpr const char* kHowToRepeat = "How to make it again";

/// Correlations as a table in colours; nothing when there are none.
/// @param matrix  [heads, heads]
std::string correlation_html(const std::vector<CorrelationHead>& heads, const View& matrix);

/// Quality of the times of recordings, as a table.
std::string time_audit_html(const View& recordings);

/// How to reproduce a result: name and value pairs.
std::string provenance_html(const jobs::Provenance& provenance);

/// The diagrams of one page with common numbering, and their data.
class Figures {
 public:
  /// The figure element of a diagram, whose data are kept.
  std::string add(const Chart& chart);
  /// The same of one in a report.
  std::string add(const json::Json& chart);
  /// The data of all diagrams so far, a JSON array.
  std::string data() const { return "[" + data_ + "]"; }
  /// Whether any diagram has three axes.
  bool has_space() const { return has_space_; }

 private:
  std::string data_;
  std::size_t number_ = 0;
  bool has_space_ = false;
};

/// Diagrams side by side, as far as the page's width allows.
/// @param first  number of diagrams already placed elsewhere
std::string charts_html(const std::vector<Chart>& charts, Figures& figures, std::size_t first = 0);
/// The same of diagrams in a report.
std::string charts_html(const json::Json& charts, Figures& figures, std::size_t first = 0);

/// A key number shown before the tables of a page.
struct KeyNumber {
  std::string text;   ///< with its unit, "0.4034° ± 0.0007°"
  std::string words;  ///< what it is
};

/// Content below the verdict: a few numbers beside the first of some diagrams, if there is one.
std::string overview_html(const std::vector<KeyNumber>& numbers, const std::vector<Chart>& charts,
                          Figures& figures);
/// The same of diagrams in a report.
std::string overview_html(const std::vector<KeyNumber>& numbers, const json::Json& charts,
                          Figures& figures);

/// The sections of a page under their headings. Each can be expanded, and a table of contents links
/// to it.
class Sections {
 public:
  /// Whether a section is initially open.
  enum class Shown { folded, unfolded };
  /// @param html  empty: the section is omitted
  void add(const std::string& title, const std::string& html, Shown shown = Shown::folded);
  /// @param id      for links to it
  /// @param remark  text of the contents beside the title
  void add(const std::string& title, const std::string& html, const std::string& id,
           const std::string& remark);
  /// Contents and sections.
  std::string html() const;

 private:
  void add(const std::string& title, const std::string& html, const std::string& id,
           const std::string& remark, Shown shown);

  std::string contents_, sections_;
};

/// One self-contained page (Apache ECharts included, no network).
/// @param lead       one sentence under the title, text
/// @param head_html  top of the page: verdict_html(), overview_html()
/// @param viewer     fills the window, with the rest below it; none: nullptr
std::string page_html(const std::string& title, const std::string& lead,
                      const std::string& head_html, const Sections& sections,
                      const Figures& figures, const PointViewer* viewer = nullptr);

}  // namespace risley::report
