// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Random trains. A few run each time; RISLEY_SEEDS=N runs N of each kind, numbered from
// RISLEY_FIRST_SEED, and prints what became of them.
#include <algorithm>
#include <chrono>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/identification/identify.hpp"

#include "identification/judge.hpp"
#include "identification/scans.hpp"
#include "seeds.hpp"

namespace risley::identification::random_trains_test {

/// A field of view below 80 degrees, by the deviations of thin prisms.
constexpr double kLargestAside_deg = 38;

/// One or six emitters, wedges of 5 to 25 degrees, indices of 1.45 to 1.9, one glass in half of
/// the trains, rotors of 20 to 300 Hz either way; the weakest prism leaves an eighth of the beam's
/// way aside.
Scan random_scan(int prisms, std::uint64_t seed) {
  const RandomStream random(seed, 77);
  std::uint64_t drawn = 0;
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * random.uniform(drawn++);
  };
  for (;;) {
    Scan scan;
    scan.seed = seed;
    scan.faces.clear();
    scan.index.clear();
    scan.wedge_deg.clear();
    scan.speed_hz.clear();
    scan.start_deg.clear();
    const bool one_glass = uniform(0, 1) < 0.5;
    double aside = 0;
    for (int k = 0; k < prisms; ++k) {
      scan.faces += k > 0 ? "-" : "";
      scan.faces += uniform(0, 1) < 0.5 ? "PA" : "AP";
      scan.index.push_back(one_glass && k > 0 ? scan.index.front() : uniform(1.45, 1.9));
      scan.wedge_deg.push_back(uniform(5, 25));
      scan.speed_hz.push_back((uniform(0, 1) < 0.5 ? -1 : 1) * uniform(20, 300));
      scan.start_deg.push_back(uniform(0, 360));
      aside += (scan.index.back() - 1) * scan.wedge_deg.back();
    }
    if (uniform(0, 1) < 0.5) scan.emitter_elevation_deg = six_emitters_deg();
    if (aside < kLargestAside_deg) return scan;
  }
}

struct Tally {
  int right = 0, wrong = 0, undecided = 0, refused = 0;
  double worst_error = 0;  ///< of indices and wedges in sigmas, where right
};

Tally run(int prisms, bool noisy, int trains) {
  Tally tally;
  const auto first = static_cast<std::uint64_t>(testing::number_or("RISLEY_FIRST_SEED", 1));
  for (int i = 0; i < trains; ++i) {
    Scan scan = random_scan(prisms, first + static_cast<std::uint64_t>(i));
    if (noisy) {
      scan.duration_s = 10;
      scan.noise_deg = scan.printed_deg = 0.01;
      scan.hunting = true;
    }
    const auto begin = std::chrono::steady_clock::now();
    std::string outcome;
    double error = 0;
    try {
      const Identification found = identify(scan.series());
      const bool right = class_holds(found, scan);
      if (!found.decided || !found.fits) {
        ++tally.undecided;
        outcome = right ? "undecided, the true one first" : "undecided";
      } else if (right) {
        ++tally.right;
        outcome = "right";
        if (is(found.best(), scan)) error = worst_error(found, scan);
        tally.worst_error = std::max(tally.worst_error, error);
      } else {
        ++tally.wrong;
        outcome = fmt::format("WRONG: {}", to_string(found.best().train().face_order()));
      }
    } catch (const EstimationError& refusal) {
      ++tally.refused;
      outcome = refusal.what();
    }
    if (trains > 5) {
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
      fmt::print(
          "{} {} emitters {} index {:.4f} wedge {:.3f} Hz {:.2f}: {}, {:.1f} sigmas, {:.1f} s\n",
          scan.seed, scan.faces, scan.emitter_elevation_deg.size(), fmt::join(scan.index, " "),
          fmt::join(scan.wedge_deg, " "), fmt::join(scan.speed_hz, " "), outcome, error,
          took.count());
      std::fflush(stdout);
    }
  }
  fmt::print("{} right, {} wrong, {} undecided, {} refused; largest error {:.1f} sigmas\n",
             tally.right, tally.wrong, tally.undecided, tally.refused, tally.worst_error);
  return tally;
}

/// @param share  that must be right of many
void expect_right(int prisms, bool noisy, int few, double share) {
  const int trains = testing::seeds_or(few);
  const Tally tally = run(prisms, noisy, trains);
  EXPECT_LE(tally.wrong, trains >= 20 ? 1 : 0);
  EXPECT_GE(tally.right, trains >= 20 ? static_cast<int>(share * trains) : trains);
}

TEST(RandomTrains, TwoPrismsExact) { expect_right(2, false, 2, 0.98); }
TEST(RandomTrains, ThreePrismsExact) { expect_right(3, false, 1, 0.96); }
TEST(RandomTrains, TwoPrismsNoisy) { expect_right(2, true, 1, 0.95); }
TEST(RandomTrains, ThreePrismsNoisy) { expect_right(3, true, 1, 0.84); }

}  // namespace risley::identification::random_trains_test
