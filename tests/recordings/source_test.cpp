// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/source.hpp"

#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "recordings/format_tests.hpp"
#include "refusal.hpp"

namespace risley::recordings::source_test {

using format_tests::TestFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;

/// Packets of 5 rows, each third one with an inertial sample instead.
Recording recording_of(std::size_t packets) {
  Recording recording;
  recording.header.format = "lvx-1.1";
  recording.header.devices.resize(1);
  Chunk& data = recording.data;
  for (std::size_t i = 0; i < packets; ++i) {
    Packet packet;
    const auto time = static_cast<std::int64_t>(i) * 1'000'000;
    if (i % 3 == 2) {
      packet.data_type = livox::kImuDataType;
      data.imu.push_back({time, 0, {0.1F, 0.2F, static_cast<float>(i)}, {0, 0, 1}});
    } else {
      packet.rows = 5;
      for (int k = 0; k < 5; ++k) {
        Observations& rows = data.observations;
        rows.resize(rows.size() + 1);
        rows.time_ns.back() = time + 10'000 * k;
        rows.azimuth.back() = 0.01 * static_cast<double>(i);
        rows.zenith.back() = 1.5 + 0.01 * k;
        rows.range.back() = 10;
        rows.return_number.back() = 1;
        rows.valid.back() = 1;
      }
    }
    data.packets.push_back(packet);
  }
  return recording;
}

std::shared_ptr<const Recording> shared(Recording recording) {
  return std::make_shared<const Recording>(std::move(recording));
}

/// Packets, first time and number of rows, inertial samples of every chunk.
std::vector<std::string> chunks_of(const Source& source, std::size_t max_rows) {
  const auto reader = open_recording(source);
  std::vector<std::string> chunks;
  Chunk chunk;
  while (reader->read(chunk, max_rows)) {
    const Observations& rows = chunk.observations;
    chunks.push_back(fmt::format("{} packets, {} rows from {}, {} samples", chunk.packets.size(),
                                 rows.size(), rows.size() > 0 ? rows.time_ns.front() : -1,
                                 chunk.imu.size()));
  }
  EXPECT_EQ(reader->fraction_read(), 1.0);
  return chunks;
}

TEST(SourceTest, ColumnsInMemoryAreReadAsTheirFileIs) {
  const TestFolder folder;
  const std::string path = folder.file("packets.nc");
  const auto recording = shared(recording_of(40));
  const auto writer = create_recording(path, recording->header);
  writer->write(recording->data);
  writer->close();
  const Source memory(recording, "recording in memory");
  for (const std::size_t max_rows : {1, 5, 6, 17, 1000}) {
    EXPECT_EQ(chunks_of(memory, max_rows), chunks_of(path, max_rows)) << max_rows;
  }
  const Recording again = load_recording(memory);
  const Recording from_file = load_recording(path);
  EXPECT_EQ(again.data.observations.time_ns, from_file.data.observations.time_ns);
  EXPECT_EQ(again.data.observations.zenith, from_file.data.observations.zenith);
  EXPECT_EQ(again.data.imu.size(), from_file.data.imu.size());
}

TEST(SourceTest, RowsOfAPacketStayTogetherWithoutItsHeader) {
  Recording recording = recording_of(6);  // 20 rows
  recording.data.packets.clear();
  recording.data.imu.clear();
  recording.header.packet_shots = 9;
  recording.data.packet_begins = {0, 3, 12};
  const Source source(shared(std::move(recording)), "recording in memory");
  const auto reader = open_recording(source);
  std::vector<std::vector<std::size_t>> begins;
  std::vector<std::size_t> rows;
  Chunk chunk;
  while (reader->read(chunk, 5)) {
    begins.push_back(chunk.packet_begins);
    rows.push_back(chunk.observations.size());
  }
  EXPECT_THAT(rows, ElementsAre(3, 9, 8));
  EXPECT_THAT(begins, ElementsAre(ElementsAre(0), ElementsAre(0), ElementsAre(0)));
  EXPECT_THAT(load_recording(source).data.packet_begins, ElementsAre(0, 3, 12));
}

TEST(SourceTest, OptionsOfReadingHoldInMemoryToo) {
  const auto recording = shared(recording_of(6));
  ReadOptions options;
  options.shot_rate = 1000.0;
  const Recording counted = load_recording(Source(recording, "memory"), {}, options);
  EXPECT_EQ(counted.data.observations.time_ns[7], 7'000'000);
  EXPECT_TRUE(counted.data.packets.empty());
  EXPECT_EQ(recording->data.observations.time_ns[7], 1'020'000);
}

TEST(SourceTest, TwoSourcesAreTheSameOrNot) {
  const TestFolder folder;
  format_tests::put_bytes(folder.file("a"), "a");
  format_tests::put_bytes(folder.file("b"), "b");
  const auto recording = shared(recording_of(1));
  const Source memory(recording, "a");
  EXPECT_TRUE(Source(folder.file("a")).is_same_as(folder.file("./a")));
  EXPECT_FALSE(Source(folder.file("a")).is_same_as(folder.file("b")));
  EXPECT_TRUE(memory.is_same_as(Source(recording, "b")));
  EXPECT_FALSE(memory.is_same_as(Source(shared(recording_of(1)), "a")));
  EXPECT_FALSE(memory.is_same_as("a"));
  EXPECT_TRUE(Source().empty());
  EXPECT_FALSE(memory.empty());
  EXPECT_TRUE(recording_files(memory).empty());
  EXPECT_THAT(recording_files(folder.file("a")), ElementsAre(folder.file("a")));
}

/// What is said of columns that were changed.
template <class Change>
std::string problem_of(Change&& change) {
  Recording recording = recording_of(4);
  change(recording);
  try {
    const Source refused(shared(std::move(recording)), "memory");
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "none";
}

TEST(SourceTest, DamageThatAQuestionMeetsIsKept) {
  const TestFolder folder;
  std::string text = "time_s,x_m,y_m,z_m\n";
  constexpr int kSound = 300'000;  // more than the first rows
  for (int row = 0; row < kSound; ++row) text += fmt::format("{:.5f},1,2,3\n", 1e-5 * row);
  format_tests::put_bytes(folder.file("a.csv"), text + "damage\n");
  const Source source = Source(folder.file("a.csv")).held_open(), copy = source;
  Chunk chunk;
  std::size_t rows = 0;
  const auto asking = open_recording(source);
  EXPECT_FALSE(source.damage());
  while (asking->read_sound(chunk)) rows += chunk.observations.size();
  EXPECT_EQ(rows, kSound);
  ASSERT_TRUE(copy.damage());
  EXPECT_EQ(copy.damage()->place().line, kSound + 2U);
  const auto reader = open_recording(copy);  // reading them all meets it all the same
  for (rows = 0; reader->read_sound(chunk);) rows += chunk.observations.size();
  EXPECT_EQ(rows, kSound);
  EXPECT_THROW(reader->read(chunk), FileError);
  EXPECT_FALSE(Source(folder.file("a.csv")).damage());  // of another job
}

TEST(SourceTest, WrongColumnsAreNamed) {
  EXPECT_EQ(problem_of([](Recording&) {}), "none");
  EXPECT_THROW(Source(nullptr, "memory"), InvalidArgument);
  EXPECT_THAT(problem_of([](Recording& r) { r.header.devices.clear(); }), NamesField("device"));
  EXPECT_THAT(problem_of([](Recording& r) { r.data.observations.device[3] = 1; }),
              NamesField("device"));
  EXPECT_THAT(problem_of([](Recording& r) { r.data.observations.range.pop_back(); }),
              NamesField("range"));
  EXPECT_THAT(problem_of([](Recording& r) { r.data.observations.zenith[2] = 4; }),
              NamesField("zenith"));
  EXPECT_THAT(problem_of([](Recording& r) { r.data.packets.pop_back(); }),
              AllOf(NamesField("packets"), NamesField("10 values, expected 15")));
  EXPECT_THAT(problem_of([](Recording& r) { r.data.imu.clear(); }),
              NamesField("inertial samples of packets"));
}

}  // namespace risley::recordings::source_test
