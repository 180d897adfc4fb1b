// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/flight_words.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"

namespace risley::calibration {
namespace {

/// Parts of a jump are named if they exceed this many of their sigmas.
constexpr double kNamedSigmas = 3;

const FlightUnknown& clock_of(const FlightCalibration& c) {
  return c.unknowns[FlightUnknowns::clock_offset()];
}

}  // namespace

const char* correction_name(int correction) {
  constexpr std::array<const char*, kCorrections> kNames = {
      "east", "north", "up", "tilt about east", "tilt about north", "heading"};
  return kNames.at(correction);
}

std::string in_words(const AttitudeDelay& delay) {
  const NumberText text = number_text(1e3 * std::abs(delay.value), 1e3 * delay.sigma);
  return fmt::format("the attitudes of the trajectory are {} by {} +- {} ms against its positions",
                     delay.value > 0 ? "late" : "early", text.value, text.sigma);
}

std::string in_words(const TrajectoryJump& jump, std::int64_t begin_ns) {
  std::string sizes;
  for (int c = 0; c < kCorrections; ++c) {
    if (!(std::abs(jump.size[c]) > kNamedSigmas * jump.sigma[c])) continue;
    const auto unit = [&](double value) {
      return c < 3 ? 1e3 * value : degrees_from_radians(value);
    };
    const NumberText text = number_text(unit(jump.size[c]), unit(jump.sigma[c]));
    sizes += fmt::format("{}{} +- {} {} {}", sizes.empty() ? "" : ", ", text.value, text.sigma,
                         c < 3 ? "mm" : "degree", correction_name(c));
  }
  const auto since = [&](std::int64_t time_ns) {
    return 1e-9 * static_cast<double>(time_ns - begin_ns);
  };
  return fmt::format(
      "the trajectory jumps{} {:.2f} to {:.2f} s after the first shot ({} {}), {:.0f} sigmas "
      "beyond its stated errors",
      sizes.empty() ? std::string(", in a direction that the strips hardly determine,")
                    : " by " + sizes,
      since(jump.begin_ns), since(jump.end_ns), jump.between_strips ? "after strip" : "strip",
      jump.strip + 1, jump.score);
}

std::string clock_in_words(const FlightCalibration& c) {
  const FlightUnknown& clock = clock_of(c);
  return fmt::format(
      "the strips require a clock offset of {:.3g} ms, {:.0f} sigmas from the stated {:.3g} +- "
      "{:.2g} ms: the times of sensor or trajectory are not as stated",
      1e3 * clock.value,
      std::abs(clock.value - clock.start) / std::hypot(clock.prior_sigma, clock.sigma),
      1e3 * clock.start, 1e3 * clock.prior_sigma);
}

std::string misfit_in_words(const FlightCalibration& c) {
  const TrajectoryFit& fit = c.trajectory_fit;
  return fmt::format(
      "the errors of the trajectory are larger than stated, even with {} jump{} and larger sigmas: "
      "the results may be off by more than their sigmas",
      fit.jumps.size(), fit.jumps.size() == 1 ? "" : "s");
}

std::optional<CalibrationVerdict> contradiction_of(const FlightCalibration& c) {
  if (c.attitude_delay.significant) {
    return CalibrationVerdict{
        CalibrationCode::undecided, in_words(c.attitude_delay),
        "correct the time stamps of the trajectory's attitudes by that, and calibrate again"};
  }
  if (c.clock_contradicts) {
    return CalibrationVerdict{
        CalibrationCode::undecided, clock_in_words(c),
        "find out which times are wrong, attitudes or positions or shots, and correct them; or "
        "state a larger sigma of the clock offset in the mount"};
  }
  if (!c.trajectory_fit.fits) {
    return CalibrationVerdict{
        CalibrationCode::undecided, misfit_in_words(c),
        "process the trajectory again (GNSS fix, alignment, lever arm of its antenna), or state "
        "larger errors or shorter correlation times for it"};
  }
  return std::nullopt;
}

}  // namespace risley::calibration
