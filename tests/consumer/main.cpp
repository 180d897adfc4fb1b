// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Points one beam through two prisms, through air where there is nothing to deviate it, catches an
// error, and asks which kernels this processor runs: exit status 3 if none.
#include <cmath>
#include <cstdio>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/instruction_set.hpp"
#include "risley/optics/observation_model.hpp"

int main() {
  using namespace risley;
  PrismTrain train({FaceOrder::perpendicular_angled, FaceOrder::angled_perpendicular});
  const double angles[] = {30 * kRadiansPerDegree, 75 * kRadiansPerDegree};
  const Observation glass = observe(train, angles);
  train.set("refractive_index", 1.0);
  const Observation air = observe(train, angles);
  std::printf("azimuth %.6f deg, zenith %.6f deg\n", glass.azimuth / kRadiansPerDegree,
              glass.zenith / kRadiansPerDegree);
  const bool deviated = glass.valid && std::hypot(glass.direction.y, glass.direction.z) > 0.01;
  const bool straight = air.valid && std::hypot(air.direction.y, air.direction.z) < 1e-12;
  bool caught = false;
  try {
    train.set("no_such_parameter", 1.0);
  } catch (const InvalidArgument& error) {  // thrown in the library, caught here by its type
    caught = true;
  }
  try {
    std::printf("kernels for %s\n", to_string(best_instruction_set()).c_str());
  } catch (const Error& error) {
    std::puts(error.what());
    return 3;
  }
  return deviated && straight && caught ? 0 : 1;
}
