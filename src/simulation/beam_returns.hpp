// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <limits>

#include "risley/core/vector3.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/footprint.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::simulation {

/// A beam in a scene.
struct SceneBeam {
  Vector3<double> origin, direction;  ///< m; unit vector
  sensors::FootprintAxes axes;        ///< of a beam with a footprint, or of one that needs slopes
  double penetration = 0.5;           ///< of bushes, (0, 1)
  double time = 0;                    ///< since the first shot, s
};

/// Return of one shot, before the errors of the sensor.
struct BeamReturn {
  double true_range = std::numeric_limits<double>::quiet_NaN();  ///< of the beam's middle, m
  double range = 0;            ///< measured by the sensor, m; 0: no return
  double reflectance = 0;      ///< reflectivity times cosine of incidence, [0, 1]
  double footprint_depth = 0;  ///< sensors::footprint_depth, m; 0 if it is not needed
};

/// How a sensor sees a scene.
class BeamReturns {
 public:
  /// Keeps references to both.
  BeamReturns(const scenes::Scene& scene, const sensors::Sensor& sensor);

  /// Whether a beam needs the axes of its footprint.
  bool needs_axes() const { return footprint_ || slopes_; }
  BeamReturn of(const SceneBeam& beam) const;

 private:
  BeamReturn of_line(const SceneBeam& beam) const;
  BeamReturn of_footprint(const SceneBeam& beam) const;
  /// Whether the sensor receives enough.
  /// @param part  of the light that a matt surface of reflectivity 1 at this range, m, sends back
  bool detects(double range, double part) const;
  double depth(const SceneBeam& beam, double range, const Vector3<double>& normal) const;

  const scenes::Scene* scene_;
  const sensors::Sensor* sensor_;
  bool footprint_ = false, slopes_ = false;
};

}  // namespace risley::simulation
