// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/pointing_model.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/parameter_agreement.hpp"
#include "risley/sensors/prism_sizes.hpp"
#include "risley/sensors/range_values.hpp"

#include "cloud/common_factors.hpp"
#include "cloud/pointing_kernel.hpp"

namespace risley::cloud {
namespace {

using algebra::NamedCovariance;
using Eigen::Index;

/// Those of a calibration that affect a point: not its speeds and rotation angles, and sizes of the
/// prisms only if beams start at the last one.
NamedCovariance calibrated(const sensors::Sensor& sensor, const PointingOptions& options) {
  NamedCovariance result;
  std::vector<Index> rows;
  for (std::size_t i = 0; i < sensor.covariance_names.size(); ++i) {
    const std::string& name = sensor.covariance_names[i];
    if (sensors::find_prism_size(name, sensor.prisms())) {
      if (!options.beam_origin) continue;
    } else if (!sensors::is_range_value(name) &&
               find_parameter(name, sensor.shape()).kind != ParameterKind::train) {
      continue;
    }
    result.names.push_back(name);
    rows.push_back(static_cast<Index>(i));
  }
  result.matrix = sensor.covariance(rows, rows);
  return result;
}

NamedCovariance believed(const SensorBelief& belief) {
  NamedCovariance result;
  for (const auto& free : belief.free) result.names.push_back(free.name);
  result.matrix = belief.covariance;
  return result;
}

/// Uncertainty of some parameters of an uncalibrated sensor.
NamedCovariance assumed(const sensors::Sensor& sensor,
                        const std::vector<estimation::FreeParameter>& parameters) {
  NamedCovariance result;
  const Index count = parameters.size();
  result.matrix = Eigen::MatrixXd::Zero(count, count);
  for (Index j = 0; j < count; ++j) {
    result.names.push_back(parameters[j].name);
    const sensors::Knowledge* known = sensor.find_knowledge(result.names.back());
    if (known != nullptr) result.matrix(j, j) = known->sigma * known->sigma;
  }
  return result;
}

/// Uncertainty of all parameters of an uncalibrated sensor.
NamedCovariance assumed(const sensors::Sensor& sensor, const SensorBelief& belief) {
  std::vector<estimation::FreeParameter> all = belief.free;
  for (estimation::FreeParameter& held : estimation::uncertain_held(sensor, belief.free)) {
    all.push_back(std::move(held));
  }
  return assumed(sensor, all);
}

void require_belief(const SensorBelief& belief) {
  const std::size_t free = belief.free.size();
  const auto length = [](const char* name, Index size, std::size_t expected) {
    require_length(name, size, expected);
  };
  length("rows of the belief's covariance", belief.covariance.rows(), free);
  length("columns of the belief's covariance", belief.covariance.cols(), free);
  if (free > 0) {
    length("rows of angle_sensitivity", belief.angle_sensitivity.rows(), belief.sensor.prisms());
    length("columns of angle_sensitivity", belief.angle_sensitivity.cols(), free);
  }
  require_not_below("angle noise", belief.angle_noise, 0, "rad");
}

/// What a calibration's parameters mean. Those of an uncalibrated sensor are as good as their
/// sigmas: if the reported directions agree with them these are the better knowledge, otherwise the
/// sensor reports wrong directions.
sensors::CalibrationReference meaning_of(const sensors::Sensor& calibration,
                                         const SensorBelief& belief) {
  using sensors::CalibrationReference;
  if (calibration.reference != CalibrationReference::none) return calibration.reference;
  const Index n = belief.free.size();
  if (n == 0) return CalibrationReference::directions;
  Eigen::VectorXd off(n);
  for (Index j = 0; j < n; ++j) {
    const int place = belief.free[j].places.front();
    off[j] = belief.sensor.train[place] - calibration.train[place];
  }
  const Eigen::MatrixXd covariance = belief.covariance + assumed(calibration, belief.free).matrix;
  return estimation::disagreement(off, covariance).same_sensor() ? CalibrationReference::directions
                                                                 : CalibrationReference::planes;
}

/// Whether a mount was adjusted together with parameters of its sensor.
bool is_of_a_calibration(const trajectories::Mount& mount) {
  const auto& own = trajectories::mount_names();
  return std::ranges::any_of(mount.covariance.names, [&](const std::string& name) {
    return std::ranges::find(own, name) == own.end();
  });
}

void require_few(const PointingModel& model) {
  if (model.factors.size() > static_cast<std::size_t>(kMostFactors)) {
    throw InvalidArgument(fmt::format("the calibration's covariance has {} quantities, allowed {}",
                                      model.factors.size(), kMostFactors));
  }
}

}  // namespace

PointingModel pointing_model(const sensors::Sensor& calibration, const SensorBelief& belief,
                             const PointingOptions& options,
                             const std::optional<trajectories::Mount>& mount) {
  using sensors::CalibrationReference;
  PointingModel model;
  require_belief(belief);
  if (calibration.train.face_order() != belief.sensor.train.face_order()) {
    throw InvalidArgument(fmt::format(
        "a calibration of another sensor: its face order is {}, the "
        "recording's {}",
        to_string(calibration.train.face_order()), to_string(belief.sensor.train.face_order())));
  }
  const int emitters = belief.sensor.train.emitters();
  require_between("number of emitters of the calibration", calibration.train.emitters(), emitters,
                  emitters);
  model.reference = meaning_of(calibration, belief);
  const bool type = calibration.reference == CalibrationReference::none;
  const bool planes = model.reference == CalibrationReference::planes;
  model.sensor = calibration;
  model.options = options;
  model.believed = belief.sensor.train;
  model.train = planes ? calibration.train : belief.sensor.train;
  if (options.beam_origin) model.geometry = calibration.geometry;
  model.range_offset = calibration.range_offset;
  model.range_errors = calibration.range_errors;
  model.angle_noise = belief.angle_noise;
  model.sizes.clear();
  if (options.beam_origin) model.sizes = sensors::uncertain_prism_sizes(calibration);
  Factors factors(model, belief);
  const bool smoothed = !options.reported_directions;
  NamedCovariance uncertain = !type    ? calibrated(calibration, options)
                              : planes ? assumed(calibration, belief)
                                       : believed(belief);
  if (mount) {
    model.mount_of_another = is_of_a_calibration(*mount) && !found_together(*mount, uncertain);
    uncertain = trajectories::joint_covariance(uncertain, *mount);
  }
  factors.add(uncertain, planes || smoothed, !planes && smoothed, type && !planes);
  if (planes) factors.add_angles(believed(belief));
  factors.add_geometry(calibration);
  factors.finish();
  if (mount) {
    const Eigen::Matrix3d sensor_from_body = trajectories::body_from_sensor(*mount).transpose();
    model.has_pose = true;
    for (CommonFactor& factor : model.factors) {
      Eigen::Map<Eigen::Vector3d> shift(factor.mount.data() + 3);
      shift = sensor_from_body * Eigen::Vector3d(shift);
    }
  }
  require_few(model);
  return model;
}

std::size_t stand(PointingModel& model, const StandingPose& pose) {
  if (pose.response.size() > 0) {
    require_length("response of the pose", pose.response.cols(), model.factors.size());
    for (std::size_t k = 0; k < model.factors.size(); ++k) {
      for (Index i = 0; i < 6; ++i) {
        model.factors[k].mount[static_cast<std::size_t>(i)] +=
            pose.response(i, static_cast<Index>(k));
      }
    }
  }
  constexpr std::array<const char*, 6> kQuantities{
      "rotation_x_deg", "rotation_y_deg", "rotation_z_deg", "shift_x_m", "shift_y_m", "shift_z_m"};
  const Index weights = std::ssize(model.places) + model.train.prisms() + std::ssize(model.sizes);
  const auto add = [&](const char* of, Index number, const auto& moved) -> CommonFactor& {
    CommonFactor& common = model.factors.emplace_back(
        CommonFactor{fmt::format("{}_{}", of, kQuantities[static_cast<std::size_t>(number)]),
                     Eigen::VectorXd::Zero(weights)});
    for (Index i = 0; i < 6; ++i) common.mount[static_cast<std::size_t>(i)] = moved(i, number);
    return common;
  };
  for (Index j = 0; j < pose.of_survey.cols(); ++j) add(kTargets, j, pose.of_survey);
  const auto of_recording =
      std::stable_partition(model.factors.begin(), model.factors.end(),
                            [](const CommonFactor& factor) { return !factor.of_recording; });
  auto own = static_cast<std::size_t>(model.factors.end() - of_recording);
  const Eigen::MatrixXd factor = lower_factor(pose.covariance);
  for (Index j = 0; j < 6; ++j) {
    add("station", j, factor).of_recording = true;
    ++own;
  }
  model.has_pose = true;
  require_few(model);
  return own;
}

bool needs_rotation_angles(const sensors::Sensor& calibration, const PointingOptions& options) {
  return !options.reported_directions || options.beam_origin ||
         calibration.reference == sensors::CalibrationReference::planes;
}

PointingModel reported_pointing_model(const sensors::Sensor& calibration,
                                      const PointingOptions& options,
                                      std::optional<double> angle_noise,
                                      const std::optional<trajectories::Mount>& mount) {
  if (needs_rotation_angles(calibration, options)) {
    throw InvalidArgument(
        "points of reported directions need rotation angles for the beam's origin and for a "
        "calibration against planes");
  }
  SensorBelief belief;
  belief.sensor = calibration;
  belief.covariance.resize(0, 0);
  belief.angle_noise = angle_noise.value_or(calibration.angle_noise);
  return pointing_model(calibration, belief, options, mount);
}

}  // namespace risley::cloud
