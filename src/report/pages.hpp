// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/datum.hpp"
#include "risley/report/page_parts.hpp"
#include "risley/report/report_file.hpp"

#include "report/view.hpp"

namespace risley::report {

// Pages of results, drawn from report.json, and their common parts. Numbers are in its units.

std::string estimate_page(const View& report);
std::string calibration_page(const View& report);
std::string flight_page(const View& report);

/// Puts a report together.
/// @param page  data for the page only, of page_of() and more
Report finished_report(const char* verb, const json::Json& result, const json::Json& page,
                       const json::Json& charts, const jobs::Provenance& provenance);
/// Data needed by all pages of results in addition to the result: numbers of prisms and emitters,
/// recordings.
json::Json page_of(TrainShape shape, const std::vector<jobs::ReadRecording>& recordings);
/// Correlations of the free parameters, by name.
json::Json correlation_json(const std::vector<std::string>& names,
                            const Eigen::MatrixXd& covariance);
/// Of free parameters.
json::Json correlation_json(const std::vector<estimation::FreeParameter>& free,
                            const Eigen::MatrixXd& covariance);

TrainShape shape_of(const View& report);
/// Last part of a path.
std::string file_name(const std::string& path);
/// "a.lvx, b.lvx"
std::string recording_names(const View& report);
/// "a.lvx and 2 more"
std::string title_of(const View& report);
/// Rows of all recordings.
std::uint64_t observations_of(const View& report);

/// A parameter's name on pages; unknown ones are shown unchanged.
struct ParameterWords {
  std::string head_html, symbol_html, unit;
};
ParameterWords parameter_words(const std::string& name, TrainShape shape);
/// Whether held parameters make the sigma of some parameter larger.
bool any_held_parameter(const View& parameters);
/// NaN if a list by name does not have it.
double number_of(const View& by_name, const std::string& name);

/// Combinations that data do not determine, in words.
std::vector<std::string> weak_directions(const View& unobservable);
/// The box at the top of a page, as far as it is common to all results.
Verdict verdict_of(const View& report);
/// "0.4034° ± 0.0007°" of an object with value and sigma in degrees.
std::string angle_text(const View& angle);
/// Of an angle in degrees: "at 30 m, 2.6 mm" and the like.
std::string offset_of(double degrees);

/// The final sections common to all pages of results.
void add_end(Sections& sections, const View& report);

}  // namespace risley::report
