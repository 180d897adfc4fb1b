// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Inertial Explorer, POSPac, OpenMMS, named CSV, TUM and RTKLIB.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/trajectories/interpolation.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"
#include "trajectories/known_flight.hpp"
#include "warning_codes.hpp"

namespace risley::trajectories::text_formats_test {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

const io::TestFolder& folder() {
  static const io::TestFolder one;
  return one;
}

Trajectory read(const std::string& text, const std::string& name = "a.txt") {
  const std::string path = folder().file(name);
  write_bytes(path, text);
  EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::trajectory) << text.substr(0, 300);
  return load_trajectory(path);
}

std::string fault(const std::string& text, const std::string& name = "a.txt") {
  return refusal<FileError>([&] {
    const std::string path = folder().file(name);
    write_bytes(path, text);
    load_trajectory(path);
  });
}

/// The flight at a time, s, angles in degrees.
struct FlightRow {
  double t, latitude, longitude, height, roll, pitch, heading;
  Vector3d velocity_ned;

  explicit FlightRow(double time, const KnownFlight& flight = {}) : t(time) {
    const Geodetic place = flight.place(t);
    const RollPitchHeading angles = flight.angles(t);
    latitude = degrees_from_radians(place.latitude);
    longitude = degrees_from_radians(place.longitude);
    height = place.height;
    roll = degrees_from_radians(angles.roll);
    pitch = degrees_from_radians(angles.pitch);
    heading = degrees_from_radians(angles.heading);
    velocity_ned = flight.velocity_ned(t);
  }
};

/// Rows of the flight.
std::string rows(int count, const std::function<std::string(const FlightRow&)>& row) {
  std::string text;
  for (int i = 0; i < count; ++i) text += row(FlightRow(KnownFlight::kStep * i)) + "\n";
  return text;
}

void expect_flight(const Trajectory& t, std::size_t records, double position, double angle,
                   double speed) {
  const KnownFlight flight;
  ASSERT_EQ(t.size(), records);
  EXPECT_EQ(t.frame, Frame::geocentric);
  for (std::size_t i = 0; i < records; i += 7) {
    const double time = KnownFlight::kStep * static_cast<double>(i);
    EXPECT_LT((t.position[i] - flight.position(time)).norm(), position) << i;
    EXPECT_LT(t.attitude[i].angularDistance(flight.attitude(time)), angle) << i;
    if (speed > 0) {
      ASSERT_EQ(t.velocity.size(), records);
      EXPECT_LT((t.velocity[i] - flight.velocity(time)).norm(), speed) << i;
    }
  }
}

/// Degrees, minutes and seconds as Inertial Explorer writes them.
std::string sexagesimal(double degrees) {
  const double size = std::abs(degrees);
  const int whole = static_cast<int>(size), minutes = static_cast<int>((size - whole) * 60);
  const double seconds = ((size - whole) * 60 - minutes) * 60;
  return fmt::format("{}{} {:02d} {:08.5f}", degrees < 0 ? "-" : " ", whole, minutes, seconds);
}

const std::string kExplorerHead =
    "Project:     flight\n"
    "Program:     Inertial Explorer Version 8.60.4609\n"
    "Profile:     everything\n"
    "Source:      GNSS/INS Epochs(Smoothed TC Combined)\n"
    "\n"
    "Datum:       WGS84, (processing datum)\n"
    "Master 1:    Name BASE, Status ENABLED\n"
    "UTC Offset:  18s\n"
    "SD Scaling Settings:\n"
    "  Position: 1.0000\n"
    "  Velocity: 1.0000\n"
    "  Attitude: 1.0000\n"
    "\n";

std::string explorer_text(int count, bool sexagesimal_places) {
  std::string text = kExplorerHead;
  text +=
      "  GPSTime      Latitude       Longitude     H-Ell  VEast VNorth  VUp  SDNorth SDEast "
      "SDHeight  Roll  RollSD  Pitch PitchSD Heading HdngSD Q\n";
  text += fmt::format(
      "    (sec)   {0}    {0}      (m)  (m/s)  (m/s) (m/s)   (m)   (m)   (m) (deg) "
      "(deg) (deg) (deg) (deg) (deg)\n",
      sexagesimal_places ? "(+/-D M S)" : "(Deg)");
  text.back() = ' ';
  text += "(none)\n\n";
  text += rows(count, [&](const FlightRow& f) {
    const Vector3d& v = f.velocity_ned;
    return fmt::format(
        "{:.4f} {} {} {:.4f} {:.4f} {:.4f} {:.4f} 0.011 0.012 0.023 {:.8f} 0.004 {:.8f} 0.005 "
        "{:.8f} 0.021 1",
        KnownFlight::kBegin + f.t,
        sexagesimal_places ? sexagesimal(f.latitude) : fmt::format("{:.10f}", f.latitude),
        sexagesimal_places ? sexagesimal(f.longitude) : fmt::format("{:.10f}", f.longitude),
        f.height, v.y(), v.x(), -v.z(), f.roll, f.pitch, f.heading);
  });
  return text;
}

TEST(InertialExplorer, ColumnsAreFoundByNamesAndUnits) {
  for (const bool sexagesimal_places : {false, true}) {
    const Trajectory t = read(explorer_text(300, sexagesimal_places));
    EXPECT_EQ(t.format, "inertial-explorer");
    EXPECT_EQ(t.time_scale, TimeScale::gps_second_of_week);
    EXPECT_THAT(t.warnings, IsEmpty());
    expect_flight(t, 300, 3e-4, 1e-9, 1e-4);
    EXPECT_EQ(t.velocity_frame->name, "east-north-up");
    EXPECT_LT(t.velocity_frame->residual->norm(), 2e-3);
    ASSERT_EQ(t.accuracy.size(), 300U);
    EXPECT_EQ(t.accuracy[5].position, Vector3d(0.011, 0.012, 0.023));
    EXPECT_NEAR(degrees_from_radians(t.accuracy[5].roll), 0.004, 1e-12);
    EXPECT_NEAR(degrees_from_radians(t.accuracy[5].pitch), 0.005, 1e-12);
    EXPECT_NEAR(degrees_from_radians(t.accuracy[5].heading), 0.021, 1e-12);
  }
}

TEST(InertialExplorer, HeadersOfAnyLength) {
  const std::string text = explorer_text(60, false);
  expect_flight(read(text.substr(text.find("  GPSTime"))), 60, 3e-4, 1e-9, 1e-4);
  expect_flight(read("\n\nRemote: one\n" + text), 60, 3e-4, 1e-9, 1e-4);
}

TEST(InertialExplorer, ScaledStandardDeviationsAreDividedAgain) {
  std::string text = replaced(explorer_text(60, false), "Position: 1.0000", "Position: 2.0000");
  text = replaced(text, "Attitude: 1.0000", "Attitude: No scaling (1-sigma)");
  Trajectory t = read(text);
  EXPECT_DOUBLE_EQ(t.accuracy[0].position.x(), 0.0055);
  EXPECT_NEAR(degrees_from_radians(t.accuracy[0].heading), 0.021, 1e-12);
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.values_changed, {"position", "2 times"})));
  EXPECT_EQ(t.warnings[0].place.line, 10U);
  t = read(replaced(text, "Position: 2.0000", "Position: 95 percent"));
  // A number is a number.
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.values_changed, {"position", "95 times"})));
  t = read(replaced(text, "Position: 2.0000", "Position: twice"));
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.unit_guessed, {"twice"})));
}

TEST(InertialExplorer, StandardDeviationsOfAnglesInAnyUnit) {
  const std::string units = "(deg) (deg) (deg) (deg) (deg) (deg)";
  for (const auto& [unit, per_degree] : {std::pair("(arcmin)", 60.0), std::pair("(arcsec)", 3600.0),
                                         std::pair("(rad)", kRadiansPerDegree)}) {
    const Trajectory t = read(replaced(explorer_text(20, false), units,
                                       fmt::format("(deg) {0} (deg) {0} (deg) {0}", unit)));
    EXPECT_NEAR(degrees_from_radians(t.accuracy[5].roll) * per_degree, 0.004, 1e-12) << unit;
    EXPECT_NEAR(degrees_from_radians(t.accuracy[5].pitch) * per_degree, 0.005, 1e-12) << unit;
    EXPECT_NEAR(degrees_from_radians(t.accuracy[5].heading) * per_degree, 0.021, 1e-12) << unit;
  }
}

TEST(InertialExplorer, MistakesAreNamed) {
  const std::string text = explorer_text(20, false);
  EXPECT_THAT(fault(replaced(text, "H-Ell", "H-MSL")), NamesField("column H", 14));
  EXPECT_THAT(fault(replaced(text, "GPSTime", "UTCDate")), NamesField("column GPSTime"));
  EXPECT_THAT(fault(replaced(text, "(sec)", "(HMS)")), NamesField("column gpstime", 15));
  EXPECT_THAT(fault(replaced(text, "(none)", "")), NamesField("17"));
  EXPECT_THAT(fault(replaced(text, "0.004 ", "nan ")), NamesField("column rollsd", 17));
  EXPECT_THAT(fault(replaced(text, " 0.004 ", " -0.004 ")), NamesField("attitude", 17));
  EXPECT_THAT(fault(replaced(text, " 0.011 ", " 0.011 5 ")), NamesField("found 18"));
  EXPECT_THAT(fault(kExplorerHead), NamesField("a.txt"));
  EXPECT_THAT(fault(replaced(explorer_text(20, true), "37 ", "37 75 ")), NamesField("", 17));
}

TEST(InertialExplorer, TextBehindTheRecordsAndCutLines) {
  const std::string text = explorer_text(20, false);
  Trajectory t = read(text + "\nProcessing summary\n  3 passes\n");
  EXPECT_EQ(t.size(), 20U);
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.content_left_out)));
  t = read(text.substr(0, text.size() - 9));
  EXPECT_EQ(t.size(), 19U);
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.cut_off)));
}

const std::string kPospacHead =
    "POSPac Export Utility\n"
    " Mapping frame datum: WGS84  ; Mapping frame projection : TM;\n"
    " TIME, DISTANCE, EASTING, NORTHING, ELLIPSOID HEIGHT, LATITUDE, LONGITUDE, ELLIPSOID HEIGHT, "
    "ROLL, PITCH, HEADING, EAST VELOCITY, NORTH VELOCITY, UP VELOCITY, EAST SD, NORTH SD, HEIGHT "
    "SD, ROLL SD, PITCH SD, HEADING SD\n"
    "\n"
    "  (time in Sec, distance in Meters, position in Meters, lat, long in Degrees, orientation "
    "angles and SD in Degrees, velocity in Meter/Sec, position SD in Meters)  \n"
    "\n";

std::string pospac_text(int count) {
  return kPospacHead + rows(count, [&](const FlightRow& f) {
           const Vector3d& v = f.velocity_ned;
           return fmt::format(
               "{:.4f} 0.000 500000.0 4190000.0 {:.4f} {:.10f} {:.10f} {:.4f} {:.8f} {:.8f} {:.8f} "
               "{:.5f} {:.5f} {:.5f} 0.012 0.011 0.023 0.004 0.005 0.021",
               KnownFlight::kBegin + f.t, f.height, f.latitude, f.longitude, f.height, f.roll,
               f.pitch, f.heading, v.y(), v.x(), -v.z());
         });
}

TEST(Pospac, ColumnsAreFoundByTheirNames) {
  Trajectory t = read(pospac_text(300));
  EXPECT_EQ(t.format, "pospac");
  EXPECT_THAT(t.warnings, IsEmpty());
  expect_flight(t, 300, 3e-4, 1e-9, 1e-4);
  EXPECT_EQ(t.accuracy[5].position, Vector3d(0.011, 0.012, 0.023));
  EXPECT_NEAR(degrees_from_radians(t.accuracy[5].heading), 0.021, 1e-12);
  t = read(
      replaced(pospac_text(30), "angles and SD in Degrees", "angles in Degrees, SD in ArcMin"));
  EXPECT_NEAR(degrees_from_radians(t.accuracy[5].heading), 0.021 / 60, 1e-12);
  t = read(replaced(pospac_text(30), "angles and SD in Degrees", "angles in Degrees"));
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.unit_guessed)));
}

TEST(Pospac, MistakesAreNamed) {
  EXPECT_THAT(fault(replaced(pospac_text(20), "LONGITUDE", "ZONE")),
              NamesField("column LONGITUDE"));
  EXPECT_THAT(fault(kPospacHead), NamesField("a.txt"));
}

std::string openmms_text(int count, bool real_time = false) {
  const std::string head =
      real_time ? "\n"
                : "UTM North,Zone 13,WGS84,WGS 84,2020.5,0,0,0,0,0,0,1,2,3,0,0,0,0,0,0,0,0,0\n";
  return head + rows(count, [&](const FlightRow& f) {
           const Vector3d v = real_time ? Vector3d(0, 0, 0) : f.velocity_ned;
           return fmt::format(
               "{:.6f},{:.8f},{:.8f},{:.4f},-21.500,{:.4f},{:.4f},{:.4f},0.100,0.200,9.800,1.000,"
               "{:.2f},{:.2f},{:.2f}",
               40000 + f.t, f.latitude, f.longitude, f.height, f.roll, f.pitch, f.heading, v.y(),
               v.x(), -v.z());
         });
}

TEST(Openmms, FifteenColumnsInUtc) {
  Trajectory t = read(openmms_text(400));
  EXPECT_EQ(t.format, "openmms");
  EXPECT_EQ(t.time_scale, TimeScale::utc_second_of_day);
  EXPECT_EQ(t.time_ns[1], 40000'005'000'000);
  EXPECT_THAT(t.accuracy, IsEmpty());
  EXPECT_THAT(t.warnings, IsEmpty());
  expect_flight(t, 400, 1.5e-3, 2e-6, 0.01);  // 1e-8 degree, 1e-4 degree
  t = read(openmms_text(400, true));
  EXPECT_EQ(t.velocity_frame->name, "undecided");
  EXPECT_THAT(t.velocity, IsEmpty());
}

TEST(Openmms, MidnightMayPass) {
  const KnownFlight flight;
  std::string text = openmms_text(400);
  std::string shifted;
  std::size_t i = 0;
  for (std::size_t at = text.find('\n') + 1; at < text.size(); ++i) {
    const std::size_t comma = text.find(',', at), end = text.find('\n', at);
    const double time = 86399 + 0.005 * static_cast<double>(i);
    shifted += fmt::format("{:.6f}", time >= 86400 ? time - 86400 : time) +
               text.substr(comma, end + 1 - comma);
    at = end + 1;
  }
  const Trajectory t = read(shifted);
  EXPECT_EQ(t.week_crossings, 1);
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.clock_wrapped, {"86400 s"})));
  EXPECT_EQ(t.time_ns.back() - t.time_ns.front(), 399 * 5'000'000);
}

const std::string kCsvHead =
    "gps_second_of_week_s,latitude_deg,longitude_deg,ellipsoidal_height_m,roll_deg,pitch_deg,"
    "heading_deg,velocity_north_m_per_s,velocity_east_m_per_s,velocity_up_m_per_s";

std::string csv_text(int count, const std::string& head = kCsvHead) {
  return head + "\n" + rows(count, [&](const FlightRow& f) {
           const Vector3d& v = f.velocity_ned;
           return fmt::format(
               "{:.4f},{:.12f},{:.12f},{:.6f},{:.9f},{:.9f},{:.9f},{:.6f},{:.6f},{:.6f}",
               KnownFlight::kBegin + f.t, f.latitude, f.longitude, f.height, f.roll, f.pitch,
               f.heading, v.x(), v.y(), -v.z());
         });
}

TEST(TrajectoryCsv, ColumnsAreFoundByTheirNames) {
  const Trajectory t = read(csv_text(300), "a.csv");
  EXPECT_EQ(t.format, "trajectory-csv");
  EXPECT_EQ(t.time_scale, TimeScale::gps_second_of_week);
  expect_flight(t, 300, 1e-6, 1e-10, 1e-5);
  EXPECT_EQ(t.velocity_frame->name, "north-east-down");
}

TEST(TrajectoryCsv, NamesOfTimesSayTheirScale) {
  for (const auto& [name, scale] : {std::pair{"time_s", TimeScale::unknown},
                                    {"utc_second_of_day_s", TimeScale::utc_second_of_day},
                                    {"gps_s", TimeScale::gps},
                                    {"adjusted_gps_s", TimeScale::adjusted_gps},
                                    {"utc_unix_s", TimeScale::utc_unix}}) {
    const Trajectory t =
        read(csv_text(3, replaced(kCsvHead, "gps_second_of_week_s", name)), "a.csv");
    EXPECT_EQ(t.time_scale, scale);
    EXPECT_EQ(t.time_ns[1], 400825'005'000'000);
  }
  const Trajectory t = read(
      "utc_unix_ns,x_m,y_m,z_m,qx,qy,qz,qw\n"
      "1700000000123456789,1,2,3,0,0,0,1\n"
      "1700000000223456789,1,2,3,0,0,0,1\n",
      "a.csv");
  EXPECT_EQ(t.time_ns[0], 1'700'000'000'123'456'789);
}

TEST(TrajectoryCsv, WeeksGoAlong) {
  const Trajectory t = read(
      "gps_week,gps_second_of_week_s,latitude_deg,longitude_deg,"
      "ellipsoidal_height_m,roll_deg,pitch_deg,heading_deg\n"
      "2200,604799.5,1,2,3,0,0,0\n2201,0.5,1,2,3,0,0,0\n",
      "a.csv");
  EXPECT_EQ(t.gps_week, 2200);
  EXPECT_EQ(t.time_ns[1] - t.time_ns[0], 1'000'000'000);
  EXPECT_EQ(t.week_crossings, 0);
}

TEST(TrajectoryCsv, WrongNamesGetANearOne) {
  const auto refused = [](const std::string& what, const std::string& by) {
    return fault(replaced(csv_text(3), what, by), "a.csv");
  };
  EXPECT_THAT(refused("latitude_deg", "lattitude_deg"), NamesField("latitude_deg", 1));
  EXPECT_THAT(refused("latitude_deg", "latitude"), NamesField("latitude_deg"));
  EXPECT_THAT(refused("ellipsoidal_height_m", "ellipsoidal_height"),
              NamesField("ellipsoidal_height_m"));
  EXPECT_THAT(refused("heading_deg", "colour"), NamesField("column heading_deg"));
  EXPECT_THAT(refused("gps_second_of_week_s", "hour"), NamesField("hour"));
  EXPECT_THAT(refused("pitch_deg", "roll_rad"), NamesField("column roll_rad"));
  const Trajectory t = read(replaced(csv_text(3), "velocity_up_m_per_s", "temperature"), "a.csv");
  EXPECT_THAT(t.velocity, IsEmpty());
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.columns_unused, {"velocity_north_m_per_s"}),
                                      Warns(kWarning.columns_unused, {"column temperature"})));
}

TEST(TrajectoryCsv, ValuesThatNoPlatformHasAreRefusedAtTheirLine) {
  const std::string text = csv_text(20);
  const std::size_t row = text.find("400825.0250");
  const auto with = [&](const std::string& line) {
    return fault(text.substr(0, row) + line + text.substr(text.find('\n', row)), "a.csv");
  };
  EXPECT_THAT(with("400825.025,91,1,1,1,1,1,1,1,1"), NamesField("latitude", 7));
  EXPECT_THAT(with("400825.025,1,1,nan,1,1,1,1,1,1"), NamesField("column ellipsoidal_height_m"));
  EXPECT_THAT(with("400825.025,1,1,1e9,1,1,1,1,1,1"), NamesField("ellipsoidal height"));
  EXPECT_THAT(with("400825.025,1,1,1,1,95,1,1,1,1"), NamesField("pitch"));
  EXPECT_THAT(with("400825.025,1,1,1,1,5,1,1,1"), NamesField("found 9", 7));
  EXPECT_THAT(with("1e300,1,1,1,1,5,1,1,1,1"), NamesField("time", 7));
  EXPECT_THAT(with(""), NamesField("line 7"));
  EXPECT_THAT(with("400823.9,1,1,1,1,5,1,1,1,1"), NamesField("1.120000 s", 7));
}

TEST(TrajectoryCsv, StatedVelocitiesThatDoNotFitAreNamed) {
  std::string head = replaced(kCsvHead, "velocity_north", "velocity_east");
  head =
      replaced(head, "velocity_east_m_per_s,velocity_east", "velocity_east_m_per_s,velocity_north");
  head = replaced(head, "velocity_up", "velocity_down");
  const Trajectory t = read(csv_text(400, head), "a.csv");
  EXPECT_EQ(t.velocity.size(), 400U);
  EXPECT_THAT(t.warnings,
              ElementsAre(Warns(kWarning.velocity_frame, {"north-east-down", "east-north-up"})));
}

TEST(TrajectoryCsv, ACutLastLineIsLeftOut) {
  const std::string text = csv_text(20);
  for (std::size_t cut = 1; cut < 60; ++cut) {
    const Trajectory t = read(text.substr(0, text.size() - 1 - cut), "a.csv");
    EXPECT_EQ(t.size(), 19U) << cut;
    EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.cut_off))) << cut;
  }
  EXPECT_EQ(read(text.substr(0, text.size() - 1), "a.csv").size(), 20U);
}

void expect_same_bits(const Trajectory& a, const Trajectory& b) {
  EXPECT_EQ(a.time_ns, b.time_ns);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.velocity, b.velocity);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.attitude[i].coeffs(), b.attitude[i].coeffs());
  }
}

TEST(TrajectoryCsv, LocalPosesComeBackToTheLastBit) {
  const RandomStream random(3, 4);
  Trajectory t;
  t.frame = Frame::local;
  t.time_scale = TimeScale::utc_unix;
  for (std::uint64_t i = 0; i < 500; ++i) {
    t.time_ns.push_back(1'700'000'000'000'000'000 + static_cast<std::int64_t>(7'654'321 * i));
    const auto vector = [&](std::uint64_t first) {
      return Vector3d(random.normal(first), random.normal(first + 1), random.normal(first + 2));
    };
    t.position.emplace_back(100 * vector(20 * i));
    t.velocity.emplace_back(vector(20 * i + 3));
    t.attitude.push_back(Eigen::Quaterniond(random.normal(20 * i + 9), random.normal(20 * i + 6),
                                            random.normal(20 * i + 7), random.normal(20 * i + 8))
                             .normalized());
  }
  const std::string path = folder().file("local.csv");
  EXPECT_THAT(write_trajectory(path, t), IsEmpty());
  const Trajectory again = load_trajectory(path);
  expect_same_bits(again, t);
  EXPECT_EQ(again.time_scale, TimeScale::utc_unix);
}

TEST(TrajectoryCsv, PlacesComeBackToTheNanometre) {
  Trajectory t = trajectory_of(KnownFlight(), 300);
  t.gps_week = 2214;
  t.accuracy.resize(300);
  for (PoseAccuracy& accuracy : t.accuracy) accuracy = {{0.011, 0.012, 0.023}, 1e-4, 2e-4, 3e-4};
  const std::string path = folder().file("places.csv");
  write_trajectory(path, t);
  const Trajectory again = load_trajectory(path);
  EXPECT_EQ(again.time_ns, t.time_ns);
  EXPECT_EQ(again.gps_week, 2214);
  expect_flight(again, 300, 2e-9, 1e-14, 1e-12);
  EXPECT_EQ(again.accuracy[0].position, t.accuracy[0].position);
  EXPECT_NEAR(again.accuracy[0].heading, 3e-4, 1e-18);
}

TEST(TrajectoryCsv, OutputsAreWholeOrNotThere) {
  Trajectory t = trajectory_of(KnownFlight(), 3);
  t.time_scale = TimeScale::utc_unix;
  const std::string path = folder().file("refused.sbet");
  EXPECT_THROW(write_trajectory(path, t), InvalidArgument);
  t = trajectory_of(KnownFlight(), 3);
  t.frame = Frame::local;
  EXPECT_THROW(write_trajectory(path, t), InvalidArgument);
  EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::none);
  EXPECT_THROW(write_trajectory(folder().file("no/folder/a.csv"), t), FileError);
}

const std::string kTum =
    "# timestamp tx ty tz qx qy qz qw\n"
    "1305031102.1753 1.0 2.0 3.0 0.0 0.0 0.0 1.0\n"
    "1305031102.2753 1.1 2.0 3.0 0.0 0.0 0.7071 0.7071\n"
    "1305031102.3753 1.2 2.0 3.0 0.0 0.0 1.0 0.0\n";

TEST(Tum, BodiesAreForwardLeftUp) {
  const Trajectory t = read(kTum);
  EXPECT_EQ(t.format, "tum");
  EXPECT_EQ(t.frame, Frame::local);
  EXPECT_EQ(t.time_scale, TimeScale::utc_unix);
  ASSERT_EQ(t.size(), 3U);
  EXPECT_EQ(t.position[1], Vector3d(1.1, 2, 3));
  // The nose looks along x, then along y; down of the body is -z of the map.
  EXPECT_LT((t.attitude[0] * Vector3d(1, 0, 0) - Vector3d(1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((t.attitude[0] * Vector3d(0, 0, 1) - Vector3d(0, 0, -1)).norm(), 1e-15);
  EXPECT_LT((t.attitude[1] * Vector3d(1, 0, 0) - Vector3d(0, 1, 0)).norm(), 1e-15);
  EXPECT_NEAR(t.attitude[1].norm(), 1, 1e-15);
  EXPECT_EQ(t.velocity_frame->name, "none");
  EXPECT_EQ(read("0.1 1 2 3 0 0 0 1\n0.2 1 2 3 0 0 0 1\n").time_scale, TimeScale::unknown);
}

/// A drive along x that turns by 0.02 rad a record, upright; w first or last.
std::string tum_drive(const std::string& head, bool w_first) {
  std::string text = head;
  for (int i = 0; i < 40; ++i) {
    const double half = 0.01 * i, w = std::cos(half), z = std::sin(half);
    text += fmt::format("{:.2f} {:.2f} 0 0 ", 1.7e9 + 0.05 * i, 0.05 * i);
    text += w_first ? fmt::format("{:.9f} 0 0 {:.9f}\n", w, z)
                    : fmt::format("0 0 {:.9f} {:.9f}\n", z, w);
  }
  return text;
}

TEST(Tum, TheHeaderDecidesTheOrderOfTheQuaternion) {
  const Trajectory wanted = read(tum_drive("", false));
  EXPECT_THAT(wanted.warnings, IsEmpty());
  for (const char* head :
       {"# timestamp tx ty tz qw qx qy qz\n", "#time, x, y, z, q_w, q_x, q_y, q_z\n",
        "# made by hand\n# TIME X Y Z QW QX QY QZ\n", "timestamp x y z qw qx qy qz\n"}) {
    const Trajectory t = read(tum_drive(head, true));
    EXPECT_THAT(t.warnings, IsEmpty());
    ASSERT_EQ(t.size(), wanted.size());
    for (std::size_t i = 0; i < t.size(); ++i) {
      EXPECT_LT(t.attitude[i].angularDistance(wanted.attitude[i]), 1e-8) << head;
    }
  }
  // Without one, a body that lies on its back says so.
  const Trajectory t = read(tum_drive("", true));
  EXPECT_THAT(t.warnings, ElementsAre(Warns(kWarning.columns_guessed, {"qw qx qy qz"})));
  EXPECT_THAT(read(tum_drive("# timestamp tx ty tz qx qy qz qw\n", true)).warnings, IsEmpty());
}

TEST(Tum, DecimalCommasAndUtf16) {
  const std::string text = tum_drive("# timestamp tx ty tz qw qx qy qz\n", true);
  std::string commas = text, wide = "\xFF\xFE";
  std::ranges::replace(commas, '.', ',');
  for (const char c : commas) wide += {c, '\0'};
  const Trajectory wanted = read(text);
  for (const std::string& other : {commas, wide}) {
    const Trajectory t = read(other);
    ASSERT_EQ(t.size(), wanted.size());
    EXPECT_EQ(t.time_ns, wanted.time_ns);
    EXPECT_EQ(t.position, wanted.position);
  }
}

TEST(TrajectoryCsv, EurocIsRead) {
  const Trajectory wanted = read(tum_drive("", false));
  for (const char* names :
       {"#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
        "q_RS_z []",
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
        "q_RS_z []"}) {
    std::string text = std::string(names) + "\n";
    for (int i = 0; i < 40; ++i) {
      text += fmt::format("{},{:.2f},0,0,{:.9f},0,0,{:.9f}\n",
                          1'700'000'000'000'000'000 + 50'000'000LL * i, 0.05 * i,
                          std::cos(0.01 * i), std::sin(0.01 * i));
    }
    const Trajectory t = read(text, "data.csv");
    EXPECT_EQ(t.time_ns, wanted.time_ns);
    EXPECT_EQ(t.position, wanted.position);
    EXPECT_LT(t.attitude.back().angularDistance(wanted.attitude.back()), 1e-8);
  }
}

TEST(TrajectoryCsv, NamesWithUnitsInBrackets) {
  const std::string rows =
      "400825.000;47.0;8.5;480.0;1.9;-0.2;359.5\n400825.050;47.00000225;8.5;480.0;1.8;-0.3;359.5\n";
  const std::string good =
      "Timestamp [s];Lat [deg];Lon [deg];Ellipsoidal height [m];Roll [deg];Pitch [deg];Heading "
      "[deg]\n";
  const Trajectory t = read(good + rows, "ins.csv");
  ASSERT_EQ(t.size(), 2U);
  EXPECT_EQ(t.frame, Frame::geocentric);
  EXPECT_EQ(t.time_ns[0], 400'825'000'000'000);
  EXPECT_EQ(read(replaced(good, "Timestamp [s]", "Timestamp (s)") + rows, "ins.csv").size(), 2U);
  // What may be one thing or another is not guessed.
  const std::string yaw = replaced(good, "Heading", "Yaw"),
                    altitude = replaced(good, "Ellipsoidal height", "Alt");
  EXPECT_THAT(fault(yaw + rows, "ins.csv"), NamesField("heading_deg"));
  EXPECT_THAT(fault(altitude + rows, "ins.csv"), NamesField("ellipsoidal_height_m"));
  EXPECT_THAT(fault(replaced(yaw, "Ellipsoidal height", "Alt") + rows, "ins.csv"),
              AllOf(NamesField("heading_deg"), NamesField("ellipsoidal_height_m")));
}

TEST(Kitti, IsRefusedBecauseItHasNoTimes) {
  const std::string text = "1 0 0 0.0 0 1 0 0 0 0 1 0\n0 -1 0 0.05 1 0 0 0 0 0 1 0\n";
  EXPECT_THAT(fault(text), NamesField("KITTI"));
  EXPECT_THAT(fault(replaced(text, "0 -1 0 0.05", "0 -2 0 0.05")),
              AllOf(NamesField("a.txt"), Not(NamesField("KITTI"))));
}

TEST(InertialExplorer, TheDateDecidesBetweenSecondsOfDayAndOfWeek) {
  // 2023-11-16 is a Thursday, day 4 of GPS week 2288.
  const auto text = [](const std::string& unit, const std::vector<std::string>& days,
                       const std::vector<double>& times) {
    std::string all =
        "Program: Inertial Explorer Version 8.90\n\n"
        "   Date   GPSTime   Latitude  Longitude  H-Ell   Roll  Pitch  Heading\n  " +
        unit + "     (sec)      (deg)      (deg)    (m)  (deg)  (deg)    (deg)\n";
    for (std::size_t i = 0; i < days.size(); ++i) {
      all += fmt::format("  {}  {:.2f}  47.0  8.5  480.0  1.9  -0.2  0.5\n", days[i], times[i]);
    }
    return all;
  };
  struct Case {
    std::string unit;
    std::vector<std::string> days;
    std::vector<double> times, wanted;
  };
  for (const auto& [unit, days, times, wanted] : {
           Case{"(YMD)", {"2023/11/16", "2023/11/16"}, {55225.0, 55225.05}, {400825.0, 400825.05}},
           Case{
               "(YMD)", {"2023-11-16", "2023-11-16"}, {400825.0, 400825.05}, {400825.0, 400825.05}},
           Case{"(MDY)", {"11/16/2023", "11/16/2023"}, {55225.0, 55225.05}, {400825.0, 400825.05}},
           Case{"     ", {"2023/11/16", "2023/11/16"}, {55225.0, 55225.05}, {400825.0, 400825.05}},
           Case{"(DMY)", {"16.11.2023", "16.11.2023"}, {55225.0, 55225.05}, {400825.0, 400825.05}},
           // Over midnight, and over the end of the week.
           Case{"(YMD)", {"2023/11/16", "2023/11/17"}, {86399.95, 0.0}, {431999.95, 432000.0}},
           Case{"(YMD)", {"2023/11/18", "2023/11/19"}, {86399.95, 0.0}, {604799.95, 604800.0}},
           Case{"(YMD)", {"2023/11/18", "2023/11/19"}, {604799.95, 0.0}, {604799.95, 604800.0}},
           // On a Sunday both are the same, until it ends.
           Case{"(YMD)", {"2023/11/12", "2023/11/12"}, {100.0, 100.05}, {100.0, 100.05}},
           Case{"(YMD)", {"2023/11/12", "2023/11/13"}, {86399.95, 0.0}, {86399.95, 86400.0}},
           Case{"(YMD)", {"2023/11/12", "2023/11/13"}, {86399.95, 86400.0}, {86399.95, 86400.0}},
       }) {
    SCOPED_TRACE(days[1] + " " + fmt::to_string(times[1]));
    const Trajectory t = read(text(unit, days, times));
    ASSERT_EQ(t.size(), 2U);
    EXPECT_EQ(t.time_scale, TimeScale::gps_second_of_week);
    EXPECT_EQ(t.gps_week, 2288);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(1e-9 * static_cast<double>(t.time_ns[i]), wanted[i], 1e-6);
    }
  }
  EXPECT_THAT(fault(text("(YMD)", {"2023/11/16"}, {200'000.0})), NamesField("200000"));
  EXPECT_THAT(fault(text("(YMD)", {"2023/13/16"}, {55225.0})), NamesField("", 5));
  EXPECT_THAT(fault(text("(MDY)", {"2023/11/16"}, {55225.0})), NamesField("", 5));
  EXPECT_THAT(fault(text("(day)", {"2023/11/16"}, {55225.0})), NamesField("(YMD)"));
}

TEST(InertialExplorer, ColumnsWithoutAUnit) {
  const auto text = [](const std::string& units, const std::string& names) {
    return "Program: Inertial Explorer Version 8.90\n\n" + names + "\n" + units +
           "\n  400825.000   47.0        8.5   480.0     1    1.9   -0.2      0.5     3\n";
  };
  const std::string names =
      "     GPSTime   Latitude  Longitude  H-Ell  Q  Roll  Pitch  Heading  NS";
  for (const std::string units :
       {"       (sec)      (deg)      (deg)    (m)     (deg) (deg)   (deg)    ",
        "       (sec)      (deg)      (deg)    (m)     (deg)  (deg)    (deg)"}) {
    const Trajectory t = read(text(units, names));
    ASSERT_EQ(t.size(), 1U);
    EXPECT_EQ(t.time_ns[0], 400'825'000'000'000);
    EXPECT_NEAR(
        degrees_from_radians(roll_pitch_heading(t.frame, t.position[0], t.attitude[0]).heading),
        0.5, 1e-9);
  }
  EXPECT_THAT(
      fault(text("       (sec)      (deg)               (m)     (deg)  (deg)    (deg)", names)),
      NamesField("longitude"));
}

TEST(Tum, WhatIsNoRotationIsRefused) {
  EXPECT_THAT(fault(kTum + "1305031102.4753 1.2 2.0 3.0 0.0 0.0 1.0 1.0\n"),
              NamesField("1.41421", 5));
  EXPECT_THAT(fault(kTum + "1305031102.4753 1e9 2.0 3.0 0.0 0.0 1.0 0.0\n"),
              NamesField("position", 5));
}

TEST(Rtklib, IsRefusedBecauseItHasNoAttitude) {
  const std::string text =
      "% program   : RTKPOST ver.2.4.2\n"
      "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns\n"
      "2022/02/07 00:00:00.000   40.063710326  -105.222420012  1565.0000   1  12\n";
  EXPECT_THAT(fault(text, "a.pos"), AllOf(NamesField("a.pos"), NamesField("RTKLIB")));
}

TEST(TextFormats, EveryBeginningOfAFileIsReadOrRefused) {
  for (const std::string& text :
       {explorer_text(3, true), pospac_text(3), openmms_text(3), csv_text(3), kTum}) {
    const std::size_t whole = load_trajectory([&] {
                                const std::string path = folder().file("whole.txt");
                                write_bytes(path, text);
                                return path;
                              }())
                                  .size();
    for (std::size_t size = 0; size < text.size(); ++size) {
      const std::string path = folder().file("beginning.txt");
      write_bytes(path, text.substr(0, size));
      try {
        const Trajectory t = load_trajectory(path);
        EXPECT_LE(t.size(), whole);
        require_trajectory(t);
      } catch (const FileError&) {
        continue;
      }
    }
  }
}

TEST(TextFormats, OtherTextsAreNoTrajectory) {
  for (const std::string& text :
       {std::string("hello\n"), std::string("a,b,c\n1,2,3\n"), std::string("1 2 3\n"),
        std::string("time_s,x,y,z,intensity\n0,1,2,3,4\n"), std::string("\n\n\n"),
        std::string("1,2,3,4,5,6,7,8\n")}) {
    const std::string path = folder().file("other.csv");
    write_bytes(path, text);
    EXPECT_EQ(trajectory_file_kind(path), TrajectoryFileKind::none) << text;
    EXPECT_THAT(fault(text, "other.csv"), NamesField("other.csv")) << text;
  }
  EXPECT_EQ(trajectory_file_kind(folder().file("missing")), TrajectoryFileKind::none);
  EXPECT_THROW(load_trajectory(folder().file("missing")), FileError);
  EXPECT_THROW(load_trajectory(folder().path().string()), FileError);
}

TEST(TextFormats, UnknownEndingsListTheKnownOnes) {
  const Trajectory t = trajectory_of(KnownFlight(), 3);
  EXPECT_THAT(refusal([&] { write_trajectory(folder().file("a.xyz"), t); }),
              AllOf(NamesField("a.xyz"), NamesField(".csv"), NamesField(".sbet")));
  EXPECT_THROW(write_trajectory(folder().file("a.csv"), t, "tum"), InvalidArgument);
  EXPECT_THROW(write_trajectory(folder().file("a.csv"), {}), InvalidArgument);
  EXPECT_EQ(writable_trajectories().size(), 2U);
}

}  // namespace risley::trajectories::text_formats_test
