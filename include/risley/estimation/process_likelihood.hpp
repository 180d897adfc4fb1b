// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/rotor_trajectory.hpp"

namespace risley::estimation {

/// Usual length of the windows, s.
inline constexpr double kRotorWindow = 0.010;

/// Information of the data on one rotor, window by window: the other rotors' parts are eliminated,
/// so that each rotor's noise can be judged separately. Contains only the data for a likelihood of
/// the process noise: the parameters stay at the linearisation.
class RotorWindows {
 public:
  /// Joins the knots of a linearisation to windows of about that length (s), or of eight shots if
  /// shots are rare, up to the first most_windows.
  RotorWindows(const NormalEquations& equations, const RotorTrajectory& linearisation, int rotor,
               std::size_t most_windows = 3000, double window = kRotorWindow);

  /// Logarithm of the likelihood of the windows for a motion model, up to a constant.
  double log_likelihood(const RotorProcess& process) const;

 private:
  struct Window {
    Eigen::Matrix3d curvature;
    Eigen::Vector3d gradient;
    Eigen::Vector3d offset;  ///< where the motion from the window before misses this linearisation
    double step = 0;         ///< s since the window before; 0 begins a stretch
    Eigen::Vector3d state;   ///< linearisation point
  };
  std::vector<Window> windows_;
};

/// Intensities of white acceleration and white jerk that make a rotor's observations likeliest,
/// each rotor separately. The jerk is zero unless it makes the data likelier by a factor of e^3.
/// @return [prisms]
std::vector<RotorProcess> likeliest_process(const NormalEquations& equations,
                                            const RotorTrajectory& linearisation);

}  // namespace risley::estimation
