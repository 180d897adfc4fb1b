// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/make_cloud.hpp"

#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"
#include "warning_codes.hpp"

namespace risley::cloud::make_cloud_test {

using ::testing::HasSubstr;

/// A simulated recording before a wall at 10 m that goes through a reader, changed on its way.
class SimulatedReader final : public recordings::Reader {
 public:
  using Change = std::function<void(recordings::Observations&)>;

  explicit SimulatedReader(const simulation::SimulationSettings& settings, Change change = {})
      : scanner_(settings), change_(std::move(change)) {
    header_ = scanner_.header();
  }
  recordings::RecordingHeader& header() { return header_; }
  void fail_after(std::size_t chunks) { left_ = chunks; }

  bool read(recordings::Chunk& chunk, std::size_t) override {
    if (left_-- == 0) throw FileError("simulated", {1234, {}}, "damaged");
    recordings::TruthColumns truth;
    if (!scanner_.read(chunk, truth)) return false;
    if (change_) change_(chunk.observations);
    return true;
  }
  double fraction_read() const override { return 0.5; }

 private:
  simulation::Scanner scanner_;
  Change change_;
  std::size_t left_ = static_cast<std::size_t>(-1);
};

simulation::SimulationSettings wall_settings(double duration, double rate) {
  simulation::SimulationSettings settings;
  settings.truth = sensors::load_sensor("mid-40-table3");
  settings.duration = duration;
  settings.rate = rate;
  settings.angle_noise = radians_from_degrees(0.004);
  settings.range_noise = 0.02;
  settings.scene = scenes::Scene{};
  scenes::ScenePlane wall;
  wall.name = "wall";
  wall.plane = {{1, 0, 0}, 10.0};
  settings.scene->planes.push_back(wall);
  return settings;
}

class MakeCloud : public ::testing::Test {
 protected:
  std::string path(const char* name = "cloud.csv") const { return folder_.file(name); }
  std::size_t files() const { return folder_.names().size(); }

  /// Columns of the CSV by name.
  std::map<std::string, std::vector<double>> columns() const {
    std::ifstream file(path());
    std::string line, word;
    std::getline(file, line);
    std::vector<std::string> names;
    for (std::istringstream words(line); std::getline(words, word, ',');) names.push_back(word);
    std::map<std::string, std::vector<double>> result;
    while (std::getline(file, line)) {
      std::istringstream words(line);
      for (const std::string& name : names) {
        std::getline(words, word, ',');
        result[name].push_back(std::stod(word));
      }
    }
    return result;
  }

  io::TestFolder folder_;
  sensors::Sensor type_ = sensors::load_sensor("mid-40-table3");
};

TEST_F(MakeCloud, ManyPiecesGiveEveryPointItsOwnPlace) {
  // More than the beginning and two further pieces.
  SimulatedReader reader(wall_settings(17.0, 100000.0));
  CloudOptions options;
  options.rate = 1000.0;
  const CloudSummary summary = make_cloud(reader, type_, path("cloud.las"), options);
  EXPECT_EQ(summary.observations, 1'700'000U);
  EXPECT_EQ(summary.points + summary.outliers, 1'700'000U);
  EXPECT_LT(summary.outliers, 200U);
  EXPECT_NEAR(degrees_from_radians(summary.azimuth_residual_rms),
              std::hypot(0.004, 0.01 / std::sqrt(12.0)), 1e-4);
  EXPECT_EQ(summary.repointing_rms, 0.0);
  EXPECT_EQ(files(), 1U);
}

TEST_F(MakeCloud, TwoSensorsAreRefusedByName) {
  SimulatedReader reader(wall_settings(1.0, 2000.0));
  recordings::Device other = reader.header().devices.front();
  other.serial = "3GGDJ9600100401";
  reader.header().devices.push_back(other);
  EXPECT_THAT(refusal([&] { make_cloud(reader, type_, path(), {}); }),
              HasSubstr("3GGDJ9600100401"));
  EXPECT_EQ(files(), 0U);
}

TEST_F(MakeCloud, KeepsTheSoundPartOfADamagedRecording) {
  SimulatedReader whole(wall_settings(4.0, 100000.0));
  const CloudSummary all = make_cloud(whole, type_, path(), {});
  SimulatedReader damaged(wall_settings(4.0, 100000.0));
  damaged.fail_after(2);
  const CloudSummary part = make_cloud(damaged, type_, path(), {});
  ASSERT_TRUE(part.damage);
  EXPECT_EQ(part.damage->place().byte_offset, 1234U);
  EXPECT_GT(part.points, 10000U);
  EXPECT_LT(part.points, all.points);
  SimulatedReader nothing(wall_settings(1.0, 2000.0));
  nothing.fail_after(0);
  EXPECT_THROW(make_cloud(nothing, type_, path("none.csv"), {}), FileError);
  EXPECT_EQ(files(), 1U);
}

TEST_F(MakeCloud, CountsWhatHasNoPoint) {
  std::size_t row = 0;
  SimulatedReader reader(wall_settings(2.0, 5000.0), [&row](recordings::Observations& o) {
    for (std::size_t i = 0; i < o.size(); ++i, ++row) {
      if (row % 10 == 3) {
        o.range[i] = 0.0;
        o.valid[i] = 0;
      }
      if (row % 100 == 7) o.azimuth[i] += 0.05;
    }
  });
  const CloudSummary summary = make_cloud(reader, type_, path(), {});
  EXPECT_EQ(summary.observations, 10000U);
  EXPECT_EQ(summary.no_return, 1000U);
  EXPECT_NEAR(static_cast<double>(summary.outliers), 100.0, 5.0);
  EXPECT_EQ(summary.points, 10000U - 1000U - summary.outliers);
}

// The first of two returns may have none itself: LAS asks for one number in all points of a pulse.
TEST_F(MakeCloud, AllReturnsOfAShotHaveOneNumberOfReturns) {
  SimulatedReader reader(wall_settings(0.5, 5000.0), [](recordings::Observations& o) {
    recordings::Observations tripled;
    for (std::size_t i = 0; i < o.size(); ++i) {
      recordings::Observations row = o;
      row.drop_front(i);
      row.resize(1);
      for (const int number : {1, 2, 3}) {
        row.return_number[0] = static_cast<std::uint8_t>(number);
        row.range[0] = number == 1 ? 0.0 : o.range[i] + 0.5 * number;
        row.valid[0] = number == 1 ? 0 : 1;
        tripled.append(row);
      }
    }
    o = tripled;
  });
  make_cloud(reader, type_, path(), {});
  auto found = columns();
  ASSERT_GT(found["Time_s"].size(), 1000U);
  for (const double number : found["NumberOfReturns"]) EXPECT_EQ(number, 3.0);
}

TEST_F(MakeCloud, ReturnsOfOneShotAreCounted) {
  // Every third shot gets a second return behind the first.
  SimulatedReader reader(wall_settings(2.0, 5000.0), [](recordings::Observations& o) {
    recordings::Observations doubled;
    for (std::size_t i = 0; i < o.size(); ++i) {
      recordings::Observations row = o;
      row.drop_front(i);
      row.resize(1);
      doubled.append(row);
      if (o.time_ns[i] / 200000 % 3 != 0) continue;
      row.return_number[0] = 2;
      row.range[0] += 1.0;
      doubled.append(row);
    }
    o = doubled;
  });
  make_cloud(reader, type_, path(), {});
  auto found = columns();
  std::size_t seconds = 0;
  for (std::size_t i = 0; i < found["Time_s"].size(); ++i) {
    const bool has_two = std::llround(1e9 * found["Time_s"][i]) / 200000 % 3 == 0;
    EXPECT_EQ(found["NumberOfReturns"][i], has_two ? 2.0 : 1.0);
    if (found["ReturnNumber"][i] != 2.0) continue;
    ++seconds;
    ASSERT_GT(i, 0U);
    EXPECT_NEAR(found["LidarRange_m"][i] - found["LidarRange_m"][i - 1], 1.0, 1e-4);
    // The same beam.
    EXPECT_EQ(found["PrismAngle1_deg"][i], found["PrismAngle1_deg"][i - 1]);
  }
  EXPECT_GT(seconds, 3000U);
}

TEST_F(MakeCloud, TurnsAMirroredRecording) {
  SimulatedReader straight(wall_settings(2.0, 5000.0));
  make_cloud(straight, type_, path(), {});
  const auto expected = columns();
  SimulatedReader mirrored(wall_settings(2.0, 5000.0), [](recordings::Observations& o) {
    for (double& zenith : o.zenith) zenith = kPi - zenith;
  });
  const CloudSummary summary = make_cloud(mirrored, type_, path(), {});
  EXPECT_TRUE(summary.mirrored);
  auto found = columns();
  ASSERT_EQ(found["Z_m"].size(), expected.at("Z_m").size());
  for (std::size_t i = 0; i < found["Z_m"].size(); ++i) {
    EXPECT_NEAR(found["Z_m"][i], expected.at("Z_m")[i], 1e-3);
  }
}

TEST_F(MakeCloud, ReportedDirectionsFromTheOriginAreTheRecordsThemselves) {
  SimulatedReader reader(wall_settings(0.02, 5000.0));
  SimulatedReader same(wall_settings(0.02, 5000.0));
  recordings::Chunk chunk;
  ASSERT_TRUE(same.read(chunk, 0));
  const recordings::Observations& o = chunk.observations;
  CloudOptions options;
  options.pointing.reported_directions = true;
  options.pointing.beam_origin = false;
  const CloudSummary summary = make_cloud(reader, type_, path(), options);
  EXPECT_EQ(summary.points, o.size());
  auto found = columns();
  for (std::size_t i = 0; i < o.size(); ++i) {
    EXPECT_NEAR(found["X_m"][i], o.range[i] * std::sin(o.zenith[i]) * std::cos(o.azimuth[i]),
                1e-12);
    EXPECT_NEAR(found["Y_m"][i], o.range[i] * std::sin(o.zenith[i]) * std::sin(o.azimuth[i]),
                1e-12);
    EXPECT_NEAR(found["Z_m"][i], o.range[i] * std::cos(o.zenith[i]), 1e-12);
    // Along the beam the range's noise, across it angles and footprint.
    const double along =
        found["VarianceX_m2"][i] + found["VarianceY_m2"][i] + found["VarianceZ_m2"][i];
    const auto square = [](double x) { return x * x; };
    const double angles = square(type_.angle_noise) + square(radians_from_degrees(0.01)) / 12.0;
    const double footprint = square(kDivergenceSigma * type_.beam_divergence_horizontal) +
                             square(kDivergenceSigma * type_.beam_divergence_vertical);
    const double expected =
        square(type_.range_noise) + square(type_.range_resolution) / 12.0 +
        square(o.range[i]) * (angles * (1.0 + square(std::sin(o.zenith[i]))) + footprint);
    EXPECT_NEAR(along / expected, 1.0, 1e-6);
  }
}

/// Mean and rms distance of the points of the CSV from a wall, along its normal, m.
std::pair<double, double> distance_from(const Plane& wall,
                                        std::map<std::string, std::vector<double>> points) {
  double sum = 0, squares = 0;
  const std::size_t n = points["X_m"].size();
  for (std::size_t i = 0; i < n; ++i) {
    const double distance =
        signed_distance(wall, {points["X_m"][i], points["Y_m"][i], points["Z_m"][i]});
    sum += distance;
    squares += distance * distance;
  }
  const auto count = static_cast<double>(n);
  return {sum / count, std::sqrt(squares / count)};
}

// A wall that stands at an angle, light on one side and dark on the other, scanned with range
// errors that a calibration found.
TEST_F(MakeCloud, PointsLieOnTheWallWhenRangesHaveErrors) {
  auto settings = wall_settings(3.0, 20000.0);
  settings.range_noise = 0.001;
  settings.truth.range_offset = 0.02;
  settings.truth.range_errors = {0.02, 0.3, 0.01, {0.004}};
  scenes::ScenePlane& wall = settings.scene->planes.front();
  const double turned = radians_from_degrees(50);
  wall.plane = {{std::cos(turned), std::sin(turned), 0}, 2.0};
  wall.horizontal_axis = {-std::sin(turned), std::cos(turned), 0};
  wall.vertical_axis = {0, 0, 1};
  scenes::Patch dark;
  dark.center = {-1.5, 0.4};
  dark.size = {1.5, 1.0};
  dark.reflectivity = 0.05;
  wall.patches.push_back(dark);
  sensors::Sensor calibrated = type_;
  calibrated.range_offset = settings.truth.range_offset;
  const auto found = [&](const simulation::SimulationSettings& of) {
    SimulatedReader reader(of);
    make_cloud(reader, calibrated, path(), {});
    return distance_from(wall.plane, columns());
  };
  const auto [off, scattered] = found(settings);
  EXPECT_GT(std::abs(off), 0.005);
  calibrated.range_errors = settings.truth.range_errors;
  const auto [mean, rms] = found(settings);
  // The angle of incidence, known to half a degree, leaves some hundredths of the depth.
  EXPECT_LT(std::abs(mean), 0.0002);
  EXPECT_LT(rms, 0.0012);
  EXPECT_GT(scattered, 2 * rms);
}

TEST_F(MakeCloud, SaysThatRangesWithoutIntensitiesAreNotCorrectedByThem) {
  type_.range_errors.per_decade = 0.01;
  const auto made = [&](bool known) {
    auto settings = wall_settings(1.0, 2000.0);
    SimulatedReader reader(settings);
    reader.header().has_intensity = known;
    return codes_of(make_cloud(reader, type_, path(), {}).warnings);
  };
  EXPECT_THAT(made(true), ::testing::Not(::testing::Contains("ranges_uncorrected")));
  const double corrected = columns()["LidarRange_m"].front();
  EXPECT_THAT(made(false), ::testing::Contains("ranges_uncorrected"));
  EXPECT_GT(std::abs(columns()["LidarRange_m"].front() - corrected), 1e-4);
}

TEST_F(MakeCloud, SaysThatExtrinsicsAreNotApplied) {
  SimulatedReader reader(wall_settings(1.0, 2000.0));
  reader.header().devices.front().extrinsic_enabled = true;
  const CloudSummary summary = make_cloud(reader, type_, path(), {});
  EXPECT_THAT(codes_of(summary.warnings), ::testing::Contains("pose_unused"));
}

TEST_F(MakeCloud, ATurnedFrameIsRefusedByNameAndLeavesNothing) {
  const double yaw = radians_from_degrees(40.0);
  SimulatedReader reader(wall_settings(1.0, 5000.0), [yaw](recordings::Observations& rows) {
    for (double& azimuth : rows.azimuth) azimuth += yaw;
  });
  EXPECT_THAT(refusal<EstimationError>([&] { make_cloud(reader, type_, path(), {}); }),
              AllOf(::testing::ContainsRegex("(39\\.9|40\\.0)[0-9]* deg in yaw"),
                    ::testing::ContainsRegex("-?0\\.0[0-9]* deg in pitch")));
  EXPECT_EQ(files(), 0U);
}

TEST_F(MakeCloud, ACoordinateThatLasCannotHoldLeavesNothing) {
  SimulatedReader reader(wall_settings(1.0, 2000.0));
  CloudOptions options;
  options.writer.las_scale = 1e-9;
  EXPECT_THROW(make_cloud(reader, type_, path("cloud.las"), options), InvalidArgument);
  EXPECT_EQ(files(), 0U);
}

}  // namespace risley::cloud::make_cloud_test
