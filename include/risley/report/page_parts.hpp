// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "risley/optics/parameters.hpp"
#include "risley/report/charts.hpp"
#include "risley/report/report_facts.hpp"

namespace risley::report {

/// Errors beyond so many sigmas stand out.
inline constexpr double kFarOff = 3.0;

/// "Δφ_L0" with a lowered index.
std::string symbol_html(const std::string& symbol);

/// Head of a parameter's row: its name in words, its symbol and its name in files.
std::string parameter_head(const std::string& long_name, const std::string& symbol,
                           const std::string& name);
std::string parameter_head(const ParameterInfo& parameter);

/// Whether held parameters make the sigma of some parameter larger.
bool any_held_parameter(std::span<const ReportedParameter> parameters);

std::string list_html(const std::vector<std::string>& items);

/// What a page says first.
struct Verdict {
  bool converged = false;
  std::string reason;                 ///< why not converged
  ReportedVerdict result;             ///< empty in files of older versions
  std::vector<std::string> warnings;  ///< any makes a converged result one to use with care
  std::string facts;
  std::string mend;  ///< what else to do when it did not converge; empty: nothing
  /// A reason for care that needs more than a line: paragraphs, or nothing.
  std::string care_html;
};
std::string verdict_html(const Verdict& verdict);

/// What stands before a row and above a column of correlations.
struct CorrelationHead {
  std::string row_html, symbol_html;
};

/// Correlations as a table in colours; nothing when there are none.
/// @param covariance  [heads, heads]
std::string correlation_html(const std::vector<CorrelationHead>& heads,
                             const Eigen::MatrixXd& covariance);

/// The same of the free parameters of a train.
/// @param free        names
/// @param covariance  [free, free]
std::string correlation_html(const std::vector<std::string>& free,
                             const Eigen::MatrixXd& covariance, TrainShape shape);

/// How sound the times of recordings are, as a table.
std::string time_audit_html(const std::vector<ReportedRecording>& recordings);

/// How to make a result again: name and value pairs.
std::string provenance_html(const Provenance& provenance);

/// The diagrams of one page in one numbering, and the data that they draw.
class Figures {
 public:
  /// The figure element of a diagram, whose data are kept.
  std::string add(const Chart& chart);
  /// The data of all diagrams so far, a JSON array.
  std::string data() const { return "[" + data_ + "]"; }
  /// Whether any diagram has three axes.
  bool has_space() const { return has_space_; }

 private:
  std::string data_;
  std::size_t number_ = 0;
  bool has_space_ = false;
};

/// Diagrams side by side, as far as the page is wide.
std::string charts_html(const std::vector<Chart>& charts, Figures& figures);

/// One self-contained page (Apache ECharts included, no network).
/// @param lead       one sentence under the title, text
/// @param body_html  all that follows
std::string page_html(const std::string& title, const std::string& lead,
                      const std::string& body_html, const Figures& figures);

}  // namespace risley::report
