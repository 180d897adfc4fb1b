// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/lvx_bytes.hpp"

namespace risley::recordings::registry_test {

class RegistryTest : public ::testing::Test {
 protected:
  std::string open_error(const std::string& path) {
    try {
      open_recording(path);
    } catch (const FileError& error) {
      EXPECT_EQ(error.path(), path);
      return error.what();
    }
    return "was opened";
  }

  RecordingHeader header_with_range(bool has_range) {
    RecordingHeader header;
    header.devices.resize(1);
    header.has_range = has_range;
    return header;
  }

  /// Format of a file of this name, as it is recognised again by its content.
  std::string format_written(const std::string& name, bool has_range) {
    const std::string path = folder_.file(name);
    Chunk chunk;
    Observations& o = chunk.observations;
    o.resize(3);
    for (std::size_t row = 0; row < 3; ++row) {
      o.time_ns[row] = static_cast<std::int64_t>(row) * 10'000;
      o.azimuth[row] = 0.1;
      o.zenith[row] = 1.5;
      o.range[row] = has_range ? 4.0 : std::numeric_limits<double>::quiet_NaN();
      o.return_number[row] = o.valid[row] = 1;
    }
    const auto writer = create_recording(path, header_with_range(has_range));
    writer->write(chunk);
    writer->close();
    // The content decides when reading: the name is changed to prove it.
    std::filesystem::rename(path, folder_.file("renamed"));
    return open_recording(folder_.file("renamed"))->header().format;
  }

  lvx_bytes::TestFolder folder_;
};

TEST_F(RegistryTest, FilesThatCannotBeARecordingAreNamed) {
  EXPECT_THAT(open_error(folder_.file("missing.lvx")), NamesField("missing.lvx"));
  EXPECT_THAT(open_error(std::filesystem::path(folder_.file("x")).parent_path()),
              NamesField("folder"));
  EXPECT_THAT(open_error("/dev/null"), NamesField("regular"));
  format_tests::put_bytes(folder_.file("empty.lvx"), "");
  EXPECT_THAT(open_error(folder_.file("empty.lvx")), NamesField("empty"));
  format_tests::put_bytes(folder_.file("text.lvx"), "hello, world");
  EXPECT_THAT(open_error(folder_.file("text.lvx")),
              ::testing::AllOf(NamesField("lvx-1.1"), NamesField("'hello, world'")));
  format_tests::put_bytes(folder_.file("binary.lvx"), std::string("\x7F"
                                                                  "ELF\0\1",
                                                                  6));
  EXPECT_THAT(open_error(folder_.file("binary.lvx")), NamesField("7F 45 4C 46 00 01"));
}

TEST_F(RegistryTest, TheEndingChoosesTheFormat) {
  EXPECT_EQ(format_written("a.lvx", true), "lvx-1.1");
  EXPECT_EQ(format_written("A.LVX", true), "lvx-1.1");
  EXPECT_EQ(format_written("a.csv", true), "openpylivox-csv");
  EXPECT_EQ(format_written("a.csv", false), "scan-sequence-csv");
  EXPECT_EQ(format_written("a.sequence.csv", true), "scan-sequence-csv");
  EXPECT_EQ(format_written("a.sequence.csv", false), "scan-sequence-csv");
  EXPECT_EQ(format_written("a.openpylivox.csv", true), "openpylivox-csv");
  const std::string netcdf = format_written("a.nc", true);
  EXPECT_THAT(netcdf, NamesField("netcdf"));
}

TEST_F(RegistryTest, FormatsThatNeedRangesSaySo) {
  for (const char* name : {"a.lvx", "a.openpylivox.csv"}) {
    EXPECT_THROW(format_written(name, false), InvalidArgument) << name;
    EXPECT_FALSE(std::filesystem::exists(folder_.file(name)));
  }
}

TEST_F(RegistryTest, UnknownEndingsListTheKnownOnes) {
  for (const char* name : {"a.xyz", "a", "lvx", "a.lvx.gz"}) {
    try {
      create_recording(folder_.file(name), header_with_range(true));
      FAIL() << name;
    } catch (const InvalidArgument& error) {
      for (const WritableFormat& format : writable_formats()) {
        EXPECT_THAT(error.what(), NamesField(format.ending));
      }
    }
  }
}

TEST_F(RegistryTest, TheListOfWritableFormatsIsComplete) {
  std::set<std::string> endings;
  for (const WritableFormat& format : writable_formats()) {
    endings.insert(format.ending);
    EXPECT_FALSE(format.name.empty() || format.description.empty());
  }
  EXPECT_THAT(endings,
              ::testing::UnorderedElementsAre(".lvx", ".lvx2", ".nc", ".csv", ".sequence.csv",
                                              ".openpylivox.csv", ".bag", ".db3", ".mcap"));
}

TEST_F(RegistryTest, AWholeRecordingIsLoadedWithItsWarnings) {
  std::mt19937 random(1);
  std::string file = lvx_bytes::header_lvx11({{"A", 0, 1}});
  std::vector<std::string> packages;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    packages.push_back(lvx_bytes::package(0, 0, 1, i * 1'000'000, random));
  }
  lvx_bytes::put_frame(file, packages, 0);
  file.resize(file.size() - 1);
  format_tests::put_bytes(folder_.file("a.lvx"), file);
  std::vector<double> progress;
  const Recording recording =
      load_recording(folder_.file("a.lvx"), [&](double f) { progress.push_back(f); });
  EXPECT_EQ(recording.data.observations.size(), 199'900U);
  EXPECT_EQ(recording.data.packets.size(), 1999U);
  EXPECT_EQ(recording.data.observations.time_ns.back(), 1'998'990'000);
  ASSERT_EQ(recording.warnings.size(), 1U);
  EXPECT_EQ(recording.warnings[0].lost_records, 100U);
  EXPECT_GT(progress.size(), 2U);
  EXPECT_TRUE(std::is_sorted(progress.begin(), progress.end()));
  EXPECT_EQ(progress.back(), 1.0);
}

/// A file that is changed between two reads of its content: rows that were read stand, none is
/// invented, and what is missing is reported or was never announced.
void expect_changes_survived(const std::string& ending, bool shrinks) {
  SCOPED_TRACE(ending);
  constexpr std::size_t kRows = 150'000;
  const lvx_bytes::TestFolder folder;
  const std::string path = folder.file("recording" + ending);
  RecordingHeader header;
  header.devices.resize(1);
  header.has_range = ending != ".sequence.csv";
  Chunk chunk;
  Observations& o = chunk.observations;
  o.resize(kRows);
  for (std::size_t row = 0; row < kRows; ++row) {
    o.time_ns[row] = static_cast<std::int64_t>(row) * 10'000;
    o.azimuth[row] = 0.1;
    o.zenith[row] = 1.5;
    o.range[row] = header.has_range ? 4.0 : std::numeric_limits<double>::quiet_NaN();
    o.return_number[row] = o.valid[row] = 1;
  }
  const auto writer = create_recording(path, header);
  writer->write(chunk);
  writer->close();
  const auto size = std::filesystem::file_size(path);
  const auto reader = open_recording(path);
  std::size_t rows = 0;
  ASSERT_TRUE(reader->read(chunk, 1000));
  rows += chunk.observations.size();
  if (shrinks) {
    std::filesystem::resize_file(path, size / 3);
  } else {
    std::ofstream(path, std::ios::binary | std::ios::app) << std::string(size / 3, '7');
  }
  try {
    while (reader->read(chunk)) rows += chunk.observations.size();
  } catch (const FileError& error) {
    EXPECT_EQ(error.path(), path);
  }
  EXPECT_LE(rows, kRows + (shrinks ? 0 : size / 3));
}

TEST(Registry, FilesThatShrinkOrGrowWhileTheyAreRead) {
  for (const char* ending : {".lvx", ".nc", ".sequence.csv", ".openpylivox.csv"}) {
    expect_changes_survived(ending, true);
    expect_changes_survived(ending, false);
  }
}

}  // namespace risley::recordings::registry_test
