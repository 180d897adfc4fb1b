// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/excerpt.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/recordings/writer.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/formats/cartesian.hpp"
#include "recordings/las_bytes.hpp"
#include "refusal.hpp"

namespace risley::recordings::excerpt_test {

using namespace format_tests;
using ::testing::HasSubstr;

constexpr std::int64_t kStart = 1'600'000'000'000'000'000;
constexpr const char* kSerial = "0TFDG3B006H2Z11";
constexpr const char* kHubSerial = "13UUG1R00400170";

RecordingHeader telling_header() {
  RecordingHeader header;
  header.format = "lvx-1.1";
  header.devices.resize(1);
  header.devices[0].serial = kSerial;
  header.devices[0].hub_serial = kHubSerial;
  header.devices[0].type = 6;
  header.devices[0].extrinsic_enabled = true;
  header.devices[0].roll_pitch_yaw_deg = {1, 2, 3};
  header.time_reference = TimeReference::utc;
  header.set_detail("owner", "Jane Roe");
  return header;
}

/// Point of a shot in whole millimetres.
Vector3<double> point_of(std::size_t shot) {
  const auto k = static_cast<std::int64_t>(shot);
  return {1e-3 * static_cast<double>(2001 + k * 7919 % 4001),
          1e-3 * static_cast<double>(k * 104'729 % 1501 - 750),
          1e-3 * static_cast<double>(k * 1299 % 1201 - 600)};
}

/// A recording of one row per shot, `step_ns` apart.
struct Source {
  RecordingHeader header = telling_header();
  Chunk chunk;

  Observations& rows() { return chunk.observations; }

  void add(std::size_t shots, std::int64_t step_ns, bool cartesian = false) {
    Observations& o = rows();
    const std::size_t begin = o.size();
    o.resize(begin + shots);
    for (std::size_t i = begin; i < o.size(); ++i) {
      o.time_ns[i] = i == 0 ? kStart : o.time_ns[i - 1] + step_ns;
      if (cartesian) {
        set_cartesian(o, i, point_of(i), kMillimetre);
      } else {
        const double turn = static_cast<double>(i % 1000);
        set_spherical(o, i, radians_from_degrees(0.01 * turn), radians_from_degrees(90), 4.5);
      }
      o.intensity[i] = static_cast<std::uint8_t>(i);
      o.return_number[i] = 1;
      o.tag[i] = static_cast<std::uint8_t>(i % 7);
      o.beam[i] = static_cast<std::uint8_t>(i % 6);
    }
  }

  void invalidate(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      rows().valid[i] = 0;
      rows().range[i] = 0;
    }
  }
};

class ExcerptTest : public ::testing::Test {
 protected:
  std::string save(const Source& source, const std::string& name = "recording.nc") const {
    write_all(kNetcdfFormat, folder_.file(name), source.header, source.chunk);
    return folder_.file(name);
  }

  Excerpt share(const std::string& recording, const ExcerptOptions& options = {}) {
    Excerpt excerpt = write_excerpt(recording, path_, options);
    shared_ = load_recording(path_);
    EXPECT_EQ(excerpt.observations, rows().size());
    return excerpt;
  }

  const Observations& rows() const { return shared_.data.observations; }

  /// Compares the directions, returns, tags, beams and validity of rows from `first` on.
  void expect_rows_from(Observations source, std::size_t first) const {
    source.drop_front(first);
    ASSERT_LE(rows().size(), source.size());
    const Observations& o = rows();
    EXPECT_TRUE(same_bits(o.azimuth, source.azimuth));
    EXPECT_TRUE(same_bits(o.zenith, source.zenith));
    EXPECT_TRUE(same_bits(o.azimuth_resolution, source.azimuth_resolution));
    EXPECT_TRUE(same_bits(o.zenith_resolution, source.zenith_resolution));
    EXPECT_TRUE(same_bits(o.return_number, source.return_number));
    EXPECT_TRUE(same_bits(o.tag, source.tag));
    EXPECT_TRUE(same_bits(o.beam, source.beam));
    EXPECT_TRUE(same_bits(o.valid, source.valid));
    for (std::size_t i = 0; i < o.size(); ++i) {
      ASSERT_EQ(o.time_ns[i], source.time_ns[i] - source.time_ns[0]) << i;
    }
  }

  TestFolder folder_;
  std::string path_ = folder_.file("excerpt.nc");
  Recording shared_;
};

TEST_F(ExcerptTest, OfAShortRecordingIsAllOfIt) {
  Source source;
  source.add(5000, 10'000);
  source.invalidate(70, 75);
  const Excerpt excerpt = share(save(source));
  EXPECT_EQ(excerpt.shots, 5000U);
  EXPECT_EQ(excerpt.no_return, 5U);
  EXPECT_NEAR(excerpt.duration, 4999 * 1e-5, 1e-12);
  EXPECT_EQ(excerpt.first_row, 0U);
  EXPECT_FALSE(excerpt.rounded);
  EXPECT_FALSE(excerpt.damage);
  ASSERT_EQ(rows().size(), 5000U);
  expect_rows_from(source.rows(), 0);
}

TEST_F(ExcerptTest, HoldsNothingThatTellsOfPlaceTimeAndOwner) {
  Source source;
  source.add(5000, 10'000);
  source.chunk.imu.resize(3);
  const std::string recording = save(source);
  share(recording);
  const RecordingHeader& header = shared_.header;
  ASSERT_EQ(header.devices.size(), 1U);
  EXPECT_EQ(header.devices[0].type, 6);
  EXPECT_EQ(header.devices[0].serial, "");
  EXPECT_EQ(header.devices[0].hub_serial, "");
  EXPECT_FALSE(header.devices[0].extrinsic_enabled);
  EXPECT_EQ(header.devices[0].roll_pitch_yaw_deg, (std::array<float, 3>{}));
  EXPECT_EQ(header.time_reference, TimeReference::relative);
  EXPECT_FALSE(header.has_range);
  EXPECT_FALSE(header.has_intensity);
  EXPECT_EQ(source_format(header), "lvx-1.1");
  EXPECT_EQ(header.detail("owner"), "");
  EXPECT_TRUE(shared_.data.packets.empty());
  EXPECT_TRUE(shared_.data.imu.empty());
  for (std::size_t i = 0; i < rows().size(); ++i) {
    ASSERT_TRUE(std::isnan(rows().range[i]));
    ASSERT_EQ(rows().range_resolution[i], 0.0F);
    ASSERT_EQ(rows().intensity[i], 0);
  }
  const std::string before = get_bytes(recording), after = get_bytes(path_);
  for (const char* word : {kSerial, kHubSerial, "Jane Roe"}) {
    EXPECT_THAT(before, HasSubstr(word));
    EXPECT_EQ(after.find(word), after.npos) << word;
  }
  EXPECT_EQ(after.find("recording.nc"), after.npos);
}

TEST_F(ExcerptTest, AFormatNameThatIsNoneIsNotPassedOn) {
  Source source;
  source.header.format = "Jane Roe's format";
  source.add(50, 10'000);
  const std::string recording = save(source);
  EXPECT_THAT(get_bytes(recording), HasSubstr("Jane Roe's"));
  share(recording);
  EXPECT_EQ(get_bytes(path_).find("Jane Roe's"), std::string::npos);
}

TEST_F(ExcerptTest, TakesTheSecondWithMostDirections) {
  Source source;
  source.add(60'000, 50'000);         // 3 s
  source.invalidate(0, 27'000);       // up to 1.35 s
  source.invalidate(49'000, 60'000);  // from 2.45 s on
  const Excerpt excerpt = share(save(source));
  EXPECT_LE(excerpt.duration, 1.0);
  EXPECT_GE(excerpt.shots, 19'000U);
  EXPECT_EQ(excerpt.no_return, 0U);
  EXPECT_GE(excerpt.first_row, 27'000U);
  EXPECT_LE(excerpt.first_row + excerpt.observations, 49'000U);
  EXPECT_EQ(rows().time_ns[0], 0);
  expect_rows_from(source.rows(), excerpt.first_row);
}

TEST_F(ExcerptTest, ShotsWithoutReturnKeepTheirPlaces) {
  Source source;
  source.add(60'000, 50'000);
  for (std::size_t i = 0; i < 60'000; i += 3) source.invalidate(i, i + 1);
  const Excerpt excerpt = share(save(source));
  EXPECT_NEAR(static_cast<double>(excerpt.no_return), static_cast<double>(excerpt.observations) / 3,
              1);
  expect_rows_from(source.rows(), excerpt.first_row);
}

TEST_F(ExcerptTest, NoClockIsResetWithin) {
  Source source;
  source.add(12'000, 50'000);
  source.add(1, -50'000'000'000);
  source.add(15'000, 50'000);
  const Excerpt excerpt = share(save(source));
  EXPECT_EQ(excerpt.first_row, 12'000U);
  EXPECT_EQ(excerpt.shots, 15'001U);
  EXPECT_TRUE(std::is_sorted(rows().time_ns.begin(), rows().time_ns.end()));
}

TEST_F(ExcerptTest, TimesAtBothEndsOfAllTimesAreSurvived) {
  Source source;
  source.add(4, 10'000);
  source.rows().time_ns = {INT64_MIN, INT64_MAX, INT64_MIN, INT64_MAX};
  EXPECT_EQ(share(save(source)).shots, 1U);
}

TEST_F(ExcerptTest, KeepsToItsLimits) {
  Source source;
  source.add(30'000, 10'000);
  const std::string recording = save(source);
  Excerpt excerpt = share(recording, {.longest = 0.1});
  EXPECT_LE(excerpt.duration, 0.1);
  EXPECT_GE(excerpt.shots, 9'900U);
  excerpt = share(recording, {.most_shots = 777});
  EXPECT_EQ(excerpt.shots, 777U);
  excerpt = share(recording, {.most_shots = 20'000});
  EXPECT_LE(excerpt.shots, 20'000U);
  EXPECT_GE(excerpt.shots, 18'000U);
}

TEST_F(ExcerptTest, ReturnsOfOneShotStayTogether) {
  Source source;
  source.header.returns_per_shot = 2;
  source.add(20'000, 0);
  for (std::size_t i = 0; i < 20'000; ++i) {
    source.rows().time_ns[i] = kStart + static_cast<std::int64_t>(i / 2) * 10'000;
    source.rows().return_number[i] = static_cast<std::uint8_t>(1 + i % 2);
  }
  const Excerpt excerpt = share(save(source), {.most_shots = 501});
  EXPECT_EQ(shared_.header.returns_per_shot, 2);
  EXPECT_EQ(excerpt.shots, 501U);
  EXPECT_EQ(excerpt.observations, 1002U);
  EXPECT_EQ(rows().return_number.front(), 1);
  EXPECT_EQ(rows().return_number.back(), 2);
}

TEST_F(ExcerptTest, IsOfTheSensorThatSeesMost) {
  Source source;
  source.header.devices.resize(2);
  source.header.devices[1].type = 7;
  source.header.devices[1].serial = kSerial;
  source.add(6000, 10'000);
  for (std::size_t i = 0; i < 6000; ++i) source.rows().device[i] = i % 3 != 0;
  const Excerpt excerpt = share(save(source));
  EXPECT_EQ(excerpt.device_type, 7);
  EXPECT_EQ(excerpt.shots, 4000U);
  ASSERT_EQ(shared_.header.devices.size(), 1U);
  EXPECT_EQ(shared_.header.devices[0].type, 7);
  for (std::size_t i = 0; i < rows().size(); ++i) {
    const std::size_t from = i / 2 * 3 + 1 + i % 2;
    ASSERT_EQ(rows().device[i], 0);
    ASSERT_EQ(rows().azimuth[i], source.rows().azimuth[from]);
  }
}

TEST_F(ExcerptTest, WithRangesIsExactToTheLastBit) {
  for (const bool cartesian : {false, true}) {
    Source source;
    source.header.cartesian = cartesian;
    source.add(3000, 10'000, cartesian);
    const Excerpt excerpt = share(save(source), {.ranges = true});
    EXPECT_TRUE(excerpt.has_ranges);
    EXPECT_FALSE(excerpt.rounded);
    EXPECT_TRUE(shared_.header.has_range);
    EXPECT_EQ(shared_.header.cartesian, cartesian);
    expect_rows_from(source.rows(), 0);
    EXPECT_TRUE(same_bits(rows().range, source.rows().range));
    EXPECT_TRUE(same_bits(rows().range_resolution, source.rows().range_resolution));
  }
}

/// Ranges, mm, of the points in whole millimetres that lie from `near` to `far` and whose direction
/// differs from the given one by less than the tolerances.
std::vector<double> possible_ranges(double azimuth, double zenith, double azimuth_tolerance,
                                    double zenith_tolerance, double near, double far) {
  std::vector<double> ranges;
  const Vector3<double> beam = direction_from_angles(SphericalAngles<double>{azimuth, zenith});
  for (double x = std::ceil(near * beam.x); x <= far * beam.x; ++x) {
    const Vector3<double> point{x, std::round(x * beam.y / beam.x),
                                std::round(x * beam.z / beam.x)};
    const auto angles = angles_from_direction(point);
    if (std::abs(angles.azimuth - azimuth) > azimuth_tolerance ||
        std::abs(angles.zenith - zenith) > zenith_tolerance) {
      continue;
    }
    ranges.push_back(norm(point));
  }
  return ranges;
}

TEST_F(ExcerptTest, DirectionsFromCoordinatesDoNotGiveTheRangeAway) {
  Source source;
  source.header.cartesian = true;
  source.add(3000, 10'000, true);
  source.invalidate(10, 12);
  const Excerpt excerpt = share(save(source));
  EXPECT_TRUE(excerpt.rounded);
  const Observations& o = rows();
  ASSERT_EQ(o.size(), 3000U);
  std::size_t told_before = 0;
  for (std::size_t i = 0; i < o.size(); ++i) {
    if (o.valid[i] == 0) continue;
    // Resolutions are the nearest powers of two, angles multiples of a quarter of them.
    for (const auto& [resolution, true_resolution, angle, true_angle] :
         {std::tuple{o.azimuth_resolution[i], source.rows().azimuth_resolution[i], o.azimuth[i],
                     source.rows().azimuth[i]},
          std::tuple{o.zenith_resolution[i], source.rows().zenith_resolution[i], o.zenith[i],
                     source.rows().zenith[i]}}) {
      int exponent = 0;
      ASSERT_EQ(std::frexp(resolution, &exponent), 0.5F);
      ASSERT_LT(std::abs(std::log2(resolution / true_resolution)), 0.5001F);
      ASSERT_EQ(std::fmod(angle, 0.25 * resolution), 0.0);
      ASSERT_LE(std::abs(angle - true_angle), 0.125 * resolution * (1 + 1e-9));
    }
    if (i % 100 != 0) continue;
    const double range = 1e3 * source.rows().range[i];
    const double far = std::sqrt(2.0) / o.zenith_resolution[i];  // in steps of 1 mm
    const auto before = possible_ranges(source.rows().azimuth[i], source.rows().zenith[i], 1e-12,
                                        1e-12, far / 2, far);
    told_before += before.size() == 1 ? 1 : 0;
    const auto after = possible_ranges(o.azimuth[i], o.zenith[i], 0.125 * o.azimuth_resolution[i],
                                       0.125 * o.zenith_resolution[i], far / 2, far);
    ASSERT_GE(after.size(), 50U) << i;
    EXPECT_LT(*std::min_element(after.begin(), after.end()), 0.62 * far) << i;
    EXPECT_GT(*std::max_element(after.begin(), after.end()), 0.9 * far) << i;
    EXPECT_GE(range, far / 2 * (1 - 1e-6));
    EXPECT_LE(range, far * (1 + 1e-6));
  }
  EXPECT_GE(told_before, 25U);  // of 30: the directions as they were give the very point
}

TEST_F(ExcerptTest, AnExcerptOfAnExcerptIsTheSame) {
  for (const bool cartesian : {false, true}) {
    Source source;
    source.header.cartesian = cartesian;
    source.add(3000, 10'000, cartesian);
    share(save(source));
    const Observations once = rows();
    write_excerpt(path_, folder_.file("again.nc"));
    EXPECT_TRUE(is_same(load_recording(folder_.file("again.nc")).data.observations, once));
  }
}

TEST_F(ExcerptTest, RoundsOnlyRowsThatCameFromCoordinates) {
  Source source;  // packets of both kinds, and the header describes the first one
  source.add(100, 10'000, false);
  source.add(100, 10'000, true);
  const Excerpt excerpt = share(save(source));
  EXPECT_TRUE(excerpt.rounded);
  for (std::size_t i = 0; i < 200; ++i) {
    EXPECT_EQ(rows().azimuth_resolution[i] == source.rows().azimuth_resolution[i], i < 100) << i;
    EXPECT_EQ(rows().zenith_resolution[i] == source.rows().zenith_resolution[i], i < 100) << i;
  }
}

TEST_F(ExcerptTest, WithoutTimesHoldsShotNumbers) {
  las_bytes::LasFile file;
  file.format = 0;
  file.points.resize(130'000);
  for (std::size_t i = 0; i < file.points.size(); ++i) {
    if (i >= 20'000) file.points[i].xyz = {5000, static_cast<std::int32_t>(i % 1000), 300};
  }
  put_bytes(folder_.file("cloud.las"), file.bytes());
  Excerpt excerpt = share(folder_.file("cloud.las"));
  EXPECT_FALSE(excerpt.has_times);
  EXPECT_FALSE(shared_.header.has_times);
  EXPECT_EQ(source_format(shared_.header), "las");
  EXPECT_LE(excerpt.shots, 100'000U);
  EXPECT_GE(excerpt.shots - excerpt.no_return, 99'000U);
  EXPECT_EQ(rows().time_ns.front(), 0);
  EXPECT_EQ(rows().time_ns.back(), static_cast<std::int64_t>(excerpt.shots) - 1);
  // With a shot rate it has times, and keeps to a second.
  excerpt = write_excerpt(folder_.file("cloud.las"), path_, {}, {.shot_rate = 50'000.0});
  EXPECT_TRUE(excerpt.has_times);
  EXPECT_LE(excerpt.duration, 1.0);
  EXPECT_EQ(load_recording(path_).data.observations.time_ns[1], 20'000);
}

TEST_F(ExcerptTest, OfADamagedRecordingIsOfItsSoundPart) {
  las_bytes::LasFile file;
  file.points.resize(1000);
  for (std::size_t i = 0; i < 1000; ++i) {
    file.points[i].xyz = {5000, static_cast<std::int32_t>(i), 300};
    file.points[i].gps_time = 1e-5 * static_cast<double>(i);
  }
  put_bytes(folder_.file("cut.las"), file.bytes().substr(0, 227 + 600 * 28 + 3));
  const Excerpt excerpt = share(folder_.file("cut.las"));
  EXPECT_EQ(excerpt.shots, 600U);
  ASSERT_TRUE(excerpt.damage);
  EXPECT_EQ(excerpt.damage->place().byte_offset, 227U + 600 * 28);
}

TEST_F(ExcerptTest, RefusesWhatMakesNoSense) {
  Source source;
  source.add(10, 10'000);
  const std::string recording = save(source);
  const auto problem = [&](const std::string& path, const ExcerptOptions& options = {}) {
    try {
      write_excerpt(recording, path, options);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("was written");
  };
  EXPECT_THAT(problem(folder_.file("excerpt.lvx")),
              ::testing::AllOf(NamesField("excerpt.lvx"), NamesField(".nc")));
  EXPECT_THAT(problem(recording), NamesField(recording));
  EXPECT_THAT(problem(path_, {.longest = 0}), NamesField("longest"));
  EXPECT_THAT(problem(path_, {.longest = std::numeric_limits<double>::quiet_NaN()}),
              NamesField("longest"));
  EXPECT_THAT(problem(path_, {.most_shots = 0}), NamesField("most_shots"));
  EXPECT_EQ(folder_.names().size(), 1U);  // the recording
}

TEST_F(ExcerptTest, WithoutADirectionThereIsNothingToShare) {
  Source source;
  source.add(10, 10'000);
  source.invalidate(0, 10);
  const std::string recording = save(source);
  EXPECT_THROW(write_excerpt(recording, path_), FileError);
  EXPECT_EQ(folder_.names().size(), 1U);
}

TEST_F(ExcerptTest, AnInterruptedOneLeavesNothing) {
  Source source;
  source.add(200'000, 5'000);
  const std::string recording = save(source);
  const Progress stop = [](double fraction) {
    if (fraction > 0.7) throw std::runtime_error("interrupted");
  };
  EXPECT_THROW(write_excerpt(recording, path_, {}, {}, stop), std::runtime_error);
  EXPECT_EQ(folder_.names().size(), 1U);
}

}  // namespace risley::recordings::excerpt_test
