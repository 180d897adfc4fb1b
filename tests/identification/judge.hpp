// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "risley/identification/identify.hpp"

#include "identification/scans.hpp"

namespace risley::identification {

/// Whether a hypothesis has the faces of a scan, and its rotors in that order.
inline bool is(const Hypothesis& hypothesis, const Scan& scan) {
  if (to_string(hypothesis.train().face_order()) != scan.faces) return false;
  for (int k = 0; k < hypothesis.train().prisms(); ++k) {
    const double speed = hypothesis.fit.model.rotors.mean_angular_velocity(k) / kTwoPi;
    if (std::abs(speed - scan.speed_hz[static_cast<std::size_t>(k)]) > 0.5) return false;
  }
  return true;
}

inline bool class_holds(const Identification& found, const Scan& scan) {
  const auto& same = found.best().equivalent_to;
  return is(found.best(), scan) || std::any_of(same.begin(), same.end(), [&](std::size_t other) {
           return is(found.hypotheses[other], scan);
         });
}

/// Largest error of indices and wedges in sigmas.
inline double worst_error(const Identification& found, const Scan& scan) {
  const Hypothesis& best = found.best();
  double worst = 0;
  for (std::size_t i = 0; i < best.fit.names.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double sigma = std::sqrt(best.total_covariance(at, at));
    for (int k = 0; k < best.train().prisms(); ++k) {
      const auto prism = static_cast<std::size_t>(k);
      const std::string letter(1, prism_letter(k));
      double error = 0;
      if (best.fit.names[i] == "refractive_index_" + letter) {
        error = best.train()[place::refractive_index(k)] - scan.index[prism];
      } else if (best.fit.names[i] == "wedge_angle_" + letter + "_deg") {
        error = best.train()[place::wedge_angle(k)] - radians_from_degrees(scan.wedge_deg[prism]);
      }
      worst = std::max(worst, std::abs(error) / sigma);
    }
  }
  return worst;
}

}  // namespace risley::identification
