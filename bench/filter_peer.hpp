// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "risley/core/angle.hpp"
#include "risley/optics/prism_train.hpp"

// What the library's estimators are compared with, compiled for the processor that compiles it.
namespace risley::peers {

/// The extended Kalman filter as one writes it down, and competently, with Eigen, derivatives by
/// Jets of all twelve states and Joseph's form. Its model is the library's template, because that
/// is leaner than Eq. (10-26) as printed (Rodrigues' form, no quaternions); the train is prepared
/// anew for every shot because every shot changes its parameters. Matrices have fixed sizes, so
/// nothing is allocated, and lazyProduct() spares the products Eigen's blocking, which costs more
/// than it gives at this size. What it does not use is the structure of F and H, nor
/// does it look for outliers.
class PlainFilter {
 public:
  /// Constants (refractive index, incident beam, bearing of A, vertical tilt of A, both of B), then
  /// angle and speed of A, and of B.
  static constexpr int kStates = 12;
  static constexpr int kConstants = 8;
  /// How fast the rotors may change their speed: fits those of the benchmarks, rad/s/sqrt(s); from
  /// a fifth to twenty times this the parameters come out equally well.
  static constexpr double kAcceleration = radians_from_degrees(1.0);

  /// @param train           two prisms, PA-AP, as the start has them
  /// @param rotation_angle  at the time, rad
  /// @param speed           rad/s
  /// @param angle_noise     1 sigma of azimuth and zenith, rad
  PlainFilter(const PrismTrain& train, const std::array<double, 2>& rotation_angle,
              const std::array<double, 2>& speed, std::int64_t time_ns, double angle_noise);
  ~PlainFilter();
  PlainFilter(PlainFilter&&) noexcept;
  PlainFilter& operator=(PlainFilter&&) noexcept;

  /// Constant speed with white acceleration.                                  [B21 Eq. (27)]
  void predict(std::int64_t time_ns);
  /// @param azimuth,zenith  observed, rad
  void update(double azimuth, double zenith);

  std::array<double, kStates> mean() const;
  std::array<double, kStates> sigma() const;

 private:
  struct State;  // of Eigen's matrices, which align as the flags of the compiler say
  std::unique_ptr<State> state_;
};

}  // namespace risley::peers
