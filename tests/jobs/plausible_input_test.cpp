// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Inputs that no sensor in its own frame can have made, and files that are no recording at all:
// what is wrong with them comes before any sensor is recognised.
#include <cmath>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/jobs/inspect_recording.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/truth_file.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"
#include "source_tree.hpp"

namespace risley::jobs::plausible_input_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string estimate_problem(const std::string& path, const std::string& sensor = "") {
  try {
    EstimateRecordingOptions options;
    options.recording = path;
    options.sensor = sensor;
    estimate_recording(options);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(PlausibleInput, MapCoordinatesAreOfNoSensor) {
  const io::TestFolder folder;
  std::string text = "X,Y,Z,GpsTime\n";
  for (int i = 0; i < 4000; ++i) {
    text += fmt::format("{:.3f},{:.3f},{:.3f},{:.6f}\n", 447007.0 + 4 * std::sin(0.0011 * i),
                        5538001.0 + 4 * std::cos(0.0017 * i), 314.0 + std::sin(0.003 * i),
                        400825.0 + 1e-5 * i);
  }
  io::write_text_file(folder.file("utm.csv"), text);
  const InspectedRecording found = inspect_recording({folder.file("utm.csv"), {}, {}, {}});
  ASSERT_TRUE(found.choice);
  EXPECT_EQ(sensor_name(*found.choice), "unknown");
  EXPECT_THAT(found.choice->words, NamesField("sensor frame"));
  EXPECT_THAT(found.choice->words, Not(HasSubstr("leaves")));
  EXPECT_EQ(found.warnings.size(), 1U);
  for (const char* sensor : {"", "mid-40", "avia"}) {
    EXPECT_THAT(estimate_problem(folder.file("utm.csv"), sensor),
                AllOf(NamesField("utm.csv"), NamesField("sensor frame")));
  }
}

/// Shots all around, between two elevations, of emitters that are not named.
std::string all_around(double low_deg, double high_deg) {
  std::string text = "time_s,azimuth_deg,elevation_deg,range_m\n";
  for (int i = 0; i < 20'000; ++i) {
    text += fmt::format("{:.6f},{:.3f},{:.3f},5.000\n", 5e-6 * i,
                        std::fmod(0.0187 * i * 4.1, 360.0) - 180.0,
                        low_deg + (high_deg - low_deg) * (0.5 + 0.5 * std::sin(0.0063 * i)));
  }
  return text;
}

TEST(PlausibleInput, FieldsOfViewBeyondAllPresetsAreNamed) {
  const io::TestFolder folder;
  struct Case {
    double low_deg, high_deg;
    const char* words;
  };
  for (const auto& [low_deg, high_deg, words] :
       {Case{-7, 52, "Mid-360"}, Case{-12.5, 12.5, "several sensors"}}) {
    const std::string path = folder.file("around.csv");
    io::write_text_file(path, all_around(low_deg, high_deg));
    const InspectedRecording found = inspect_recording({path, {}, {}, {}});
    ASSERT_TRUE(found.choice);
    EXPECT_EQ(sensor_name(*found.choice), "unknown");
    EXPECT_THAT(found.choice->words, AllOf(HasSubstr("360 x"), HasSubstr(words)));
    EXPECT_THAT(estimate_problem(path), AllOf(HasSubstr(words), Not(HasSubstr("allowed"))));
  }
}

TEST(PlausibleInput, TrajectoriesAreNamedAsSuch) {
  const io::TestFolder folder;
  std::string tum,
      ins = "Timestamp [s];Lat [deg];Lon [deg];Alt [m];Roll [deg];Pitch [deg];Yaw [deg]\n";
  for (int i = 0; i < 20; ++i) {
    tum += fmt::format("{:.2f} {:.2f} 0 0 0 0 0 1\n", 1.7e9 + 0.05 * i, 0.05 * i);
    ins += fmt::format("{:.3f};47.0;8.5;480.0;1.9;-0.2;359.5\n", 400825 + 0.05 * i);
  }
  io::write_text_file(folder.file("tum.txt"), tum);
  io::write_text_file(folder.file("ins.csv"), ins);
  io::write_text_file(folder.file("kitti.txt"), "1 0 0 0.0 0 1 0 0 0 0 1 0\n");
  for (const char* name : {"tum.txt", "ins.csv", "kitti.txt"}) {
    EXPECT_THAT(estimate_problem(folder.file(name)),
                AllOf(NamesField(name), NamesField("trajectory")));
  }
}

/// What a Mid-40 sees of a hall, as a table in a unit.
class HallTable : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    simulation::SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40-table3");
    settings.scene = scenes::load_scene(in_source_tree("data/hall.yaml"));
    settings.duration = 0.2;
    settings.rate = 50000.0;
    settings.seed = 7;
    const io::TestFolder folder;
    simulation::simulate_to_file(settings, folder.file("hall.nc"), {});
    hall_ = recordings::load_recording(folder.file("hall.nc"));
  }

  static std::string table(const std::string& names, double per_m, int decimals,
                           const std::string& line = "") {
    std::string text = "time_s," + names + (line.empty() ? "" : ",line") + "\n";
    const recordings::Observations& rows = hall_.data.observations;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double flat = per_m * rows.range[i] * std::sin(rows.zenith[i]);
      text += fmt::format("{:.9f},{:.{}f},{:.{}f},{:.{}f}", 1e-9 * double(rows.time_ns[i]),
                          rows.valid[i] ? flat * std::cos(rows.azimuth[i]) : 0.0, decimals,
                          rows.valid[i] ? flat * std::sin(rows.azimuth[i]) : 0.0, decimals,
                          rows.valid[i] ? per_m * rows.range[i] * std::cos(rows.zenith[i]) : 0.0,
                          decimals);
      text += line.empty() ? "\n" : fmt::format(",{}\n", i % 4);
    }
    return text;
  }

  std::string calibration_problem(const std::string& text) {
    io::write_text_file(folder_.file("hall.csv"), text);
    try {
      CalibrateRecordingsOptions options;
      options.recordings = {folder_.file("hall.csv")};
      const calibration::Calibration found = calibrate_recordings(options).calibration;
      EXPECT_EQ(found.verdict.code, calibration::CalibrationCode::undecided);
      return found.reason;
    } catch (const EstimationError& error) {
      return error.what();
    }
  }

  io::TestFolder folder_;
  static inline recordings::Recording hall_;
};

TEST_F(HallTable, CalibrationDoesNotDecideOnRangesOfAnUnknownUnit) {
  // Centimetres that can be taken for millimetres scatter too much.
  EXPECT_THAT(calibration_problem(table("x,y,z", 100, 0)), NamesField("unit"));
  EXPECT_THAT(calibration_problem(table("x,y,z", 1000, 3)), NamesField("millimetres"));
  // Within what others reach, and beyond what this one does.
  EXPECT_THAT(calibration_problem(table("x,y,z", 100, 3)), NamesField("centimetres"));
}

TEST_F(HallTable, MoreLinesThanEmittersAreNoInternalLimit) {
  io::write_text_file(folder_.file("lines.csv"), table("x_m,y_m,z_m", 1, 3, "line"));
  EXPECT_THAT(estimate_problem(folder_.file("lines.csv"), "mid-40"),
              AllOf(NamesField("4 lines"), NamesField("1 emitter"), Not(HasSubstr("allowed"))));
}

}  // namespace risley::jobs::plausible_input_test
