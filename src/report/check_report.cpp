// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/check_report.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"

#include "report/flight_unknowns.hpp"
#include "report/json_archive.hpp"

namespace risley::report {
namespace {

constexpr double kMostCorrelation = 1 + 1e-9;

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
         place + ".colour", fmt::format("unknown colour '{}'", series.colour));
  const std::size_t points = series.x.size();
  const bool space = kind == ChartKind::space, cells = series.kind == SeriesKind::cells;
  check_values(series.y, points, false, place + ".y");
  check_values(series.z, points, !space, place + ".z");
  check_values(series.value, points, !cells, place + ".value");
  expect(!space || series.kind == SeriesKind::points, place + ".kind",
         "expected points in three dimensions");
  for (const double size : {series.cell_width, series.cell_height}) {
    expect(size >= 0, place, "cell_width and cell_height must not be negative");
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
             "expected two numbers, the smaller first");
    }
    expect(!chart.grows_for || *chart.grows_for > 0, place + ".grows_for",
           "expected a time above 0 s");
  }
}

template <class AnyReport>
void check_train_shape(const AnyReport& report) {
  try {
    check_shape(report.shape());
  } catch (const InvalidArgument& error) {
    throw FieldError(fmt::format("prisms, emitters: {}", error.what()));
  }
}

/// @param list  what the covariance is of
void check_covariance(const Eigen::MatrixXd& c, std::size_t expected, const char* list,
                      bool converged) {
  const auto size = static_cast<Eigen::Index>(expected);
  expect(c.rows() == size && (c.cols() == size || size == 0), "covariance",
         fmt::format("{} rows of {} values, expected {} rows of {}: one per entry of {}", c.rows(),
                     c.cols(), size, size, list));
  for (Eigen::Index i = 0; i < size && converged; ++i) {
    expect(c.row(i).allFinite() && c(i, i) >= 0, fmt::format("covariance[{}]", i),
           "expected finite numbers, and none below 0 on the diagonal");
  }
}

/// What estimates and calibrations on walls have.
template <class AnyReport>
void check_common(const AnyReport& report) {
  check_train_shape(report);
  const TrainShape shape = report.shape();
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
  check_covariance(report.covariance, report.free.size(), "free", report.converged);
}

/// A number where the result converged, and nowhere one below 0.
void check_size_of(double value, bool converged, const std::string& place) {
  expect(!converged || std::isfinite(value), place, "expected a number");
  expect(!(value < 0), place, "is negative");
}

void check_unknowns(const FlightReport& r) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < r.unknowns.size(); ++i) {
    const calibration::FlightUnknown& own = r.unknowns[i];
    const std::string place = fmt::format("unknowns[{}]", i);
    if (is_of_train(own.name)) check_known(own.name, r.shape(), place + ".name");
    expect(names.insert(own.name).second, place + ".name",
           fmt::format("'{}' is listed twice", own.name));
    expect(!r.converged || std::isfinite(own.value), place + ".value", "expected a number");
    check_size_of(own.sigma, r.converged, place + ".sigma");
    expect(!(own.prior_sigma < 0), place + ".prior_sigma", "is negative");
    expect(!(own.prior_share < 0 || own.prior_share > 1), place + ".prior_share",
           "expected 0 to 1");
    expect(!(std::abs(own.twin_correlation) > kMostCorrelation), place + ".twin_correlation",
           "expected -1 to 1");
  }
  for (std::size_t i = 0; i < r.unknowns.size(); ++i) {
    const std::string& twin = r.unknowns[i].twin;
    expect(twin.empty() || names.contains(twin), fmt::format("unknowns[{}].twin", i),
           fmt::format("'{}' is not one of the unknowns", twin));
  }
}

void check_pairs(const std::vector<calibration::StripPair>& pairs, const std::string& list) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::string place = fmt::format("{}[{}]", list, i);
    expect(pairs[i].first < pairs[i].second, place,
           "expected two strips, the smaller number first");
    expect(!(pairs[i].rms < 0), place + ".rms_m", "is negative");
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      expect(!(pairs[i].sigma[axis] < 0), place + ".shift_sigma_m", "is negative");
    }
  }
}

}  // namespace

void check_report(const EstimateReport& r) {
  check_common(r);
  const auto prisms = static_cast<std::size_t>(r.prisms);
  expect(r.combination >= 0 && r.combination <= 2, "combination", "expected 0, 1 or 2");
  expect(r.method == "map" || r.method == "ekf", "method",
         fmt::format("unknown method '{}', expected map or ekf", r.method));
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
  if (r.pointing_charts) check_charts(*r.pointing_charts, "pointing_charts");
  check_charts(r.thickness_charts, "thickness_charts");
  check_charts(r.wall_charts, "wall_charts");
  check_charts(r.view_charts, "view_charts");
}

void check_report(const FlightReport& r) {
  check_train_shape(r);
  check_unknowns(r);
  check_size(r.nominal.size(), r.unknowns.size(), "nominal");
  if (r.truth) check_size(r.truth->values.size(), r.unknowns.size(), "truth.values");
  check_covariance(r.covariance, r.unknowns.size(), "unknowns", r.converged);
  const Eigen::MatrixXd& mount = r.body_from_sensor;
  expect(mount.rows() == 3 && mount.cols() == 3 && mount.allFinite(), "body_from_sensor",
         "expected three rows of three numbers");
  for (const auto& [value, name] :
       {std::pair(r.datum.sigma_x, "sigma_x"), std::pair(r.datum.sigma_y, "sigma_y"),
        std::pair(r.datum.sigma_z, "sigma_z"), std::pair(r.datum.rotation, "rotation"),
        std::pair(r.datum.shape, "shape"), std::pair(r.datum.total, "total"),
        std::pair(r.datum.height, "height_m")}) {
    check_size_of(value, r.converged, fmt::format("datum.{}", name));
  }
  for (std::size_t i = 0; i < r.not_told.size(); ++i) {
    expect(!(r.not_told[i].sigma < 0), fmt::format("not_told[{}].sigma", i), "is negative");
  }
  for (std::size_t i = 0; i < r.control.size(); ++i) {
    expect(r.control[i].sigma > 0, fmt::format("control[{}].sigma_m", i), "expected above 0");
  }
  check_pairs(r.pairs_before, "pairs_before");
  check_pairs(r.pairs_after, "pairs_after");
  expect(r.knot_spacing >= 0, "knot_spacing_s", "is negative");
  check_charts(r.strip_charts, "strip_charts");
  check_charts(r.difference_charts, "difference_charts");
  check_charts(r.ground_charts, "ground_charts");
  check_charts(r.residual_charts, "residual_charts");
  check_charts(r.correction_charts, "correction_charts");
}

}  // namespace risley::report
