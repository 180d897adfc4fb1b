// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/algebra/distributions.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/random.hpp"
#include "risley/core/setting.hpp"

#include "calibration/flight_words.hpp"

namespace risley::calibration {
namespace {

/// A calibration is written if it is better with this probability: of 400 random ones on one to
/// five walls (statistics.RandomUnits) none that was written was worse.
constexpr double kBetter = 0.99;

/// A sigma interval this wide around the tolerance leaves open on which side the error is.
constexpr double kOpenSigmas = 2;
/// A total error in flight of fewer sigmas may be the boresight's.
constexpr double kToldSigmas = 3;
/// Number of beams, on a grid over all rotation angles, for comparing the prisms of a flight.
constexpr double kMostBeams = 4096;

bool contradicts(const PriorTest& test) {
  return test.degrees_of_freedom != 0 && !(test.chi2 <= test.critical);
}

/// Chi2 that chance exceeds once in a thousand times.
double significant_chi2(double degrees_of_freedom) {
  constexpr double kNormalQuantile = 3.0902;
  return degrees_of_freedom * algebra::chi_square_per_degree(degrees_of_freedom, kNormalQuantile);
}

/// A root mean square error that a verdict judges, rad.
struct JudgedError {
  double value = 0, sigma = 0;
  const char* subject = "that";
  bool beyond(double tolerance) const { return value > tolerance; }
};

/// "; that is within the tolerance of 0.1 degree, with a probability of 0.93".
std::string tolerance_words(const JudgedError& error, double tolerance) {
  if (!(tolerance > 0)) return "";
  const bool beyond = error.beyond(tolerance);
  std::string words = fmt::format("; {} is {} the tolerance of {:.3g} degree", error.subject,
                                  beyond ? "beyond" : "within", degrees_from_radians(tolerance));
  if (std::abs(error.value - tolerance) <= kOpenSigmas * error.sigma) {
    const double probability = beyond_probability(error.value, error.sigma, tolerance);
    words += fmt::format(", with a probability of {:.2g}", beyond ? probability : 1 - probability);
  }
  return words;
}

/// The recording that would determine the quantities that these walls do not.
std::string better_scan() {
  return fmt::format(
      "scan walls that are tilted steeply against the sensor's axis and fill its field of view, or "
      "more distant ones, or the same walls twice from one spot with the sensor rolled by 180 "
      "degrees; or state known normals and poses ({}, {})",
      name_of(kSetting.planes), name_of(kSetting.stations));
}

CalibrationVerdict undecided_words(const Calibration& c) {
  if (std::ranges::any_of(c.prior_tests, contradicts)) {
    return {CalibrationCode::undecided, c.reason,
            fmt::format("check the stated normals and poses, or omit them ({}, {})",
                        name_of(kSetting.planes), name_of(kSetting.stations))};
  }
  if (c.unit_doubted) {
    return {CalibrationCode::undecided, c.reason, "state the unit of the ranges in the file"};
  }
  return {CalibrationCode::undecided, c.reason, better_scan()};
}

}  // namespace

std::string in_words(const PointingError& error) {
  const auto in_degrees = [](double value, double sigma) {
    return number_text(degrees_from_radians(value), degrees_from_radians(sigma));
  };
  const DirectionErrors& errors = error.errors;
  const NumberText total = in_degrees(errors.total, error.total_sigma);
  const NumberText gauge = in_degrees(errors.gauge, error.gauge_sigma);
  const NumberText shape = in_degrees(errors.shape, error.shape_sigma);
  return fmt::format(
      "reported directions are off by {} ± {} degree ({}): {} ± {} shared by all beams and {} ± {} "
      "in shape, {} at worst",
      total.value, total.sigma, offset_text(errors.total), gauge.value, gauge.sigma, shape.value,
      shape.sigma, in_degrees(error.worst_shape, error.worst_shape_sigma).value);
}

std::string reason_of_failure(const Calibration& c, const PlanarSolution& solution) {
  std::string reason;
  if (!solution.converged || !c.covariance.allFinite()) {
    reason = "the adjustment did not converge";
  }
  if (!c.unobservable.empty()) {
    reason = fmt::format(
        "the walls determine {} only to {:.2g} degrees: walls tilted by 30 degrees or more against "
        "the axis would do better, or a prior ({})",
        estimation::direction_text(c.unobservable.front()), c.unobservable.front().sigma,
        name_of(kSetting.prior_sigma));
  }
  const PriorTest* worst = nullptr;
  for (const PriorTest& test : c.prior_tests) {
    if (!contradicts(test)) continue;
    if (worst == nullptr || test.chi2 > worst->chi2) worst = &test;
  }
  if (worst != nullptr) {
    reason = fmt::format(
        "{} {} contradicts the data: it is off by {:.3g} degrees from the stated value, chi2 "
        "{:.3g} where {:.3g} is the limit",
        worst->station ? "station" : "plane", worst->name, degrees_from_radians(worst->misfit),
        worst->chi2, worst->critical);
    std::string others;
    for (const PriorTest& test : c.prior_tests) {
      if (&test == worst || !contradicts(test)) continue;
      others += (others.empty() ? "" : ", ") + test.name;
    }
    if (!others.empty()) {
      reason += fmt::format("; so do {}: they contradict one another", others);
    }
  }
  return reason;
}

std::string reason_of_ranges(const Calibration& c, const std::vector<RangedRecording>& recordings,
                             double range_noise) {
  // Healthy units scatter by at least a third of their specification; confusing centimetres with
  // millimetres or metres with feet is further off.
  constexpr double kMostOff = 3.0;
  const auto assumed =
      std::ranges::find_if(recordings, [](const RangedRecording& one) { return one.unit_assumed; });
  if (assumed == recordings.end()) return "";
  if (c.sigma0 <= kMostOff && c.sigma0 * kMostOff >= 1.0) return "";
  return fmt::format(
      "{} does not name the unit of its ranges, and they scatter by {:.2g} mm about the walls, "
      "where those of a {} scatter by {:.2g} mm: the unit is probably another one",
      assumed->name, 1e3 * c.sigma0 * range_noise, c.sensor.name, 1e3 * range_noise);
}

CalibrationVerdict verdict_of(const Calibration& c) {
  if (!c.converged) return undecided_words(c);
  Eigen::VectorXd change = c.parameters;
  for (Eigen::Index i = 0; i < change.size(); ++i) {
    change[i] -= c.believed.get(c.free[i].name);
  }
  const auto freedom = static_cast<double>(change.size());
  Eigen::MatrixXd covariance = c.covariance;
  if (c.held_changes.cols() > 0) covariance += c.held_changes * c.held_changes.transpose();
  const double chi2 =
      change.size() == 0 ? 0.0 : change.dot(algebra::SymmetricSolver(covariance).solve(change));
  if (!(chi2 > significant_chi2(freedom))) {
    const std::string confirmed = fmt::format(
        "the walls confirm the sensor's own parameters to {} degree, {} (chi2 {:.3g} of {:.0f} "
        "parameters)",
        plain_text(degrees_from_radians(c.datum.total), 2), offset_text(c.datum.total), chi2,
        freedom);
    if (c.tolerance > 0 && !(c.datum.total <= c.tolerance)) {
      return {CalibrationCode::undecided,
              fmt::format("{}, which leaves open whether it is within the tolerance of {:.3g} "
                          "degree",
                          confirmed, degrees_from_radians(c.tolerance)),
              better_scan()};
    }
    return {CalibrationCode::as_believed, confirmed,
            "keep the sensor's own parameters: these walls leave open whether the calibration is "
            "better"};
  }
  const std::string moved = in_words(c.pointing_error);
  // Wavy walls can be thicker about the right plane than about one fitted to them.
  if (c.rms_after >= std::hypot(c.rms_before, c.shape.sigma)) {
    return {CalibrationCode::not_better,
            fmt::format("{}; but the walls are {:.4g} mm thick before and {:.4g} mm after", moved,
                        1e3 * c.rms_before, 1e3 * c.rms_after),
            "do not use it: check that the walls are flat and that the sensor stood still"};
  }
  if (c.better_probability < kBetter) {
    return {CalibrationCode::not_better,
            fmt::format("{}; but the calibration itself may be off by {} degree ({}), and is "
                        "better than what the sensor believes with a probability of only {:.2g}",
                        moved, plain_text(degrees_from_radians(c.datum.total), 2),
                        offset_text(c.datum.total), c.better_probability),
            better_scan()};
  }
  const JudgedError error{c.pointing_error.errors.total, c.pointing_error.total_sigma};
  const std::string words = moved + tolerance_words(error, c.tolerance);
  if (c.tolerance > 0 && !error.beyond(c.tolerance)) {
    return {
        CalibrationCode::off_within_tolerance, words,
        "keep the unit, which is within the tolerance; the calibration still improves its clouds"};
  }
  return {CalibrationCode::bent, words,
          "use the calibration for this unit's clouds, and repeat it on other walls"};
}

std::string in_words(const HeldParameter& held, const sensors::Sensor& sensor) {
  const ParameterInfo& info = find_parameter(held.name, sensor.shape());
  const auto in_unit = [&](double value) { return value / info.si_per_unit; };
  const std::string unit = info.unit == "1" ? "" : " " + info.unit;
  return fmt::format("{} is held at {:.6g} +- {:.2g}{}, and the strips say {:.6g} +- {:.2g}{}",
                     held.name, in_unit(held.held), in_unit(held.stated_sigma), unit,
                     in_unit(held.from_flight), in_unit(held.sigma), unit);
}

PointingError pointing_error_of(const FlightCalibration& c) {
  const PrismTrain& train = c.model.train;
  const auto prisms = static_cast<std::size_t>(train.prisms());
  const auto steps = static_cast<std::size_t>(
      std::floor(std::pow(kMostBeams, 1.0 / static_cast<double>(prisms)) + 1e-9));
  std::vector<std::vector<double>> angles(prisms);
  std::vector<std::uint8_t> emitters;
  const RandomStream places(0, 0);
  const auto beams = static_cast<std::size_t>(std::llround(std::pow(steps, prisms)));
  for (std::size_t i = 0; i < beams; ++i) {
    std::size_t rest = i;
    for (std::vector<double>& own : angles) {
      own.push_back(kTwoPi * static_cast<double>(rest % steps) / static_cast<double>(steps));
      rest /= steps;
    }
    emitters.push_back(static_cast<std::uint8_t>(places.uniform(i) * train.emitters()));
  }
  PrismTrain given = train;
  std::vector<Eigen::Index> rows;
  for (std::size_t j = 0; j < c.model.free.size(); ++j) {
    const int row = FlightUnknowns::parameter(static_cast<int>(j));
    rows.push_back(row);
    for (const int place : c.model.free[j].places) {
      given.set_place(place, c.unknowns[row].start);
    }
  }
  return BeamBundle(train, c.model.free, angles, emitters)
      .pointing_error(given, c.covariance(rows, rows));
}

CalibrationVerdict verdict_of(const FlightCalibration& c) {
  if (!c.converged) {
    return {
        CalibrationCode::undecided, c.reason,
        "fly crossing strips that overlap, over roofs or other slopes, and check that mount and "
        "trajectory belong to this flight"};
  }
  if (c.clock_drift.significant) {
    return {
        CalibrationCode::undecided,
        fmt::format("the clocks of sensor and trajectory drift apart by {:.2g} +- {:.1g} ppm, "
                    "{:.2g} ms over the flight",
                    1e6 * c.clock_drift.value, 1e6 * c.clock_drift.sigma,
                    1e3 * std::abs(c.clock_drift.value) * c.clock_drift.seconds),
        "synchronise the sensor's clock by PPS or PTP, or calibrate shorter parts of the flight"};
  }
  for (const HeldParameter& held : c.held) {
    if (!held.significant) continue;
    return {CalibrationCode::undecided, in_words(held, c.sensor),
            fmt::format("estimate {} as well ({})", held.name, name_of(kSetting.free))};
  }
  if (auto contradiction = contradiction_of(c)) return *contradiction;
  // Of the change of some unknowns, and their number.
  const auto significance = [&](std::size_t from) {
    std::vector<Eigen::Index> rows;
    for (std::size_t i = from; i < c.unknowns.size(); ++i) {
      if (!c.unknowns[i].held) rows.push_back(static_cast<Eigen::Index>(i));
    }
    Eigen::VectorXd change(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const FlightUnknown& own = c.unknowns[rows[i]];
      change[i] = own.value - own.start;
    }
    const double chi2 =
        rows.empty() ? 0.0
                     : change.dot(algebra::SymmetricSolver(c.covariance(rows, rows)).solve(change));
    return std::pair{chi2, static_cast<double>(rows.size())};
  };
  const auto significant = [](const std::pair<double, double>& test) {
    return test.first > significant_chi2(std::max(1.0, test.second));
  };
  const auto all = significance(0), prisms = significance(FlightUnknowns{}.size());
  const std::string strips =
      fmt::format("strips were {:.3g} mm apart with the given values and are {:.3g} mm apart now",
                  1e3 * c.rms_before, 1e3 * c.rms_after);
  if (significant(all) && c.rms_after >= c.rms_before) {
    return {CalibrationCode::not_better, strips,
            "do not use it: check that ground, trajectory and mount belong to this flight"};
  }
  if (!significant(prisms)) {
    return {CalibrationCode::as_believed,
            fmt::format("the strips confirm what the sensor believes of its prisms (chi2 {:.3g} "
                        "of {:.0f} parameters); {}",
                        prisms.first, prisms.second, strips),
            "use the adjusted mount, with the calibration beside it, for clouds of this platform"};
  }
  const PointingError& found = c.pointing_error;
  const bool total_is_told = found.errors.total >= kToldSigmas * found.total_sigma;
  const JudgedError error = total_is_told
                                ? JudgedError{found.errors.total, found.total_sigma}
                                : JudgedError{found.errors.shape, found.shape_sigma, "the shape"};
  const std::string words = fmt::format(
      "the prisms differ from what the sensor believes (chi2 {:.3g} of {:.0f} "
      "parameters): {}{}; {}",
      prisms.first, prisms.second, in_words(found), tolerance_words(error, c.tolerance), strips);
  if (c.tolerance > 0 && !error.beyond(c.tolerance)) {
    return {CalibrationCode::off_within_tolerance, words,
            "keep the unit, which is within the tolerance; use both the mount and the calibration "
            "for clouds of this platform"};
  }
  return {CalibrationCode::bent, words,
          "use both the mount and the calibration for clouds of this platform"};
}

const char* to_string(CalibrationCode code) {
  switch (code) {
    case CalibrationCode::as_believed:
      return "as_believed";
    case CalibrationCode::off_within_tolerance:
      return "off_within_tolerance";
    case CalibrationCode::bent:
      return "bent";
    case CalibrationCode::not_better:
      return "not_better";
    case CalibrationCode::undecided:
      break;
  }
  return "undecided";
}

bool improves(CalibrationCode code) {
  return code == CalibrationCode::bent || code == CalibrationCode::off_within_tolerance;
}

std::vector<Warning> warnings_of(const Calibration& c, const PlanarSolution& solution,
                                 const std::vector<RangedRecording>& recordings) {
  std::vector<Warning> warnings;
  const double boresight = std::hypot(c.datum.sigma_pitch, c.datum.sigma_yaw);
  if (boresight > kPoorDatum) {
    warn(warnings, kWarning.poor_datum,
         "the direction that all beams share is known only to {} degrees, {} (pitch {}, yaw {}); "
         "their directions relative to one another to {} degrees, {}",
         plain_text(degrees_from_radians(boresight), 2), offset_text(boresight),
         plain_text(degrees_from_radians(c.datum.sigma_pitch), 2),
         plain_text(degrees_from_radians(c.datum.sigma_yaw), 2),
         plain_text(degrees_from_radians(c.datum.shape), 2), offset_text(c.datum.shape));
  }
  for (const SurfaceStep& step : c.steps) {
    warn(warnings, kWarning.uneven_plane,
         "{}: a region of {:.2g} degrees stands {:.0f} mm off {} (azimuth {:.1f}, zenith "
         "{:.1f}); its {} shots are not used",
         recordings[step.recording].name, degrees_from_radians(step.size), 1e3 * step.height,
         c.planes[step.plane].name, degrees_from_radians(step.azimuth),
         degrees_from_radians(step.zenith), step.points);
  }
  if (solution.lost > 0) {
    warn(warnings, kWarning.shots_unused, "{} shots do not meet the plane they were assigned to",
         solution.lost);
  }
  return warnings;
}

}  // namespace risley::calibration
