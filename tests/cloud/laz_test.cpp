// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// LAZ read back by LASzip itself, against the same cloud as LAS.
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#ifdef RISLEY_HAS_LASZIP
#include <laszip/laszip_api.h>
#endif

#include "risley/cloud/cloud_writer.hpp"
#include "risley/io/text_file.hpp"

#include "cloud/cloud_samples.hpp"

namespace risley::cloud::laz_test {

#ifdef RISLEY_HAS_LASZIP

template <class T>
T at(const std::string& bytes, std::size_t offset) {
  T value;
  std::copy_n(bytes.data() + offset, sizeof value, reinterpret_cast<char*>(&value));
  return value;
}

class LazTest : public ::testing::TestWithParam<std::size_t> {};

TEST_P(LazTest, HoldsWhatTheLasFileHolds) {
  const TestFolder folder;
  CloudCase one{"laz", GetParam(), {}};
  CloudHeader& header = one.header;
  header.sensor = "Livox Mid-40";
  header.factors = {"one", "two"};
  Points points = make_points(one);
  for (std::size_t i = 0; i < points.size(); ++i) {  // as many as LAS can hold
    points.number_of_returns[i] = static_cast<std::uint8_t>(1 + i % 3);
    points.return_number[i] = static_cast<std::uint8_t>(1 + i % points.number_of_returns[i]);
  }
  for (const char* name : {"cloud.las", "cloud.laz"}) {
    const auto writer = create_cloud(folder.file(name), header);
    writer->write(points);
    writer->close();
  }
  const std::string las = io::read_text_file(folder.file("cloud.las"));
  const auto data = at<std::uint32_t>(las, 96);
  const auto record = at<std::uint16_t>(las, 105);
  constexpr std::size_t kBase = 30;  // bytes of point format 6
  ASSERT_EQ(las.size(), data + GetParam() * record);

  laszip_POINTER reader = nullptr;
  ASSERT_EQ(laszip_create(&reader), 0);
  laszip_BOOL compressed = 0;
  ASSERT_EQ(laszip_open_reader(reader, folder.file("cloud.laz").c_str(), &compressed), 0);
  EXPECT_TRUE(compressed);
  laszip_header* found = nullptr;
  ASSERT_EQ(laszip_get_header_pointer(reader, &found), 0);
  EXPECT_EQ(found->version_minor, 4);
  EXPECT_EQ(found->extended_number_of_point_records, GetParam());
  EXPECT_EQ(found->point_data_record_length, record);
  EXPECT_EQ(found->x_scale_factor, at<double>(las, 131));
  EXPECT_EQ(found->max_x, at<double>(las, 179));
  EXPECT_EQ(found->min_x, at<double>(las, 187));
  laszip_point* point = nullptr;
  ASSERT_EQ(laszip_get_point_pointer(reader, &point), 0);
  for (std::size_t i = 0; i < GetParam(); ++i) {
    ASSERT_EQ(laszip_read_point(reader), 0);
    const std::size_t from = data + i * record;
    EXPECT_EQ(point->X, at<std::int32_t>(las, from));
    EXPECT_EQ(point->Y, at<std::int32_t>(las, from + 4));
    EXPECT_EQ(point->Z, at<std::int32_t>(las, from + 8));
    EXPECT_EQ(point->intensity, at<std::uint16_t>(las, from + 12));
    const auto returns = at<std::uint8_t>(las, from + 14);
    EXPECT_EQ(point->extended_return_number, returns & 15);
    EXPECT_EQ(point->extended_number_of_returns, returns >> 4);
    EXPECT_EQ(point->gps_time, at<double>(las, from + 22));
    ASSERT_EQ(static_cast<std::size_t>(point->num_extra_bytes), record - kBase);
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(point->extra_bytes), record - kBase),
              las.substr(from + kBase, record - kBase));
  }
  laszip_close_reader(reader);
  laszip_destroy(reader);
}

INSTANTIATE_TEST_SUITE_P(Sizes, LazTest, ::testing::Values(0, 1, 60000));

#else

TEST(LazTest, HoldsWhatTheLasFileHolds) {
  GTEST_SKIP() << "SKIPPED: this build has no LASzip (Debian 13 has it)";
}

#endif

}  // namespace risley::cloud::laz_test
