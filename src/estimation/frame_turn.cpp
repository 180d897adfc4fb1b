// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/frame_turn.hpp"

#include <cmath>

#include <Eigen/Geometry>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/core/direction.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::estimation {

std::array<std::string, 2> turn_names(bool axis_up) {
  if (axis_up) return {"pitch", "roll"};
  return {"yaw", "pitch"};
}

Eigen::Matrix3d sensor_from_train(bool axis_up) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (axis_up) axes << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  return axes;
}

Eigen::Matrix3d recording_from_sensor(const FrameTurn& turn) {
  const Eigen::Matrix3d axes = sensor_from_train(turn.axis_up);
  return axes *
         (Eigen::AngleAxisd(turn.yaw, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(turn.pitch, Eigen::Vector3d::UnitY()))
             .toRotationMatrix() *
         axes.transpose();
}

FrameTurn turn_of(const Eigen::Matrix3d& recording_from_sensor, bool axis_up) {
  const Eigen::Matrix3d axes = sensor_from_train(axis_up);
  const Eigen::Vector3d axis = axes.transpose() * (recording_from_sensor * axes.col(0));
  return {std::atan2(axis.y(), axis.x()), std::atan2(-axis.z(), std::hypot(axis.x(), axis.y())),
          axis_up};
}

Eigen::Matrix3d turned_further(const Eigen::Matrix3d& rotation, const Eigen::Vector2d& step,
                               bool axis_up) {
  if (step.isZero(0)) return rotation;
  const Eigen::Vector3d about = sensor_from_train(axis_up) * Eigen::Vector3d(0, step[1], step[0]);
  return recording_from_sensor(turn_of(rotation * algebra::rotation_by(about), axis_up));
}

void turn(AngleSeries& series, const Eigen::Matrix3d& rotation) {
  for (std::size_t i = 0; i < series.size(); ++i) {
    const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
    const double sine = std::hypot(v.x, v.y);
    const Eigen::Vector3d direction = rotation * Eigen::Vector3d(v.x, v.y, v.z);
    const auto angles =
        angles_from_direction(Vector3<double>{direction.x(), direction.y(), direction.z()});
    const double new_sine = std::sin(angles.zenith);
    // Where azimuth grew before, seen from where it grows now: the two variances mix by that angle.
    const Eigen::Vector3d along =
        rotation * Eigen::Vector3d(-std::sin(series.azimuth[i]), std::cos(series.azimuth[i]), 0.0);
    const double cosine =
        -std::sin(angles.azimuth) * along.x() + std::cos(angles.azimuth) * along.y();
    const double share = cosine * cosine;
    const double across = static_cast<double>(series.azimuth_rounding_variance[i]) * sine * sine;
    const double down = static_cast<double>(series.zenith_rounding_variance[i]);
    series.azimuth_rounding_variance[i] =
        static_cast<float>((share * across + (1.0 - share) * down) / (new_sine * new_sine));
    series.zenith_rounding_variance[i] = static_cast<float>(share * down + (1.0 - share) * across);
    series.azimuth[i] = angles.azimuth;
    series.zenith[i] = angles.zenith;
  }
}

std::vector<FreeParameter> frame_parameters(const TrainLayout& layout, double prior_sigma) {
  const auto [first, second] = turn_names(layout.axis_up);
  return {{"frame_" + first + "_deg", {place::frame_yaw(layout)}, prior_sigma, true},
          {"frame_" + second + "_deg", {place::frame_pitch(layout)}, prior_sigma, true}};
}

void hold_last_bearing(const TrainLayout& layout, std::vector<FreeParameter>& free) {
  std::erase_if(free, [&](const FreeParameter& parameter) {
    const int at = parameter.places.front();
    return at == place::frame_yaw(layout) || at == place::frame_pitch(layout);
  });
}

}  // namespace risley::estimation
