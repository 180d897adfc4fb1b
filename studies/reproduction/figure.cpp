// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reproduction/figure.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/number_text.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/report/chart.hpp"
#include "risley/report/html.hpp"

namespace risley::reproduction {
report::Chart histogram_chart(std::string title, std::string x_label,
                              std::span<const double> values, double scale) {
  const estimation::Moments m = estimation::moments(values);
  report::Chart chart{std::move(title), std::move(x_label), "count",
                      report::histogram("sample", "a", values, {}, m, scale), ""};
  if (m.std > 0) {
    const double sigma = scale * m.std / std::sqrt(static_cast<double>(m.count));  // of the mean
    chart.note =
        fmt::format("{} values, mean {}, standard deviation {:.3g}", report::count_text(m.count),
                    number_text(scale * m.mean, sigma).value, scale * m.std);
  }
  return chart;
}

report::Chart field_of_view_chart(std::string title, report::Series series) {
  report::Chart chart{std::move(title),      "azimuth, deg", "zenith, deg", {}, "",
                      report::ChartKind::map};
  if (!series.value.empty()) {
    chart.value_label = series.label;
    std::vector<double> sorted = series.value;
    std::sort(sorted.begin(), sorted.end());
    const double least = sorted.front(), greatest = sorted.back();
    const double high =
        sorted[static_cast<std::size_t>(0.98 * static_cast<double>(sorted.size() - 1))];
    if (least < 0) {
      const double reach = std::max(-least, std::abs(greatest));
      chart.palette = report::Palette::diverging;
      chart.value_range = {-reach, reach};
    } else if (greatest > 2.0 * high) {
      chart.value_range = {least, high};
      chart.note =
          fmt::format("Colours end at {:.4g}; the highest value is {:.4g}.", high, greatest);
    }
  }
  chart.series.push_back(std::move(series));
  return chart;
}

}  // namespace risley::reproduction
