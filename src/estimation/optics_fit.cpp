// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/optics_fit.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/batch_map.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/free_parameters.hpp"

namespace risley::estimation {
namespace {

/// Rotors of a start as a trajectory at its time.
void take_rotors(Start& start, const RotorTrajectory& motion) {
  const auto away = [&](std::size_t knot) {
    return std::abs(motion.time_ns[knot] - start.time_ns);
  };
  std::size_t nearest = 0;
  for (std::size_t knot = 0; knot < motion.size(); ++knot) {
    if (away(knot) < away(nearest)) nearest = knot;
  }
  const double later = 1e-9 * static_cast<double>(start.time_ns - motion.time_ns[nearest]);
  for (std::size_t k = 0; k < start.rotation_angle.size(); ++k) {
    start.rotation_angle[k] = wrap_to_pi(motion.angle(nearest, k, later));
    start.angular_velocity[k] = motion.speed(nearest, k, later);
  }
}

}  // namespace

std::optional<Start> fit_optics(const AngleSeries& series, const Start& start,
                                const sensors::Sensor& sensor, Priors priors) {
  BatchMapOptions options;
  options.rotor_process.assign(static_cast<std::size_t>(sensor.prisms()), kSettlingProcess);
  options.free =
      free_parameters(default_free_names(sensor.shape(), one_glass(sensor.train)), sensor.shape());
  for (FreeParameter& parameter : options.free) {
    const sensors::Knowledge* known = sensor.find_knowledge(parameter.name);
    if (priors == Priors::of_the_type && known != nullptr && known->sigma > 0) {
      parameter.prior_sigma = known->sigma;
    }
  }
  try {
    const Solution solution = run_batch_map(series, start, sensor, options);
    Start found = start;
    found.train = solution.train;
    const ShotResiduals residuals = residuals_of_shots(solution, series, {0, series.size()});
    found.residual_rms = robust_scale(residuals.azimuth, residuals.zenith);
    take_rotors(found, solution.trajectory);
    return found;
  } catch (const EstimationError&) {
    return std::nullopt;
  }
}

}  // namespace risley::estimation
