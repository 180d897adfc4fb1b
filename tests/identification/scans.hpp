// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "risley/core/angle.hpp"
#include "risley/core/random.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/simulation/rotor_dynamics.hpp"

namespace risley::identification {

/// A train, how its rotors turn, and what a recording of it is like.
struct Scan {
  std::string faces = "PA-AP";
  std::vector<double> index{1.5089, 1.5089};
  std::vector<double> wedge_deg{18, 18};
  std::vector<double> speed_hz{-121.5, 77.7};
  std::vector<double> start_deg{30, 200};
  std::vector<double> emitter_elevation_deg{0};
  double rate_hz = 6000, duration_s = 4;
  double noise_deg = 0;
  double printed_deg = 1e-8;  ///< step of azimuth and zenith
  bool hunting = false;       ///< the rotors
  bool together = false;      ///< the shots of a round share the rotors' position
  std::uint64_t seed = 1;

  PrismTrain train() const {
    const int emitters = static_cast<int>(emitter_elevation_deg.size());
    PrismTrain train(parse_face_order(faces), emitters);
    for (int k = 0; k < train.prisms(); ++k) {
      const auto at = static_cast<std::size_t>(k);
      train.set_place(place::refractive_index(k), index[at]);
      train.set_place(place::wedge_angle(k), radians_from_degrees(wedge_deg[at]));
    }
    for (int j = 0; j < emitters; ++j) {
      train.set_place(place::incident_beam_vertical(j, train.prisms()),
                      radians_from_degrees(emitter_elevation_deg[static_cast<std::size_t>(j)]));
    }
    return train;
  }

  estimation::AngleSeries series() const {
    const PrismTrain optics = train();
    const auto emitters = static_cast<std::size_t>(optics.emitters());
    const auto shots = static_cast<std::size_t>(std::lround(rate_hz * duration_s));
    std::vector<std::int64_t> time_ns(shots), rotor_ns(shots);
    std::vector<double> rotor_time(shots);
    for (std::size_t i = 0; i < shots; ++i) {
      const std::size_t of_rotors = together ? i - i % emitters : i;
      rotor_time[i] = static_cast<double>(of_rotors) / rate_hz;
      time_ns[i] = std::llround(1e9 * static_cast<double>(i) / rate_hz);
      rotor_ns[i] = std::llround(1e9 * rotor_time[i]);
    }
    std::vector<std::vector<double>> angle(index.size(), std::vector<double>(shots));
    for (std::size_t k = 0; k < index.size(); ++k) {
      const double start = radians_from_degrees(start_deg[k]), speed = kTwoPi * speed_hz[k];
      if (hunting) {
        std::vector<double> speeds(shots);
        simulation::RotorMotion(
            simulation::rotor_settings(simulation::RotorKind::hunting, optics.prisms()),
            static_cast<int>(k), start, speed, time_ns.back(), seed)
            .evaluate(rotor_ns, angle[k], speeds);
      } else {
        for (std::size_t i = 0; i < shots; ++i) angle[k][i] = start + speed * rotor_time[i];
      }
    }
    const RandomStream random(seed, 7);
    std::uint64_t drawn = 0;
    estimation::AngleSeries series;
    std::vector<double> angles(index.size());
    for (std::size_t i = 0; i < shots; ++i) {
      for (std::size_t k = 0; k < angles.size(); ++k) angles[k] = angle[k][i];
      const Observation shot = observe(optics, angles, static_cast<int>(i % emitters));
      const auto printed = [&](double value) {
        const double degrees = degrees_from_radians(value) + noise_deg * random.normal(drawn++);
        return radians_from_degrees(std::round(degrees / printed_deg) * printed_deg);
      };
      const double azimuth = printed(shot.azimuth), zenith = printed(shot.zenith);
      if (shot.valid) series.append(time_ns[i], azimuth, zenith);
    }
    return series;
  }
};

/// Six emitters as Livox builds them, 0.47 mm apart behind a lens of 30 mm.
inline std::vector<double> six_emitters_deg() {
  std::vector<double> elevation;
  for (int j = 1; j <= 6; ++j) {
    elevation.push_back(degrees_from_radians(std::atan((j - 3.5) * 0.47 / 30)));
  }
  return elevation;
}

}  // namespace risley::identification
