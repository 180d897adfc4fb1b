// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/trajectories/geodesy.hpp"
#include "risley/trajectories/interpolation.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"
#include "trajectories/known_flight.hpp"
#include "warning_codes.hpp"

namespace risley::trajectories::sbet_test {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const io::TestFolder& folder() {
  static const io::TestFolder one;
  return one;
}

Trajectory read(const std::string& bytes, const std::string& name = "a.sbet") {
  const std::string path = folder().file(name);
  write_bytes(path, bytes);
  return load_trajectory(path);
}

Trajectory read(const std::vector<SbetRecord>& records) { return read(bytes_of(records)); }

/// What reading says is wrong, "" when nothing is.
std::string fault(const std::vector<SbetRecord>& records) {
  return refusal<FileError>([&] { read(records); });
}

TEST(Sbet, PosesAndVelocitiesAreThoseOfTheFlight) {
  const KnownFlight flight;
  for (const double wander : {0.0, 0.0178, -1.2}) {
    const Trajectory t = read(sbet_records(flight, 600, wander));
    ASSERT_EQ(t.size(), 600U);
    EXPECT_EQ(t.format, "sbet");
    EXPECT_EQ(t.frame, Frame::geocentric);
    EXPECT_EQ(t.time_scale, TimeScale::gps_second_of_week);
    EXPECT_THAT(t.warnings, IsEmpty());
    EXPECT_EQ(t.velocity_frame->name, "north-east-down") << t.velocity_frame->reason;
    EXPECT_NEAR(t.wander->median, wander, 1e-15);
    for (std::size_t i = 0; i < t.size(); i += 37) {
      const double time = KnownFlight::kStep * static_cast<double>(i);
      EXPECT_EQ(t.time_ns[i], std::llround((KnownFlight::kBegin + time) * 1e9));
      EXPECT_LT((t.position[i] - flight.position(time)).norm(), 3e-9);
      EXPECT_LT(t.attitude[i].angularDistance(flight.attitude(time)), 1e-14);
      EXPECT_LT((t.velocity[i] - flight.velocity(time)).norm(), 1e-12);
    }
  }
}

struct VelocityCase {
  const char* name;
  double wander;
  std::function<Vector3d(const Vector3d& ned, const RollPitchHeading& angles, double wander)> turn;
};

/// Components along axes whose x is at an azimuth.
Vector3d along(const Vector3d& ned, double azimuth) {
  return {std::cos(azimuth) * ned.x() + std::sin(azimuth) * ned.y(),
          -std::sin(azimuth) * ned.x() + std::cos(azimuth) * ned.y(), ned.z()};
}

Vector3d flipped(const Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }

TEST(Sbet, FramesOfVelocitiesAreFound) {
  const KnownFlight flight;
  const std::vector<VelocityCase> cases{
      {"east-north-up", 0.5,
       [](const Vector3d& v, const RollPitchHeading&, double) {
         return Vector3d(v.y(), v.x(), -v.z());
       }},
      {"north-west-up, turned by the wander angle", 0,
       [](const Vector3d& v, const RollPitchHeading&, double) { return flipped(v); }},
      {"north-west-up, turned by the wander angle", 0.018,
       [](const Vector3d& v, const RollPitchHeading&, double a) { return flipped(along(v, -a)); }},
      {"forward-right-down of the body", 0.5,
       [](const Vector3d& v, const RollPitchHeading& angles, double) {
         return Vector3d(ned_from_body(angles).conjugate() * v);
       }},
      {"forward-left-up of the body", 0,
       [](const Vector3d& v, const RollPitchHeading& angles, double) {
         return flipped(ned_from_body(angles).conjugate() * v);
       }},
  };
  for (const VelocityCase& each : cases) {
    std::vector<SbetRecord> records = sbet_records(flight, 1000, each.wander);
    for (std::size_t i = 0; i < records.size(); ++i) {
      SbetRecord& n = records[i];
      const Vector3d v =
          each.turn({n[4], n[5], n[6]}, flight.angles(KnownFlight::kStep * static_cast<double>(i)),
                    each.wander);
      for (std::size_t axis = 0; axis < 3; ++axis) n[4 + axis] = v[static_cast<int>(axis)];
    }
    const Trajectory t = read(records);
    EXPECT_EQ(t.velocity_frame->name, each.name) << t.velocity_frame->reason;
    ASSERT_EQ(t.velocity.size(), t.size()) << each.name;
    EXPECT_LT((t.velocity[500] - flight.velocity(2.5)).norm(), 1e-9) << each.name;
    EXPECT_LT(t.velocity_frame->residual->norm(), 1e-3);
  }
}

TEST(Sbet, FramesThatCannotBeToldStayUndecided) {
  const KnownFlight flight;
  // Too short.
  Trajectory t = read(sbet_records(flight, 9));
  EXPECT_EQ(t.velocity_frame->name, "undecided");
  EXPECT_THAT(t.velocity_frame->reason, NamesField("9 records"));
  EXPECT_THAT(t.velocity, IsEmpty());
  // None fits.
  std::vector<SbetRecord> records = sbet_records(flight, 400);
  for (SbetRecord& n : records) n[4] += 15;
  t = read(records);
  EXPECT_EQ(t.velocity_frame->name, "undecided");
  EXPECT_THAT(t.velocity_frame->reason, NamesField("none of 5 frames"));
  EXPECT_THAT(t.velocity, IsEmpty());
  // Zeros, as some programs write.
  for (SbetRecord& n : records) n[4] = n[5] = n[6] = 0;
  EXPECT_THAT(read(records).velocity_frame->reason, NamesField("velocities are 0"));
  // Level to the north: the body's axes are those of the map.
  records = sbet_records(flight, 400);
  for (std::size_t i = 0; i < records.size(); ++i) {
    SbetRecord& n = records[i];
    n[1] = 0.6 + 20 * KnownFlight::kStep * static_cast<double>(i) / 6.37e6;
    n[2] = 0;
    n[3] = 100;
    n[4] = 20;
    n[5] = n[6] = n[7] = n[8] = n[9] = 0;
  }
  t = read(records);
  EXPECT_EQ(t.velocity_frame->name, "undecided");
  EXPECT_THAT(t.velocity_frame->reason, NamesField("equally well"));
}

TEST(Sbet, NoisyPositionsDoNotHideTheFrame) {
  std::vector<SbetRecord> records = sbet_records(KnownFlight(), 2000, 0.018);
  const RandomStream random(5, 1);
  for (std::size_t i = 0; i < records.size(); ++i) {
    SbetRecord& n = records[i];
    n[1] += 0.002 / 6.37e6 * random.normal(3 * i);
    n[2] += 0.002 / 6.37e6 * random.normal(3 * i + 1);
    n[3] += 0.002 * random.normal(3 * i + 2);
    const double x = n[4], y = n[5];  // north-west-up, turned
    n[4] = std::cos(0.018) * x - std::sin(0.018) * y;
    n[5] = -(std::sin(0.018) * x + std::cos(0.018) * y);
    n[6] = -n[6];
  }
  EXPECT_EQ(read(records).velocity_frame->name, "north-west-up, turned by the wander angle");
}

TEST(Sbet, SizesThatAreNoWholeRecordsAreRefusedByName) {
  const std::string bytes = bytes_of(sbet_records(KnownFlight(), 3));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    if (size > 0 && size % 136 == 0) continue;
    EXPECT_THAT(refusal<FileError>([&] { read(bytes.substr(0, size), "cut.sbet"); }),
                AllOf(NamesField("cut.sbet"),
                      NamesField(size == 0 ? "empty" : std::to_string(size) + " bytes")));
  }
}

TEST(Sbet, DegreesWhereRadiansBelongAreNamed) {
  std::vector<SbetRecord> records = sbet_records(KnownFlight(), 20);
  for (SbetRecord& n : records) {
    for (const std::size_t i : {1, 2, 7, 8, 9}) n[i] = degrees_from_radians(n[i]);
  }
  EXPECT_THAT(fault(records),
              AllOf(NamesField("byte 0"), NamesField("latitude"), NamesField("radians")));
  // Without the ending, too.
  const std::string path = folder().file("degrees.out");
  write_bytes(path, bytes_of(records));
  EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::trajectory);
}

TEST(Sbet, ValuesThatNoPlatformHasAreRefusedAtTheirRecord) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const std::vector<SbetRecord> sound = sbet_records(KnownFlight(), 20);
  for (std::size_t field = 0; field < 11; ++field) {
    for (const double value : {kNan, kInfinite, -kInfinite, 1e300, -1e9}) {
      std::vector<SbetRecord> records = sound;
      records[7][field] = value;
      EXPECT_THAT(fault(records), NamesField("byte 952")) << field << ' ' << value;
    }
  }
  EXPECT_EQ(fault(sound), "");
}

TEST(Sbet, TimesThatRunBackAreSortedOrRefused) {
  std::vector<SbetRecord> records = sbet_records(KnownFlight(), 300);
  std::swap(records[100], records[101]);
  records.insert(records.begin() + 200, records[200]);
  const Trajectory t = read(records);
  EXPECT_EQ(t.size(), 300U);
  ASSERT_THAT(t.warnings, ElementsAre(Warns(kWarning.rows_sorted, {"1 of 301"}),
                                      Warns(kWarning.content_left_out, {"1"})));
  EXPECT_EQ(t.warnings[0].place.byte_offset, 101U * 136);
  EXPECT_TRUE(std::ranges::is_sorted(t.time_ns));
  EXPECT_EQ(t.velocity_frame->name, "north-east-down");
  EXPECT_LT((t.position[100] - KnownFlight().position(0.5)).norm(), 1e-8);
  // Another flight behind this one.
  const std::vector<SbetRecord> again = sbet_records(KnownFlight(), 260);
  records.insert(records.end(), again.begin(), again.end());
  EXPECT_THAT(fault(records), AllOf(NamesField("byte 40936"), NamesField("1.495000 s")));
}

TEST(Sbet, TheWeekMayEnd) {
  std::vector<SbetRecord> records = sbet_records(KnownFlight(), 400);
  for (SbetRecord& n : records) {
    n[0] += 604799 - KnownFlight::kBegin;
    if (n[0] >= 604800) n[0] -= 604800;
  }
  const Trajectory t = read(records);
  EXPECT_EQ(t.week_crossings, 1);
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.clock_wrapped, {"604800 s"})));
  EXPECT_NEAR(static_cast<double>(t.time_ns.back() - t.time_ns.front()), 399 * 5e6, 2);
  EXPECT_THAT(Interpolation(t).gaps(), IsEmpty());
  EXPECT_EQ(t.velocity_frame->name, "north-east-down");
}

TEST(Sbet, OneRecordIsATrajectory) {
  const Trajectory t = read(sbet_records(KnownFlight(), 1));
  EXPECT_EQ(t.size(), 1U);
  EXPECT_EQ(t.velocity_frame->name, "undecided");
}

TEST(Sbet, WrittenAndReadAgain) {
  const KnownFlight flight;
  const Trajectory t = read(sbet_records(flight, 300, 0.3));
  const std::string path = folder().file("again.sbet");
  const auto left_out = write_trajectory(path, t);
  EXPECT_THAT(left_out, ::testing::ElementsAre("accelerations and angular rates are 0"));
  const Trajectory again = load_trajectory(path);
  EXPECT_EQ(again.time_ns, t.time_ns);
  EXPECT_EQ(again.velocity_frame->name, "north-east-down");
  EXPECT_EQ(again.wander->greatest, 0);
  for (std::size_t i = 0; i < t.size(); ++i) {
    EXPECT_LT((again.position[i] - t.position[i]).norm(), 3e-9);
    EXPECT_LT(again.attitude[i].angularDistance(t.attitude[i]), 1e-14);
    EXPECT_LT((again.velocity[i] - t.velocity[i]).norm(), 1e-12);
  }
}

using SmrmsgRecord = std::array<double, 10>;

std::vector<SmrmsgRecord> accuracies(int records) {
  std::vector<SmrmsgRecord> all;
  for (int i = 0; i < records; ++i) {
    all.push_back({KnownFlight::kBegin - 5 + i, 0.02 + 0.001 * i, 0.03, 0.05, 0.004, 0.005, 0.006,
                   0.25, 0.26, 1.0 + 0.1 * i});
  }
  return all;
}

AccuracyRecords read_accuracies(const std::vector<SmrmsgRecord>& records) {
  const std::string path = folder().file("a.smrmsg");
  write_bytes(path, bytes_of(records));
  EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::accuracies);
  return load_accuracies(path);
}

TEST(Smrmsg, AccuraciesAreInterpolatedToTheRecords) {
  const AccuracyRecords found = read_accuracies(accuracies(20));
  EXPECT_EQ(found.time_ns.size(), 20U);
  EXPECT_NEAR(found.accuracy[3].heading, radians_from_degrees(1.3 / 60), 1e-15);
  EXPECT_EQ(found.velocity[0], Vector3d(0.004, 0.005, 0.006));
  Trajectory t = read(sbet_records(KnownFlight(), 400));
  add_accuracies(t, found, "a.smrmsg");
  ASSERT_EQ(t.accuracy.size(), 400U);
  EXPECT_NEAR(t.accuracy[100].position.x(), 0.02 + 0.001 * 5.5, 1e-12);
  EXPECT_NEAR(degrees_from_radians(t.accuracy[100].heading), 1.55 / 60, 1e-12);
  EXPECT_NEAR(degrees_from_radians(t.accuracy[100].roll), 0.25 / 60, 1e-12);
}

TEST(Smrmsg, UnorderedRecordsAndTheEndOfTheWeek) {
  std::vector<SmrmsgRecord> records = accuracies(20);
  std::ranges::reverse(records);
  records.push_back(records.back());
  const AccuracyRecords found = read_accuracies(records);
  EXPECT_EQ(found.time_ns.size(), 20U);
  EXPECT_TRUE(std::ranges::is_sorted(found.time_ns));
  EXPECT_EQ(found.warnings.size(), 2U);
  // The week ends within both.
  records = accuracies(20);
  for (SmrmsgRecord& n : records) {
    n[0] += 604799 - KnownFlight::kBegin;
    if (n[0] >= 604800) n[0] -= 604800;
  }
  std::vector<SbetRecord> poses = sbet_records(KnownFlight(), 400);
  for (SbetRecord& n : poses) {
    n[0] += 604799 - KnownFlight::kBegin;
    if (n[0] >= 604800) n[0] -= 604800;
  }
  Trajectory t = read(poses);
  add_accuracies(t, read_accuracies(records), "a.smrmsg");
  EXPECT_NEAR(t.accuracy[100].position.x(), 0.02 + 0.001 * 5.5, 1e-12);
  // The trajectory lies behind the end of the week, where its times began again.
  poses = sbet_records(KnownFlight(), 100);
  for (SbetRecord& n : poses) n[0] += 2 - KnownFlight::kBegin;
  t = read(poses);
  add_accuracies(t, read_accuracies(records), "a.smrmsg");
  EXPECT_NEAR(t.accuracy[0].position.x(), 0.02 + 0.001 * 8, 1e-12);
}

TEST(Smrmsg, OtherFlightsAndDamageAreRefused) {
  Trajectory t = read(sbet_records(KnownFlight(), 400));
  std::vector<SmrmsgRecord> records = accuracies(20);
  for (SmrmsgRecord& n : records) n[0] += 3600;
  EXPECT_THAT(refusal<FileError>([&] { add_accuracies(t, read_accuracies(records), "b.smrmsg"); }),
              AllOf(NamesField("b.smrmsg"), HasSubstr("404420")));
  for (std::size_t field = 0; field < 10; ++field) {
    for (const double value : {std::nan(""), -1.0, 1e12}) {
      records = accuracies(20);
      records[2][field] = value;
      EXPECT_THROW(read_accuracies(records), FileError) << field << value;
    }
  }
  const std::string path = folder().file("cut.smrmsg"), bytes = bytes_of(accuracies(2));
  for (std::size_t size = 1; size < bytes.size(); ++size) {
    if (size == 80) continue;
    write_bytes(path, bytes.substr(0, size));
    EXPECT_THROW(load_accuracies(path), FileError) << size;
  }
  EXPECT_THROW(load_trajectory(folder().file("a.smrmsg")), FileError);
}

TEST(RealSbet, VelocitiesStandNorthWestUpTurnedByTheWander) {
  const std::string path = real_file("leeward-sbet.out");
  if (path.empty()) GTEST_SKIP() << "SKIPPED: RISLEY_VENDOR_DATA names no folder";
  const Trajectory t = load_trajectory(path);
  EXPECT_EQ(t.size(), 200U);
  EXPECT_EQ(t.velocity_frame->name, "north-west-up, turned by the wander angle")
      << t.velocity_frame->reason;
  EXPECT_LT(t.velocity_frame->residual->norm(), 0.005) << t.velocity_frame->reason;
  EXPECT_NEAR(degrees_from_radians(t.wander->median), 1.02, 0.005);
  EXPECT_NEAR(static_cast<double>(Interpolation(t).median_step_ns()), 5e6, 1e4);
  // The aircraft flies where it looks: the course is the heading less the drift, which stays.
  const RollPitchHeading angles =
      roll_pitch_heading(Frame::geocentric, t.position[100], t.attitude[100]);
  EXPECT_NEAR(degrees_from_radians(angles.heading), degrees_from_radians(2.8794 - 0.01783), 0.02);
}

TEST(RealSbet, TwoPointsAndACutFile) {
  const std::string path = real_file("2-points.sbet");
  if (path.empty()) GTEST_SKIP() << "SKIPPED: RISLEY_VENDOR_DATA names no folder";
  const Trajectory t = load_trajectory(path);
  EXPECT_EQ(t.size(), 2U);
  EXPECT_EQ(t.velocity_frame->name, "undecided");
  EXPECT_THAT(refusal<FileError>([&] { load_trajectory(real_file("badfile.sbet")); }),
              AllOf(NamesField("badfile.sbet"), NamesField("271 bytes")));
}

TEST(RealSmrmsg, MediansAreThoseOfTheFile) {
  const std::string path = real_file("first-3000.smrmsg");
  if (path.empty()) GTEST_SKIP() << "SKIPPED: RISLEY_VENDOR_DATA names no folder";
  EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::accuracies);
  const AccuracyRecords found = load_accuracies(path);
  std::vector<double> headings;
  for (const PoseAccuracy& accuracy : found.accuracy) headings.push_back(accuracy.heading);
  std::nth_element(headings.begin(), headings.begin() + 1500, headings.end());
  // 1.859 arc-minutes, of 1.270 to 3.011 (counted apart from this library)
  EXPECT_EQ(found.time_ns.size(), 3000U);
  EXPECT_NEAR(60 * degrees_from_radians(headings[1500]), 1.8594, 0.001);
}

}  // namespace risley::trajectories::sbet_test
