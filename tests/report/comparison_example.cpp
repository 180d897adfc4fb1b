// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/comparison_example.hpp"

#include <cmath>
#include <cstddef>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::testing {

calibration::PointingError pointing_error(double total_deg) {
  const double total = radians_from_degrees(total_deg);
  calibration::PointingError off;
  off.errors.total = total;
  off.errors.gauge = 0.8 * total;
  off.errors.shape = 0.6 * total;
  off.errors.rotation = {0, 0.5 * total, -0.25 * total};
  off.total_sigma = off.gauge_sigma = 0.1 * total;
  off.shape_sigma = 0.05 * total;
  off.worst_shape = total;
  off.worst_shape_sigma = 0.2 * total;
  return off;
}

jobs::ResultComparison compared(const std::vector<KnownValue>& a, const std::vector<KnownValue>& b,
                                double apart_deg) {
  jobs::ResultComparison c;
  c.a = c.b = sensors::load_sensor("mid-40");
  c.a.serial = c.b.serial = "1PQD&7";
  c.same_unit = true;
  for (std::size_t i = 0; i < a.size(); ++i) {
    c.parameters.push_back({a[i].name, a[i].value, b[i].value, a[i].sigma, b[i].sigma,
                            b[i].value - a[i].value, std::hypot(a[i].sigma, b[i].sigma)});
  }
  c.beams = pointing_error(apart_deg);
  return c;
}

void of_two_units(jobs::ResultComparison& comparison) {
  comparison.b.serial = "2QRE<8>";
  comparison.same_unit = comparison.held_alike = false;
}

}  // namespace risley::testing
