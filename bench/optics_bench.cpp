// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How many shots a second can the observation model point, and what do derivatives cost? Every
// comparison runs peer and library in turn, many times, in one process: peer_over_ours is the
// median of the ratios of neighbours, beside the smallest, the quartiles and the median times per
// shot. The peers (optics_peers.cpp) are compiled for this processor; the library chooses its
// instruction set when it runs.
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "risley/core/angle.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/inverse.hpp"
#include "risley/optics/observation_adjoint.hpp"
#include "risley/sensors/preset.hpp"

#include "optics_peers.hpp"

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

/// Processor time of this thread: other programs of a busy machine change it least.
double thread_seconds() {
  std::timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Runs both in turn and tells how many times longer the peer takes.
/// @param peer_shots  of the peer's run, which may be shorter than ours
template <class Ours, class Peer>
void compare(benchmark::State& state, const Ours& ours, const Peer& peer,
             std::size_t peer_shots = kShots) {
  const auto seconds = [](const auto& run) {
    const double begin = thread_seconds();
    run();
    benchmark::ClobberMemory();
    return thread_seconds() - begin;
  };
  std::vector<double> ratios, our_times, peer_times;
  for (auto _ : state) {
    const double theirs = 1e9 * seconds(peer) / static_cast<double>(peer_shots);
    const double mine = 1e9 * seconds(ours) / static_cast<double>(kShots);
    state.SetIterationTime(1e-9 * mine * static_cast<double>(kShots));
    our_times.push_back(mine);
    peer_times.push_back(theirs);
    ratios.push_back(theirs / mine);
  }
  const auto at = [](std::vector<double>& values, double part) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
  };
  state.counters["peer_over_ours"] = at(ratios, 0.5);
  state.counters["ratio_min"] = ratios.front();
  state.counters["ratio_q1"] = at(ratios, 0.25);
  state.counters["ratio_q3"] = at(ratios, 0.75);
  state.counters["ours_ns"] = at(our_times, 0.5);
  state.counters["peer_ns"] = at(peer_times, 0.5);
}

/// Azimuth and zenith against plain Eigen.
void directions(benchmark::State& state, InstructionSet set) {
  Shots shots;
  const auto angles = shots.angles();
  std::vector<double> azimuth(kShots), zenith(kShots);
  const auto ours = [&] {
    observe_batch(shots.train, angles, {{}, {}, {}, shots.azimuth, shots.zenith}, {}, set);
  };
  compare(state, ours, [&] {
    peers::plain_directions(shots.train, shots.a.data(), shots.b.data(), kShots, azimuth.data(),
                            zenith.data());
  });
  double worst = 0;
  for (std::size_t i = 0; i < kShots; ++i) {
    worst = std::max(
        {worst, std::abs(azimuth[i] - shots.azimuth[i]), std::abs(zenith[i] - shots.zenith[i])});
  }
  state.counters["difference_rad"] = worst;
}

/// The same at constant speeds, from times on: 100 kHz for longer and longer.
void sequence(benchmark::State& state, InstructionSet set) {
  Shots shots;
  std::vector<double> azimuth(kShots), zenith(kShots);
  constexpr double kSpeedA = -763.8, kSpeedB = 488.4, kInterval = 1e-5;
  double begin = 0;
  const auto turn = [&] {
    for (std::size_t i = 0; i < kShots; ++i) {
      const double time = begin + kInterval * static_cast<double>(i);
      shots.a[i] = rotation_angle_at(0.3, kSpeedA, time);
      shots.b[i] = rotation_angle_at(1.7, kSpeedB, time);
    }
    begin += kInterval * static_cast<double>(kShots);
  };
  const auto ours = [&] {
    turn();
    observe_batch(shots.train, shots.angles(), {{}, {}, {}, shots.azimuth, shots.zenith}, {}, set);
  };
  compare(state, ours, [&] {
    turn();
    peers::plain_directions(shots.train, shots.a.data(), shots.b.data(), kShots, azimuth.data(),
                            zenith.data());
  });
}

/// Both angles and their derivatives by nine parameters and two rotation angles against Jets, block
/// by block, as whoever sums them up calls it: columns of all shots at once measure the memory.
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
  compare(
      state, ours,
      [&] {
        benchmark::DoNotOptimize(peers::jet_jacobians(shots.train, shots.a.data(), shots.b.data(),
                                                      kPeerShots, every_shot));
      },
      kPeerShots);
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
  const auto in_turn = [](const std::string& name, auto function) {
    benchmark::RegisterBenchmark(name.c_str(), function)
        ->Iterations(201)
        ->UseManualTime()
        ->Unit(benchmark::kMicrosecond);
  };
  for (const InstructionSet set : available_instruction_sets()) {
    const std::string name = to_string(set);
    in_turn("directions/" + name, [set](benchmark::State& state) { directions(state, set); });
    in_turn("sequence/" + name, [set](benchmark::State& state) { sequence(state, set); });
    in_turn("jacobian/" + name, [set](benchmark::State& state) { jacobian(state, set, true); });
    in_turn("jacobian_prepared/" + name,
            [set](benchmark::State& state) { jacobian(state, set, false); });
  }
  return true;
}();

}  // namespace
}  // namespace risley
