// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "estimation/residual_model.hpp"
#include "estimation/used_shots.hpp"

namespace risley::estimation {
namespace {

/// Parameters, mean speeds and first rotation angles as named values.
/// @param stretches  rows of the states that are tied together
std::vector<EstimatedValue> named_values(const Estimate& estimate,
                                         const std::vector<ShotRange>& stretches) {
  std::vector<EstimatedValue> values;
  for (std::size_t i = 0; i < estimate.free.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    values.push_back(
        {estimate.free[i].name, estimate.parameters[at], std::sqrt(estimate.covariance(at, at))});
  }
  const RotorStates& states = estimate.states;
  const int prisms = states.prisms();
  std::size_t diagonal = 0;
  std::vector<EstimatedValue> angles;
  for (int rotor = 0; rotor < prisms; ++rotor) {
    const auto k = static_cast<std::size_t>(rotor);
    const auto& angle = states.rotation_angle[k];
    const auto& variance = states.rotation_angle_covariance[diagonal];
    diagonal += static_cast<std::size_t>(prisms - rotor);
    // The mean speed is the angle turned over the time it took; the ends are far apart and so
    // independent.
    double turned = 0, time = 0, turned_variance = 0;
    for (const ShotRange& rows : stretches) {
      const std::size_t first = rows.begin, last = rows.end - 1;
      turned += angle[last] - angle[first];
      turned_variance += variance[first] + variance[last];
      time += 1e-9 * static_cast<double>(states.time_ns[last] - states.time_ns[first]);
    }
    EstimatedValue speed{fmt::format("angular_velocity_{}_deg_per_s", prism_letter(rotor)),
                         states.angular_velocity[k][0], states.angular_velocity_sigma[k][0]};
    if (time > 0) {
      speed.value = turned / time;
      speed.sigma = std::sqrt(turned_variance) / time;
    }
    values.push_back(speed);
    angles.push_back({fmt::format("rotation_angle_{}_deg", prism_letter(rotor)),
                      wrap_to_pi(angle[0]), std::sqrt(variance[0])});
  }
  values.insert(values.end(), angles.begin(), angles.end());
  return values;
}

/// The sensor preset that the estimate amounts to.
sensors::Sensor calibrated_sensor(const sensors::Sensor& nominal, const PrismTrain& train,
                                  const Estimate& estimate) {
  sensors::Sensor sensor = nominal;
  sensor.train = train;
  sensor.combination = estimate.start.combination;
  sensor.reference = sensors::CalibrationReference::directions;
  const auto statics = static_cast<Eigen::Index>(estimate.free.size());
  const Eigen::Index prisms = sensor.prisms();
  sensor.covariance_names.clear();
  sensor.covariance = Eigen::MatrixXd::Zero(statics + prisms, statics + prisms);
  sensor.covariance.topLeftCorner(statics, statics) = estimate.covariance;
  for (Eigen::Index i = 0; i < statics + prisms; ++i) {
    const EstimatedValue& value = estimate.values[static_cast<std::size_t>(i)];
    sensor.covariance_names.push_back(value.name);
    if (i >= statics) {
      sensor.angular_velocity[static_cast<std::size_t>(i - statics)] = value.value;
      sensor.covariance(i, i) = value.sigma * value.sigma;
    }
    sensor.set_knowledge({value.name, value.sigma, "estimated from a recording"});
  }
  return sensor;
}

/// Root mean square that noise and rounding together should leave, rad.
double expected_residual(const AngleSeries& series, double angle_noise) {
  double rounding = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    rounding += static_cast<double>(series.azimuth_rounding_variance[i]) +
                static_cast<double>(series.zenith_rounding_variance[i]);
  }
  return std::sqrt(angle_noise * angle_noise + rounding / (2.0 * double(series.size())));
}

/// A parameter that ended where no sensor of the kind can be, as words; empty when there is none.
/// A tilt of a whole wedge angle, for one, turns a prism into one with its faces exchanged: such a
/// fit is as good as the right one, and its numbers mean nothing.
std::string implausible_parameter(const Estimate& estimate, const PrismTrain& nominal) {
  constexpr double kLargest = 5.0;  // prior sigmas
  for (std::size_t i = 0; i < estimate.free.size(); ++i) {
    const FreeParameter& parameter = estimate.free[i];
    const double change =
        estimate.parameters[static_cast<Eigen::Index>(i)] - nominal[parameter.places[0]];
    if (std::abs(change) <= kLargest * parameter.prior_sigma) continue;
    const ParameterInfo& info = find_parameter(parameter.name, nominal.prisms());
    return fmt::format(
        "{} came out {:.4g}{} away from the sensor's value, more than any such sensor can be: "
        "wrong "
        "face order, wrong wedge angles or another sensor",
        parameter.name, change / info.si_per_unit, info.unit == "1" ? "" : " " + info.unit);
  }
  return {};
}

/// Residuals below the stated noise by more than this say that the noise is not what was stated.
constexpr double kFarBelow = 1.0 / 3.0;
constexpr double kFarAbove = 3.0;
/// A parameter combination that keeps more of its prior sigma than this was not measured.
constexpr double kUnmeasured = 0.3;

/// Squared means over a prism's angle, per bin: 1 with a scatter of 0.12 (72 bins, two axes) when
/// nothing depends on the angle.
constexpr double kUneven = 1.6;
/// Residual variances above the stated one by more than this are worth a word.
constexpr double kEnlarged = 1.1;

/// Says whether the result can be believed.
void judge(Estimate& estimate, const PrismTrain& nominal) {
  const double rms =
      std::sqrt(0.5 * (estimate.azimuth_residuals.rms * estimate.azimuth_residuals.rms +
                       estimate.zenith_residuals.rms * estimate.zenith_residuals.rms));
  const bool map = estimate.method == Method::map;
  // Rounding may differ from shot to shot; the unit variance weighs each by its own.
  const double ratio =
      map ? std::sqrt(estimate.map->unit_variance) : rms / estimate.expected_residual;
  const auto shots = static_cast<double>(estimate.series.size());
  const double outlier_share = static_cast<double>(estimate.outliers) / shots;
  const std::string residuals =
      fmt::format("residuals of {:.3g} deg where noise and rounding amount to {:.3g} deg",
                  degrees_from_radians(rms), degrees_from_radians(estimate.expected_residual));
  estimate.converged = true;
  const auto fail = [&](std::string reason) {
    estimate.converged = false;
    estimate.reason = std::move(reason);
  };
  if (!std::isfinite(ratio)) {
    fail("no residual could be formed");
  } else if (outlier_share > 0.3) {
    fail(
        fmt::format("{:.0f} % of the shots do not fit the model: wrong sensor, speed combination "
                    "or mirror image, or a start that did not pull in",
                    100 * outlier_share));
  } else if (ratio > kFarAbove) {
    fail(residuals + ": the model does not describe these data, or their noise is larger");
  } else if (!estimate.unobservable.empty()) {
    const WeakDirection& worst = estimate.unobservable.front();
    fail(
        fmt::format("the data do not tell the combination {} (in units of 1 deg, or 0.01 of an "
                    "index; its sigma "
                    "is {:.2g} of them): hold one of these fixed, or record longer",
                    direction_text(worst), worst.sigma));
  } else if (std::string words = implausible_parameter(estimate, nominal); !words.empty()) {
    fail(std::move(words));
  } else if (map && ratio < kFarBelow) {
    estimate.noise_overstated = true;
    fail(residuals +
         ": the sigmas would be far too large; state the noise that the recording has with "
         "--noise-angle-deg");
  } else if (map && !estimate.map->settled) {
    fail("the last steps still moved parameters by more than a tenth of their sigma");
  } else if (map && estimate.map->unit_variance > kEnlarged) {
    estimate.warnings.push_back(residuals + ": the sigmas were enlarged by that factor");
  } else if (!map && ratio > 1.3) {
    estimate.warnings.push_back(residuals + ": the sigmas are too small by about that factor");
  } else if (ratio < 0.93) {
    estimate.warnings.push_back(residuals +
                                ": the rotors' noise is set so high that they follow the noise, or "
                                "the stated noise is too large");
  }
  double unevenness = 1.0;
  std::size_t uneven = 0;
  for (std::size_t k = 0; k < estimate.residuals_over_angle.size(); ++k) {
    if (estimate.residuals_over_angle[k].chi2_per_bin <= unevenness) continue;
    unevenness = estimate.residuals_over_angle[k].chi2_per_bin;
    uneven = k;
  }
  if (unevenness > kUneven * (map ? estimate.map->autocorrelation.factor : 1.0)) {
    estimate.warnings.push_back(fmt::format(
        "residuals depend on the rotation angle of prism {} ({:.3g} times what chance would make "
        "of "
        "them): the model lacks something that this sensor has, or a parameter is held at a wrong "
        "value; the sigmas do not cover that",
        prism_letter(static_cast<int>(uneven)), unevenness));
  }
  if (map && estimate.map->autocorrelation.factor > 1.05) {
    estimate.warnings.push_back(fmt::format(
        "residuals of neighbouring shots are correlated ({:.2f} from one to the next): every "
        "variance was multiplied by {:.3g}",
        estimate.map->autocorrelation.rho.front(), estimate.map->autocorrelation.factor));
  }
  if (map && estimate.map->unused_shots > 0) {
    estimate.warnings.push_back(fmt::format(
        "{} shots lie in pieces between clock resets or long gaps that are too short to find the "
        "rotors' phases, or run in the other speed combination; they were not used",
        estimate.map->unused_shots));
  }
  if (estimate.converged && outlier_share > 0.02) {
    estimate.warnings.push_back(
        fmt::format("{:.1f} % of the shots were left out as outliers", 100 * outlier_share));
  }
}

/// Mean residuals over every prism's angle, of all shots that were used.
std::vector<AngleProfile> profiles(const Estimate& estimate) {
  std::vector<AngleProfiler> profilers(static_cast<std::size_t>(estimate.states.prisms()));
  for_each_used_shot(estimate, [&](const auto& angle, double azimuth, double zenith) {
    for (std::size_t k = 0; k < profilers.size(); ++k) profilers[k].add(angle(k), azimuth, zenith);
  });
  std::vector<AngleProfile> result;
  result.reserve(profilers.size());
  for (const AngleProfiler& profiler : profilers) result.push_back(profiler.result());
  return result;
}

/// Runs the batch estimator and takes over what it found. @return rows of the states per stretch
std::vector<ShotRange> take_map(Estimate& estimate, const EstimateOptions& options,
                                const Progress& progress) {
  BatchMapOptions settings;
  settings.angle_noise = estimate.angle_noise;
  settings.free = estimate.free;
  settings.rotor_process = options.rotor_process;
  estimate.map = run_batch_map(estimate.series, estimate.start, options.sensor, settings, progress);
  const BatchMapResult& result = *estimate.map;
  estimate.parameters = result.parameters;
  estimate.covariance = result.covariance;
  estimate.rotor_process = result.rotor_process;
  estimate.outliers = result.outliers;
  estimate.states = states_of_knots(result, estimate.series);
  estimate.azimuth_residuals = moments(result.azimuth_residual, result.outlier);
  estimate.zenith_residuals = moments(result.zenith_residual, result.outlier);
  estimate.unobservable = weak_directions(result.information, estimate.free, kUnmeasured);
  std::vector<ShotRange> ranges;
  const auto& begins = result.trajectory.stretch_begin;
  for (std::size_t i = 0; i < begins.size(); ++i) {
    ranges.push_back({begins[i], i + 1 < begins.size() ? begins[i + 1] : result.trajectory.size()});
  }
  return ranges;
}

/// As take_map, for the paper's filter.
std::vector<ShotRange> take_ekf(Estimate& estimate, const EstimateOptions& options,
                                const Progress& progress) {
  EkfOptions settings;
  settings.angle_noise = estimate.angle_noise;
  settings.free = estimate.free;
  settings.rotor_process = options.rotor_process;
  EkfResult result = run_ekf(estimate.series, estimate.start, settings, progress);
  estimate.parameters = std::move(result.parameters);
  estimate.covariance = std::move(result.covariance);
  estimate.rotor_process = std::move(result.rotor_process);
  estimate.outliers = result.outliers;
  estimate.states = std::move(result.states);
  estimate.azimuth_residuals = moments(estimate.states.azimuth_residual, estimate.states.outlier);
  estimate.zenith_residuals = moments(estimate.states.zenith_residual, estimate.states.outlier);
  return {{0, estimate.states.size()}};
}

/// A start from the first second, or, where that holds too little, from the first place in the
/// series that has enough.
Start start_anywhere(const AngleSeries& series, const AngleSeries& head,
                     const EstimateOptions& options, const Estimate& estimate) {
  const auto start_of = [&](const AngleSeries& shots) {
    return find_start(shots, options.sensor, estimate.free, estimate.angle_noise, options.mirrored);
  };
  try {
    return start_of(head);
  } catch (const EstimationError&) {
    constexpr std::size_t kPlaces = 50;
    constexpr std::int64_t kLongestNs = 500'000'000;
    for (std::size_t place = 1; place < kPlaces; ++place) {
      const std::size_t begin = place * series.size() / kPlaces;
      std::size_t end = begin;
      while (end < series.size() && series.time_ns[end] >= series.time_ns[begin] &&
             series.time_ns[end] - series.time_ns[begin] < kLongestNs) {
        ++end;
      }
      try {
        return start_of(rows_of(series, begin, end));
      } catch (const EstimationError&) {  // nor here
      }
    }
    throw;
  }
}

}  // namespace

std::vector<FreeParameter> chosen_parameters(const EstimateOptions& options) {
  const int prisms = options.sensor.prisms();
  std::vector<std::string> names = default_free_names(prisms);
  for (const std::string& name : options.fixed) {
    find_parameter(name, prisms);  // an unknown name is an error; one that is not free is no harm
    std::erase(names, name);
  }
  for (const std::string& name : options.additional) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return free_parameters(names, prisms);
}

Estimate estimate(Method method, AngleSeries series, const AngleSeries& head,
                  const EstimateOptions& options, const Progress& progress) {
  if (series.size() == 0) throw EstimationError("the recording holds no valid shot");
  Estimate estimate;
  estimate.method = method;
  estimate.angle_noise = options.angle_noise.value_or(options.sensor.angle_noise);
  if (!(estimate.angle_noise > 0) || !std::isfinite(estimate.angle_noise)) {
    throw InvalidArgument(fmt::format("angle noise = {} deg, allowed above 0",
                                      degrees_from_radians(estimate.angle_noise)));
  }
  estimate.free = chosen_parameters(options);
  estimate.series = std::move(series);
  bool head_is_used = true;
  if (method == Method::ekf) {
    const auto ranges = stretches(estimate.series);
    if (ranges.size() > 1) {
      const auto longest = std::max_element(
          ranges.begin(), ranges.end(),
          [](const ShotRange& a, const ShotRange& b) { return a.size() < b.size(); });
      estimate.warnings.push_back(fmt::format(
          "the clock was reset or the recording paused {} times: the filter takes the longest "
          "piece, {} of {} shots",
          ranges.size() - 1, longest->size(), estimate.series.size()));
      head_is_used = longest == ranges.begin();
      estimate.series = rows_of(estimate.series, longest->begin, longest->end);
    }
  }
  constexpr std::size_t kHeadRows = 2000;
  estimate.start = start_anywhere(
      estimate.series,
      head_is_used ? head
                   : rows_of(estimate.series, 0, std::min(kHeadRows, estimate.series.size())),
      options, estimate);
  estimate.mirrored = estimate.start.mirrored;
  if (estimate.mirrored) {
    mirror(estimate.series);
    estimate.warnings.push_back(
        "the recording is a mirror image (its elevation has the other sign) and was turned");
  }
  const std::vector<ShotRange> ranges = method == Method::map
                                            ? take_map(estimate, options, progress)
                                            : take_ekf(estimate, options, progress);
  estimate.expected_residual = expected_residual(estimate.series, estimate.angle_noise);
  estimate.values = named_values(estimate, ranges);
  estimate.sensor = calibrated_sensor(
      options.sensor, with_free_values(options.sensor.train, estimate.free, estimate.parameters),
      estimate);
  estimate.residuals_over_angle = profiles(estimate);
  judge(estimate, options.sensor.train);
  return estimate;
}

ShotResiduals shot_residuals(const Estimate& estimate) {
  const auto of = [](const auto& holder) {
    return ShotResiduals{holder.azimuth_residual, holder.zenith_residual, holder.outlier};
  };
  return estimate.map ? of(*estimate.map) : of(estimate.states);
}

RotorStates states_of_shots(const Estimate& estimate, ShotRange shots) {
  return estimate.map ? states_of_shots(*estimate.map, estimate.series, shots)
                      : rows_of(estimate.states, shots);
}

}  // namespace risley::estimation
