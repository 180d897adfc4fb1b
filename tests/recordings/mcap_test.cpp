// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bags/written_mcap.hpp"
#include "fuzz/memory_file.hpp"
#include "recordings/format_tests.hpp"
#include "recordings/ros2_messages.hpp"

namespace risley::recordings::mcap_test {

using namespace ros2_messages;
using namespace format_tests;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Outcome read_bytes(const std::string& bytes, std::size_t chunk_rows = kDefaultChunkRows) {
  // In memory: a disk takes its time for thousands of files.
  const fuzz::MemoryFile file({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  return read_all(kMcapFormat, file.path(), chunk_rows);
}

McapFile small_file() { return McapFile(small_ros2_bag()); }

/// Every way to write the same file.
std::vector<McapFile> all_ways(const McapFile& file) {
  std::vector<McapFile> ways;
  for (const char* packing : {"", "lz4", "zstd"}) {
    for (const bool summary : {true, false}) {
      McapFile way = file;
      way.packing = packing;
      way.summary = summary;
      way.data_checksum = !summary;
      way.strange_records = summary;
      ways.push_back(way);
    }
  }
  ways.push_back(file);
  ways.back().statistics = ways.back().checksums = false;
  ways.push_back(file);
  ways.back().chunked = false;
  ways.push_back(ways.back());
  ways.back().summary = false;
  return ways;
}

TEST(Mcap, HasTheRowsOfTheSameBagInSqlite) {
  const TestFolder folder;
  const std::string path = folder.file("input.db3");
  small_ros2_bag().write(path).reset();
  const Outcome wanted = read_all(kRos2BagFormat, path);
  ASSERT_EQ(wanted.rows().size(), 120U);
  for (const McapFile& way : all_ways(small_file())) {
    for (const std::size_t chunk_rows : {std::size_t{1}, kDefaultChunkRows}) {
      SCOPED_TRACE(fmt::format("{} {} {}", way.packing, way.chunked, way.summary));
      const Outcome outcome = read_bytes(way.bytes(), chunk_rows);
      ASSERT_FALSE(outcome.error) << outcome.error->what();
      EXPECT_EQ(outcome.recording.header.format, "mcap");
      EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::power_on);
      EXPECT_TRUE(outcome.recording.warnings.empty());
      EXPECT_TRUE(is_same(outcome.rows(), wanted.rows()));
      ASSERT_EQ(outcome.recording.data.imu.size(), 6U);
      EXPECT_EQ(outcome.recording.data.imu[3].time_ns, wanted.recording.data.imu[3].time_ns);
    }
  }
}

TEST(Mcap, HoldsMessagesOfRos1) {
  std::string custom_message = ros_header(kPowerOn);
  put<std::uint64_t>(custom_message, kPowerOn);
  put<std::uint32_t>(custom_message, 2);
  custom_message.append(4, '\0');
  put<std::uint32_t>(custom_message, 2);
  for (const float x : {2.0F, 4.0F}) {
    put<std::uint32_t>(custom_message, x == 2.0F ? 0 : 10'000);
    for (const float value : {x, 0.0F, 0.0F}) put<float>(custom_message, value);
    custom_message += std::string("\x07\x10\0", 3);
  }
  McapFile file;
  file.topics = {{kTopic, "livox_ros_driver/CustomMsg", "ros1"}};
  file.messages = {{0, custom_message}};
  const Outcome outcome = read_bytes(file.bytes());
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  EXPECT_THAT(outcome.rows().range, ElementsAre(2.0, 4.0));
  EXPECT_THAT(outcome.rows().time_ns, ElementsAre(static_cast<std::int64_t>(kPowerOn),
                                                  static_cast<std::int64_t>(kPowerOn) + 10'000));
}

TEST(Mcap, OtherEncodingsAndVersionsAreNamed) {
  McapFile file = small_file();
  file.topics[0].encoding = "protobuf";
  Outcome outcome = read_bytes(file.bytes());
  expect_damage(outcome,
                HasSubstr("/livox/lidar (livox_ros_driver2/msg/CustomMsg, encoded as \"protobuf\" "
                          "instead of cdr"));
  std::string bytes = small_file().bytes();
  bytes[5] = '1';
  outcome = read_bytes(bytes);
  ASSERT_TRUE(outcome.error);
  EXPECT_FALSE(outcome.opened);
  EXPECT_EQ(outcome.error->place().byte_offset, 5U);
  EXPECT_THAT(outcome.error->problem(), NamesField("version 0"));
}

TEST(Mcap, CutAnywhereItGivesWhatIsWhole) {
  McapFile file = small_file();
  file.messages.resize(8);  // three of them with 20 points
  file.messages_per_chunk = 2;
  for (const McapFile& way : all_ways(file)) {
    SCOPED_TRACE(fmt::format("{} {} {}", way.packing, way.chunked, way.summary));
    const std::string bytes = way.bytes();
    const Outcome whole = read_bytes(bytes);
    ASSERT_FALSE(whole.error);
    std::size_t most = 0, opened = 0;
    // Every byte in two ways; the other ways take long, so only some bytes.
    const bool is_plain = way.packing.empty() && !way.strange_records;
    const std::size_t step = way.packing == "lz4" || is_plain ? 1 : 29;
    for (std::size_t length = 1; length < bytes.size(); length += step) {
      SCOPED_TRACE(length);
      const Outcome cut = read_bytes(bytes.substr(0, length));
      ASSERT_TRUE(is_prefix(cut.rows(), whole.rows()));
      ASSERT_GE(cut.rows().size(), most);  // more bytes never give fewer rows
      most = cut.rows().size();
      if (!cut.opened) {  // before a topic of points
        ASSERT_TRUE(cut.error);
        ASSERT_EQ(opened, 0U);
        continue;
      }
      ++opened;
      ASSERT_FALSE(cut.error) << cut.error->what();
      ASSERT_EQ(cut.recording.warnings.size(), 1U);
      ASSERT_THAT(cut.recording.warnings[0].message, NamesField(fmt::format("byte {}", length)));
      ASSERT_LE(*cut.recording.warnings[0].place.byte_offset, length);
    }
    EXPECT_EQ(most, 60U);
  }
}

TEST(Mcap, AnyChangedBitIsFoundByTheChecksums) {
  for (const char* packing : {"", "lz4", "zstd"}) {
    McapFile file = small_file();
    file.packing = packing;
    file.data_checksum = true;
    const std::string bytes = file.bytes();
    const Outcome whole = read_bytes(bytes);
    for (std::size_t at = 0; at < bytes.size();
         at += at < 300 || at + 400 > bytes.size() ? 1 : 17) {
      SCOPED_TRACE(at);
      std::string changed = bytes;
      changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
      const Outcome outcome = read_bytes(changed);
      // Only the mark at the end of the data can be missed without a loss.
      ASSERT_TRUE(outcome.error || !outcome.recording.warnings.empty() ||
                  is_same(outcome.rows(), whole.rows()));
      // A chunk that is taken for a record to step over is missed at the end.
      const auto& times = whole.rows().time_ns;
      ASSERT_TRUE(is_prefix(outcome.rows(), whole.rows()) ||
                  (outcome.error &&
                   std::includes(times.begin(), times.end(), outcome.rows().time_ns.begin(),
                                 outcome.rows().time_ns.end())));
    }
  }
}

TEST(Mcap, SurvivesAnyChangedByteWithoutChecksums) {
  for (McapFile way : all_ways(small_file())) {
    way.checksums = way.data_checksum = false;
    const std::string bytes = way.bytes();
    for (std::size_t at = 0; at < bytes.size(); at += 29) {
      for (const int value : {0, 255, bytes[at] ^ (1 << (at % 8))}) {
        std::string changed = bytes;
        changed[at] = static_cast<char>(value);
        ASSERT_LE(read_bytes(changed).rows().size(), 200U) << at;
      }
    }
  }
}

TEST(Mcap, DamageKeepsWhatStandsBefore) {
  struct Case {
    const char* name;
    const char* problem;
    std::size_t rows;
  };
  McapFile file = small_file();
  file.packing = "zstd";
  const std::string bytes = file.bytes();
  std::vector<std::size_t> chunks;
  for (std::size_t at = 0; (at = bytes.find(std::string("\x04\0\0\0zstd", 8), at)) != bytes.npos;
       ++at) {
    chunks.push_back(at - 37);  // where the record begins
  }
  ASSERT_EQ(chunks.size(), 5U);
  const auto refused = [&](const std::string& changed, std::size_t rows,
                           std::optional<std::size_t> offset, const char* named) {
    SCOPED_TRACE(named);
    const Outcome outcome = read_bytes(changed);
    expect_damage(outcome, NamesField(named), rows, offset);
    EXPECT_TRUE(outcome.error && outcome.error->place().byte_offset);
  };
  const auto changed = [&](std::size_t at, const std::string& by) {
    std::string other = bytes;
    other.replace(at, by.size(), by);
    return other;
  };
  const std::string huge(8, '\x7f');
  // Two messages of 20 points each stand in the two chunks before the third.
  refused(changed(chunks[2] + 33, "\1\1\1\1"), 60, chunks[2], "checksum");
  refused(changed(chunks[2] + 25, huge), 60, chunks[2], "1073741824 bytes");
  refused(changed(chunks[2] + 25, std::string("\0\0\0\x20\0\0\0\0", 8)), 60, chunks[2],
          "536870912 bytes");
  refused(changed(chunks[2] + 25, std::string("\1\0\0\0\0\0\0\0", 8)), 60, chunks[2], "1 bytes");
  refused(changed(chunks[2] + 41, "zfoo"), 60, chunks[2], "found \"zfoo\"");
  refused(changed(chunks[2] + 45, huge), 60, chunks[2], "bytes of records");
  refused(changed(chunks[2] + 53, "????"), 60, chunks[2], "Zstandard");
  refused(changed(chunks[2] + 1, huge), 60, chunks[2], "record");
  refused(changed(chunks[2], std::string(1, '\0')), 60, chunks[2], "found type 0");
  refused(changed(chunks[2], "\x45"), 100, std::nullopt, "summary states 18");
  const std::size_t footer = bytes.size() - 37;
  refused(changed(footer + 25, "\1\1\1\1"), 120, std::nullopt, "summary");
  refused(changed(footer + 9, huge), 120, footer, "summary begins at byte 9187201950435737471");
  refused(changed(bytes.size() - 1, "x"), 120, bytes.size() - 8, "file");

  file.packing = "";
  file.data_checksum = true;
  const std::string plain = file.bytes();
  std::string other = plain;
  const std::size_t end = other.rfind(std::string("\x0f\4\0\0\0\0\0\0\0", 9));
  ASSERT_NE(end, other.npos);
  other.replace(end + 9, 4, "\1\1\1\1");
  refused(other, 120, end, "checksum");
}

TEST(Mcap, RecordsThatContradictEachOther) {
  const auto problem = [](const std::string& bytes) {
    const Outcome outcome = read_bytes(bytes);
    return outcome.error ? std::string(outcome.error->what()) : "none";
  };
  McapFile file = small_file();
  file.chunked = file.summary = false;
  const std::string whole = file.bytes();
  const std::size_t end = whole.size() - 37 - 13;
  const auto with = [&](const std::string& records) {
    return whole.substr(0, end) + records + whole.substr(end);
  };
  EXPECT_EQ(problem(with("")), "none");
  EXPECT_EQ(problem(with(file.schema(0) + file.channel(0))), "none");
  McapFile renamed = file;
  renamed.topics[0].name = "/other";
  EXPECT_THAT(problem(with(renamed.channel(0))),
              AllOf(NamesField("channel 10"), NamesField("/other")));
  renamed.topics[0].type = "other/msg/Type";
  EXPECT_THAT(problem(with(renamed.schema(0))),
              AllOf(NamesField("schema 1"), NamesField("other/msg/Type")));
  std::string lost = file.message(0);
  lost[9] = '\x77';
  EXPECT_THAT(problem(with(lost)), NamesField("channel 119"));
  EXPECT_THAT(problem(with(mcap_record(5, "short"))), NamesField("22 bytes"));
  EXPECT_THAT(problem(with(mcap_record(15, "abcd"))), NamesField("ends the data"));
  EXPECT_THAT(problem(with(mcap_chunk(mcap_record(6, ""), "", 0))), NamesField("type 6"));
  EXPECT_THAT(problem(with(mcap_chunk("123", "lz4", 0))), NamesField("chunk"));
  EXPECT_THAT(problem(with(mcap_record(6, "1234"))), NamesField("chunk's times"));
  EXPECT_THAT(problem(with(mcap_record(4, "1234"))), NamesField("topic"));
}

TEST(Mcap, DamagedMessagesAreNamed) {
  McapFile file = small_file();
  file.messages[7].second = "no CDR";  // the third of the lidar
  for (const bool chunked : {true, false}) {
    file.chunked = chunked;
    const std::string bytes = file.bytes();
    const Outcome outcome = read_bytes(bytes);
    expect_damage(outcome, NamesField("message 3 of topic /livox/lidar"), 40,
                  bytes.find("no CDR") - 31);
  }
}

TEST(Mcap, InertialSamplesWithoutNumbersAreLeftOut) {
  McapFile file = small_file();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::string& message = file.messages[2].second;  // the last number but nine
  message.replace(message.size() - 80, 8, reinterpret_cast<const char*>(&nan), 8);
  const Outcome outcome = read_bytes(file.bytes());
  EXPECT_FALSE(outcome.error);
  EXPECT_EQ(outcome.recording.data.imu.size(), 5U);
  EXPECT_THAT(warnings_of(outcome), ElementsAre(Warns(kWarning.content_left_out)));
}

TEST(Mcap, AClaimedChunkCostsNoMemory) {
  McapFile file = small_file();
  file.packing = "zstd";
  file.messages_per_chunk = 100;
  // Two hundred thousand bytes could hold 1 GiB.
  file.messages.emplace_back(2, std::string(200'000, 'a'));
  std::uint32_t state = 1;
  for (char& c : file.messages.back().second) {
    state = state * 1'664'525 + 1'013'904'223;
    c = static_cast<char>(state >> 24);
  }
  std::string bytes = file.bytes();
  const std::size_t at = bytes.find(std::string("\x04\0\0\0zstd", 8));
  bytes.replace(at - 12, 8, std::string("\0\0\0\x40\0\0\0\0", 8));
  expect_little_memory([&] { expect_damage(read_bytes(bytes), NamesField("1073741824 bytes")); });
}

TEST(Mcap, OpeningAndReadingCanBeCancelled) {
  const TestFolder folder;
  McapFile file = small_file();
  file.write(folder.file("whole.mcap"));
  file.summary = false;
  file.write(folder.file("without_summary.mcap"));
  CancelFlag flag;
  const Progress progress([](double) {}, &flag);
  const auto reader = open_recording(folder.file("whole.mcap"), {}, progress);
  flag.set();
  Chunk chunk;
  EXPECT_THROW(reader->read(chunk), Cancelled);
  EXPECT_THROW(open_recording(folder.file("without_summary.mcap"), {}, progress), Cancelled);
}

}  // namespace risley::recordings::mcap_test
