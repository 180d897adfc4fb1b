// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// LVX 2: files built byte by byte from the format's description.
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/time_audit.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/numbered_packets.hpp"
#include "wire/hex.hpp"

namespace risley::recordings::lvx2_test {

using namespace format_tests;
using ::testing::ElementsAre;

constexpr std::uint64_t kTime = 1'700'000'000'123'456'789;

template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct Sensor {
  std::string serial = "47MDGEN2000001";
  std::uint8_t last = 112, type = 9;  // of the address, device type
};

std::string head(const std::vector<Sensor>& sensors) {
  std::string bytes = "livox_tech";
  bytes.resize(16);
  bytes += std::string("\2\0\0\0\x67\xA7\x0E\xAC\x32\0\0\0", 12);
  put(bytes, static_cast<std::uint8_t>(sensors.size()));
  for (const Sensor& sensor : sensors) {
    std::string entry = sensor.serial;
    entry.resize(16);
    entry += std::string(16, '\0');
    const int lidar_type = sensor.type == 10 ? 246 : 247;
    for (const int byte : {192, 168, 1, int{sensor.last}, lidar_type, int{sensor.type}, 0}) {
      put(entry, static_cast<std::uint8_t>(byte));
    }
    bytes += entry + std::string(24, '\0');
  }
  return bytes;
}

struct Content {
  std::uint64_t time_ns = kTime;
  std::uint16_t number = 0;
  std::uint8_t data_type = 1, last = 112, time_type = 1;
};

std::string package(const Content& content, const std::string& points) {
  std::string bytes(1, '\0');
  for (const int byte : {192, 168, 1, int{content.last}, 8, int{content.time_type}}) {
    put(bytes, static_cast<std::uint8_t>(byte));
  }
  put(bytes, content.time_ns);
  put(bytes, content.number);
  put(bytes, content.data_type);
  put(bytes, static_cast<std::uint32_t>(points.size()));
  return bytes + std::string(5, '\0') + points;
}

std::string frame(std::size_t at, std::uint64_t index, const std::string& packages) {
  std::string bytes;
  put(bytes, std::uint64_t{at});
  put(bytes, std::uint64_t{at + 24 + packages.size()});
  put(bytes, index);
  return bytes + packages;
}

/// Records, every fifth without return.
std::string points(std::uint8_t data_type, std::size_t records, std::mt19937& random) {
  std::string bytes;
  for (std::size_t i = 0; i < records * (data_type == 0x11 ? 2 : 1); ++i) {
    const bool missing = random() % 5 == 0;
    if (data_type == 2) {
      for (int axis = 0; axis < 3; ++axis) {
        put(bytes, static_cast<std::int16_t>(missing ? 0 : 1 + random() % 2000));
      }
    } else if (data_type == 3) {
      put(bytes, missing ? 0U : static_cast<std::uint32_t>(1 + random() % 70'000));
      put(bytes, static_cast<std::uint16_t>(missing ? 0 : random() % 18'001));
      put(bytes, static_cast<std::uint16_t>(missing ? 0 : random() % 36'000));
    } else {
      for (int axis = 0; axis < 3; ++axis) {
        put(bytes, missing ? 0 : static_cast<std::int32_t>(1 + random() % 40'000) - 20'000);
      }
    }
    put(bytes, static_cast<std::uint8_t>(random()));
    put(bytes, static_cast<std::uint8_t>(random()));
  }
  return bytes;
}

std::string inertial(float first) {
  std::string bytes;
  for (int i = 0; i < 6; ++i) put(bytes, first + static_cast<float>(i));
  return bytes;
}

/// Packets of a Mid-360 in frames of 50 ms, with an inertial sample in ten.
std::string recording(std::size_t packets, const std::vector<std::size_t>& lost = {}) {
  std::mt19937 random(1);
  std::string bytes = head({{}});
  std::string packages;
  std::uint64_t frames = 0, begin = kTime;
  std::uint16_t samples = 0;
  for (std::size_t i = 0; i < packets; ++i) {
    const std::uint64_t time = kTime + i * 480'000;
    if (std::find(lost.begin(), lost.end(), i) != lost.end()) continue;
    if (time >= begin + 50'000'000) {
      bytes += frame(bytes.size(), frames++, packages);
      packages.clear();
      begin = time;
    }
    packages += package({time, static_cast<std::uint16_t>(65'500 + i)}, points(1, 96, random));
    if (i % 10 == 0) {
      packages += package({time, samples++, 0}, inertial(static_cast<float>(i)));
    }
  }
  return bytes + frame(bytes.size(), frames, packages);
}

TEST(Lvx2, TheKnownFileBothWays) {
  const auto known = wire::bytes_of(
      "6C69766F785F74656368000000000000 02000000 67A70EAC 32000000 01 "
      "34374D4447454E323030303030310000 00000000000000000000000000000000 C0A80170 F7 09 00 "
      "000000000000000000000000000000000000000000000000 5C00000000000000 AB00000000000000 "
      "0000000000000000 00 C0A80170 08 01 15CD853DFE9C9717 0700 01 1C000000 00 00000000 "
      "D2040000D2E9FFFF840300002A15 0000000000000000000000003C00");
  const std::string bytes(known.begin(), known.end());
  const Outcome read = read_text(kLvx2Format, bytes);
  ASSERT_FALSE(read.error);
  const RecordingHeader& header = read.recording.header;
  EXPECT_EQ(header.format, "lvx-2");
  ASSERT_EQ(header.devices.size(), 1U);
  EXPECT_EQ(header.devices[0].serial, "47MDGEN2000001");
  EXPECT_EQ(header.devices[0].address, "192.168.1.112");
  EXPECT_EQ(header.devices[0].type, kMid360);
  EXPECT_EQ(header.time_reference, TimeReference::ptp);
  const auto time = static_cast<std::int64_t>(kTime);
  EXPECT_THAT(read.rows().time_ns, ElementsAre(time, time + 5000));
  EXPECT_NEAR(read.rows().range[0], std::hypot(1.234, 5.678, 0.9), 1e-12);
  EXPECT_THAT(read.rows().tag, ElementsAre(0x15, 0));
  EXPECT_THAT(read.rows().valid, ElementsAre(1, 0));
  EXPECT_EQ(rewritten(kLvx2Format, bytes), bytes);
}

TEST(Lvx2, ARecordingIsTheSameBytesAgain) {
  const std::string bytes = recording(350, {20, 21, 150});
  for (const std::size_t rows : {1U, 100U, 100'000U}) {
    EXPECT_TRUE(rewritten(kLvx2Format, bytes, rows) == bytes) << rows;
  }
  const Outcome read = read_text(kLvx2Format, bytes);
  EXPECT_THAT(warnings_of(read), ElementsAre(Warns(kWarning.shots_lost, {"3 packets"})));
  EXPECT_EQ(read.recording.data.imu.size(), 33U);  // of 35
  TimeAudit audit(read.recording.header);
  audit.add(read.recording.data);
  EXPECT_EQ(audit.result().numbered_by_device.at(0)->lost_packets, 3);
}

TEST(Lvx2, ThroughNetcdfItIsTheSameBytesAgain) {
  const std::string bytes = recording(250, {20});
  const TestFolder folder;
  put_bytes(folder.file("a.lvx2"), bytes);
  for (const auto& [from, to] : {std::pair("a.lvx2", "b.nc"), {"b.nc", "c.lvx2"}}) {
    const Recording whole = load_recording(folder.file(from));
    const auto writer = create_recording(folder.file(to), whole.header);
    writer->write(whole.data);
    writer->close();
  }
  EXPECT_TRUE(get_bytes(folder.file("c.lvx2")) == bytes);
}

TEST(Lvx2, PackagesFormedFromRowsKeepNumbersOfWhatIsMissing) {
  const std::string bytes = recording(250, {20, 100, 101});
  Outcome read = read_text(kLvx2Format, bytes);
  read.recording.data.packets.clear();
  const TestFolder folder;
  const std::string path = folder.file("formed.lvx2");
  write_all(kLvx2Format, path, read.recording.header, read.recording.data);
  const Outcome again = read_all(kLvx2Format, path);
  EXPECT_TRUE(is_same(again.rows(), read.rows()));
  EXPECT_EQ(again.recording.data.imu.size(), 25U - 2);  // with two of the lost packets
  EXPECT_THAT(warnings_of(again), ElementsAre(Warns(kWarning.shots_lost, {"3 packets"})));
}

TEST(Lvx2, EveryDataTypeIsRead) {
  std::mt19937 random(2);
  std::string packages;
  std::uint16_t number = 0;
  std::size_t rows = 0;
  for (const auto& [type, records] :
       {std::pair(1, 96), {2, 96}, {3, 96}, {0x11, 48}, {1, 10}, {2, 0}}) {
    packages +=
        package({kTime + number * 480'000ULL, number, static_cast<std::uint8_t>(type)},
                points(static_cast<std::uint8_t>(type), static_cast<std::size_t>(records), random));
    ++number;
    rows += static_cast<std::size_t>(records) * (type == 0x11 ? 2 : 1);
  }
  const std::string begin = head({{}});
  const std::string bytes = begin + frame(begin.size(), 0, packages);
  const Outcome read = read_text(kLvx2Format, bytes);
  ASSERT_FALSE(read.error);
  EXPECT_TRUE(read.recording.warnings.empty());
  EXPECT_EQ(read.rows().size(), rows);
  EXPECT_EQ(read.recording.header.returns_per_shot, 2);
  EXPECT_THAT(read.rows().range_resolution[0], ::testing::FloatNear(0.001F, 1e-9F));
  // Spherical records have no place in the format's description: they become points.
  const Outcome again = read_text(kLvx2Format, rewritten(kLvx2Format, bytes));
  ASSERT_EQ(again.rows().size(), rows);
  for (std::size_t row = 0; row < rows; ++row) {
    EXPECT_EQ(again.rows().time_ns[row], read.rows().time_ns[row]);
    EXPECT_NEAR(again.rows().range[row], read.rows().range[row], 9e-4);
  }
}

TEST(Lvx2, SeveralSensorsShareFrames) {
  std::mt19937 random(3);
  std::string bytes = head({{"47MDGEN2000001", 112, 9}, {"6FTEGEN2000002", 7, 10}});
  std::string packages;
  for (std::uint16_t i = 0; i < 40; ++i) {
    if (i != 5) packages += package({kTime + i * 480'000ULL, i}, points(1, 96, random));
    packages += package({5'000'000'000 + i * 212'389ULL, i, 1, 7, 0}, points(1, 96, random));
  }
  bytes += frame(bytes.size(), 0, packages);
  const Outcome read = read_text(kLvx2Format, bytes);
  EXPECT_THAT(warnings_of(read),
              ElementsAre(Warns(kWarning.shots_lost, {"47MDGEN2000001: 1 packets"})));
  EXPECT_EQ(read.rows().size(), 79U * 96);
  EXPECT_EQ(read.recording.header.devices[1].type, kHap);
  EXPECT_TRUE(rewritten(kLvx2Format, bytes) == bytes);
  // The shots of a HAP follow each other at 452 kHz.
  const auto first = std::find(read.rows().device.begin(), read.rows().device.end(), 1) -
                     read.rows().device.begin();
  EXPECT_EQ(read.rows().time_ns[static_cast<std::size_t>(first) + 95], 5'000'000'000 + 210'177);
}

TEST(Lvx2, WhatVariesIsTaken) {
  std::mt19937 random(4);
  const std::string good = points(1, 96, random);
  const std::string begin = head({{}});
  const auto read = [&](const std::string& packages, const std::string& first = {}) {
    const std::string& heads = first.empty() ? begin : first;
    return read_text(kLvx2Format, heads + frame(heads.size(), 0, packages));
  };
  // An unknown data type, a sensor that is not in the table beside one that is, a piece of a
  // record.
  const Outcome odd =
      read(package({kTime, 1}, good) + package({kTime, 1, 9}, "what?") +
           package({kTime, 1, 1, 3}, good) + package({kTime + 480'000, 2}, good.substr(0, 30)));
  ASSERT_FALSE(odd.error);
  EXPECT_EQ(odd.rows().size(), 98U);
  EXPECT_EQ(odd.recording.warnings.size(), 3U);
  // One sensor in the table, and packages of another name.
  const Outcome renamed = read(package({kTime, 1, 1, 3}, good));
  EXPECT_EQ(renamed.rows().size(), 96U);
  EXPECT_EQ(renamed.recording.warnings.size(), 1U);
  // An unknown type: the times decide.
  const Outcome unknown =
      read(package({kTime, 1}, good) + package({kTime + 480'000, 2}, good), head({{"x", 112, 0}}));
  EXPECT_EQ(unknown.recording.header.devices[0].type, kMid360);
  EXPECT_TRUE(unknown.recording.header.devices[0].type_inferred);
  EXPECT_EQ(unknown.rows().time_ns[1], static_cast<std::int64_t>(kTime) + 5000);
  // The same packet twice.
  const Outcome twice = read(package({kTime, 1}, good) + package({kTime, 1}, good));
  EXPECT_EQ(twice.rows().size(), 96U);
  EXPECT_EQ(twice.recording.warnings.size(), 1U);
}

TEST(Lvx2, DamageIsNamedWithItsPlaceAndTheSoundPartKept) {
  std::mt19937 random(5);
  const std::string good = points(1, 96, random);
  const std::string begin = head({{}});
  const std::size_t first = begin.size() + 24, size = 27 + good.size();
  const std::string packages = package({kTime, 1}, good) + package({kTime + 480'000, 2}, good);
  const std::string bytes =
      begin + frame(begin.size(), 0, packages) +
      frame(begin.size() + 24 + packages.size(), 1, package({kTime + 960'000, 3}, good));
  const auto damaged = [&](std::size_t at, const std::string& with) {
    std::string changed = bytes;
    changed.replace(at, with.size(), with);
    return read_text(kLvx2Format, changed);
  };
  expect_damage(damaged(first + size, "\5"), NamesField("version"), 96, first + size);
  expect_damage(damaged(first + size + 18, "\xFF\xFF\xFF"), NamesField("bytes of points"), 96,
                first + size + 18);
  expect_damage(damaged(first + size + 18, "\xFF\xF0"), NamesField("fit"), 96, first + size);
  expect_damage(damaged(first + size + 14, "\xFF"), NamesField("time"), 96, first + size + 7);
  expect_damage(damaged(begin.size() + 24 + packages.size(), "\1"), NamesField("frame header"), 192,
                begin.size() + 24 + packages.size());
  EXPECT_THROW(kLvx2Format.open(io::InputFile("/nonexistent"), {}), FileError);
  for (const auto& [at, byte] : {std::pair(17, 1), {28, 0}}) {  // version 2.1, no device
    const Outcome refused =
        damaged(static_cast<std::size_t>(at), std::string(1, static_cast<char>(byte)));
    EXPECT_FALSE(refused.opened);
    EXPECT_TRUE(refused.error);
  }
}

TEST(Lvx2, CutAnywhereWholePackagesAreKept) {
  std::mt19937 random(6);
  std::string bytes = head({{}});
  const std::size_t begin = bytes.size();
  for (std::uint16_t i = 0; i < 3; ++i) {
    bytes += frame(bytes.size(), i,
                   package({kTime + i * 20'000ULL, i}, points(1, 4, random)) +
                       package({kTime, i, 0}, inertial(i)));
  }
  const auto expected = [&](std::string_view cut) {
    const std::size_t one = 24 + 27 + 4 * 14 + 27 + 24;
    const std::size_t frames = (cut.size() - begin) / one, rest = (cut.size() - begin) % one;
    std::size_t rows = frames * 5;
    if (rest >= 24 + 27 + 4 * 14) rows += 4;
    return std::pair(rows, rest > 0 || frames == 0);
  };
  check_cuts(kLvx2Format, bytes, 1, expected);
}

TEST(Lvx2, SensorsOfTheFirstGenerationAreRefused) {
  const TestFolder folder;
  RecordingHeader header;
  header.devices.emplace_back();
  EXPECT_THROW(kLvx2Format.create(folder.file("a.lvx2"), header, {}), InvalidArgument);
  header.devices[0].type = kMid360;
  header.returns_per_shot = 3;
  EXPECT_THROW(kLvx2Format.create(folder.file("a.lvx2"), header, {}), InvalidArgument);
}

TEST(Lvx2, EmittersKeepTheirPlacesWhereShotsAreMissing) {
  RecordingHeader header;
  header.devices.emplace_back().type = kMid360;
  Chunk chunk;
  Observations& o = chunk.observations;
  o.resize(5);
  for (std::size_t row = 0; row < 5; ++row) {
    const std::size_t shot = std::array<std::size_t, 5>{2, 3, 5, 95, 97}[row];
    o.time_ns[row] = 1'000'000 + static_cast<std::int64_t>(shot) * 5000;
    o.beam[row] = static_cast<std::uint8_t>(shot % 4);
    o.zenith[row] = 1.5;
    o.range[row] = 5.0;
    o.return_number[row] = o.valid[row] = 1;
  }
  const TestFolder folder;
  const std::string path = folder.file("a.lvx2");
  write_all(kLvx2Format, path, header, chunk);
  const Outcome read = read_all(kLvx2Format, path);
  EXPECT_EQ(read.rows().size(), 192U);
  std::vector<std::int64_t> times;
  for (std::size_t row = 0; row < read.rows().size(); ++row) {
    if (read.rows().valid[row] == 0) continue;
    EXPECT_EQ(read.rows().beam[row], o.beam[times.size()]);
    times.push_back(read.rows().time_ns[row]);
  }
  EXPECT_EQ(times, o.time_ns);
}

}  // namespace risley::recordings::lvx2_test
