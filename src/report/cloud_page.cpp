// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/cloud_page.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::report {
namespace {

using cloud::CloudSummary;
using cloud::PointSample;
using cloud::RangeClass;

constexpr double kLowShare = 0.02, kHighShare = 0.98;  // where colours end

/// Values as a page draws them: digits beyond a step are invisible.
std::vector<double> stepped(const std::vector<double>& values, double scale, double step) {
  std::vector<double> result(values.size());
  std::transform(values.begin(), values.end(), result.begin(),
                 [&](double value) { return std::round(scale * value / step) * step; });
  return result;
}

/// Where most values lie; nothing when none is known.
std::optional<std::pair<double, double>> usual_range(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return std::isnan(v); }),
               values.end());
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  const double low = at(kLowShare), high = at(kHighShare);
  return std::pair{low, high > low ? high : low + 1};
}

std::vector<double> sigma_mm(const PointSample& sample) {
  return stepped(sample.total_sigma, kMillimetres, 0.01);
}

std::vector<double> incidence_deg(const PointSample& sample) {
  return stepped(sample.incidence, degrees_from_radians(1.0), 0.1);
}

Chart points_chart(const PointSample& sample) {
  const auto label = [&](std::size_t axis) {
    const double offset = sample.frame.offset[axis];
    return offset == 0 ? fmt::format("{}, m", sample.frame.axes[axis])
                       : fmt::format("{} − {:.0f} m, m", sample.frame.axes[axis], offset);
  };
  Series points{"", "a", SeriesKind::points, stepped(sample.x, 1, 1e-3),
                stepped(sample.y, 1, 1e-3)};
  points.z = stepped(sample.z, 1, 1e-3);
  Chart chart{"The points", label(0), label(1), {}, "", ChartKind::space};
  chart.z_label = label(2);
  chart.note = fmt::format("{} The colours leave out the lowest and the highest 2 % of the values.",
                           sample.size() == sample.points
                               ? fmt::format("All {} points are drawn.", count_text(sample.points))
                               : fmt::format("{1} of the {0} points are drawn, chosen at random.",
                                             count_text(sample.points), count_text(sample.size())));
  std::vector<Colouring>& colourings = chart.colourings.emplace();
  const auto add = [&](std::string name, std::vector<double> values) {
    if (values.empty()) return;
    auto range = usual_range(values);
    if (range) colourings.push_back({std::move(name), std::move(values), range});
  };
  add("standard uncertainty of the position, mm", sigma_mm(sample));
  add(chart.z_label, points.z);
  add("intensity", std::vector<double>(sample.intensity.begin(), sample.intensity.end()));
  add("angle of incidence, deg", incidence_deg(sample));
  chart.series.push_back(std::move(points));
  return chart;
}

/// @param x  of every point of the sample
Chart sigma_chart(const PointSample& sample, std::string title, std::string x_label,
                  const std::vector<double>& x) {
  constexpr std::size_t kMostDots = 6000;
  const std::vector<double> sigma = sigma_mm(sample);
  Series dots{"", "a", SeriesKind::points, {}, {}};
  for (const std::size_t row : every_nth(sample.size(), kMostDots)) {
    if (std::isnan(x[row])) continue;
    dots.x.push_back(x[row]);
    dots.y.push_back(sigma[row]);
  }
  return {std::move(title),
          std::move(x_label),
          "standard uncertainty, mm",
          {std::move(dots)},
          every_nth_note(sample.size(), kMostDots, "points of the sample")};
}

std::string row_of(const std::string& head, const RangeClass& one) {
  return fmt::format(
      "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{:.1f} %</td></tr>\n",
      head, count_text(one.points), millimetres(one.median_sigma), millimetres(one.high_sigma),
      100 * one.known_incidence);
}

std::string uncertainty_html(const PointSample& sample, Figures& figures) {
  if (sample.total_sigma.empty()) return "";
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>range</th><th>points of the "
      "sample</th><th>median, mm</th><th>95 % are below, mm</th><th>angle of incidence "
      "known</th></tr></thead><tbody>\n";
  for (const RangeClass& one : cloud::range_classes(sample)) {
    html += row_of(std::isfinite(one.to) ? fmt::format("{:g} to {:g} m", one.from, one.to)
                                         : fmt::format("beyond {:g} m", one.from),
                   one);
  }
  html += row_of("all", cloud::whole_range(sample));
  return html +
         "</tbody></table></div>\n<p class=\"note\">Standard uncertainty of the position: the "
         "square root of the sum of the variances of the three coordinates. It includes the noise "
         "of the ranges and rotation angles, the width of the beam, and the uncertainty of the "
         "calibration and, if the sensor moves, of its mount and trajectory.</p>\n" +
         charts_html({sigma_chart(sample, "Uncertainty against range", "range, m",
                                  stepped(sample.range, 1, 1e-3)),
                      sigma_chart(sample, "Uncertainty against the angle of incidence",
                                  "angle of incidence, deg", incidence_deg(sample))},
                     figures);
}

std::string counts_html(const CloudSummary& cloud) {
  const auto row = [](const char* head, std::uint64_t count, const char* words) {
    return fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"text says\">{}</td></tr>\n", head,
        count_text(count), words);
  };
  return "<div class=\"wide\"><table><thead><tr><th></th><th>observations</th>"
         "<th class=\"text\">why</th></tr></thead><tbody>\n" +
         row("points", cloud.points, "in the cloud") +
         row("without return", cloud.no_return, "sky, glass or water: nothing came back") +
         row("outliers", cloud.outliers,
             "the reported direction contradicts the motion of the rotors") +
         row("without rotation angles", cloud.without_rotation_angle,
             "the motion of the rotors was not found at that time") +
         row("without pose", cloud.without_pose, "the trajectory does not cover that time") +
         row("all", cloud.observations, "of the recording") + "</tbody></table></div>\n";
}

std::vector<KeyNumber> key_numbers(const CloudSummary& cloud) {
  std::vector<KeyNumber> numbers{{count_text(cloud.points), "points in the cloud"}};
  if (cloud.sample->total_sigma.empty()) return numbers;
  const RangeClass all = cloud::whole_range(*cloud.sample);
  numbers.push_back({fmt::format("{} mm", millimetres(all.median_sigma)),
                     "standard uncertainty of a point's position, median"});
  numbers.push_back({fmt::format("{} mm", millimetres(all.high_sigma)),
                     "95 % of the points have a smaller standard uncertainty"});
  return numbers;
}

}  // namespace

std::string cloud_page(const CloudSummary& cloud, const std::string& recording,
                       const jobs::Provenance& provenance) {
  if (!cloud.sample || cloud.sample->size() == 0) {
    throw InvalidArgument("a page of a cloud needs a sample of its points, and there is none");
  }
  Figures figures;
  std::string head = overview_html(key_numbers(cloud), {points_chart(*cloud.sample)}, figures);
  if (!cloud.warnings.empty()) {
    std::vector<std::string> texts;
    std::ranges::transform(cloud.warnings, std::back_inserter(texts), warning_text);
    head += "<section class=\"verdict care\"><strong>With care:</strong>" + list_html(texts) +
            "</section>\n";
  }
  Sections sections;
  sections.add("Uncertainty of the points", uncertainty_html(*cloud.sample, figures),
               Sections::Shown::unfolded);
  sections.add("What is not in the cloud", counts_html(cloud));
  sections.add(kHowToRepeat, provenance_html(provenance));
  return page_html("Point cloud: " + recording, fmt::format("Coordinates are {}.", cloud.frame),
                   head, sections, figures);
}

}  // namespace risley::report
