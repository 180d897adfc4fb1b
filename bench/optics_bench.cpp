// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How many shots a second can the observation model point, and what do derivatives cost? Every
// comparison runs peer and library in turn, many times, in one process: peer_over_ours is the
// median of the ratios of neighbours, beside the smallest, the quartiles and the median times per
// shot. The peers (optics_peers.cpp) are compiled for this processor; the library chooses its
// instruction set when it runs. error_rad and error are the largest differences from the model in
// long double and from the derivatives by Jets.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "risley/core/angle.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/inverse.hpp"
#include "risley/optics/observation_adjoint.hpp"
#include "risley/sensors/preset.hpp"

#include "in_turn.hpp"
#include "optics_peers.hpp"

namespace risley {
namespace {

using bench::run_in_turn;

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

/// The largest error of columns of directions, rad: the template of the model in long double.
double largest_error(const Shots& shots) {
  const auto doubles = parameter_array<2>(shots.train);
  std::array<long double, doubles.size()> parameters;
  std::copy(doubles.begin(), doubles.end(), parameters.begin());
  const auto train = prepare<long double, 2>(parameters, face_order_array<2>(shots.train));
  long double worst = 0;
  for (std::size_t i = 0; i < kShots; ++i) {
    const std::array<long double, 2> angles{shots.a[i], shots.b[i]};
    const auto exact = angles_from_direction(trace(train, angles).direction);
    worst = std::max({worst, std::abs(exact.azimuth - shots.azimuth[i]),
                      std::abs(exact.zenith - shots.zenith[i])});
  }
  return static_cast<double>(worst);
}

/// Azimuth and zenith against plain Eigen.
void directions(benchmark::State& state, InstructionSet set) {
  Shots shots;
  const auto angles = shots.angles();
  std::vector<double> azimuth(kShots), zenith(kShots);
  const auto ours = [&] {
    observe_batch(shots.train, angles, {{}, {}, {}, shots.azimuth, shots.zenith}, {}, set);
  };
  run_in_turn(state, kShots, ours, kShots, [&] {
    peers::plain_directions(shots.train, shots.a.data(), shots.b.data(), kShots, azimuth.data(),
                            zenith.data());
  });
  state.counters["error_rad"] = largest_error(shots);
}

/// More shots than any cache holds, against reading and writing the same bytes.
void directions_in_memory(benchmark::State& state, InstructionSet set) {
  constexpr std::size_t kTimes = 256;
  const Shots shots;
  std::array<std::vector<double>, 4> columns;
  for (auto& column : columns) column.resize(kTimes * kShots);
  for (std::size_t i = 0; i < kTimes; ++i) {
    const auto at = static_cast<std::ptrdiff_t>(i * kShots);
    std::copy(shots.a.begin(), shots.a.end(), columns[0].begin() + at);
    std::copy(shots.b.begin(), shots.b.end(), columns[1].begin() + at);
  }
  const std::vector<std::span<const double>> angles{columns[0], columns[1]};
  const auto ours = [&] {
    observe_batch(shots.train, angles, {{}, {}, {}, columns[2], columns[3]}, {}, set);
  };
  run_in_turn(state, kTimes * kShots, ours, kTimes * kShots, [&] {
    std::copy(columns[0].begin(), columns[0].end(), columns[2].begin());
    std::copy(columns[1].begin(), columns[1].end(), columns[3].begin());
  });
  state.counters["peer_GB_per_s"] = 32.0 / state.counters["peer_ns"];
}

/// The same at constant speeds, from times on: 100 kHz for longer and longer.
void sequence(benchmark::State& state, InstructionSet set) {
  Shots shots;
  std::vector<double> azimuth(kShots), zenith(kShots);
  constexpr double kSpeedA = -763.8, kSpeedB = 488.4, kInterval = 1e-5;
  double begin = 0;
  const auto turn = [&] {
    // An int becomes a double in batches, a std::size_t one by one, which costs both sides 0.5 ns;
    // so does a start that any of the angles might overwrite.
    const double first = begin;
    double *const angle_a = shots.a.data(), *const angle_b = shots.b.data();
    for (int i = 0; i < static_cast<int>(kShots); ++i) {
      const double time = first + kInterval * i;
      angle_a[i] = rotation_angle_at(0.3, kSpeedA, time);
      angle_b[i] = rotation_angle_at(1.7, kSpeedB, time);
    }
    begin += kInterval * static_cast<double>(kShots);
  };
  const auto ours = [&] {
    turn();
    observe_batch(shots.train, shots.angles(), {{}, {}, {}, shots.azimuth, shots.zenith}, {}, set);
  };
  run_in_turn(state, kShots, ours, kShots, [&] {
    turn();
    peers::plain_directions(shots.train, shots.a.data(), shots.b.data(), kShots, azimuth.data(),
                            zenith.data());
  });
  ours();
  state.counters["error_rad"] = largest_error(shots);
}

/// Both angles and their derivatives by nine parameters and two rotation angles against Jets, block
/// by block, as code that sums them calls it: columns of all shots at once measure the memory.
/// @param every_shot  see peers::jet_jacobians()
void jacobian(benchmark::State& state, InstructionSet set, bool every_shot) {
  constexpr std::size_t kBlock = 2048;
  Shots shots;
  const auto columns = static_cast<std::size_t>(parameter_count(2) + 2);
  std::array<std::vector<std::vector<double>>, 2> gradients;
  for (auto& gradient : gradients) {
    gradient.resize(columns);
    for (int column = 0; column < peers::kJetColumns - 2; ++column) {
      gradient[static_cast<std::size_t>(peers::jet_place(column))].resize(kBlock);
    }
    gradient[columns - 2].resize(kBlock);
    gradient[columns - 1].resize(kBlock);
  }
  const LinearisationColumns out{std::span(shots.azimuth).first(kBlock),
                                 std::span(shots.zenith).first(kBlock),
                                 {gradients[0].begin(), gradients[0].end()},
                                 {gradients[1].begin(), gradients[1].end()}};
  constexpr std::size_t kPeerShots = kShots / 16;
  const auto ours = [&] {
    for (std::size_t begin = 0; begin < kShots; begin += kBlock) {
      const std::vector<std::span<const double>> angles{std::span(shots.a).subspan(begin, kBlock),
                                                        std::span(shots.b).subspan(begin, kBlock)};
      linearise_batch(shots.train, angles, out, {}, set);
    }
  };
  run_in_turn(state, kShots, ours, kPeerShots, [&] {
    benchmark::DoNotOptimize(
        peers::jet_jacobians(shots.train, shots.a.data(), shots.b.data(), kPeerShots, every_shot));
  });
  // The last block against the same shots by Jets.
  std::vector<double> derivatives(kBlock * 2 * peers::kJetColumns);
  peers::jet_jacobians(shots.train, shots.a.data() + kShots - kBlock,
                       shots.b.data() + kShots - kBlock, kBlock, every_shot, derivatives.data());
  double worst = 0;
  const double* exact = derivatives.data();
  for (std::size_t i = 0; i < kBlock; ++i) {
    for (const auto& gradient : gradients) {
      for (int column = 0; column < peers::kJetColumns; ++column, ++exact) {
        const std::size_t place =
            column < peers::kJetColumns - 2
                ? static_cast<std::size_t>(peers::jet_place(column))
                : columns - peers::kJetColumns + static_cast<std::size_t>(column);
        worst = std::max(worst, std::abs(gradient[place][i] - *exact));
      }
    }
  }
  state.counters["error"] = worst;
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
  const auto in_turn = [](const std::string& name, auto function, int times = 201) {
    benchmark::RegisterBenchmark(name.c_str(), function)
        ->Iterations(times)
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  };
  for (const InstructionSet set : available_instruction_sets()) {
    const std::string name = to_string(set);
    in_turn("directions/" + name, [set](benchmark::State& state) { directions(state, set); });
    in_turn(
        "directions_in_memory/" + name,
        [set](benchmark::State& state) { directions_in_memory(state, set); }, 21);
    in_turn("sequence/" + name, [set](benchmark::State& state) { sequence(state, set); });
    in_turn("jacobian/" + name, [set](benchmark::State& state) { jacobian(state, set, true); });
    in_turn("jacobian_prepared/" + name,
            [set](benchmark::State& state) { jacobian(state, set, false); });
  }
  return true;
}();

}  // namespace
}  // namespace risley
