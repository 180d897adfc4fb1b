// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "flight_text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/text.hpp"

#include "command.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using calibration::FlightCalibration;
using calibration::FlightUnknown;
using calibration::StripPair;
using jobs::CalibratedFlight;

double in_degrees(double radians) { return degrees_from_radians(radians); }

void print_control(const FlightCalibration& c) {
  if (c.control.empty()) return;
  say("\n");
  Table table({"known ground", "shots", "seen above it mm", "+- sigma mm"});
  for (const calibration::SeenControl& seen : c.control) {
    table.add({seen.name, grouped(seen.shots),
               seen.used ? fmt::format("{:+.1f}", 1e3 * seen.off) : "left out",
               fmt::format("{:.1f}", 1e3 * seen.sigma)});
  }
  table.print();
}

/// Findings of the strips on the trajectory and the ground; jumps and factors are warnings.
void print_trajectory_fit(const FlightCalibration& c) {
  const NumberText delay = number_text(1e3 * c.attitude_delay.value, 1e3 * c.attitude_delay.sigma);
  say("\nattitudes late against positions by {} +- {} ms; jumps of the trajectory: {}", delay.value,
      delay.sigma, c.trajectory_fit.jumps.size());
  if (c.roughness > 0) say("; ground rough by {:.1f} mm", 1e3 * c.roughness);
  say("\n");
}

}  // namespace

void print_judgement(const calibration::FlightJudgement& judgement) {
  const calibration::FlightDatum& datum = judgement.datum;
  say("boresight and prisms together: 1 sigma {:.2g} deg over the field of view ({:.2g} shared by "
      "all beams, {:.2g} in shape), {}\n",
      in_degrees(datum.total), in_degrees(datum.rotation), in_degrees(datum.shape),
      offset_text(datum.total, datum.height));
  for (const calibration::NotTold& own : judgement.not_told) {
    say("not determined by this flight: {} (keeps {:.0f} % of its sigma)\n", own.words,
        100 * std::min(1.0, own.sigma));
  }
}

void print_flight(const CalibratedFlight& outcome) {
  const FlightCalibration& c = outcome.calibration;
  const TrainShape shape = c.sensor.shape();
  say("{}\n", c.converged ? "converged" : "NOT CONVERGED");
  print_verdict(c.verdict);
  say("sensor {}: {}\n", outcome.choice.sensor.name, outcome.choice.words);
  say("{} shots on {} strips, {} cells of ground; read {:.2f} s, rotation angles {:.2f} s, solved "
      "{:.2f} s\n\n",
      grouped(c.used), outcome.strips.size(), grouped(c.cells), outcome.reading_time,
      outcome.angles_time, outcome.solving_time);
  Table table({"unknown", "value", "+- sigma", "unit", "before", "+- sigma"});
  for (const FlightUnknown& unknown : c.unknowns) {
    if (unknown.held && !(unknown.sigma > 0)) continue;
    const NumberText text = number_text(calibration::in_file_unit(unknown, unknown.value, shape),
                                        calibration::in_file_unit(unknown, unknown.sigma, shape));
    const double before = calibration::in_file_unit(unknown, unknown.start, shape);
    const double prior = calibration::in_file_unit(unknown, unknown.prior_sigma, shape);
    table.add({unknown.name + (unknown.held ? " (held)" : ""), text.value, text.sigma,
               calibration::file_unit(unknown, shape),
               text_to_place_of(before, calibration::in_file_unit(unknown, unknown.sigma, shape)),
               std::isfinite(prior) ? fmt::format("{:.2g}", prior) : "none"});
  }
  table.print();
  say("\n");
  print_judgement(c);
  say("strips apart along the ground's normals: {:.1f} mm before, {:.1f} mm after\n\n",
      1e3 * c.rms_before, 1e3 * c.rms_after);
  Table pairs({"strips", "cells", "before mm", "after mm", "east mm", "north mm", "up mm"});
  for (const StripPair& after : c.pairs_after) {
    const StripPair* before = find_pair(c.pairs_before, after);
    std::vector<std::string> row = {
        fmt::format("{} - {}", after.first + 1, after.second + 1), grouped(after.cells),
        before == nullptr ? "-" : fmt::format("{:.1f}", 1e3 * before->rms),
        fmt::format("{:.1f}", 1e3 * after.rms)};
    for (Eigen::Index k = 0; k < 3; ++k) {
      row.push_back(after.sigma[k] >= 1 ? "not determined"
                                        : fmt::format("{:.1f} +- {:.1f}", 1e3 * after.shift[k],
                                                      1e3 * after.sigma[k]));
    }
    pairs.add(row);
  }
  pairs.print();
  print_trajectory_fit(c);
  print_control(c);
  if (!outcome.truth) return;
  say("\n");
  Table errors({"error, deg", "total", "shared rotation", "shape"});
  const auto add = [&errors](const char* name, const calibration::DirectionErrors& e) {
    errors.add({name, fmt::format("{:.5f}", in_degrees(e.total)),
                fmt::format("{:.5f}", in_degrees(e.gauge)),
                fmt::format("{:.5f}", in_degrees(e.shape))});
  };
  add("before", outcome.truth->before);
  add("after", outcome.truth->after);
  errors.print();
}

}  // namespace risley::app
