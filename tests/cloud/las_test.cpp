// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/core/error.hpp"

#include "cloud/cloud_samples.hpp"
#include "cloud/file_size_limit.hpp"
#include "cloud/las_checker.hpp"
#include "refusal.hpp"

namespace risley::cloud::las_test {

using recordings::TimeReference;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kPi = 3.14159265358979323846;

Points random_points(const CloudHeader& header, std::size_t rows, unsigned seed = 1) {
  std::mt19937_64 generator(seed);
  const auto fill = [&generator](std::vector<double>& column, double low, double high) {
    std::uniform_real_distribution<double> values(low, high);
    for (double& value : column) value = values(generator);
  };
  Points points;
  header.resize(points, rows);
  for (auto* column : {&points.x, &points.y, &points.z}) fill(*column, -260.0, 260.0);
  for (auto& column : points.covariance) fill(column, 0.0, 1e-4);
  for (auto& column : points.rotation_angle) fill(column, 0.0, 2 * kPi);
  fill(points.range, 0.1, 260.0);
  fill(points.incidence, 0.0, kPi / 2);
  fill(points.azimuth_residual, -1e-3, 1e-3);
  fill(points.zenith_residual, -1e-3, 1e-3);
  for (auto& factor : points.loading) {
    for (auto& column : factor) fill(column, -0.01, 0.01);
  }
  for (std::size_t i = 0; i < rows; ++i) {
    points.time_ns[i] = 123'456'789 + static_cast<std::int64_t>(i) * 10'000;
    points.intensity[i] = static_cast<std::uint8_t>(generator());
    points.number_of_returns[i] = static_cast<std::uint8_t>(1 + generator() % 3);
    points.return_number[i] =
        static_cast<std::uint8_t>(1 + generator() % points.number_of_returns[i]);
    points.tag[i] = static_cast<std::uint8_t>(generator());
    points.beam[i] = static_cast<std::uint8_t>(generator() % 6);
    if (i % 7 == 3) points.incidence[i] = std::numeric_limits<double>::quiet_NaN();
  }
  return points;
}

class LasTest : public ::testing::Test {
 protected:
  LasTest() {
    header_.sensor = "Livox Mid-40";
    header_.serial = "0TFDG3B006H2Z11";
    header_.provenance = {{"command", "risley cloud"}, {"version", "0.1.0"}};
  }

  std::string path() const { return folder_.file("cloud.las"); }

  /// Writes all points in pieces of these lengths, again and again.
  void write(const Points& points, std::vector<std::size_t> pieces = {100'000}) {
    const auto writer = create_cloud(path(), header_, options_);
    std::size_t first = 0;
    for (std::size_t k = 0; first < points.size(); ++k) {
      const std::size_t rows = std::min(pieces[k % pieces.size()], points.size() - first);
      writer->write(rows == points.size() ? points : slice(points, first, rows));
      first += rows;
    }
    writer->close();
  }

  std::string bytes() const {
    std::ifstream stream(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  /// The message of the exception that writing ends with; the writer is gone after it.
  template <class Exception>
  std::string refusal(const Points& points, std::vector<std::size_t> pieces = {100'000}) {
    try {
      write(points, std::move(pieces));
    } catch (const Exception& error) {
      EXPECT_TRUE(folder_.names().empty());
      return error.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
  }

  void expect_equal(const las_checker::File& file, const Points& points) const {
    ASSERT_EQ(file.points.size(), points.size());
    TestTable floats = expected_table(header_, points);
    std::erase_if(floats, [](const TestColumn& one) { return one.type != 'f'; });
    std::vector<std::string> names, expected_names;
    for (const auto& field : file.extra) names.push_back(field.name);
    for (const auto& field : floats) expected_names.push_back(field.name);
    expected_names.insert(expected_names.end(), {"Tag", "Beam"});
    ASSERT_EQ(names, expected_names);

    const double scale = options_.las_scale;
    EXPECT_THAT(file.scale, ElementsAre(scale, scale, scale));
    EXPECT_THAT(file.offset, ElementsAre(0, 0, 0));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const las_checker::Point& point = file.points[i];
      const std::array<double, 3> xyz{points.x[i], points.y[i], points.z[i]};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(point.xyz[axis], std::llrint(xyz[axis] / scale)) << i;
      }
      ASSERT_EQ(point.intensity, points.intensity[i] * 256) << i;
      ASSERT_EQ(point.return_number, points.return_number[i]) << i;
      ASSERT_EQ(point.number_of_returns, points.number_of_returns[i]) << i;
      ASSERT_EQ(point.point_source, 1);
      ASSERT_EQ(point.classification | point.user_data | point.scan_angle | point.scanner_channel,
                0);
      if (!file.gps_time) {
        ASSERT_DOUBLE_EQ(point.gps_time, static_cast<double>(points.time_ns[i]) * 1e-9) << i;
      }
      for (std::size_t k = 0; k < floats.size(); ++k) {
        const float stored = file.real(i, file.extra[k]);
        const float expected = static_cast<float>(floats[k].values[i]);
        if (std::isnan(expected)) {
          ASSERT_TRUE(std::isnan(stored)) << floats[k].name << i;
        } else {
          ASSERT_EQ(stored, expected) << floats[k].name << i;
        }
      }
      ASSERT_EQ(file.byte(i, file.field("Tag")), points.tag[i]) << i;
      ASSERT_EQ(file.byte(i, file.field("Beam")), points.beam[i]) << i;
    }
  }

  TestFolder folder_;
  CloudHeader header_;
  CloudWriterOptions options_;
};

/// Whether there are covariances and rotation angles, prisms, common factors.
struct Variant {
  bool covariance, angles;
  int prisms;
  std::size_t factors;
};

class LasVariants : public LasTest, public ::testing::WithParamInterface<Variant> {
 protected:
  LasVariants() {
    header_.has_covariance = GetParam().covariance;
    header_.has_rotation_angles = GetParam().angles;
    header_.prisms = GetParam().prisms;
    header_.factors.assign(GetParam().factors, "factor");
  }
};

TEST_P(LasVariants, KeepsEveryFieldOfEveryPoint) {
  for (const std::size_t rows : {0, 1, 2, 3, 255, 256, 257, 4097}) {
    const Points points = random_points(header_, rows);
    write(points, {1, 300, 0, 5, 1021});
    const las_checker::File file = las_checker::read(path());
    EXPECT_FALSE(file.gps_time);
    EXPECT_EQ(file.creation_year, 0);
    ASSERT_NO_FATAL_FAILURE(expect_equal(file, points)) << rows;
  }
}

INSTANTIATE_TEST_SUITE_P(All, LasVariants,
                         ::testing::Values(Variant{true, true, 2, 0}, Variant{false, true, 3, 0},
                                           Variant{true, false, 2, 4}, Variant{false, false, 2, 0}),
                         [](const auto& variant) {
                           return std::string(variant.param.covariance ? "Covariance" : "Plain") +
                                  (variant.param.angles ? "Angles" : "") +
                                  (variant.param.factors > 0 ? "Factors" : "");
                         });

TEST_F(LasTest, ManyBlocksOfTheBuffer) {
  const Points points = random_points(header_, 40'000);  // several MB
  write(points, {9973});
  expect_equal(las_checker::read(path()), points);
}

TEST_F(LasTest, HeaderSaysWhoAndHow) {
  write(random_points(header_, 3));
  const las_checker::File file = las_checker::read(path());
  EXPECT_EQ(file.system_identifier, "Livox Mid-40 0TFDG3B006H2Z11");
  EXPECT_EQ(file.generating_software, "risley 0.1.0");
  const auto* text = file.record("LASF_Spec", 3);
  ASSERT_NE(text, nullptr);
  EXPECT_EQ(text->data, std::string("command = risley cloud\nversion = 0.1.0\n") + '\0');
  EXPECT_THAT(file.record("LASF_Projection", 2112)->data, HasSubstr("UNIT[\"metre\",1]"));
  EXPECT_EQ(file.field("StdX").description, "1 sigma of X (m)");
}

TEST_F(LasTest, HeaderOfAnUnknownSensor) {
  header_.sensor = "Gerät \"7\" with a name that is much too long for its field";
  header_.serial.clear();
  header_.provenance.clear();
  write(random_points(header_, 1));
  las_checker::File file = las_checker::read(path());
  EXPECT_EQ(file.system_identifier.size(), 32U);
  EXPECT_THAT(file.system_identifier, ::testing::StartsWith("Ger"));
  EXPECT_EQ(file.generating_software, "risley");
  EXPECT_EQ(file.record("LASF_Spec", 3), nullptr);

  header_.sensor.clear();
  write(random_points(header_, 1));
  file = las_checker::read(path());
  EXPECT_EQ(file.system_identifier, "OTHER");
}

TEST_F(LasTest, BoundingBoxIsThatOfTheRoundedCoordinates) {
  options_.las_scale = 0.01;
  Points points = random_points(header_, 3);
  points.x = {1.2349, -0.004, 0.0};
  points.y = {-7.126, -7.124, -7.0};
  points.z = {0.005, 0.015, 0.025};  // ties, as far as these are
  write(points);
  const las_checker::File file = las_checker::read(path());
  EXPECT_EQ(file.low[0], 0.0);
  EXPECT_EQ(file.high[0], 123 * 0.01);
  EXPECT_EQ(file.low[1], -713 * 0.01);
  EXPECT_EQ(file.high[1], -700 * 0.01);
}

TEST_F(LasTest, FinerScale) {
  options_.las_scale = 1e-5;
  const Points points = random_points(header_, 500);
  write(points);
  const las_checker::File file = las_checker::read(path());
  expect_equal(file, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(file.points[i].xyz[2] * 1e-5, points.z[i], 0.5e-5 * (1 + 1e-9));
  }
}

TEST_F(LasTest, CoordinatesAtTheLimit) {
  options_.las_scale = 1.0;
  Points points = random_points(header_, 2);
  points.x = {2147483647.0, -2147483647.0};
  write(points);
  expect_equal(las_checker::read(path()), points);
  points.x[1] = 2147483648.0;
  std::filesystem::remove(path());
  EXPECT_THAT(refusal<InvalidArgument>(points), NamesField("point 2: X"));
}

TEST_F(LasTest, CoordinatesThatDoNotFit) {
  // At every place of a block, so that each lane and the remainder are looked at.
  for (const std::size_t wrong : {0, 1, 255, 256, 1000, 1001, 1002}) {
    Points points = random_points(header_, 1003);
    points.y[wrong] = -214748.4;
    const std::string message = refusal<InvalidArgument>(points, {400, 1, 602});
    EXPECT_THAT(message,
                AllOf(NamesField("point " + std::to_string(wrong + 1) + ": Y = -214748.4 m"),
                      NamesField("-214748.3647 to 214748.3647 m")));
    points.y[wrong] = 1.0;
    for (const double value :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      points.z[wrong] = value;
      EXPECT_THAT(refusal<InvalidArgument>(points),
                  NamesField("point " + std::to_string(wrong + 1) + ": Z"));
    }
  }
}

TEST_F(LasTest, AfterARefusalTheFileCannotBeCompleted) {
  Points points = random_points(header_, 10);
  const auto writer = create_cloud(path(), header_, options_);
  writer->write(points);
  points.x[3] = 1e9;
  EXPECT_THROW(writer->write(points), InvalidArgument);
  points.x[3] = 1;
  EXPECT_THROW(writer->write(points), FileError);
  EXPECT_THROW(writer->close(), FileError);
  EXPECT_FALSE(std::filesystem::exists(path()));
}

TEST_F(LasTest, RefusesReturnsThatDoNotFit) {
  Points points = random_points(header_, 600);
  points.number_of_returns[511] = points.return_number[511] = 0;
  EXPECT_THAT(refusal<InvalidArgument>(points), NamesField("point 512: number_of_returns = 0"));
  points.number_of_returns[511] = 3;
  EXPECT_THAT(refusal<InvalidArgument>(points),
              AllOf(NamesField("point 512: return_number = 0"), NamesField("1 to 3")));
  points.return_number[511] = 4;
  EXPECT_THAT(refusal<InvalidArgument>(points), NamesField("point 512: return_number = 4"));
  points.number_of_returns[511] = 16;
  EXPECT_THAT(refusal<InvalidArgument>(points), NamesField("1 to 15"));
}

TEST_F(LasTest, AllReturnsThatLas14Counts) {
  Points points = random_points(header_, 15);
  for (std::size_t i = 0; i < 15; ++i) {
    points.number_of_returns[i] = 15;
    points.return_number[i] = static_cast<std::uint8_t>(i + 1);
  }
  write(points);
  const las_checker::File file = las_checker::read(path());
  EXPECT_THAT(file.points_by_return, ::testing::Each(1U));
  expect_equal(file, points);
}

TEST_F(LasTest, RefusesMoreFactorsAndProvenanceThanThereIsRoomFor) {
  header_.factors.assign(200, "factor");
  EXPECT_THAT(refusal<InvalidArgument>({}), NamesField("factors"));
  header_.factors.assign(108, "factor");
  const Points points = random_points(header_, 5);
  write(points);
  expect_equal(las_checker::read(path()), points);
  std::filesystem::remove(path());
  header_.provenance.emplace_back("command", std::string(70'000, 'x'));
  EXPECT_THAT(refusal<InvalidArgument>({}), NamesField("provenance"));
}

TEST_F(LasTest, GpsTime) {
  // 2021-08-26 is day 18865 since 1970, a Thursday: 18865 * 86400 + 7 * 3600 + 1.5 = 1629961201.5
  // s. GPS week 2172 began on Sunday 2021-08-22, 2172 * 604800 = 1313625600 s after 1980-01-06;
  // four days, seven hours, 1.5 s and 18 leap seconds later it is 1313996419.5 s.
  header_.time_reference = TimeReference::utc;
  Points points = random_points(header_, 5);
  points.time_ns = {1'629'961'201'500'000'000, 1'483'228'800'000'000'000, 1'483'228'799'000'000'000,
                    1'435'708'799'750'000'000, 1'341'100'799'000'000'000};
  options_.gps_time = true;
  write(points);
  las_checker::File file = las_checker::read(path());
  EXPECT_TRUE(file.gps_time);
  EXPECT_EQ(file.creation_day, 238);
  EXPECT_EQ(file.creation_year, 2021);
  EXPECT_EQ(file.points[0].gps_time, 313'996'419.5);
  // GPS time at leap seconds: 1167264018 s at 2017-01-01, 1119744017 s at 2015-07-01 and
  // 1025136016 s at 2012-07-01 is the first second after each.
  EXPECT_EQ(file.points[1].gps_time, 167'264'018.0);
  EXPECT_EQ(file.points[2].gps_time, 167'264'018.0 - 2);
  EXPECT_EQ(file.points[3].gps_time, 119'744'017.0 - 1.25);
  EXPECT_EQ(file.points[4].gps_time, 25'136'016.0 - 2);

  options_.gps_time = false;
  write(points);
  file = las_checker::read(path());
  EXPECT_FALSE(file.gps_time);
  EXPECT_EQ(file.points[0].gps_time, 1'629'961'201.5);
  EXPECT_EQ(file.creation_day, 238);
}

TEST_F(LasTest, OtherClocksAreNotGpsTime) {
  for (const auto reference :
       {TimeReference::relative, TimeReference::power_on, TimeReference::ptp, TimeReference::pps}) {
    header_.time_reference = reference;
    Points points = random_points(header_, 2);
    points.time_ns = {0, 987'654'321'012'345'678};
    write(points);
    const las_checker::File file = las_checker::read(path());
    EXPECT_FALSE(file.gps_time);
    EXPECT_EQ(file.creation_day, 0);
    EXPECT_EQ(file.points[0].gps_time, 0.0);
    EXPECT_EQ(file.points[1].gps_time, 987'654'321.012345678);
    using namespace std::chrono;
    options_.date = sys_days{year{2026} / February / 1};
    write(points);
    EXPECT_EQ(las_checker::read(path()).creation_day, 32);
    EXPECT_EQ(las_checker::read(path()).creation_year, 2026);
    options_.date.reset();
  }
}

TEST_F(LasTest, CreationDayOfLeapYears) {
  header_.time_reference = TimeReference::utc;
  Points points = random_points(header_, 1);
  points.time_ns = {1'735'689'599'999'999'999};  // 2024-12-31, just before midnight
  write(points);
  EXPECT_EQ(las_checker::read(path()).creation_day, 366);
  EXPECT_EQ(las_checker::read(path()).creation_year, 2024);
}

}  // namespace risley::cloud::las_test
