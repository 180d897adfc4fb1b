// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/estimate.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley::estimation {
namespace {

/// The default free parameters less the fixed ones plus the additional ones.
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

/// Parameters, mean speeds and first rotation angles as named values.
std::vector<EstimatedValue> named_values(const EkfResult& filter, double duration) {
  std::vector<EstimatedValue> values;
  for (std::size_t i = 0; i < filter.free.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    values.push_back(
        {filter.free[i].name, filter.parameters[at], std::sqrt(filter.covariance(at, at))});
  }
  const RotorStates& states = filter.states;
  const int prisms = filter.train.prisms();
  const std::size_t last = states.size() - 1;
  std::size_t diagonal = 0;
  std::vector<EstimatedValue> angles;
  for (int rotor = 0; rotor < prisms; ++rotor) {
    const auto k = static_cast<std::size_t>(rotor);
    const auto& angle = states.rotation_angle[k];
    const auto& variance = states.rotation_angle_covariance[diagonal];
    diagonal += static_cast<std::size_t>(prisms - rotor);
    // The mean speed is the angle turned over the time it took; its ends are far apart and so
    // independent.
    EstimatedValue speed{fmt::format("angular_velocity_{}_deg_per_s", prism_letter(rotor)),
                         states.angular_velocity[k][0], states.angular_velocity_sigma[k][0]};
    if (duration > 0) {
      speed.value = (angle[last] - angle[0]) / duration;
      speed.sigma = std::sqrt(variance[0] + variance[last]) / duration;
    }
    values.push_back(speed);
    angles.push_back({fmt::format("rotation_angle_{}_deg", prism_letter(rotor)),
                      wrap_to_pi(angle[0]), std::sqrt(variance[0])});
  }
  values.insert(values.end(), angles.begin(), angles.end());
  return values;
}

/// The sensor preset that the estimate amounts to.
sensors::Sensor calibrated_sensor(const sensors::Sensor& nominal, const EkfResult& filter,
                                  const Start& start, const std::vector<EstimatedValue>& values) {
  sensors::Sensor sensor = nominal;
  sensor.train = filter.train;
  sensor.combination = start.combination;
  const auto statics = static_cast<Eigen::Index>(filter.free.size());
  const Eigen::Index prisms = sensor.prisms();
  sensor.covariance_names.clear();
  sensor.covariance = Eigen::MatrixXd::Zero(statics + prisms, statics + prisms);
  sensor.covariance.topLeftCorner(statics, statics) = filter.covariance;
  for (Eigen::Index i = 0; i < statics + prisms; ++i) {
    const EstimatedValue& value = values[static_cast<std::size_t>(i)];
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
    rounding += series.azimuth_rounding_variance[i] + series.zenith_rounding_variance[i];
  }
  return std::sqrt(angle_noise * angle_noise + rounding / (2.0 * double(series.size())));
}

/// A parameter that ended where no sensor of the kind can be, as words; empty when there is none.
/// A tilt of a whole wedge angle, for one, turns a prism into one with its faces exchanged: such a
/// fit is as good as the right one, and its numbers mean nothing.
std::string implausible_parameter(const EkfResult& filter, const PrismTrain& nominal) {
  constexpr double kLargest = 5.0;  // prior sigmas
  for (std::size_t i = 0; i < filter.free.size(); ++i) {
    const FreeParameter& parameter = filter.free[i];
    const double change =
        filter.parameters[static_cast<Eigen::Index>(i)] - nominal[parameter.places[0]];
    if (std::abs(change) <= kLargest * parameter.prior_sigma) continue;
    const ParameterInfo& info = find_parameter(parameter.name, filter.train.prisms());
    return fmt::format(
        "{} came out {:.4g}{} away from the sensor's value, more than any such sensor can be: "
        "wrong "
        "face order, wrong wedge angles or another sensor",
        parameter.name, change / info.si_per_unit, info.unit == "1" ? "" : " " + info.unit);
  }
  return {};
}

/// Says whether the result can be believed.
void judge(Estimate& estimate, const PrismTrain& nominal) {
  const double rms =
      std::sqrt(0.5 * (estimate.azimuth_residuals.rms * estimate.azimuth_residuals.rms +
                       estimate.zenith_residuals.rms * estimate.zenith_residuals.rms));
  const double ratio = rms / estimate.expected_residual;
  const auto shots = static_cast<double>(estimate.filter.states.size());
  const double outlier_share = static_cast<double>(estimate.filter.outliers) / shots;
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
  } else if (ratio > 3.0) {
    fail(residuals + ": the model does not describe these data, or their noise is larger");
  } else if (std::string words = implausible_parameter(estimate.filter, nominal); !words.empty()) {
    fail(std::move(words));
  } else if (ratio > 1.3) {
    estimate.warnings.push_back(residuals + ": the sigmas are too small by about that factor");
  } else if (ratio < 0.93) {
    estimate.warnings.push_back(residuals +
                                ": the rotors' noise is set so high that they follow the noise, or "
                                "the stated noise is too large");
  }
  if (estimate.converged && outlier_share > 0.02) {
    estimate.warnings.push_back(
        fmt::format("{:.1f} % of the shots were left out as outliers", 100 * outlier_share));
  }
}

}  // namespace

Estimate estimate_with_ekf(const AngleSeries& recorded_series, const AngleSeries& recorded_head,
                           const EstimateOptions& options, const Progress& progress) {
  if (recorded_series.size() == 0) throw EstimationError("the recording holds no valid shot");
  Estimate estimate;
  estimate.method = "ekf";
  estimate.angle_noise = options.angle_noise.value_or(options.sensor.angle_noise);
  if (!(estimate.angle_noise > 0)) {
    throw InvalidArgument(fmt::format("angle noise = {} deg, allowed above 0",
                                      degrees_from_radians(estimate.angle_noise)));
  }
  EkfOptions ekf;
  ekf.angle_noise = estimate.angle_noise;
  ekf.free = chosen_parameters(options);
  ekf.rotor_process = options.rotor_process;
  estimate.mirrored =
      options.mirrored ? *options.mirrored
                       : is_mirrored(recorded_head, options.sensor, ekf.free, estimate.angle_noise);
  AngleSeries turned_series, turned_head;
  if (estimate.mirrored) {
    turned_series = mirror_image(recorded_series);
    turned_head = mirror_image(recorded_head);
    estimate.warnings.push_back(
        "the recording is a mirror image (its elevation has the other sign) and was turned");
  }
  const AngleSeries& series = estimate.mirrored ? turned_series : recorded_series;
  const AngleSeries& head = estimate.mirrored ? turned_head : recorded_head;
  estimate.start = find_start(head, options.sensor, ekf.free, estimate.angle_noise);
  estimate.filter = run_ekf(series, estimate.start, ekf, progress);

  const RotorStates& states = estimate.filter.states;
  estimate.azimuth_residuals = moments(states.azimuth_residual, states.outlier);
  estimate.zenith_residuals = moments(states.zenith_residual, states.outlier);
  estimate.expected_residual = expected_residual(series, estimate.angle_noise);
  estimate.values = named_values(estimate.filter, series.duration());
  estimate.sensor =
      calibrated_sensor(options.sensor, estimate.filter, estimate.start, estimate.values);
  judge(estimate, options.sensor.train);
  return estimate;
}

}  // namespace risley::estimation
