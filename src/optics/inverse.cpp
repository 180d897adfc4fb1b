// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/inverse.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/golden_section.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/observation_model.hpp"

namespace risley {
namespace {

using Vector = Vector3<double>;

/// Below this a miss counts as a hit: rad, 6e-11 degree.
constexpr double kHit = 1e-12;
/// Samples of the last angle; the miss has a few harmonics only, so its roots and near-roots are
/// far wider apart or found through the extremum between them.
constexpr int kSamples = 144;

/// The optics around the gap before the last prism, with one moving prism on either side.
template <TrainLayout N>
class Gap {
 public:
  Gap(const PrismTrain& train, int beam, std::span<const double> fixed_angles,
      const Vector& direction)
      : train_(prepare<double, N>(parameter_array<N>(train, beam), face_order_array<N>(train))),
        entering_(train_.incident),
        direction_(in_train_frame<N>(direction)) {
    for (std::size_t prism = 0; prism + 2 < N; ++prism) {
      entering_ = through(prism, entering_, fixed_angles[prism]);
    }
    // The beam after the last prism but one traces a closed curve; seen from its centre the curve
    // is nearly a circle, with the rotation angle as its azimuth.
    Vector sum{0, 0, 0};
    for (int i = 0; i < kSamples; ++i) sum += forward(i * kTwoPi / kSamples);
    centre_ = normalized(sum);
    const Vector start = forward(0.0);
    radius_ = angle_between(start, centre_);
    // The basis turns with the curve: its first axis points in the direction of rotation angle
    // zero.
    first_ = normalized(start - dot(start, centre_) * centre_);
    second_ = cross(centre_, first_);
  }

  double radius() const { return radius_; }

  /// The beam in the gap for an angle of the last prism but one.
  Vector forward(double angle) const { return through(N - 2, entering_, angle); }

  /// The beam in the gap that the last prism, at a given angle, sends in the requested direction.
  Vector backward(double angle) const {
    const double sine = std::sin(angle), cosine = std::cos(angle);
    Vector beam = direction_;
    for (std::size_t face = N.surfaces(); face-- > 2 * N - 2;) {
      const auto& f = train_.faces[face];
      beam = at_surface(face, beam, f.normal.at(sine, cosine), 1.0 / f.index_ratio);
    }
    return beam;
  }

  /// The angle of the last prism but one at which its curve has the azimuth of a beam.
  double angle_towards(const Vector& beam) const {
    const double wanted = azimuth(beam);
    double angle = wanted;
    for (int i = 0; i < 60; ++i) {
      const double step = wrap_to_pi(wanted - azimuth(forward(angle)));
      angle += step;
      if (std::abs(step) < 1e-15) break;
    }
    return angle;
  }

  /// Distance, rad, of the required beam in the gap outside the curve of the possible beams; zero
  /// is a solution, NaN means that no beam leaves the last prism in the requested direction.
  double miss(double last_angle) const {
    const Vector beam = backward(last_angle);
    if (!std::isfinite(beam.x)) return std::numeric_limits<double>::quiet_NaN();
    return angle_between(beam, centre_) - angle_between(forward(angle_towards(beam)), centre_);
  }

 private:
  Vector through(std::size_t prism, Vector beam, double angle) const {
    const double sine = std::sin(angle), cosine = std::cos(angle);
    for (std::size_t face = 2 * prism; face < 2 * prism + N.surfaces(prism); ++face) {
      const auto& f = train_.faces[face];
      beam = at_surface(face, beam, f.normal.at(sine, cosine), f.index_ratio);
    }
    return beam;
  }

  static Vector at_surface(std::size_t face, const Vector& beam, const Vector& normal,
                           double index_ratio) {
    const bool mirror = N.reflects() && face + 2 == N.surfaces();
    return mirror ? reflect(beam, normal) : refract(beam, normal, index_ratio);
  }

  double azimuth(const Vector& beam) const {
    return std::atan2(dot(beam, second_), dot(beam, first_));
  }

  PreparedTrain<double, N> train_;
  Vector entering_, direction_, centre_, first_, second_;
  double radius_ = 0;
};

/// Root between two angles whose misses differ in sign, by bisection with secant steps.
template <class Miss>
double root_between(const Miss& miss, double a, double miss_a, double b, double miss_b) {
  for (int i = 0; i < 200 && std::abs(b - a) > 4e-16 * (1.0 + std::abs(a)); ++i) {
    double middle = 0.5 * (a + b);
    if (i % 3 != 2) {  // two secant steps, then one bisection that bounds the work
      const double secant = a - miss_a * (b - a) / (miss_b - miss_a);
      if (secant > std::min(a, b) && secant < std::max(a, b)) middle = secant;
    }
    const double value = miss(middle);
    if (value == 0.0) return middle;
    if (std::signbit(value) == std::signbit(miss_a)) {
      a = middle;
      miss_a = value;
    } else {
      b = middle;
      miss_b = value;
    }
  }
  return std::abs(miss_a) < std::abs(miss_b) ? a : b;
}

template <TrainLayout N>
InverseSolution solve(const PrismTrain& train, int beam, const Vector& direction,
                      std::span<const double> fixed_angles) {
  const Gap<N> gap(train, beam, fixed_angles, direction);
  if (!(gap.radius() > 1e-9)) {
    throw InvalidArgument(fmt::format(
        "prism {} does not deviate the beam, so every rotation angle of it is a solution", N - 1));
  }
  const auto miss = [&](double angle) { return gap.miss(angle); };
  InverseSolution solution;
  const auto add = [&](double last_angle) {
    solution.pairs.push_back(
        {wrap_to_two_pi(gap.angle_towards(gap.backward(last_angle))), wrap_to_two_pi(last_angle)});
  };

  constexpr double kStep = kTwoPi / kSamples;
  std::array<double, kSamples> sample;
  double largest = 0;
  bool complete = true;
  for (int i = 0; i < kSamples; ++i) {
    sample[static_cast<std::size_t>(i)] = miss(i * kStep);
    complete = complete && std::isfinite(sample[static_cast<std::size_t>(i)]);
    largest = std::fmax(largest, std::abs(sample[static_cast<std::size_t>(i)]));
  }
  if (complete && largest < kHit) {
    solution.continuum = true;
    add(0.0);
    return solution;
  }
  const auto at = [&](int i) {
    return sample[static_cast<std::size_t>((i + kSamples) % kSamples)];
  };
  for (int i = 0; i < kSamples; ++i) {
    const double before = at(i - 1), here = at(i), after = at(i + 1);
    if (!std::isfinite(here) || !std::isfinite(after)) continue;
    if (here == 0.0) {
      add(i * kStep);
      continue;
    }
    if (after != 0.0 && std::signbit(here) != std::signbit(after)) {
      add(root_between(miss, i * kStep, here, (i + 1) * kStep, after));
    }
    // Two roots between samples, or one where they merge, appear as a dip towards zero.
    const double sign = here > 0 ? 1.0 : -1.0;
    if (std::isfinite(before) && sign * before > sign * here && sign * after >= sign * here) {
      const double a = (i - 1) * kStep, b = (i + 1) * kStep;
      const double lowest =
          golden_section_minimum([&](double angle) { return sign * miss(angle); }, a, b, 1e-9);
      const double value = miss(lowest);
      if (std::abs(value) <= kHit) {
        add(lowest);
      } else if (sign * value < 0) {
        add(root_between(miss, a, before, lowest, value));
        add(root_between(miss, lowest, value, b, after));
      }
    }
  }
  std::sort(solution.pairs.begin(), solution.pairs.end(),
            [](const RotationPair& a, const RotationPair& b) { return a.second < b.second; });
  return solution;
}

}  // namespace

InverseSolution rotation_angles_for(const PrismTrain& train, const Vector3<double>& direction,
                                    std::span<const double> fixed_angles, int beam) {
  if (train.prisms() < 2) {
    throw InvalidArgument(
        fmt::format("the inverse needs at least 2 prisms, the train has {}", train.prisms()));
  }
  require_length("fixed_angles", fixed_angles.size(), static_cast<std::size_t>(train.prisms() - 2));
  for (const double angle : fixed_angles) require_finite("fixed_angles", angle, "rad");
  check_beam(train, beam);
  require_unit_length("direction", norm(direction));
  const Vector3<double> unit = normalized(direction);
  return with_layout(train.layout(), [&]<TrainLayout N>() -> InverseSolution {
    if constexpr (N < 2) return {};  // refused above
    if constexpr (N >= 2) return solve<N>(train, beam, unit, fixed_angles);
  });
}

}  // namespace risley
