// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Recordings whose rows stand in another order than that of firing, or whose times are rounded,
// shared or useless; and the choice of one sensor.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/random.hpp"

#include "recordings/format_tests.hpp"
#include "refusal.hpp"

namespace risley::recordings::judged_times_test {

using namespace format_tests;
using ::testing::ElementsAre;

/// Shots of a sensor with emitters that fire in turn. The azimuth of a shot is its number.
Recording shots(std::size_t count, double rate_hz, int emitters = 1) {
  Recording recording;
  recording.header.format = "test";
  recording.header.devices.resize(1);
  Observations& o = recording.data.observations;
  o.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    o.time_ns[i] = 7'000'000'000 + std::llround(static_cast<double>(i) * 1e9 / rate_hz);
    o.azimuth[i] = 1e-6 * static_cast<double>(i);
    o.zenith[i] = 1.5 + 0.001 * static_cast<double>(i % 97);
    o.range[i] = 5.0;
    o.return_number[i] = 1;
    o.beam[i] = static_cast<std::uint8_t>(i % static_cast<std::size_t>(emitters));
    o.valid[i] = 1;
  }
  return recording;
}

std::size_t number_of(const Observations& o, std::size_t row) {
  return static_cast<std::size_t>(std::llround(1e6 * o.azimuth[row]));
}

Recording read(const Recording& recording, const ReadOptions& options = {},
               std::size_t max_rows = kDefaultChunkRows) {
  const Source source(std::make_shared<const Recording>(recording), "test");
  const auto reader = open_recording(source, options);
  Recording result;
  Chunk chunk;
  while (reader->read(chunk, max_rows)) {
    EXPECT_LE(chunk.observations.size(), max_rows);
    result.data.observations.append(chunk.observations);
    result.data.imu.insert(result.data.imu.end(), chunk.imu.begin(), chunk.imu.end());
  }
  result.header = reader->header();
  result.warnings = reader->warnings();
  return result;
}

template <class Less>
Recording reordered(const Recording& recording, Less&& less) {
  const Observations& o = recording.data.observations;
  std::vector<std::size_t> order(o.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), less);
  Recording result = recording;
  result.data.observations.clear();
  result.data.observations.append(o, order);
  return result;
}

void round_times(Recording& recording, std::int64_t step_ns) {
  for (std::int64_t& time : recording.data.observations.time_ns) {
    time = (time + step_ns / 2) / step_ns * step_ns;
  }
}

/// By how much times differ from those of the clock once a shift is taken away, ns.
double spread(const Recording& found, const Recording& truth) {
  double low = 0, high = 0;
  const Observations& o = found.data.observations;
  for (std::size_t i = 0; i < o.size(); ++i) {
    const auto off =
        static_cast<double>(o.time_ns[i] - truth.data.observations.time_ns[number_of(o, i)]);
    low = i == 0 ? off : std::min(low, off);
    high = i == 0 ? off : std::max(high, off);
  }
  return high - low;
}

void expect_same_rows(const Recording& found, const Recording& truth) {
  EXPECT_EQ(found.data.observations.time_ns, truth.data.observations.time_ns);
  EXPECT_EQ(found.data.observations.azimuth, truth.data.observations.azimuth);
  EXPECT_EQ(found.data.observations.beam, truth.data.observations.beam);
}

// --- order ---------------------------------------------------------------------------------------

TEST(JudgedTimes, SoundTimesAreLeftAsTheyAre) {
  const Recording recording = shots(5000, 240e3, 6);
  const Recording found = read(recording);
  expect_same_rows(found, recording);
  EXPECT_TRUE(found.warnings.empty());
}

TEST(JudgedTimes, RowsInAnyOrderAreSortedByTime) {
  const Recording recording = shots(6000, 240e3, 6);
  const Observations& o = recording.data.observations;
  const RandomStream random(1, 1);
  const auto by = [&](auto&& key) {
    return reordered(recording, [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  };
  const Recording orders[] = {
      by([&](std::size_t i) { return o.zenith[i]; }),                     // a coordinate
      by([&](std::size_t i) { return random.uniform(i); }),               // none
      by([&](std::size_t i) { return -o.time_ns[i]; }),                   // backwards
      by([&](std::size_t i) { return o.beam[i]; }),                       // line by line
      by([&](std::size_t i) { return std::pair(i / 1200, o.beam[i]); }),  // the same in messages
      by([&](std::size_t i) { return (i / 2000) ^ 1; }),                  // blocks change places
      by([&](std::size_t i) { return (i / 96) ^ 1; }),                    // packets do
  };
  for (const Recording& order : orders) {
    for (const std::size_t max_rows : {std::size_t{333}, kDefaultChunkRows}) {
      const Recording found = read(order, {}, max_rows);
      expect_same_rows(found, recording);
      EXPECT_EQ(found.warnings.size(), 1U);
    }
  }
}

TEST(JudgedTimes, DisorderWithinMessagesIsSortedWithoutHoldingAll) {
  const Recording recording = shots(400'000, 240e3, 6);
  const auto grouped = reordered(recording, [&](std::size_t a, std::size_t b) {
    const auto& beam = recording.data.observations.beam;
    return std::pair(a / 2400, beam[a]) < std::pair(b / 2400, beam[b]);
  });
  expect_same_rows(read(grouped), recording);
}

TEST(JudgedTimes, AClockThatWasResetIsNoDisorder) {
  Recording recording = shots(4000, 100e3);
  auto& times = recording.data.observations.time_ns;
  for (std::size_t i = 2000; i < times.size(); ++i) times[i] -= 6'500'000'000;
  const Recording found = read(recording);
  expect_same_rows(found, recording);
  EXPECT_TRUE(found.warnings.empty());
}

TEST(JudgedTimes, ReturnsOfAShotStayTogetherWhereRowsAreSorted) {
  Recording recording = shots(3000, 100e3);
  Observations& o = recording.data.observations;
  const Observations first = o;
  o.append(first);  // all first returns, then all second ones
  for (std::size_t i = first.size(); i < o.size(); ++i) o.return_number[i] = 2;
  const Recording found = read(recording);
  for (std::size_t i = 0; i < o.size(); ++i) {
    ASSERT_EQ(number_of(found.data.observations, i), i / 2);
    ASSERT_EQ(found.data.observations.return_number[i], i % 2 + 1);
  }
  EXPECT_EQ(found.warnings.size(), 1U);
}

TEST(JudgedTimes, ATextSortedByACoordinateIsReadInTheOrderOfFiring) {
  std::map<int, std::string> by_x;
  for (int i = 0; i < 2000; ++i) {
    const int x = 1000 + (i * 787) % 2003;
    by_x[x] = fmt::format("{:.5f},{:.3f},0.5,0.25\n", 1e-5 * i, 1e-3 * x);
  }
  std::string text = "time_s,x_m,y_m,z_m\n";
  for (const auto& [x, line] : by_x) text += line;
  const TestFolder folder;
  put_bytes(folder.file("sorted.csv"), text);
  const Recording found = load_recording(folder.file("sorted.csv"));
  ASSERT_EQ(found.data.observations.size(), 2000U);
  for (std::size_t i = 0; i < 2000; ++i) {
    ASSERT_EQ(found.data.observations.time_ns[i], static_cast<std::int64_t>(i) * 10'000);
    ASSERT_NEAR(found.data.observations.range[i] * std::sin(found.data.observations.zenith[i]) *
                    std::cos(found.data.observations.azimuth[i]),
                1e-3 * static_cast<double>(1000 + (i * 787) % 2003), 1e-9);
  }
}

// --- rounded and shared times --------------------------------------------------------------------

TEST(JudgedTimes, RoundedTimesArePutOnTheGridOfTheShots) {
  struct Case {
    double rate_hz;
    std::int64_t rounding_ns;
  };
  for (const Case& c : {Case{240e3, 1000},
                        {240e3, 100},
                        {240'003.7, 1000},
                        {99'998.2, 1000},
                        {40e3, 10'000},
                        {6000, 10'000}}) {
    SCOPED_TRACE(fmt::format("{} Hz, {} ns", c.rate_hz, c.rounding_ns));
    const Recording truth = shots(20'000, c.rate_hz);
    Recording rounded = truth;
    round_times(rounded, c.rounding_ns);
    ASSERT_GT(spread(rounded, truth), 0.45 * static_cast<double>(c.rounding_ns));
    const Recording found = read(rounded);
    EXPECT_LT(spread(found, truth), 0.02 * static_cast<double>(c.rounding_ns) + 2);
    EXPECT_EQ(found.warnings.size(), 1U);
  }
}

TEST(JudgedTimes, ShotsThatAreMissingKeepTheirPlacesOnTheGrid) {
  const Recording truth = shots(30'000, 240e3);
  const RandomStream random(3, 1);
  Recording rounded = truth;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < 30'000; ++i) {
    if (random.uniform(i) > 0.4) kept.push_back(i);
  }
  rounded.data.observations.clear();
  rounded.data.observations.append(truth.data.observations, kept);
  round_times(rounded, 1000);
  EXPECT_LT(spread(read(rounded), truth), 20.0);
}

TEST(JudgedTimes, WholeStepsOfAThinnedRecordingAreNoRounding) {
  const RandomStream random(6, 1);
  for (const double share : {0.5, 0.95}) {
    Recording recording = shots(20'000, 100e3);
    const Observations all = recording.data.observations;
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (random.uniform(i) > share) kept.push_back(i);
    }
    recording.data.observations.clear();
    recording.data.observations.append(all, kept);
    const Recording found = read(recording);
    expect_same_rows(found, recording);
    EXPECT_TRUE(found.warnings.empty());
  }
}

TEST(JudgedTimes, SensorsThatShareOneStreamAreTold) {
  Recording recording = shots(6000, 100e3);
  auto& times = recording.data.observations.time_ns;
  for (std::size_t i = 0; i < times.size(); ++i) {  // messages of 20 ms from three sensors
    const auto message = static_cast<std::int64_t>(i / 2000);
    times[i] = 137'000 * message + static_cast<std::int64_t>(i % 2000) * 10'000;
  }
  const Recording found = read(recording);
  expect_same_rows(found, recording);
  EXPECT_EQ(found.warnings.size(), 1U);
}

TEST(JudgedTimes, RoundingOfFloatingPointNumbersIsTakenAway) {
  const Recording truth = shots(50'000, 100e3);
  Recording rounded = truth;
  for (std::int64_t& time : rounded.data.observations.time_ns) {
    time = std::llround(1e9 *
                        static_cast<double>(static_cast<float>(1e-9 * static_cast<double>(time))));
  }
  ASSERT_GT(spread(rounded, truth), 400.0);
  EXPECT_LT(spread(read(rounded), truth), 20.0);
}

TEST(JudgedTimes, AClockThatChangesItsRateIsFollowed) {
  Recording truth = shots(200'000, 240e3);
  auto& times = truth.data.observations.time_ns;
  for (std::size_t i = 0; i < times.size(); ++i) {  // 20 ppm from the middle on
    if (i > 100'000)
      times[i] += std::llround(20e-6 * static_cast<double>(times[i] - times[100'000]));
  }
  Recording rounded = truth;
  round_times(rounded, 1000);
  EXPECT_LT(spread(read(rounded), truth), 350.0);  // at the bend; 1000 without the grid
}

TEST(JudgedTimes, PacketsThatAreNotQuiteEvenAreNoRounding) {
  Recording recording = shots(9600, 240e3);
  const RandomStream random(5, 1);
  auto& times = recording.data.observations.time_ns;
  for (std::size_t i = 0; i < times.size(); ++i) {
    times[i] += std::llround(600 * random.uniform(i / 96));
  }
  const Recording found = read(recording);
  EXPECT_EQ(found.data.observations.time_ns, times);
  EXPECT_TRUE(found.warnings.empty());
}

TEST(JudgedTimes, ShotsThatShareATimeAreSpreadInTheOrderOfTheFile) {
  struct Case {
    double rate_hz;
    std::int64_t rounding_ns;
  };
  for (const Case& c :
       {Case{240e3, 25'000}, {100e3, 100'000}, {240e3, 10'000}, {100e3, 15'000}, {240e3, 5000}}) {
    SCOPED_TRACE(fmt::format("{} Hz, {} ns", c.rate_hz, c.rounding_ns));
    const Recording truth = shots(24'000, c.rate_hz);
    Recording rounded = truth;
    round_times(rounded, c.rounding_ns);
    const Recording found = read(rounded);
    EXPECT_LT(spread(found, truth), 100.0);
    EXPECT_EQ(found.warnings.size(), 1U);
  }
}

TEST(JudgedTimes, EmittersTellWhichOfTheShotsThatShareATimeAreMissing) {
  const Recording truth = shots(24'000, 240e3, 6);
  const RandomStream random(4, 1);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < 24'000; ++i) {
    if (random.uniform(i) > 0.3) kept.push_back(i);
  }
  Recording rounded = truth;
  for (std::int64_t& time : rounded.data.observations.time_ns) time = time / 25'000 * 25'000;
  const Observations all = rounded.data.observations;
  rounded.data.observations.clear();
  rounded.data.observations.append(all, kept);
  const Recording found = read(rounded);
  EXPECT_LT(spread(found, truth), 400.0);
  EXPECT_EQ(found.warnings.size(), 1U);
}

TEST(JudgedTimes, WhereNoGridExplainsSharedTimesTheyStayAndThatIsSaid) {
  const Recording truth = shots(20'000, 100e3);
  Recording rounded = truth;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < 20'000; ++i) {
    if ((i / 7) % 5 != 2) kept.push_back(i);
  }
  rounded.data.observations.clear();
  rounded.data.observations.append(truth.data.observations, kept);
  round_times(rounded, 100'000);
  const Recording found = read(rounded);
  EXPECT_EQ(found.data.observations.time_ns, rounded.data.observations.time_ns);
  EXPECT_THAT(found.warnings, ElementsAre(Warns(kWarning.times_coarse, {"shot_rate"})));
}

TEST(JudgedTimes, ReturnsOfOneShotShareItsTime) {
  Recording recording = shots(4000, 100e3);
  Observations& o = recording.data.observations;
  for (std::size_t i = 1; i < o.size(); i += 2) {  // no column says that these are second returns
    o.time_ns[i] = o.time_ns[i - 1];
    o.azimuth[i] = o.azimuth[i - 1];
    o.zenith[i] = o.zenith[i - 1];
    o.range[i] = 9.0;
  }
  const Recording found = read(recording);
  expect_same_rows(found, recording);
  EXPECT_TRUE(found.warnings.empty());
}

// --- useless times -------------------------------------------------------------------------------

TEST(JudgedTimes, TimesThatBeginAnewWithEveryMessageAreCounted) {
  for (const double rate : {100e3, 240e3}) {
    const Recording truth = shots(12'000, rate);
    for (const std::size_t message : {std::size_t{96}, std::size_t{2000}}) {
      Recording anew = truth;
      auto& times = anew.data.observations.time_ns;
      for (std::size_t i = 0; i < times.size(); ++i) {
        times[i] = std::llround(static_cast<double>(i % message) * 1e9 / rate);
      }
      const Recording found = read(anew);
      EXPECT_LE(spread(found, truth), 1.0);
      EXPECT_DOUBLE_EQ(found.header.counted_rate, rate);
      EXPECT_EQ(found.warnings.size(), 1U);
    }
  }
}

TEST(JudgedTimes, EqualTimesAreNone) {
  Recording recording = shots(1000, 100e3);
  auto& times = recording.data.observations.time_ns;
  std::fill(times.begin(), times.end(), 0);
  const Recording found = read(recording);
  EXPECT_FALSE(found.header.has_times);
  EXPECT_TRUE(found.header.all_times_equal);
  EXPECT_EQ(found.warnings.size(), 1U);
  EXPECT_EQ(found.data.observations.time_ns[999], 999);
  ReadOptions counted;
  counted.shot_rate = 1e6;
  const Recording by_rate = read(recording, counted);
  EXPECT_TRUE(by_rate.header.has_times);
  EXPECT_TRUE(by_rate.warnings.empty());
  EXPECT_EQ(by_rate.data.observations.time_ns[999], 999'000);
}

// --- one of several sensors ----------------------------------------------------------------------

Recording of_two() {
  Recording recording = shots(1000, 100e3);
  recording.header.devices.resize(2);
  recording.header.devices[0].serial = "3WEDH0000000011";
  recording.header.devices[0].topic = "/a";
  recording.header.devices[1].serial = "3WEDH0000000021";
  recording.header.devices[1].topic = "/b";
  recording.header.devices[1].index = 7;
  Observations& o = recording.data.observations;
  for (std::size_t i = 0; i < o.size(); ++i) o.device[i] = static_cast<std::uint8_t>(i % 2);
  recording.data.imu = {{5, 0, {}, {}}, {6, 1, {}, {}}};
  return recording;
}

TEST(OneDevice, IsChosenBySerialTopicOrNumber) {
  const Recording recording = of_two();
  for (const char* wanted : {"3WEDH0000000021", "/b", "1"}) {
    ReadOptions options;
    options.device = wanted;
    const Recording found = read(recording, options, 100);
    ASSERT_EQ(found.header.devices.size(), 1U);
    EXPECT_EQ(found.header.devices[0].serial, "3WEDH0000000021");
    ASSERT_EQ(found.data.observations.size(), 500U);
    EXPECT_EQ(number_of(found.data.observations, 3), 7U);
    EXPECT_EQ(found.data.observations.device[3], 0);
    ASSERT_EQ(found.data.imu.size(), 1U);
    EXPECT_EQ(found.data.imu[0].time_ns, 6);
    EXPECT_EQ(found.data.imu[0].device, 0);
  }
  EXPECT_EQ(read(recording).data.observations.size(), 1000U);
}

TEST(OneDevice, ThatIsNotThereOrNotOneIsRefusedWithAList) {
  Recording recording = of_two();
  recording.header.devices[1].topic = "/a";
  for (const char* wanted : {"2", "-1", "1.0", "/a", "3WEDH0000000031"}) {
    ReadOptions options;
    options.device = wanted;
    EXPECT_THAT(refusal([&] { read(recording, options); }), NamesField("3WEDH0000000021"));
  }
  EXPECT_THROW(require_one_device(recording.header, "test"), InvalidArgument);
}

}  // namespace risley::recordings::judged_times_test
