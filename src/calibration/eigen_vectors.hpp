// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "risley/core/vector3.hpp"

namespace risley::calibration {

inline Eigen::Vector3d eigen(const Vector3<double>& v) { return {v.x, v.y, v.z}; }
inline Vector3<double> plain(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

}  // namespace risley::calibration
