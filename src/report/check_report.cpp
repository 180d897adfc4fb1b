// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/check_report.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"

#include "report/json_archive.hpp"

namespace risley::report {
namespace {

void expect(bool right, const std::string& place, const std::string& problem) {
  if (!right) throw FieldError(fmt::format("{}: {}", place, problem));
}

void check_size(std::size_t found, std::size_t expected, const std::string& place) {
  expect(found == expected, place, fmt::format("{} values, expected {}", found, expected));
}

void check_values(const std::vector<double>& values, std::size_t expected, bool optional,
                  const std::string& place) {
  if (!(optional && values.empty())) check_size(values.size(), expected, place);
}

void check_known(const std::string& name, TrainShape shape, const std::string& place) {
  try {
    find_parameter(name, shape);
  } catch (const InvalidArgument& error) {
    throw FieldError(fmt::format("{}: {}", place, error.what()));
  }
}

void check_series(const Series& series, ChartKind kind, const std::string& place) {
  static constexpr const char* kColours[] = {"a", "b", "c", "d", "ink", "bad"};
  expect(std::find(std::begin(kColours), std::end(kColours), series.colour) != std::end(kColours),
         place + ".colour", fmt::format("'{}' is no known name", series.colour));
  const std::size_t points = series.x.size();
  const bool space = kind == ChartKind::space, cells = series.kind == SeriesKind::cells;
  check_values(series.y, points, false, place + ".y");
  check_values(series.z, points, !space, place + ".z");
  check_values(series.value, points, !cells, place + ".value");
  expect(!space || series.kind == SeriesKind::points, place + ".kind",
         "expected points in three dimensions");
  for (const double size : {series.cell_width, series.cell_height}) {
    expect(size >= 0, place, "cell_width and cell_height are lengths");
  }
}

void check_charts(const std::vector<Chart>& charts, const std::string& list) {
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const Chart& chart = charts[i];
    const std::string place = fmt::format("{}[{}]", list, i);
    for (std::size_t k = 0; k < chart.series.size(); ++k) {
      check_series(chart.series[k], chart.kind, fmt::format("{}.series[{}]", place, k));
    }
    if (chart.value_range) {
      expect(chart.value_range->first <= chart.value_range->second, place + ".value_range",
             "expected two numbers, the smaller one first");
    }
    expect(!chart.grows_for || *chart.grows_for > 0, place + ".grows_for", "expected a time");
  }
}

/// What both kinds of report have.
template <class AnyReport>
void check_common(const AnyReport& report) {
  const TrainShape shape = report.shape();
  try {
    check_shape(shape);
  } catch (const InvalidArgument& error) {
    throw FieldError(fmt::format("prisms, emitters: {}", error.what()));
  }
  for (std::size_t i = 0; i < report.parameters.size(); ++i) {
    const ReportedParameter& row = report.parameters[i];
    const std::string place = fmt::format("parameters[{}]", i);
    check_known(row.name, shape, place + ".name");
    expect(!report.converged || std::isfinite(row.value), place + ".value", "expected a number");
    expect(!(row.sigma < 0), place + ".sigma", "is negative");
    expect(!(row.sigma_given_held.value_or(row.sigma) > row.sigma), place + ".sigma_given_held",
           "is larger than sigma, which includes it");
  }
  for (std::size_t i = 0; i < report.free.size(); ++i) {
    check_known(report.free[i], shape, fmt::format("free[{}]", i));
  }
  const auto free = static_cast<Eigen::Index>(report.free.size());
  const Eigen::MatrixXd& c = report.covariance;
  expect(c.rows() == free && (c.cols() == free || free == 0), "covariance",
         fmt::format("{} rows of {} values, expected {} of {} as many as free has", c.rows(),
                     c.cols(), free, free));
  for (Eigen::Index i = 0; i < free && report.converged; ++i) {
    expect(c.row(i).allFinite() && c(i, i) >= 0, fmt::format("covariance[{}]", i),
           "expected numbers, on the diagonal none below 0");
  }
}

}  // namespace

void check_report(const EstimateReport& r) {
  check_common(r);
  const auto prisms = static_cast<std::size_t>(r.prisms);
  expect(r.combination >= 0 && r.combination <= 2, "combination", "expected 0, 1 or 2");
  expect(r.method == "map" || r.method == "ekf", "method",
         fmt::format("'{}' is no known name", r.method));
  check_values(r.unevenness, prisms, true, "residuals_over_angle_chi2_per_bin");
  if (r.truth) {
    check_values(r.truth->rotation_angle_rmse, prisms, true, "truth.rotation_angle_rmse");
  }
  check_charts(r.parameter_charts, "parameter_charts");
  check_charts(r.rotor_charts, "rotor_charts");
  check_charts(r.residual_charts, "residual_charts");
  check_charts(r.pattern_charts, "pattern_charts");
}

void check_report(const CalibrationReport& r) {
  check_common(r);
  check_charts(r.truth_charts, "truth_charts");
  check_charts(r.thickness_charts, "thickness_charts");
  check_charts(r.wall_charts, "wall_charts");
  check_charts(r.view_charts, "view_charts");
}

}  // namespace risley::report
