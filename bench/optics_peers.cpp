// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "optics_peers.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <ceres/jet.h>

#include "risley/optics/observation_model.hpp"

namespace risley::peers {

void plain_directions(const PrismTrain& train, const double* a, const double* b, std::size_t shots,
                      double* azimuth, double* zenith) {
  const PrismTrain& t = train;
  const auto lean = [](double h, double v) {
    return Eigen::Vector3d(std::cos(h) * std::cos(v), -std::sin(h) * std::cos(v), std::sin(v));
  };
  const auto refracted = [](const Eigen::Vector3d& beam, const Eigen::Vector3d& n, double m) {
    const double c = n.dot(beam);
    return Eigen::Vector3d(m * (beam - c * n) + n * std::sqrt(1 - m * m * (1 - c * c)));
  };
  const double bh = t[place::bearing_tilt_horizontal(0)], bv = t[place::bearing_tilt_vertical(0)];
  const double ah = t[place::prism_tilt_horizontal(0)], av = t[place::prism_tilt_vertical(0)];
  const double ch = t[place::prism_tilt_horizontal(1)], cv = t[place::prism_tilt_vertical(1)];
  const double wedge = t[place::wedge_angle(0)];
  const double m = t[place::refractive_index_air()] / t[place::refractive_index(0)];
  const Eigen::Vector3d axis = lean(bh, bv);
  const Eigen::Vector3d incident =
      lean(t[place::incident_beam_horizontal()], t[place::incident_beam_vertical()]);
  const Eigen::Vector3d n1 = lean(bh + ah, bv + av), n2 = lean(bh + ah, bv + av + wedge);
  const Eigen::Vector3d n3 = lean(ch, cv - wedge), n4 = lean(ch, cv);
  for (std::size_t i = 0; i < shots; ++i) {
    const Eigen::Matrix3d ra = Eigen::AngleAxisd(a[i], axis).toRotationMatrix();
    const Eigen::Matrix3d rb = Eigen::AngleAxisd(b[i], Eigen::Vector3d::UnitX()).toRotationMatrix();
    Eigen::Vector3d beam = refracted(incident, ra * n1, m);
    beam = refracted(beam, ra * n2, 1 / m);
    beam = refracted(beam, rb * n3, m);
    beam = refracted(beam, rb * n4, 1 / m);
    azimuth[i] = std::atan2(beam.y(), beam.x());
    zenith[i] = std::acos(beam.z());
  }
}

double jet_jacobians(const PrismTrain& train, const double* a, const double* b, std::size_t shots,
                     bool every_shot, double* derivatives) {
  using Jet = ceres::Jet<double, kJetColumns>;
  std::array<Jet, parameter_count(2)> parameters;
  for (int i = 0; i < parameter_count(2); ++i) {
    parameters[static_cast<std::size_t>(i)] = Jet(train[i]);
  }
  for (int column = 0; column < kJetColumns - 2; ++column) {
    parameters[static_cast<std::size_t>(jet_place(column))].v[column] = 1.0;
  }
  const auto order = face_order_array<2>(train);
  auto prepared = prepare<Jet, 2>(parameters, order);
  double sum = 0;
  for (std::size_t i = 0; i < shots; ++i) {
    if (every_shot) {
      asm volatile("" : : "r"(&parameters) : "memory");  // they may be others now
      prepared = prepare<Jet, 2>(parameters, order);
    }
    const auto beam = trace(prepared, {Jet(a[i], kJetColumns - 2), Jet(b[i], kJetColumns - 1)});
    const auto angles = angles_from_direction(beam.direction);
    if (derivatives) {
      for (const Jet& angle : {angles.azimuth, angles.zenith}) {
        derivatives = std::copy_n(angle.v.data(), kJetColumns, derivatives);
      }
    }
    sum += angles.azimuth.a + angles.zenith.a + angles.azimuth.v.sum() + angles.zenith.v.sum();
  }
  return sum;
}

}  // namespace risley::peers
