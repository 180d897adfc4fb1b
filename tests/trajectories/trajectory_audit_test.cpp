// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/trajectory_audit.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

#include "refusal.hpp"
#include "trajectories/known_flight.hpp"
#include "warning_codes.hpp"

namespace risley::trajectories::trajectory_audit_test {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(TrajectoryAudit, SaysWhatATrajectoryHolds) {
  const KnownFlight flight;
  Trajectory t = trajectory_of(flight, 2001);
  t.accuracy.resize(t.size());
  for (std::size_t i = 0; i < t.size(); ++i) {
    t.accuracy[i] = {{0.01 + 1e-6 * static_cast<double>(i), 0.02, 0.03}, 1e-4, 2e-4, 3e-4};
  }
  const TrajectoryAudit audit = audit_trajectory(t);
  EXPECT_EQ(audit.times.records, 2001U);
  EXPECT_NEAR(audit.times.rate_hz, 200, 1e-9);
  EXPECT_NEAR(audit.times.duration_s, 10, 1e-9);
  EXPECT_THAT(audit.times.gaps, IsEmpty());
  EXPECT_THAT(audit.warnings, IsEmpty());
  EXPECT_NEAR(audit.accuracy->position.x(), 0.011, 1e-9);
  EXPECT_NEAR(audit.accuracy->heading, 3e-4, 1e-15);
  EXPECT_NEAR(audit.latitude->max, flight.place(0).latitude, 1e-7);
  EXPECT_LT(audit.height.min, 691.7);
  EXPECT_NEAR(audit.roll.max, 0.1, 1e-4);
  EXPECT_GT(audit.fastest, 20);
  EXPECT_LT(audit.fastest, 24);
  EXPECT_GT(audit.fastest_turning, 0.2);
  EXPECT_LT(audit.fastest_turning, 0.4);
}

TEST(TrajectoryAudit, GapsAndJumpsAreNamed) {
  Trajectory t = trajectory_of(KnownFlight(), 600);
  for (std::size_t i = 300; i < 600; ++i) t.time_ns[i] += 2'000'000'000;
  TrajectoryAudit audit = audit_trajectory(t);
  ASSERT_EQ(audit.times.gaps.size(), 1U);
  EXPECT_EQ(audit.times.gaps[0].row, 299U);
  EXPECT_NEAR(audit.times.gaps_total_s, 2.0, 1e-9);
  EXPECT_THAT(audit.warnings, ElementsAre(Warns(kWarning.trajectory_gaps, {"1 gap", "2.005 s"})));
  EXPECT_LT(audit.fastest, 24);  // not across the gap

  t = trajectory_of(KnownFlight(), 600);
  for (std::size_t i = 300; i < 600; ++i) t.position[i] += Eigen::Vector3d(30, 0, 0);
  t.attitude[400] = t.attitude[400] * Eigen::Quaterniond(0, 0, 0, 1);
  audit = audit_trajectory(t);
  EXPECT_THAT(audit.warnings,
              ElementsAre(Warns(kWarning.trajectory_jumps, {"m/s at 400826.500 s"}),
                          Warns(kWarning.trajectory_jumps, {"degrees per second"})));
}

TEST(TrajectoryAudit, RecordsThatAreTooFewAreNamed) {
  Trajectory t;
  t.time_scale = TimeScale::utc_unix;
  for (int i = 0; i < 20; ++i) {
    t.time_ns.push_back(i * 1'000'000'000LL);
    t.position.emplace_back(i, 0, 0);
    t.attitude.push_back(ned_from_body({0, 0, 0.7 * i}));
  }
  EXPECT_THAT(audit_trajectory(t).warnings[0], Warns(kWarning.trajectory_gaps, {"40 degrees"}));
  t.time_scale = TimeScale::unknown;
  EXPECT_THAT(audit_trajectory(t).warnings[1], Warns(kWarning.clock_unknown));
}

TEST(TrajectoryAudit, OneRecordHasNoRate) {
  const TrajectoryAudit audit = audit_trajectory(trajectory_of(KnownFlight(), 1));
  EXPECT_EQ(audit.times.rate_hz, 0);
  EXPECT_EQ(audit.times.duration_s, 0);
}

TEST(AccuracyAudit, MediansAndWorst) {
  AccuracyRecords records;
  for (int i = 0; i < 10; ++i) {
    records.time_ns.push_back((i < 5 ? i : i + 30) * 1'000'000'000LL);
    records.accuracy.push_back({{0.01 * (i + 1), 0.02, 0.03}, 1e-4, 2e-4, 1e-3 * (i + 1)});
  }
  const AccuracyAudit audit = audit_accuracies(records);
  EXPECT_NEAR(audit.median.position.x(), 0.055, 1e-15);
  EXPECT_NEAR(audit.median.heading, 5.5e-3, 1e-15);
  EXPECT_NEAR(audit.worst.heading, 1e-2, 1e-15);
  EXPECT_EQ(audit.times.gaps.size(), 1U);
  EXPECT_EQ(audit.times.rate_hz, 1);
  records.time_ns[3] = 0;
  EXPECT_THAT(refusal([&] { audit_accuracies(records); }), NamesField("time_ns[3]"));
  EXPECT_THAT(refusal([] { audit_accuracies({}); }), NamesField("records"));
}

TEST(AngleWords, DegreesAndArcMinutes) {
  EXPECT_EQ(angle_words(radians_from_degrees(1.0 / 60)), "0.017 degree (1.0 arc-minute)");
  EXPECT_EQ(angle_words(radians_from_degrees(0.08)), "0.08 degree (4.8 arc-minutes)");
  EXPECT_THAT(refusal([] { angle_words(std::nan("")); }), NamesField("angle"));
}

TEST(RealAudit, LeewardsTrajectory) {
  const std::string path = real_file("leeward-sbet.out");
  if (path.empty()) GTEST_SKIP() << "SKIPPED: RISLEY_VENDOR_DATA names no folder";
  const TrajectoryAudit audit = audit_trajectory(load_trajectory(path));
  EXPECT_EQ(audit.times.records, 200U);
  EXPECT_NEAR(audit.times.rate_hz, 200, 1);
  EXPECT_NEAR(audit.times.duration_s, 0.996, 0.002);
  EXPECT_THAT(audit.times.gaps, IsEmpty());
  EXPECT_THAT(audit.warnings, IsEmpty());
  EXPECT_NEAR(audit.fastest, 110, 2);
}

}  // namespace risley::trajectories::trajectory_audit_test
