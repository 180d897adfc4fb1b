// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Times of single points in PointCloud2, in bags of ROS 1 and ROS 2.
#include "recordings/formats/cloud_times.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/bags/bag.hpp"

#include "bags/written_bags.hpp"
#include "recordings/format_tests.hpp"
#include "recordings/ros2_messages.hpp"

namespace risley::recordings::cloud_times_test {

using namespace bags::written;
using namespace format_tests;
using bags::BadMessage;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A field of times beside x, y and z, and how it holds a time.
struct TimeField {
  std::string name;
  std::uint8_t datatype;
  double per_second;
  bool absolute;

  std::size_t bytes() const { return datatype < 3 ? 1 : datatype == 8 ? 8 : 4; }
  void add(std::string& data, std::int64_t time_ns, std::int64_t stamp_ns) const {
    const std::int64_t ns = absolute ? time_ns : time_ns - stamp_ns;
    const double seconds =
        static_cast<double>(ns / 1'000'000'000) + static_cast<double>(ns % 1'000'000'000) / 1e9;
    const double value = per_second == 1e9 ? static_cast<double>(ns) : seconds * per_second;
    switch (datatype) {
      case 5:
        return put<std::int32_t>(data, static_cast<std::int32_t>(value));
      case 6:
        return put<std::uint32_t>(data, static_cast<std::uint32_t>(value));
      case 7:
        return put<float>(data, static_cast<float>(value));
      case 8:
        return put<double>(data, value);
      default:
        return put<std::uint8_t>(data, static_cast<std::uint8_t>(value));
    }
  }
};

constexpr std::size_t kShots = 40, kMessages = 3;

/// Times that no grid would give: 10.0 and 17.3 us in turns.
std::int64_t time_of(std::size_t shot, std::int64_t begin_ns) {
  return begin_ns + static_cast<std::int64_t>(shot) * 13'650 + (shot % 2 == 0 ? 0 : 3'650);
}

/// Bags of three clouds, each stamped with the time of the shot of that number in it.
struct Clouds {
  std::vector<TimeField> fields;
  std::int64_t begin_ns = 1'600'000'000'123'456'789;
  std::size_t stamped_shot = 0;

  std::string data(std::size_t message, std::int64_t stamp_ns) const {
    std::string bytes;
    for (std::size_t i = 0; i < kShots; ++i) {
      put<float>(bytes, 2.0F);
      put<float>(bytes, 0.5F);
      put<float>(bytes, -0.25F);
      for (const TimeField& field : fields) {
        field.add(bytes, time_of(message * kShots + i, begin_ns), stamp_ns);
      }
    }
    return bytes;
  }
  std::uint32_t step() const {
    std::size_t bytes = 12;
    for (const TimeField& field : fields) bytes += field.bytes();
    return static_cast<std::uint32_t>(bytes);
  }
  std::int64_t stamp_of(std::size_t message) const {
    return time_of(message * kShots + stamped_shot, begin_ns);
  }
  /// All fields as (name, offset, datatype).
  template <class Add>
  void for_each_field(Add&& add) const {
    std::uint32_t offset = 0;
    for (const char* name : {"x", "y", "z"}) {
      add(name, offset, std::uint8_t{7});
      offset += 4;
    }
    for (const TimeField& field : fields) {
      add(field.name, offset, field.datatype);
      offset += static_cast<std::uint32_t>(field.bytes());
    }
  }

  Outcome of_ros2() const {
    Ros2BagFile bag;
    const std::size_t topic = bag.topic("/points", ros2_messages::kCloudType);
    for (std::size_t message = 0; message < kMessages; ++message) {
      const std::int64_t stamp = stamp_of(message);
      Cdr cdr;
      cdr.header(static_cast<std::uint64_t>(stamp))
          .put<std::uint32_t>(1)
          .put<std::uint32_t>(kShots);
      cdr.put<std::uint32_t>(static_cast<std::uint32_t>(3 + fields.size()));
      for_each_field([&](const std::string& name, std::uint32_t offset, std::uint8_t datatype) {
        cdr.text(name).put<std::uint32_t>(offset).put<std::uint8_t>(datatype);
        cdr.put<std::uint32_t>(1);
      });
      cdr.put<std::uint8_t>(0).put<std::uint32_t>(step()).put<std::uint32_t>(step() * kShots);
      cdr.put<std::uint32_t>(step() * kShots).raw(data(message, stamp)).put<std::uint8_t>(1);
      bag.add(topic, cdr.bytes());
    }
    const TestFolder folder;
    bag.write(folder.file("input.db3")).reset();
    return read_all(kRos2BagFormat, folder.file("input.db3"));
  }

  Outcome of_ros1() const {
    Ros1BagFile bag;
    for (std::size_t message = 0; message < kMessages; ++message) {
      const std::int64_t stamp = stamp_of(message);
      RawMessage raw{"sensor_msgs/PointCloud2", "1158d486dd51d683ce2f1be655c3c181", "any",
                     ros_header(static_cast<std::uint64_t>(stamp))};
      std::string& bytes = raw.bytes;
      put<std::uint32_t>(bytes, 1);
      put<std::uint32_t>(bytes, kShots);
      put<std::uint32_t>(bytes, static_cast<std::uint32_t>(3 + fields.size()));
      for_each_field([&](const std::string& name, std::uint32_t offset, std::uint8_t datatype) {
        put_text(bytes, name);
        put<std::uint32_t>(bytes, offset);
        put<std::uint8_t>(bytes, datatype);
        put<std::uint32_t>(bytes, 1);
      });
      put<std::uint8_t>(bytes, 0);
      put<std::uint32_t>(bytes, step());
      put<std::uint32_t>(bytes, step() * kShots);
      put_text(bytes, data(message, stamp));
      put<std::uint8_t>(bytes, 1);
      bag.add("/points", raw);
    }
    const TestFolder folder;
    bag.write(folder.file("input.bag"));
    return read_all(kRos1BagFormat, folder.file("input.bag"));
  }
};

/// Expects the times of all shots in both kinds of bags. @param within_ns  by which they may be off
void expect_times(const Clouds& clouds, double within_ns, std::size_t warnings = 0) {
  for (const Outcome& outcome : {clouds.of_ros1(), clouds.of_ros2()}) {
    ASSERT_FALSE(outcome.error) << outcome.error->what();
    EXPECT_EQ(outcome.recording.warnings.size(), warnings)
        << (outcome.recording.warnings.empty() ? "" : outcome.recording.warnings[0].message);
    ASSERT_EQ(outcome.rows().size(), kShots * kMessages);
    for (std::size_t shot = 0; shot < kShots * kMessages; ++shot) {
      const std::int64_t off = outcome.rows().time_ns[shot] - time_of(shot, clouds.begin_ns);
      ASSERT_LE(std::abs(static_cast<double>(off)), within_ns) << shot;
    }
  }
}

TEST(CloudTimes, WholeNanosecondsAfterTheStamp) {
  for (const char* name : {"time", "t", "timestamp", "offset_time", "Offset_Time"}) {
    expect_times({{{name, 6, 1e9, false}}}, 0);
    expect_times({{{name, 5, 1e9, false}}, 1'600'000'000'000'000'000, 10}, 0);
  }
}

TEST(CloudTimes, SecondsAfterTheStamp) {
  expect_times({{{"time", 7, 1, false}}}, 0.1);
  expect_times({{{"time", 8, 1, false}}}, 0);
  expect_times({{{"t", 7, 1, false}}, 7'000'000'000, kShots - 1}, 0.1);  // stamped at the end
  expect_times({{{"t", 8, 1, false}}, 7'000'000'000}, 0);
}

TEST(CloudTimes, SecondsAndNanosecondsOfTheClock) {
  constexpr std::int64_t kUtc = 1'600'000'000'123'456'789, kPowerOn = 5'000'000'017;
  // Doubles of today's times have steps of 238 ns, or of 256 ns where they count nanoseconds.
  expect_times({{{"timestamp", 8, 1, true}}, kUtc}, 120, 1);
  expect_times({{{"timestamp", 8, 1e9, true}}, kUtc}, 128, 1);
  expect_times({{{"timestamp", 8, 1, true}}, kPowerOn}, 0);
  expect_times({{{"timestamp", 8, 1e9, true}}, kPowerOn, 7}, 0);
  expect_times({{{"time", 8, 1, true}}, 1}, 0);
}

TEST(CloudTimes, TheFieldWithTheFinestStepCounts) {
  expect_times({{{"time", 8, 1, true}, {"offset_time", 6, 1e9, false}}}, 0);
  expect_times({{{"timestamp", 8, 1, true}, {"t", 7, 1, false}}}, 0.1);
}

TEST(CloudTimes, WhatIsNoTimeOfSinglePointsIsNotUsed) {
  const auto warning_of = [](const Clouds& clouds) {
    const Outcome outcome = clouds.of_ros2();
    EXPECT_FALSE(outcome.error);
    EXPECT_EQ(outcome.rows().size(), kShots * kMessages);
    return outcome.recording.warnings;
  };
  EXPECT_THAT(warning_of({{{"time", 2, 1e3, false}}}),
              ElementsAre(Warns(kWarning.no_shot_times, {"time is of datatype 2"})));
  EXPECT_THAT(warning_of({{{"time", 0, 1e3, false}}}),
              ElementsAre(Warns(kWarning.no_shot_times, {"field time, found 0"})));
  // Floats in nanoseconds would be hours off as seconds.
  EXPECT_THAT(warning_of({{{"time", 7, 1e9, false}}}),
              ElementsAre(Warns(kWarning.no_shot_times, {"10 s"})));
  EXPECT_THAT(warning_of({{{"time", 7, 0, false}}}),
              ElementsAre(Warns(kWarning.no_shot_times, {"40 points"})));
  EXPECT_THAT(warning_of({{{"curvature", 7, 1e3, false}}}),
              ElementsAre(Warns(kWarning.no_shot_times)));
}

TEST(CloudTimes, ReadingsAreExactAndBounded) {
  using enum TimeReading;
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinite = std::numeric_limits<double>::infinity();
  for (const TimeReading reading : {nanoseconds_after, seconds_after, seconds, nanoseconds}) {
    for (const double value : {nan, infinite, -infinite, 1e300, -1e300, 9.3e18, -9.3e18}) {
      EXPECT_FALSE(offset_of(reading, value, 7'000'000'000'000'000'000)) << value;
    }
  }
  EXPECT_EQ(offset_of(seconds_after, 10.0, 5), 10'000'000'000);
  EXPECT_EQ(offset_of(seconds_after, -10.0, 5), -10'000'000'000);
  EXPECT_FALSE(offset_of(seconds_after, 10.000000001, 5));
  EXPECT_EQ(offset_of(nanoseconds_after, 4'294'967'295.0, 5), 4'294'967'295);
  EXPECT_EQ(offset_of(seconds, 12.000000001, 11'000'000'003), 999'999'998);
  EXPECT_FALSE(offset_of(nanoseconds, 9.1e18, -9'000'000'000'000'000'000));
}

TEST(CloudTimes, ATimeFarFromItsStampIsDamage) {
  bags::PointCloud2 layout;
  layout.height = 1;
  layout.width = 2;
  layout.point_step = layout.row_step = 4;
  layout.fields = {{"t", 0, 7, 1}};
  std::string data;
  put<float>(data, 0.0F);
  put<float>(data, 11.0F);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(data.data());
  layout.data = {bytes, data.size()};
  const auto problem = [&](std::uint8_t datatype) -> std::string {
    try {
      for_each_time({"t", datatype, TimeReading::seconds_after, 1}, layout, 0, [](std::int64_t) {});
    } catch (const BadMessage& bad) {
      return bad.what();
    }
    return "";
  };
  EXPECT_EQ(problem(7),
            "point 3 has t = 11, allowed at most 10 s from the time stamp of its message");
  EXPECT_THAT(problem(8), NamesField("datatype 8"));
  layout.fields[0].name = "u";
  EXPECT_THAT(problem(7), HasSubstr("found no such field"));
}

}  // namespace risley::recordings::cloud_times_test
