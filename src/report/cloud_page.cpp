// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/cloud_page.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"
#include "risley/report/point_viewer.hpp"

namespace risley::report {
namespace {

using cloud::CloudSummary;
using cloud::PointSample;
using cloud::RangeClass;

std::vector<float> scaled(std::vector<float> values, double scale) {
  for (float& one : values) one = static_cast<float>(scale * one);
  return values;
}

std::vector<float> sigma_mm(const PointSample& sample) {
  return scaled(sample.total_sigma, kMillimetres);
}

std::vector<float> incidence_deg(const PointSample& sample) {
  return scaled(sample.incidence, degrees_from_radians(1.0));
}

/// The result in a sentence or two.
std::string cloud_words(const CloudSummary& cloud) {
  std::string words = fmt::format("{} points", count_text(cloud.points));
  if (!cloud.sample->total_sigma.empty()) {
    const RangeClass all = cloud::whole_range(*cloud.sample);
    words += fmt::format(
        "; standard uncertainty of a position: {} mm for half of them, {} mm for 95\u00a0%",
        millimetres(all.median_sigma), millimetres(all.high_sigma));
  }
  words += ".";
  if (!cloud.warnings.empty())
    words +=
        fmt::format(" With care: {} below.", cloud.warnings.size() == 1 ? "a warning" : "warnings");
  return words;
}

PointViewer viewer_of(const CloudSummary& cloud) {
  const PointSample& sample = *cloud.sample;
  PointsToView view{sample.frame.axes, sample.frame.offset, sample.x, sample.y, sample.z};
  const auto add = [&](std::optional<PointColouring> colouring) {
    if (colouring) view.colourings.push_back(std::move(*colouring));
  };
  add(usual_colouring("standard uncertainty of the position, mm", sigma_mm(sample)));
  view.height_at = view.colourings.size();
  add(colouring_between(
      "intensity", std::vector<float>(sample.intensity.begin(), sample.intensity.end()), {0, 254}));
  add(usual_colouring("angle of incidence, deg", incidence_deg(sample)));
  view.words = cloud_words(cloud);
  view.note = sample.size() == sample.points
                  ? fmt::format("All {} points are here.", count_text(sample.points))
                  : fmt::format("{1} of the {0} points are here, chosen at random.",
                                count_text(sample.points), count_text(sample.size()));
  return PointViewer(view);
}

/// @param x  of every point of the sample
Chart sigma_chart(const PointSample& sample, std::string title, std::string x_label,
                  const std::vector<float>& x) {
  constexpr std::size_t kMostDots = 6000;
  const auto stepped = [](double value, double step) { return std::round(value / step) * step; };
  Series dots{"", "a", SeriesKind::points, {}, {}};
  for (const std::size_t row : every_nth(sample.size(), kMostDots)) {
    if (std::isnan(x[row])) continue;
    dots.x.push_back(stepped(x[row], 0.01));
    dots.y.push_back(stepped(kMillimetres * sample.total_sigma[row], 0.01));
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
         charts_html({sigma_chart(sample, "Uncertainty against range", "range, m", sample.range),
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
         row("without return", cloud.no_return, "sky, glass or water: no return") +
         row("outliers", cloud.outliers,
             "the reported direction contradicts the motion of the rotors") +
         row("without rotation angles", cloud.without_rotation_angle,
             "no rotor motion found for that time") +
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
    throw InvalidArgument("a cloud's page needs a sample of its points, and there is none");
  }
  Figures figures;
  std::string head = overview_html(key_numbers(cloud), std::vector<Chart>{}, figures);
  head += care_html(cloud.warnings);
  Sections sections;
  sections.add("Uncertainty of the points", uncertainty_html(*cloud.sample, figures),
               Sections::Shown::unfolded);
  sections.add("Shots without a point in the cloud", counts_html(cloud));
  sections.add(kHowToRepeat, provenance_html(provenance));
  const PointViewer viewer = viewer_of(cloud);
  return page_html("Point cloud: " + recording, fmt::format("Coordinates are {}.", cloud.frame),
                   head, sections, figures, &viewer);
}

}  // namespace risley::report
