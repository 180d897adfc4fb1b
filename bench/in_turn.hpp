// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <ctime>
#include <vector>

#include <benchmark/benchmark.h>

namespace risley::bench {

/// Processor time of this thread, s: other programs of a busy machine change it least.
inline double thread_seconds() {
  std::timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Runs library and peer in turn and counts how many times longer the peer takes: peer_over_ours
/// is the median of the ratios of neighbours, ratio_q1 and ratio_q3 are their quartiles, ratio_min
/// is the smallest; ours_ns and peer_ns are the median times per shot.
/// @param our_shots,peer_shots  of one run of each
template <class Ours, class Peer>
void run_in_turn(benchmark::State& state, std::size_t our_shots, const Ours& ours,
                 std::size_t peer_shots, const Peer& peer) {
  const auto seconds = [](const auto& run) {
    const double begin = thread_seconds();
    run();
    benchmark::ClobberMemory();
    return thread_seconds() - begin;
  };
  std::vector<double> ratios, our_times, peer_times;
  for (auto _ : state) {
    const double theirs = 1e9 * seconds(peer) / static_cast<double>(peer_shots);
    const double mine = 1e9 * seconds(ours) / static_cast<double>(our_shots);
    state.SetIterationTime(1e-9 * mine * static_cast<double>(our_shots));
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

}  // namespace risley::bench
