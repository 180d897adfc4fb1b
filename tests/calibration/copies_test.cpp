// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Shots that are counted twice make every sigma too small.
#include "calibration/copies.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"

namespace risley::calibration::copies_test {

constexpr std::size_t kShots = 2000;

/// A sensor before a wall: its own noise and rotors that start anywhere, by the seed.
RangedRecording recording_of(std::uint64_t seed) {
  const RandomStream random(seed, 3);
  RangedRecording recording;
  recording.name = "recording";
  recording.shots.resize(2, kShots);
  const double a = kTwoPi * random.uniform(0), b = kTwoPi * random.uniform(1);
  for (std::size_t i = 0; i < kShots; ++i) {
    const auto shot = static_cast<double>(i);
    recording.shots.rotation_angle[0][i] = wrap_to_pi(a - 0.004895 * shot);
    recording.shots.rotation_angle[1][i] = wrap_to_pi(b + 0.00759 * shot);
    recording.shots.range[i] = 5.0 + std::sin(0.001 * shot) + 0.02 * random.normal(2 + i);
  }
  return recording;
}

/// As another format has it: ranges in steps, angles that were found anew, some shots missing.
RangedRecording converted(RangedRecording recording, std::size_t begin, std::size_t end) {
  std::vector<std::size_t> rows;
  for (std::size_t i = begin; i < end; ++i) rows.push_back(i);
  recording.shots = rows_of(recording.shots, rows);
  for (double& range : recording.shots.range) range = 1e-3 * std::round(1e3 * range);
  for (double& angle : recording.shots.rotation_angle[1]) angle = wrap_to_pi(angle + 3e-4);
  return recording;
}

TEST(Copies, AreRefusedInWhateverFormat) {
  const RangedRecording one = recording_of(1), two = recording_of(2);
  EXPECT_NO_THROW(require_no_copies({one}));
  EXPECT_NO_THROW(require_no_copies({one, two, recording_of(3)}));
  EXPECT_THROW(require_no_copies({one, two, one}), InvalidArgument);
  EXPECT_THROW(require_no_copies({two, one, converted(one, 0, kShots)}), InvalidArgument);
  // A part of another one, and one that overlaps it by less than nine tenths.
  EXPECT_THROW(require_no_copies({converted(one, 500, 1100), one}), InvalidArgument);
  EXPECT_NO_THROW(require_no_copies({converted(one, 0, 1500), converted(one, 500, kShots), two}));
}

TEST(Copies, AreNotRecordingsThatStartAtTheSameAngles) {
  RangedRecording one = recording_of(1), two = recording_of(2);
  two.shots.rotation_angle = one.shots.rotation_angle;
  EXPECT_NO_THROW(require_no_copies({one, two}));
}

}  // namespace risley::calibration::copies_test
