// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Clouds in LAS and LAZ, read again as recordings.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"

#include "cloud/cloud_samples.hpp"
#include "parameter_name.hpp"
#include "refusal.hpp"

namespace risley::cloud::las_recording_test {

using recordings::Observations;

std::vector<std::string> formats_of_this_build() {
  std::vector<std::string> formats;
  for (const CloudFormat& format : cloud_formats()) {
    if (format.name.starts_with("la")) formats.push_back(format.name);
  }
  return formats;
}

class LasRecordingTest : public ::testing::TestWithParam<std::string> {
 protected:
  LasRecordingTest() {
    one_.header.sensor = "Livox Mid-40";
    one_.header.serial = "0TFDG3B006H2Z11";
    points_ = make_points(one_);
    for (std::size_t i = 0; i < points_.size(); ++i) {  // as many as LAS 1.2 can hold
      points_.number_of_returns[i] = 3;
      points_.return_number[i] = static_cast<std::uint8_t>(1 + i % 3);
    }
  }

  void write() {
    const auto writer = create_cloud(path_, one_.header, {.format = GetParam()});
    writer->write(points_);
    writer->close();
  }

  CloudCase one_{"cloud", 9000, {}};
  Points points_;
  TestFolder folder_;
  std::string path_ = folder_.file("cloud");
};

TEST_P(LasRecordingTest, GivesBackEveryPoint) {
  for (const auto reference :
       {recordings::TimeReference::utc, recordings::TimeReference::power_on}) {
    const bool utc = reference == recordings::TimeReference::utc;
    one_.header.time_reference = reference;
    if (!utc) {
      for (auto& time : points_.time_ns) time -= 1'700'000'000'000'000'000;
    }
    write();
    const recordings::Recording recording = recordings::load_recording(path_);
    EXPECT_TRUE(recording.warnings.empty());
    EXPECT_EQ(recording.header.format, GetParam() == "laz" ? "laz" : "las");
    EXPECT_EQ(recording.header.time_reference,
              utc ? reference : recordings::TimeReference::relative);
    EXPECT_TRUE(recording.header.has_times);
    EXPECT_EQ(recording.header.returns_per_shot, 3);
    ASSERT_EQ(recording.header.devices.size(), 1U);
    EXPECT_EQ(recording.header.devices[0].type, 1);
    EXPECT_EQ(recording.header.devices[0].serial, one_.header.serial);
    const Observations& rows = recording.data.observations;
    ASSERT_EQ(rows.size(), points_.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double horizontal = rows.range[i] * std::sin(rows.zenith[i]);
      ASSERT_NEAR(horizontal * std::cos(rows.azimuth[i]), points_.x[i], 0.5001e-4);
      ASSERT_NEAR(horizontal * std::sin(rows.azimuth[i]), points_.y[i], 0.5001e-4);
      ASSERT_NEAR(rows.range[i] * std::cos(rows.zenith[i]), points_.z[i], 0.5001e-4);
      ASSERT_FLOAT_EQ(rows.range_resolution[i], 1e-4F);
      // Doubles of seconds of that size have steps of 60 ns, or far less than one.
      ASSERT_LE(std::abs(rows.time_ns[i] - points_.time_ns[i]), utc ? 31 : 0);
      ASSERT_EQ(rows.time_ns[i], rows.time_ns[i / 3 * 3]);
      ASSERT_EQ(rows.intensity[i], points_.intensity[i]);
      ASSERT_EQ(rows.return_number[i], points_.return_number[i]);
      ASSERT_EQ(rows.tag[i], points_.tag[i]);
      ASSERT_EQ(rows.beam[i], points_.beam[i]);
    }
  }
}

TEST_P(LasRecordingTest, ACutFileGivesThePointsBeforeAndThenThePlace) {
  write();
  const auto size = std::filesystem::file_size(path_);
  std::filesystem::resize_file(path_, size * 2 / 3);
  std::size_t rows = 0;
  try {
    const auto reader = recordings::open_recording(path_);
    recordings::Chunk chunk;
    while (reader->read(chunk, 100)) rows += chunk.observations.size();
    FAIL() << "the end was not missed";
  } catch (const FileError& error) {
    ASSERT_TRUE(error.place().byte_offset);
    EXPECT_LE(*error.place().byte_offset, size);
  }
  // LASzip may want its table of chunks at the file's end before it gives any point.
  if (GetParam() != "laz") {
    EXPECT_NEAR(static_cast<double>(rows), 6000, 60);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, LasRecordingTest, ::testing::ValuesIn(formats_of_this_build()),
                         kByItself);

TEST(LazRecordingTest, IsTested) {
  const std::vector<std::string> formats = formats_of_this_build();
  if (std::ranges::find(formats, "laz") == formats.end()) {
    GTEST_SKIP() << "SKIPPED: this build has no LASzip (Debian 13 has it)";
  }
}

#ifdef RISLEY_HAS_LASZIP

/// A LAZ file with some bytes overwritten, and the message of reading it.
std::string laz_error(const std::string& path, std::uint64_t at, const std::string& bytes) {
  {
    std::fstream stream(path, std::ios::binary | std::ios::in | std::ios::out);
    stream.seekp(static_cast<std::streamoff>(at));
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  return refusal<FileError>([&] { recordings::load_recording(path); });
}

TEST(LazRecordingTest, ChunkTablesThatCannotBeAreRefused) {
  const TestFolder folder;
  const std::string path = folder.file("cloud.laz");
  const CloudCase one{"cloud", 2000, {}};
  Points points = make_points(one);
  std::ranges::fill(points.return_number, std::uint8_t{1});
  std::ranges::fill(points.number_of_returns, std::uint8_t{1});
  const auto writer = create_cloud(path, one.header);
  writer->write(points);
  writer->close();
  std::ifstream stream(path, std::ios::binary);
  std::uint32_t points_at = 0;
  std::int64_t table = 0;
  stream.seekg(96);
  stream.read(reinterpret_cast<char*>(&points_at), 4);
  stream.seekg(points_at);
  stream.read(reinterpret_cast<char*>(&table), 8);
  stream.close();
  EXPECT_THAT(laz_error(path, static_cast<std::uint64_t>(table) + 4, "\xff\xff\xff\x7f"),
              ::testing::HasSubstr("chunks in a file of"));
  EXPECT_THAT(laz_error(path, points_at, std::string("\xff\xff\xff\xff\xff\xff\xff\x7f", 8)),
              ::testing::HasSubstr("expected the chunk table between"));
}

#endif

}  // namespace risley::cloud::las_recording_test
