// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How many shots a second can the observation model point, and what do derivatives cost? The peer
// is the paper's model written plainly with Eigen, one shot at a time. Compare rows of one run.
#include <array>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <benchmark/benchmark.h>
#include <ceres/jet.h>

#include "risley/core/angle.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/inverse.hpp"
#include "risley/optics/observation_adjoint.hpp"
#include "risley/sensors/preset.hpp"

namespace risley {
namespace {

constexpr std::size_t kShots = 1 << 14;

struct Shots {
  PrismTrain train = sensors::load_sensor("mid-40-table3").train;
  std::vector<double> a, b, azimuth, zenith;

  Shots() : a(kShots), b(kShots), azimuth(kShots), zenith(kShots) {
    std::mt19937_64 generator(1);
    std::uniform_real_distribution<double> uniform(0.0, kTwoPi);
    for (std::size_t i = 0; i < kShots; ++i) {
      a[i] = uniform(generator);
      b[i] = uniform(generator);
    }
  }
  std::vector<std::span<const double>> angles() const { return {a, b}; }
};

void set_rate(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kShots));
}

/// The peer: Eq. (10-26) as they stand, with Eigen's rotations.
void plain_eigen(benchmark::State& state) {
  Shots shots;
  const PrismTrain& t = shots.train;
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
  for (auto _ : state) {
    for (std::size_t i = 0; i < kShots; ++i) {
      const Eigen::Matrix3d ra = Eigen::AngleAxisd(shots.a[i], axis).toRotationMatrix();
      const Eigen::Matrix3d rb =
          Eigen::AngleAxisd(shots.b[i], Eigen::Vector3d::UnitX()).toRotationMatrix();
      Eigen::Vector3d beam = refracted(incident, ra * n1, m);
      beam = refracted(beam, ra * n2, 1 / m);
      beam = refracted(beam, rb * n3, m);
      beam = refracted(beam, rb * n4, 1 / m);
      shots.azimuth[i] = std::atan2(beam.y(), beam.x());
      shots.zenith[i] = std::acos(beam.z());
    }
    benchmark::DoNotOptimize(shots.zenith.data());
    benchmark::ClobberMemory();
  }
  set_rate(state);
}
BENCHMARK(plain_eigen);

void scalar_model(benchmark::State& state) {
  Shots shots;
  const auto train =
      prepare<double, 2>(parameter_array<2>(shots.train), face_order_array<2>(shots.train));
  for (auto _ : state) {
    for (std::size_t i = 0; i < kShots; ++i) {
      const auto angles = angles_from_direction(trace(train, {shots.a[i], shots.b[i]}).direction);
      shots.azimuth[i] = angles.azimuth;
      shots.zenith[i] = angles.zenith;
    }
    benchmark::DoNotOptimize(shots.zenith.data());
    benchmark::ClobberMemory();
  }
  set_rate(state);
}
BENCHMARK(scalar_model);

void batch_model(benchmark::State& state, InstructionSet set) {
  Shots shots;
  const auto angles = shots.angles();
  for (auto _ : state) {
    observe_batch(shots.train, angles, {{}, {}, {}, shots.azimuth, shots.zenith}, {}, set);
    benchmark::ClobberMemory();
  }
  set_rate(state);
}

/// The peer of the derivatives: forward-mode automatic differentiation of the same template.
void jet_derivatives(benchmark::State& state) {
  Shots shots;
  constexpr int kColumns = parameter_count(2) + 2;
  using Jet = ceres::Jet<double, kColumns>;
  std::array<Jet, parameter_count(2)> parameters;
  for (int i = 0; i < parameter_count(2); ++i) {
    parameters[static_cast<std::size_t>(i)] = Jet(shots.train[i], i);
  }
  const auto train = prepare<Jet, 2>(parameters, face_order_array<2>(shots.train));
  for (auto _ : state) {
    for (std::size_t i = 0; i < kShots; ++i) {
      const auto angles = angles_from_direction(
          trace(train, {Jet(shots.a[i], kColumns - 2), Jet(shots.b[i], kColumns - 1)}).direction);
      benchmark::DoNotOptimize(angles.azimuth.v.data());
      benchmark::DoNotOptimize(angles.zenith.v.data());
    }
  }
  set_rate(state);
}
BENCHMARK(jet_derivatives);

void scalar_adjoint(benchmark::State& state) {
  Shots shots;
  const auto parameters = parameter_array<2>(shots.train);
  const auto order = face_order_array<2>(shots.train);
  const auto train = prepare<double, 2>(parameters, order);
  const auto derivatives = prepare_derivatives<double, 2>(parameters, order);
  for (auto _ : state) {
    for (std::size_t i = 0; i < kShots; ++i) {
      const auto result = linearise_angles(train, derivatives, {shots.a[i], shots.b[i]});
      benchmark::DoNotOptimize(result.azimuth.parameters.data());
      benchmark::DoNotOptimize(result.zenith.parameters.data());
    }
  }
  set_rate(state);
}
BENCHMARK(scalar_adjoint);

void batch_adjoint(benchmark::State& state, InstructionSet set) {
  Shots shots;
  const auto angles = shots.angles();
  const auto columns = static_cast<std::size_t>(parameter_count(2) + 2);
  std::vector<std::vector<double>> d_azimuth(columns, std::vector<double>(kShots));
  auto d_zenith = d_azimuth;
  const LinearisationColumns out{shots.azimuth,
                                 shots.zenith,
                                 {d_azimuth.begin(), d_azimuth.end()},
                                 {d_zenith.begin(), d_zenith.end()}};
  for (auto _ : state) {
    linearise_batch(shots.train, angles, out, {}, set);
    benchmark::ClobberMemory();
  }
  set_rate(state);
}

void inverse(benchmark::State& state) {
  const Shots shots;
  std::size_t i = 0;
  for (auto _ : state) {
    i = (i + 1) % kShots;
    const auto shot = observe(shots.train, std::array{shots.a[i], shots.b[i]});
    benchmark::DoNotOptimize(rotation_angles_for(shots.train, shot.direction));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(inverse);

const bool registered = [] {
  for (const InstructionSet set : available_instruction_sets()) {
    benchmark::RegisterBenchmark(("batch_model/" + to_string(set)).c_str(), batch_model, set);
    benchmark::RegisterBenchmark(("batch_adjoint/" + to_string(set)).c_str(), batch_adjoint, set);
  }
  return true;
}();

}  // namespace
}  // namespace risley
