// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Section 2.3 of the paper: what directions determine about every parameter.
#include "risley/estimation/observability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/parallel/parallel.hpp"

#include "reproduction/papers_unit.hpp"
#include "reproduction/runs.hpp"

namespace risley::reproduction {
namespace {

using estimation::Observability;
using estimation::QuantityObservability;

const char* const kTilt = "prism_tilt_a_horizontal_deg";
const char* const kVerticalTilt = "prism_tilt_a_vertical_deg";

const QuantityObservability& quantity(const Observability& all, std::string_view name) {
  const auto found = std::find_if(all.quantities.begin(), all.quantities.end(),
                                  [&](const auto& one) { return one.name == name; });
  if (found == all.quantities.end())
    throw InvalidArgument(fmt::format("unknown quantity {}", name));
  return *found;
}

double correlation(const Observability& all, const std::string& a, const std::string& b) {
  const auto place = [&](const std::string& name) {
    return std::find(all.correlation_names.begin(), all.correlation_names.end(), name) -
           all.correlation_names.begin();
  };
  return all.correlation(place(a), place(b));
}

/// Root mean square change of the directions for a degree of an angle, or for a hundredth of an
/// index, in degrees.
double effect(const QuantityObservability& one) {
  return degrees_from_radians(one.sensitivity) * si_per_unit(one.name);
}

/// Correlation of both tilts of prism A in the paper's filter, if it estimates both. The data do
/// not determine the horizontal one, so it ends anywhere within its prior, and where it ends
/// decides how the vertical one follows it: a random number between -1 and 1 that is seldom small.
Row vertical_tilt_row(const ReproduceOptions& options, const Progress& progress) {
  const double residual = radians_from_degrees(0.004);
  const double rounding = std::pow(options.unit.angle_resolution, 2) / 12.0;
  const double noise = std::sqrt(residual * residual - rounding);
  std::vector<double> size(options.effort.tilt_draws);
  std::vector<unsigned char> negative(size.size());
  parallel::for_each_job(
      size.size(),
      [&](std::size_t i) {
        simulation::SimulationSettings settings = unit_settings(options, 700000 + i);
        settings.angle_noise = noise;
        settings.quantize = true;
        const SimulatedRun run = simulate(settings);
        estimation::EstimateOptions wishes;
        wishes.sensor = options.type;
        wishes.angle_noise = noise;
        wishes.additional = {kTilt};
        wishes.rotor_process.assign(2, estimation::kPaperProcess);
        const estimation::Estimate found =
            estimation::estimate(estimation::Method::ekf, run.series, run.head, wishes);
        Eigen::Index horizontal = 0, vertical = 0;
        for (std::size_t j = 0; j < found.free.size(); ++j) {
          if (found.free[j].name == kTilt) horizontal = static_cast<Eigen::Index>(j);
          if (found.free[j].name == kVerticalTilt) vertical = static_cast<Eigen::Index>(j);
        }
        const Eigen::MatrixXd& c = found.covariance;
        const double r =
            c(horizontal, vertical) / std::sqrt(c(horizontal, horizontal) * c(vertical, vertical));
        size[i] = std::abs(r);
        negative[i] = r < 0;
      },
      progress);
  const auto negatives = std::count(negative.begin(), negative.end(), 1);
  Row row{"|correlation| of A's horizontal tilt with A's vertical tilt in the paper's filter", "1",
          printed("-0.99"), std::numeric_limits<double>::quiet_NaN()};
  row.distribution = distribution_of(size, std::abs(row.paper->value));
  row.ours = row.distribution->median;
  row.checks = {within("percentile of the paper's |-0.99| among ours", row.distribution->percentile,
                       2.5, 97.5, "the central 95 % of our draws")};
  row.note = fmt::format(
      "One random draw: the data do not determine the horizontal tilt, so the filter leaves it "
      "anywhere "
      "within its prior, and where it ends decides how the vertical tilt follows. {} of {} draws "
      "at "
      "section 3.1's noise are negative; sizes 5, 50 and 95 %: {:.3f}, {:.3f}, {:.3f}.",
      negatives, size.size(), row.distribution->low, row.distribution->median,
      row.distribution->high);
  return row;
}

}  // namespace

Reproduction observability(const ReproduceOptions& options, const Progress& progress) {
  Table table{"section_2_3",
              "Section 2.3: observability of the parameters",
              "The paper studied sensitivities and correlations with its filter. Here: the "
              "information matrix of 30 s at 1 kHz of Table 3's unit, every parameter of the "
              "prisms free, rotors that swing as in Fig. 9.",
              {}};
  estimation::ObservabilityPlan plan;
  plan.sensor = options.unit;
  plan.duration = 30;
  plan.rate = 1000;
  plan.angle_noise = options.angle_noise;
  plan.free = estimation::free_parameters(estimation::default_free_names({2}), {2});
  const Observability all = estimation::observability_of_plan(plan);

  Row angle{"correlation of A's horizontal tilt with A's rotation angle", "1", printed("-0.99"),
            correlation(all, kTilt, "rotation_angle_a_deg")};
  angle.checks = {at_most("ours", angle.ours, -0.985,
                          "as strong as the paper's at its printed digits, and negative")};
  angle.note =
      "The tilt turns the prism about the vertical, which for an ideal sensor is indistinguishable "
      "from its "
      "rotation angle. Ours is stronger than the paper's since nothing but data bind it.";
  table.rows.push_back(angle);

  const auto& tilt = quantity(all, kTilt);
  Row partner{"largest |correlation| of A's horizontal tilt with anything", "1", printed("0.99"),
              std::abs(tilt.twins.front().second)};
  partner.checks = {
      at_least("ours", partner.ours, 0.985, "the printed digits as a lower bound"),
      holds("its partner is A's rotation angle", tilt.twins.front().first == "rotation_angle_a_deg",
            "the strongest, which is " + tilt.twins.front().first)};
  table.rows.push_back(partner);

  table.rows.push_back(vertical_tilt_row(options, progress));

  // Sensitivities of the error parameters, all of them angles.
  double smallest = std::numeric_limits<double>::infinity();
  std::string who;
  for (const QuantityObservability& one : all.quantities) {
    if (one.name == kTilt || one.name.find("rotation_angle") == 0 ||
        one.name.find("angular_velocity") == 0 || one.name.find("refractive_index") == 0) {
      continue;
    }
    if (effect(one) < smallest) {
      smallest = effect(one);
      who = one.name;
    }
  }
  Row insensitive{
      "change of the directions for 1 degree of A's horizontal tilt", "deg", {}, effect(tilt)};
  insensitive.checks = {at_most("ours over that of the next smallest angle (" + who + ")",
                                effect(tilt) / smallest, 1.0,
                                "the paper: relatively insensitive; it moves the beam least of "
                                "all error parameters")};
  table.rows.push_back(insensitive);

  const QuantityObservability& wedge = quantity(all, "wedge_angle_deg");
  Row material{"correlation of the wedge angle with the index of the prisms",
               "1",
               {},
               wedge.twins.front().second};
  material.checks = {
      holds("the index is its partner", wedge.twins.front().first == "refractive_index",
            "with the other default parameters free"),
      at_least("its size", std::abs(material.ours), 0.999,
               "the paper: perfectly correlated through Snell's law")};
  material.note = "Not quite one quantity: 30 s at 100 kHz determine the wedge to 0.01 degree.";
  table.rows.push_back(material);

  Row air{"combinations of air, prism index and wedge that data do not determine", "1", {}, 0.0};
  bool exact = false;
  for (const estimation::WeakDirection& weak : all.unobservable) {
    bool material_only = true;
    for (const auto& [name, weight] : weak.weights) {
      material_only =
          material_only && (name.find("refractive_index") == 0 || name.find("wedge_angle") == 0);
      exact = exact || (name == "refractive_index_air" && weak.ratio < 1e-9);
    }
    air.ours += material_only;
  }
  air.checks = {at_least("ours", air.ours, 1.0, "the paper fixes two of the three"),
                holds("the index of air cannot be determined at all",
                      exact || std::isinf(quantity(all, "refractive_index_air").sigma),
                      "only ratios of indices enter Snell's law")};
  table.rows.push_back(air);

  for (const PapersParameter& papers : kPapersUnit) {
    const Printed stated = printed(papers.sigma);
    const ParameterInfo& info = find_parameter(papers.name, {2});
    Row row{"sigma that 30 s at 1 kHz allow: " + info.long_name, info.unit, stated,
            quantity(all, papers.name).sigma / info.si_per_unit};
    row.checks = {
        at_most("ours", row.ours, stated.value + stated.half_digit,
                "observable, as the paper says of all parameters but that tilt: not worse "
                "than Table 3's +- at its printed digits")};
    table.rows.push_back(row);
  }
  return {{table}, {}};
}

}  // namespace risley::reproduction
