// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/lvx_bytes.hpp"
#include "refusal.hpp"

namespace risley::recordings::lvx_test {

using namespace format_tests;
using ::testing::_;
using ::testing::ElementsAre;
using namespace lvx_bytes;

constexpr std::uint8_t kMid40 = 1, kHorizon = 3, kMid70 = 6, kAvia = 7;

class LvxTest : public ::testing::Test {
 protected:
  Outcome read(const std::string& bytes, std::size_t max_rows = kDefaultChunkRows) {
    put_bytes(folder_.file("in.lvx"), bytes);
    return read_all([](const std::string& path) { return open_recording(path); },
                    folder_.file("in.lvx"), max_rows);
  }

  /// Copies a recording in chunks of so many rows. @return the bytes of the copy
  std::string copy(const std::string& bytes, std::size_t max_rows = kDefaultChunkRows) {
    put_bytes(folder_.file("in.lvx"), bytes);
    std::filesystem::remove(folder_.file("out.lvx"));
    const auto reader = open_recording(folder_.file("in.lvx"));
    const auto writer = create_recording(folder_.file("out.lvx"), reader->header());
    Chunk chunk;
    while (reader->read(chunk, max_rows)) writer->write(chunk);
    writer->close();
    return get_bytes(folder_.file("out.lvx"));
  }

  std::string write(const RecordingHeader& header, const Chunk& chunk) {
    const auto writer = create_recording(folder_.file("rows.lvx"), header);
    writer->write(chunk);
    writer->close();
    return get_bytes(folder_.file("rows.lvx"));
  }

  TestFolder folder_;
};

RecordingHeader header_for(std::uint8_t device_type, bool cartesian = false, int returns = 1) {
  RecordingHeader header;
  header.devices.resize(1);
  header.devices[0].serial = "1PQDG3B006H2Z11";
  header.devices[0].type = device_type;
  header.cartesian = cartesian;
  header.returns_per_shot = returns;
  return header;
}

/// Rows without packets: shots at these times with so many returns each.
Chunk rows_at(const std::vector<std::int64_t>& times, int returns = 1, std::uint8_t device = 0) {
  Chunk chunk;
  Observations& o = chunk.observations;
  o.resize(times.size() * static_cast<std::size_t>(returns));
  std::size_t row = 0;
  for (std::size_t shot = 0; shot < times.size(); ++shot) {
    for (int number = 1; number <= returns; ++number, ++row) {
      o.time_ns[row] = times[shot];
      o.azimuth[row] = radians_from_degrees(static_cast<double>(shot % 3000) / 100.0 - 15.0);
      o.zenith[row] = radians_from_degrees(90.0 + static_cast<double>(shot % 700) / 100.0);
      o.range[row] = 2.0 * number + static_cast<double>(shot % 1000) / 1000.0;
      o.intensity[row] = static_cast<std::uint8_t>(shot);
      o.return_number[row] = static_cast<std::uint8_t>(number);
      o.tag[row] = returns > 1 ? static_cast<std::uint8_t>(number << 4) : std::uint8_t{0};
      o.valid[row] = 1;
      o.device[row] = device;
    }
  }
  return chunk;
}

std::vector<std::int64_t> grid_times(std::size_t count, double rate_hz, std::int64_t start = 0) {
  std::vector<std::int64_t> times;
  for (std::size_t i = 0; i < count; ++i) {
    times.push_back(start + std::llround(static_cast<double>(i) * 1e9 / rate_hz));
  }
  return times;
}

/// Every row that was written must come back exactly once, and nothing else but null returns.
void expect_same_shots(const Observations& written, const Observations& read) {
  std::size_t row = 0;
  for (std::size_t i = 0; i < read.size(); ++i) {
    if (!read.valid[i]) {
      EXPECT_EQ(read.range[i], 0.0);
      continue;
    }
    ASSERT_LT(row, written.size());
    ASSERT_EQ(read.time_ns[i], written.time_ns[row]) << row;
    ASSERT_NEAR(read.azimuth[i], written.azimuth[row], 1e-12) << row;
    ASSERT_NEAR(read.zenith[i], written.zenith[row], 1e-12) << row;
    ASSERT_NEAR(read.range[i], written.range[row], 1e-9) << row;
    ASSERT_EQ(read.return_number[i], written.return_number[row]) << row;
    ASSERT_EQ(read.tag[i], written.tag[row]) << row;
    ASSERT_EQ(read.intensity[i], written.intensity[row]) << row;
    ++row;
  }
  EXPECT_EQ(row, written.size());
}

/// Two devices in unordered table, mixed data types, inertial samples between packets.
std::string rich_file(std::vector<std::size_t>* frame_starts = nullptr) {
  std::mt19937 random(7);
  std::string file = header_lvx11({{"3JEDK1E001F6361", 9, kAvia}, {"1PQDG3B006H2Z11", 2, kMid40}});
  std::vector<std::size_t> starts;
  starts.push_back(
      put_frame(file,
                {package(9, 1, 8, 1'000'000, random), package(9, 1, 6, 1'050'000, random),
                 package(2, 0, 1, 500, random), package(9, 1, 5, 1'125'000, random)},
                0));
  starts.push_back(put_frame(file, {package(9, 1, 7, 51'000'000, random)}, 1));
  starts.push_back(put_frame(
      file, {package(2, 0, 0, 1'000'500, random), package(9, 1, 6, 51'050'000, random)}, 2));
  if (frame_starts) *frame_starts = starts;
  return file;
}

// --- reading -------------------------------------------------------------------------------------

TEST_F(LvxTest, TheSmallestFileIsWrittenAsDescribed) {
  Chunk chunk = rows_at({0});
  const std::string bytes = write(header_for(kMid40, true), chunk);
  ASSERT_EQ(bytes.size(), 1431U);
  const std::string head("livox_tech\0\0\0\0\0\0\1\1\0\0\x67\xA7\x0E\xAC\x32\0\0\0\1", 29);
  EXPECT_EQ(bytes.substr(0, 29), head);
  EXPECT_EQ(bytes.substr(29, 16), std::string("1PQDG3B006H2Z11\0", 16));
  std::string frame;
  for (const std::uint64_t number : {88, 1431, 0}) put(frame, number);
  EXPECT_EQ(bytes.substr(88, 24), frame);
}

TEST_F(LvxTest, TheDeviceTableAndPacketsAreRead) {
  const Outcome result = read(rich_file());
  ASSERT_FALSE(result.error);
  EXPECT_TRUE(result.recording.warnings.empty());
  const auto reader = open_recording(folder_.file("in.lvx"));
  const RecordingHeader& header = reader->header();
  EXPECT_EQ(header.format, "lvx-1.1");
  ASSERT_EQ(header.devices.size(), 2U);
  EXPECT_EQ(header.devices[0].serial, "3JEDK1E001F6361");
  EXPECT_EQ(header.devices[0].index, 9);
  EXPECT_EQ(header.devices[1].type, kMid40);
  EXPECT_TRUE(header.devices[0].extrinsic_enabled);
  EXPECT_THAT(header.devices[1].roll_pitch_yaw_deg, ElementsAre(1.5F, -2.25F, 90.0F));
  EXPECT_THAT(header.devices[1].translation_m, ElementsAre(0.1F, 0.2F, -0.3F));
  EXPECT_EQ(header.time_reference, TimeReference::ptp);
  EXPECT_EQ(header.returns_per_shot, 3);
  EXPECT_FALSE(header.cartesian);

  std::vector<int> types, devices;
  std::vector<std::uint64_t> frames;
  for (const Packet& packet : result.recording.data.packets) {
    types.push_back(packet.data_type);
    devices.push_back(packet.device_index);
    frames.push_back(packet.frame);
  }
  EXPECT_THAT(types, ElementsAre(8, 6, 1, 5, 7, 0, 6));
  EXPECT_THAT(devices, ElementsAre(9, 9, 2, 9, 9, 2, 9));
  EXPECT_THAT(frames, ElementsAre(0, 0, 0, 0, 1, 2, 2));
  const Observations& o = result.rows();
  ASSERT_EQ(o.size(), 90U + 100 + 96 + 90 + 100);
  EXPECT_EQ(o.device[0], 0);  // row of the table, not the index
  EXPECT_EQ(o.device[90], 1);
  EXPECT_EQ(o.time_ns[90 + 99], 500 + 990'000);
  ASSERT_EQ(result.recording.data.imu.size(), 2U);
  EXPECT_EQ(result.recording.data.imu[1].time_ns, 51'050'000);
}

TEST_F(LvxTest, ChunksStayWithinTheirSizeAndTogetherAreTheWhole) {
  const std::string file = rich_file();
  const Outcome whole = read(file);
  for (const std::size_t max_rows : {1U, 90U, 100U, 250U}) {
    SCOPED_TRACE(max_rows);
    const Outcome pieces = read(file, max_rows);
    EXPECT_EQ(pieces.recording.data.packets.size(), whole.recording.data.packets.size());
    ASSERT_EQ(pieces.rows().size(), whole.rows().size());
    EXPECT_TRUE(is_prefix(pieces.rows(), whole.rows()));
    const auto reader = open_recording(folder_.file("in.lvx"));
    Chunk chunk;
    while (reader->read(chunk, max_rows)) {
      EXPECT_LE(chunk.observations.size(), std::max<std::size_t>(max_rows, 100));
    }
    EXPECT_EQ(reader->fraction_read(), 1.0);
  }
}

TEST_F(LvxTest, MemoryDoesNotGrowWithTheRecording) {
  // 4 million rows in one frame that never ends: neither side may collect them.
  const std::string path = folder_.file("long.lvx"), again = folder_.file("again.lvx");
  RecordingHeader header = header_for(kMid40);
  header.frame_duration_ms = 4'000'000;
  const auto writer = create_recording(path, header);
  for (int i = 0; i < 40; ++i) {
    writer->write(rows_at(grid_times(100'000, 1e5, i * std::int64_t{1'000'000'000})));
  }
  writer->close();
  const auto reader = open_recording(path);
  const auto copy_writer = create_recording(again, reader->header());
  Chunk chunk;
  std::size_t rows = 0, largest = 0;
  while (reader->read(chunk, 10'000)) {
    rows += chunk.observations.size();
    largest = std::max({largest, chunk.observations.time_ns.capacity(), chunk.packets.capacity()});
    copy_writer->write(chunk);
  }
  copy_writer->close();
  EXPECT_EQ(rows, 4'000'000U);
  EXPECT_LE(largest, 10'000U);
  EXPECT_EQ(std::filesystem::file_size(path), 88 + 24 + 40'000 * 919);
  EXPECT_TRUE(get_bytes(again) == get_bytes(path));
}

// --- writing what was read -----------------------------------------------------------------------

TEST_F(LvxTest, AFileThatWasReadIsWrittenWithTheSameBytes) {
  const std::string file = rich_file();
  for (const std::size_t max_rows : {std::size_t{1}, std::size_t{200}, kDefaultChunkRows}) {
    EXPECT_TRUE(copy(file, max_rows) == file) << max_rows;
  }
}

TEST_F(LvxTest, RowsWithoutPacketsAreWrittenExactlyAndStayTheSame) {
  struct Case {
    const char* name;
    std::uint8_t type;
    bool cartesian;
    int returns;
    double rate_hz;
    std::uint8_t data_type;
    std::size_t packets;
  };
  const Case cases[] = {
      {"Mid-40 spherical", kMid40, false, 1, 1e5, 1, 200},
      {"Mid-40 Cartesian", kMid40, true, 1, 1e5, 0, 200},
      {"Mid-40 dual", kMid40, false, 2, 1e5, 5, 417},
      {"Mid-40 triple", kMid40, false, 3, 1e5, 8, 667},
      {"Mid-70 single", kMid70, false, 1, 1e5, 3, 209},
      {"Mid-70 Cartesian dual", kMid70, true, 2, 1e5, 4, 417},
      {"Horizon single", kHorizon, false, 1, 2.4e5, 3, 209},
      {"Avia dual", kAvia, false, 2, 2.4e5, 5, 417},
      {"Avia triple", kAvia, false, 3, 2.4e5, 8, 667},
      {"Avia Cartesian triple", kAvia, true, 3, 2.4e5, 7, 667},
      {"sparse, 1 kHz", kMid40, false, 1, 1e3, 1, 20'000},
      {"sparse, 20 kHz", kMid40, false, 1, 2e4, 1, 1'000},
      {"off the grid", kMid40, false, 1, 3e4, 1, 20'000},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const RecordingHeader header = header_for(c.type, c.cartesian, c.returns);
    const Chunk chunk = rows_at(grid_times(20'000, c.rate_hz, 123'000), c.returns);
    const std::string bytes = write(header, chunk);
    const Outcome result = read(bytes);
    ASSERT_FALSE(result.error);
    EXPECT_TRUE(result.recording.warnings.empty());
    EXPECT_EQ(result.recording.data.packets.size(), c.packets);
    EXPECT_EQ(result.recording.data.packets[0].data_type, c.data_type);
    if (!c.cartesian) expect_same_shots(chunk.observations, result.rows());
    ASSERT_GE(result.rows().size(), chunk.observations.size());
    for (std::size_t row = 0; c.cartesian && row < chunk.observations.size(); ++row) {
      // Without gaps in time the rows stand in the same order.
      ASSERT_EQ(result.rows().time_ns[row], chunk.observations.time_ns[row]);
      ASSERT_NEAR(result.rows().range[row], chunk.observations.range[row], 0.9e-3);
    }
    EXPECT_TRUE(copy(bytes, 1000) == bytes);
  }
}

TEST_F(LvxTest, RowsMayComeInPiecesOfAnySize) {
  const Chunk all = rows_at(grid_times(500, 2.4e5), 3);
  const RecordingHeader header = header_for(kAvia, false, 3);
  const std::string at_once = write(header, all);
  const auto writer = create_recording(folder_.file("pieces.lvx"), header);
  for (std::size_t row = 0; row < all.observations.size(); row += 7) {
    Chunk piece;
    piece.observations.append(all.observations, row, std::min(row + 7, all.observations.size()));
    writer->write(piece);
  }
  writer->close();
  EXPECT_TRUE(get_bytes(folder_.file("pieces.lvx")) == at_once);
}

TEST_F(LvxTest, FormedPacketsGoIntoFramesOfTheirDuration) {
  RecordingHeader header = header_for(kMid40);
  header.frame_duration_ms = 20;
  // 100 ms of shots, then a pause of 1 s: no frame is empty.
  std::vector<std::int64_t> times = grid_times(10'000, 1e5);
  for (const std::int64_t t : grid_times(100, 1e5, 1'100'000'000)) times.push_back(t);
  const std::string bytes = write(header, rows_at(times));
  const Outcome result = read(bytes);
  std::vector<int> packets_of_frame(6);
  for (const Packet& packet : result.recording.data.packets) ++packets_of_frame.at(packet.frame);
  EXPECT_THAT(packets_of_frame, ElementsAre(20, 20, 20, 20, 20, 1));
  // The last frame ends with the file.
  std::uint64_t next = 0;
  std::memcpy(&next, bytes.data() + bytes.size() - 919 - 24 + 8, 8);
  EXPECT_EQ(next, bytes.size());
}

TEST_F(LvxTest, ShotsWithoutReturnKeepTheirPlaceAndTheirAngles) {
  Chunk chunk = rows_at(grid_times(100, 1e5));
  Observations& o = chunk.observations;
  o.range[40] = 0;
  o.valid[40] = 0;
  o.azimuth[41] = o.zenith[41] = o.range[41] = std::numeric_limits<double>::quiet_NaN();
  o.valid[41] = 0;
  const Outcome result = read(write(header_for(kMid40), chunk));
  const Observations& again = result.rows();
  ASSERT_EQ(again.size(), 100U);
  EXPECT_EQ(again.range[40], 0.0);
  EXPECT_NEAR(again.azimuth[40], o.azimuth[40], 1e-12);
  EXPECT_NEAR(again.zenith[40], o.zenith[40], 1e-12);
  EXPECT_EQ(again.range[41], 0.0);
  EXPECT_EQ(again.valid[40] + again.valid[41], 0);
  EXPECT_EQ(again.valid[42], 1);
}

TEST_F(LvxTest, TagsAndFurtherReturnsThatAppearLateAreKept) {
  Chunk chunk = rows_at(grid_times(300, 1e5));
  chunk.observations.tag[50] = 0x10;  // from here on records with a tag
  Chunk second = rows_at({3'000'000, 3'010'000}, 2);
  chunk.observations.append(second.observations);
  const Outcome result = read(write(header_for(kMid40), chunk));
  expect_same_shots(chunk.observations, result.rows());
  EXPECT_EQ(result.recording.data.packets.front().data_type, 1);
  EXPECT_EQ(result.recording.data.packets.back().data_type, 5);
}

TEST_F(LvxTest, SeveralDevicesAndInertialSamplesAreWritten) {
  RecordingHeader header = header_for(kMid40);
  header.devices.push_back(header.devices[0]);
  header.devices[1].index = 4;
  header.devices[1].serial = "1PQDG3B006H2Z12";
  Chunk chunk;
  const auto times = grid_times(250, 1e5);
  for (const std::int64_t t : times) {
    chunk.observations.append(rows_at({t}, 1, 0).observations);
    chunk.observations.append(rows_at({t + 3}, 1, 1).observations);
  }
  for (const std::int64_t t : {1'000, 1'500'000, 9'000'000}) {
    ImuSample sample;
    sample.time_ns = t;
    sample.device = 1;
    sample.angular_velocity = {1, 2, 3};
    chunk.imu.push_back(sample);
  }
  const std::string bytes = write(header, chunk);
  const Outcome result = read(bytes);
  ASSERT_EQ(result.recording.data.imu.size(), 3U);
  EXPECT_EQ(result.recording.data.imu[1].time_ns, 1'500'000);
  EXPECT_EQ(result.recording.data.imu[1].device, 1);
  std::vector<std::int64_t> first, second;
  for (std::size_t row = 0; row < result.rows().size(); ++row) {
    if (!result.rows().valid[row]) continue;
    (result.rows().device[row] == 0 ? first : second).push_back(result.rows().time_ns[row]);
  }
  EXPECT_EQ(first, times);
  ASSERT_EQ(second.size(), times.size());
  for (std::size_t i = 0; i < times.size(); ++i) ASSERT_EQ(second[i], times[i] + 3);
  EXPECT_TRUE(copy(bytes) == bytes);
}

TEST_F(LvxTest, TimesKeepTheirReference) {
  struct Case {
    TimeReference reference, read_as;
    std::int64_t start, read_start;
  };
  const Case cases[] = {
      {TimeReference::relative, TimeReference::power_on, 5'000'000'017, 5'000'000'017},
      {TimeReference::power_on, TimeReference::power_on, 17, 17},
      {TimeReference::ptp, TimeReference::ptp, 1'700'000'000'123'456'789,
       1'700'000'000'123'456'789},
      {TimeReference::utc, TimeReference::utc, 1'704'067'199'999'999'000,
       1'704'067'199'999'999'000},
      // whole seconds before the first packet are not part of PPS times
      {TimeReference::pps, TimeReference::pps, 7'999'000'000, 999'000'000},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(to_string(c.reference));
    RecordingHeader header = header_for(kMid40);
    header.time_reference = c.reference;
    Chunk chunk = rows_at(grid_times(250'000, 1e5, c.start));
    const std::string bytes = write(header, chunk);
    const Outcome result = read(bytes);
    const auto reader = open_recording(folder_.file("in.lvx"));
    EXPECT_EQ(reader->header().time_reference, c.read_as);
    for (std::int64_t& t : chunk.observations.time_ns) t += c.read_start - c.start;
    ASSERT_GE(result.rows().size(), chunk.observations.size());
    expect_same_shots(chunk.observations, result.rows());
    EXPECT_TRUE(copy(bytes) == bytes);
  }
}

TEST_F(LvxTest, WhatLvxCannotHoldIsRefused) {
  RecordingHeader header = header_for(kMid40);
  Chunk good = rows_at(grid_times(3, 1e5));
  const auto refused = [&](const std::vector<const char*>& words, auto&& change) {
    RecordingHeader changed_header = header;
    Chunk changed = good;
    change(changed_header, changed, changed.observations);
    const std::string problem = refusal<InvalidArgument>([&] { write(changed_header, changed); });
    for (const char* word : words) EXPECT_THAT(problem, NamesField(word));
  };
  using Header = RecordingHeader;
  write(header, good);
  refused({"row 0", "range"}, [](Header&, Chunk&, Observations& o) {
    o.range.assign(3, std::numeric_limits<double>::quiet_NaN());
  });
  refused({"ranges"}, [](Header& h, Chunk&, Observations&) { h.has_range = false; });
  refused({"row 0", "-1 ns"}, [](Header&, Chunk&, Observations& o) { o.time_ns[0] = -1; });
  refused({"1970", "2000 to 2255"},
          [](Header& h, Chunk&, Observations&) { h.time_reference = TimeReference::utc; });
  refused({"row 1", "PPS"}, [](Header& h, Chunk& chunk, Observations&) {
    h.time_reference = TimeReference::pps;
    chunk = rows_at({0, 1'500'000'000});
  });
  refused({"row 2", "device"}, [](Header&, Chunk&, Observations& o) { o.device[2] = 1; });
  for (const int number : {0, 4}) {
    refused({fmt::format("return_number = {}", number).c_str()},
            [&](Header&, Chunk&, Observations& o) {
              o.return_number[1] = static_cast<std::uint8_t>(number);
            });
  }
  refused({"row 250", "-2 m"}, [](Header&, Chunk& chunk, Observations& o) {
    chunk = rows_at(grid_times(300, 1e5));
    o.range[250] = -2;
  });
  refused({"type 200"}, [](Header& h, Chunk&, Observations&) { h = header_for(200); });
  refused({"twice"}, [](Header& h, Chunk&, Observations&) { h.devices.push_back(h.devices[0]); });
  refused({"at most 16"},
          [](Header& h, Chunk&, Observations&) { h.devices[0].serial = "seventeen letters"; });
  refused({"1 to 3"}, [](Header& h, Chunk&, Observations&) { h.returns_per_shot = 4; });

  // Packets that do not belong to their rows.
  const Outcome result = read(rich_file());
  header = open_recording(folder_.file("in.lvx"))->header();
  good = result.recording.data;
  write(header, good);
  refused({"Chunk::packets"}, [](Header&, Chunk& c, Observations&) { c.packets.pop_back(); });
  refused({"Chunk::packets"}, [](Header&, Chunk& c, Observations&) { c.imu.pop_back(); });
  refused({"Chunk::packets"}, [](Header&, Chunk& c, Observations&) { c.packets[0].rows = 89; });
  refused({"device index"},
          [](Header&, Chunk& c, Observations&) { c.packets[0].device_index = 3; });
  refused({"timestamp"}, [](Header&, Chunk&, Observations& o) { o.time_ns[0] += 2000; });
}

TEST_F(LvxTest, NothingIsLeftWithoutClose) {
  {
    const auto writer = create_recording(folder_.file("half.lvx"), header_for(kMid40));
    writer->write(rows_at(grid_times(1000, 1e5)));
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.file("half.lvx")));
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(folder_.file(".")).parent_path()));
}

// --- damage --------------------------------------------------------------------------------------

TEST_F(LvxTest, ACutAtAnyByteLosesOnlyTheTail) {
  std::vector<std::size_t> frames;
  const std::string file = rich_file(&frames);
  const Outcome whole = read(file);
  // What stands before the cut is known from the file's description alone.
  const std::size_t sizes[] = {679, 43, 919, 787, 1279, 1319, 43};
  const std::size_t rows[] = {90, 0, 100, 96, 90, 100, 0};
  const std::size_t frame_of[] = {0, 0, 0, 0, 1, 2, 2};
  std::vector<std::size_t> ends;
  for (std::size_t i = 0, at = 0; i < 7; ++i) {
    if (i == 0 || frame_of[i] != frame_of[i - 1]) at = frames[frame_of[i]] + 24;
    at += sizes[i];
    ends.push_back(at);
  }
  ASSERT_EQ(ends.back(), file.size());
  for (std::size_t cut = 0; cut <= file.size(); ++cut) {
    SCOPED_TRACE(cut);
    const Outcome result = read(file.substr(0, cut));
    if (cut < frames[0]) {
      ASSERT_FALSE(result.opened);
      // Without the whole name it is not recognised as LVX.
      if (cut >= 16) {
        ASSERT_TRUE(result.error->place().byte_offset);
        EXPECT_LE(*result.error->place().byte_offset, cut);
      }
      continue;
    }
    ASSERT_TRUE(result.opened);
    ASSERT_FALSE(result.error);
    std::size_t expected = 0, packets = 0;
    while (packets < 7 && ends[packets] <= cut) expected += rows[packets++];
    ASSERT_EQ(result.rows().size(), expected);
    ASSERT_EQ(result.recording.data.packets.size(), packets);
    EXPECT_TRUE(is_prefix(result.rows(), whole.rows()));
    // A cut between two frames leaves a file that is whole.
    const bool between = cut == file.size() || cut == frames[1] || cut == frames[2];
    ASSERT_EQ(result.recording.warnings.size(), between ? 0U : 1U);
    if (between) continue;
    const Warning& warning = result.recording.warnings[0];
    ASSERT_TRUE(warning.place.byte_offset);
    EXPECT_LE(*warning.place.byte_offset, cut);
    // Eleven bytes of a package state how many records it had.
    const std::size_t left = cut - *warning.place.byte_offset;
    const bool in_package = *warning.place.byte_offset != frames[0] &&
                            *warning.place.byte_offset != frames[1] &&
                            *warning.place.byte_offset != frames[2];
    if (in_package && left >= 11) {
      const std::size_t records[] = {30, 1, 100, 48, 30, 100, 1};
      EXPECT_EQ(warning.lost_records, records[packets]);
      EXPECT_THAT(warning, Warns(kWarning.cut_off));
    } else {
      EXPECT_EQ(warning.lost_records, 0U);
    }
  }
}

TEST_F(LvxTest, AFlippedHeaderBitInventsNoPoint) {
  std::vector<std::size_t> frames;
  const std::string file = rich_file(&frames);
  const Outcome whole = read(file);
  std::vector<std::size_t> bytes;
  for (std::size_t i = 0; i < 24; ++i) bytes.push_back(i);
  bytes.push_back(28);
  for (const std::size_t frame : frames) {
    for (std::size_t i = 0; i < 24; ++i) bytes.push_back(frame + i);
  }
  for (const std::size_t i : {0, 1}) bytes.push_back(frames[1] + 24 + static_cast<std::size_t>(i));
  for (const std::size_t at : bytes) {
    for (int bit = 0; bit < 8; ++bit) {
      SCOPED_TRACE(::testing::Message() << "byte " << at << " bit " << bit);
      std::string damaged = file;
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << bit));
      const Outcome result = read(damaged);
      if (at < 24) {
        EXPECT_FALSE(result.opened);
        continue;
      }
      if (!result.opened) continue;
      EXPECT_TRUE(is_prefix(result.rows(), whole.rows()));
      const bool complete =
          result.recording.data.packets.size() == whole.recording.data.packets.size();
      EXPECT_TRUE(complete || result.error || !result.recording.warnings.empty());
      const bool is_current = std::any_of(frames.begin(), frames.end(), [&](std::size_t frame) {
        return at >= frame && at < frame + 8;
      });
      if (is_current) {
        EXPECT_TRUE(result.error);
      }
    }
  }
}

TEST_F(LvxTest, DamagedHeadersAreNamed) {
  const std::string file = rich_file();
  const auto refused = [&](const std::map<std::size_t, char>& changes,
                           const std::vector<const char*>& words) {
    std::string bytes = file;
    for (const auto& [at, value] : changes) bytes[at] = value;
    const Outcome result = read(bytes);
    ASSERT_FALSE(result.opened);
    for (const char* word : words) EXPECT_THAT(result.error->what(), NamesField(word));
  };
  refused({{16, 2}}, {"byte 16", "2.1.0.0"});
  refused({{17, 7}}, {"byte 16", "1.7.0.0"});
  refused({{20, 0}}, {"byte 20", "AC0EA767"});
  refused({{28, 0}}, {"byte 28", "devices = 0"});
  refused({{29 + 59 + 32, 9}}, {"device index 9", "twice"});
  EXPECT_THAT(read(file.substr(0, 100)).error->what(), NamesField("device table"));
}

TEST_F(LvxTest, DamageInTheBodyIsReportedAfterTheSoundRows) {
  std::vector<std::size_t> frames;
  const std::string file = rich_file(&frames);
  const Outcome whole = read(file);
  struct Case {
    const char* name;
    std::size_t at;
    std::uint8_t value;
    std::size_t offset, packets;
    const char* named;
  };
  const std::size_t second = frames[0] + 24 + 679;  // the IMU package
  const Case cases[] = {
      {"version", second + 1, 6, second + 1, 1, "version = 6"},
      {"device", second, 5, second, 1, "device 5"},
      {"first package", frames[0] + 24, 7, frames[0] + 24, 0, "device 7"},
      {"position", frames[1], 1, frames[1], 4, "position"},
      {"too large a type", frames[1] + 24 + 10, 2, frames[1] + 24, 4, "fit"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    std::string damaged = file;
    damaged[c.at] = static_cast<char>(c.value);
    for (const std::size_t max_rows : {std::size_t{1}, kDefaultChunkRows}) {
      const Outcome result = read(damaged, max_rows);
      ASSERT_TRUE(result.opened);
      expect_damage(result, NamesField(c.named), {}, c.offset);
      EXPECT_EQ(result.recording.data.packets.size(), c.packets);
      EXPECT_TRUE(is_prefix(result.rows(), whole.rows()));
    }
  }
}

TEST_F(LvxTest, UnknownDataTypesAreSteppedOverToTheNextFrame) {
  std::vector<std::size_t> frames;
  std::string file = rich_file(&frames);
  const std::size_t second = frames[0] + 24 + 679;
  file[second + 10] = 9;
  Outcome result = read(file);
  ASSERT_FALSE(result.error);
  std::vector<int> types;
  for (const Packet& packet : result.recording.data.packets) types.push_back(packet.data_type);
  EXPECT_THAT(types, ElementsAre(8, 7, 0, 6));
  ASSERT_EQ(result.recording.warnings.size(), 1U);
  EXPECT_EQ(result.recording.warnings[0].place.byte_offset, second);
  EXPECT_THAT(result.recording.warnings[0], Warns(kWarning.content_left_out, {"data type 9"}));
  file[frames[1] + 24 + 10] = 9;
  result = read(file);
  EXPECT_EQ(result.recording.warnings.size(), 1U);
  EXPECT_THAT(result.recording.warnings[0], Warns(kWarning.content_left_out, {"1 more"}));
}

TEST_F(LvxTest, TheLastFrameMayBeLeftOpen) {
  std::vector<std::size_t> frames;
  const std::string file = rich_file(&frames);
  const Outcome whole = read(file);
  for (const std::uint64_t next :
       {std::uint64_t{0}, std::uint64_t{frames[2]}, std::uint64_t{frames[2] - 5},
        std::uint64_t{file.size() + 1}, ~std::uint64_t{0}}) {
    SCOPED_TRACE(next);
    std::string open = file;
    put_at(open, frames[2] + 8, next);
    Outcome result = read(open);
    ASSERT_FALSE(result.error);
    ASSERT_EQ(result.rows().size(), whole.rows().size());
    EXPECT_TRUE(is_prefix(result.rows(), whole.rows()));
    EXPECT_EQ(result.recording.data.imu.size(), 2U);
    ASSERT_EQ(result.recording.warnings.size(), 1U);
    EXPECT_EQ(result.recording.warnings[0].place.byte_offset, file.size());
    // An open frame in the middle does not hide the frames behind it.
    open = file;
    put_at(open, frames[0] + 8, next == frames[2] || next == frames[2] - 5 ? 0 : next);
    result = read(open);
    ASSERT_FALSE(result.error);
    EXPECT_EQ(result.recording.data.packets.size(), whole.recording.data.packets.size());
    EXPECT_EQ(result.recording.warnings.size(), 1U);
  }
}

TEST_F(LvxTest, EmptyFramesAreRead) {
  std::mt19937 random(1);
  std::string file = header_lvx11({{"A", 0, kMid40}});
  put_frame(file, {}, 0);
  put_frame(file, {package(0, 0, 1, 0, random)}, 1);
  put_frame(file, {}, 2);
  const Outcome result = read(file);
  EXPECT_FALSE(result.error);
  EXPECT_TRUE(result.recording.warnings.empty());
  ASSERT_EQ(result.recording.data.packets.size(), 1U);
  EXPECT_EQ(result.recording.data.packets[0].frame, 1U);
}

// --- what the packets themselves state
// ------------------------------------------------------------

TEST_F(LvxTest, TheRateOfAnUnknownDeviceIsTakenFromItsPackets) {
  for (const auto& [period, last] : {std::pair{960'000, 950'000}, std::pair{400'000, 395'833}}) {
    std::mt19937 random(1);
    std::string file = header_lvx11({{"A", 0, 99}});
    std::vector<std::string> packages;
    for (int i = 0; i < 10; ++i) {
      packages.push_back(package(0, 0, 3, static_cast<std::uint64_t>(i) * period, random));
    }
    put_frame(file, packages, 0);
    const Outcome result = read(file);
    EXPECT_EQ(result.rows().time_ns[95], last);
    EXPECT_THAT(warnings_of(result), ElementsAre(Warns(kWarning.devices_unclear, {"type 99"})));
    EXPECT_TRUE(copy(file) == file);
  }
}

TEST_F(LvxTest, SeveralReturnsInSingleReturnRecordsAreToldByPeriodAndIntensity) {
  struct Case {
    int interleaved;
    std::uint64_t period_ns;
    std::int64_t last_ns;
    bool forced_intensity;
    int returns;
  };
  const Case cases[] = {
      {2, 500'000, 490'000, true, 2},
      {3, 566'667, 550'000, true, 3},
      {2, 500'000, 990'000, false, 1},   // any intensity: an ordinary Mid-40
      {2, 1'000'000, 990'000, true, 1},  // ordinary period
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(::testing::Message() << c.interleaved << " " << c.period_ns);
    std::string file = header_lvx11({{"A", 0, kMid40}});
    std::vector<std::string> packages;
    for (std::uint64_t i = 0; i < 10; ++i) {
      std::string one = package_header(0, 0, 1, i * c.period_ns);
      for (int record = 0; record < 100; ++record) {
        const int number = record % c.interleaved;
        const int intensity = number == 0 || !c.forced_intensity ? 30 : (number == 1 ? 200 : 250);
        one += spherical_record(1, 9000, 100, {static_cast<std::uint32_t>(5000 + number)},
                                static_cast<std::uint8_t>(intensity), 0);
      }
      packages.push_back(one);
    }
    put_frame(file, packages, 0);
    const Outcome result = read(file);
    const Observations& o = result.rows();
    EXPECT_EQ(o.time_ns[99], c.last_ns);
    EXPECT_EQ(o.return_number[1], c.returns == 1 ? 1 : 2);
    EXPECT_EQ(o.return_number[c.returns], 1);
    EXPECT_EQ(open_recording(folder_.file("in.lvx"))->header().returns_per_shot, c.returns);
    EXPECT_TRUE(copy(file) == file);
  }
}

// --- LVX 1.0 -------------------------------------------------------------------------------------

std::string float_package(std::uint8_t device, std::uint64_t time, float x0) {
  std::string bytes = package_header(device, 0, 0, time);
  for (int i = 0; i < 100; ++i) {
    const bool missing = i % 10 == 9;
    put(bytes, missing ? 0.0F : x0 + static_cast<float>(i) / 1000.0F);
    put(bytes, missing ? 0.0F : 1.25F);
    put(bytes, missing ? 0.0F : -0.5F);
    put(bytes, static_cast<std::uint8_t>(i));
  }
  return bytes;
}

std::string lvx10_file(std::size_t header_bytes, bool empty_first) {
  std::string file = header_lvx10({{"A", 3, kMid40}, {"B", 1, kMid40}});
  if (empty_first) put_frame(file, {}, 0, header_bytes);
  put_frame(file, {float_package(3, 0, 2.0F), float_package(1, 7, 3.0F)}, 1, header_bytes);
  put_frame(file, {float_package(3, 1'000'000, 4.0F)}, 2, header_bytes);
  return file;
}

TEST_F(LvxTest, Lvx10IsReadWithBothSizesOfFrameHeaders) {
  for (const std::size_t header_bytes : {24U, 32U}) {
    for (const bool empty_first : {false, true}) {
      SCOPED_TRACE(::testing::Message() << header_bytes << " " << empty_first);
      const std::string file = lvx10_file(header_bytes, empty_first);
      const Outcome result = read(file);
      ASSERT_FALSE(result.error);
      EXPECT_TRUE(result.recording.warnings.empty());
      const RecordingHeader header = open_recording(folder_.file("in.lvx"))->header();
      EXPECT_EQ(header.format, "lvx-1.0");
      EXPECT_TRUE(header.cartesian);
      ASSERT_EQ(header.devices.size(), 2U);
      EXPECT_THAT(header.devices[1].translation_m, ElementsAre(0.1F, 0.2F, -0.3F));
      const Observations& o = result.rows();
      ASSERT_EQ(o.size(), 300U);
      EXPECT_NEAR(o.range[0], std::sqrt(4 + 1.5625 + 0.25), 1e-7);
      EXPECT_NEAR(o.azimuth[0], std::atan2(1.25, 2.0), 1e-7);
      EXPECT_NEAR(o.zenith[0], std::acos(-0.5 / o.range[0]), 1e-7);
      EXPECT_EQ(o.valid[9], 0);
      EXPECT_EQ(o.intensity[9], 9);
      EXPECT_EQ(o.time_ns[199], 990'007);
      EXPECT_EQ(o.device[100], 1);

      // As LVX 1.1 the points are whole millimetres.
      const Outcome converted = read(copy(file));
      ASSERT_EQ(converted.rows().size(), 300U);
      EXPECT_EQ(converted.rows().time_ns, o.time_ns);
      for (std::size_t row = 0; row < 300; ++row) {
        ASSERT_NEAR(converted.rows().range[row], o.range[row], 1e-6);
      }
    }
  }
}

TEST_F(LvxTest, Lvx10CutsAndDamageLoseOnlyTheTail) {
  for (const std::size_t header_bytes : {24U, 32U}) {
    const std::string file = lvx10_file(header_bytes, false);
    const Outcome whole = read(file);
    const std::size_t first = 25 + 2 * 58;
    for (std::size_t cut = first + header_bytes + 1319; cut < file.size(); ++cut) {
      const Outcome result = read(file.substr(0, cut));
      ASSERT_FALSE(result.error) << cut;
      ASSERT_GE(result.rows().size(), 100U);
      EXPECT_TRUE(is_prefix(result.rows(), whole.rows()));
      ASSERT_EQ(result.recording.warnings.size(), cut == first + header_bytes + 2 * 1319 ? 0U : 1U)
          << cut;
    }
    for (std::size_t cut = 0; cut < first; ++cut) {
      ASSERT_FALSE(read(file.substr(0, cut)).opened) << cut;
    }
    std::string damaged = file;
    put_at(damaged, first + header_bytes + 1319 + 19 + 13, std::numeric_limits<float>::quiet_NaN());
    expect_damage(read(damaged), _, 100, first + header_bytes + 1319 + 19 + 13);
  }
}

}  // namespace risley::recordings::lvx_test
