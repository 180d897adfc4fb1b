// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/truth.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netcdf.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"

namespace risley::recordings::truth_test {

namespace fs = std::filesystem;

class Truth : public ::testing::Test {
 protected:
  std::string path() const { return folder_.file("truth.nc"); }

  /// Rows that all differ, beginning with row number `first`.
  static TruthColumns rows(int prisms, std::size_t first, std::size_t count) {
    TruthColumns t;
    t.resize(prisms, count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto n = static_cast<double>(first + i);
      t.time_ns[i] = static_cast<std::int64_t>(first + i) * 10'000 + 7;
      for (std::size_t prism = 0; prism < t.rotation_angle.size(); ++prism) {
        t.rotation_angle[prism][i] = -1000.0 * n + static_cast<double>(prism);
        t.angular_velocity[prism][i] = 700.0 + 0.001 * n - static_cast<double>(prism);
      }
      t.azimuth[i] = 0.1 + 1e-6 * n;
      t.zenith[i] = 1.5 - 1e-6 * n;
      t.range[i] = n == 3 ? std::numeric_limits<double>::quiet_NaN() : 10.0 + n;
    }
    return t;
  }

  io::TestFolder folder_;
};

TEST_F(Truth, PiecesComeBackAsOneTable) {
  constexpr std::size_t kRows = 40000;
  for (const int prisms : {1, 3}) {
    TruthWriter writer(path(), prisms);
    for (std::size_t first = 0; first < kRows; first += 7000) {
      writer.write(rows(prisms, first, std::min<std::size_t>(7000, kRows - first)));
    }
    writer.write(rows(prisms, 0, 0));
    writer.close();
    const TruthColumns expected = rows(prisms, 0, kRows);
    const TruthColumns found = load_truth(path());
    EXPECT_EQ(found.time_ns, expected.time_ns);
    ASSERT_EQ(found.prisms(), prisms);
    for (std::size_t i = 0; i < kRows; ++i) {
      for (std::size_t p = 0; p < expected.rotation_angle.size(); ++p) {
        ASSERT_DOUBLE_EQ(found.rotation_angle[p][i], expected.rotation_angle[p][i]);
        ASSERT_DOUBLE_EQ(found.angular_velocity[p][i], expected.angular_velocity[p][i]);
      }
      ASSERT_DOUBLE_EQ(found.azimuth[i], expected.azimuth[i]);
      ASSERT_DOUBLE_EQ(found.zenith[i], expected.zenith[i]);
    }
    EXPECT_TRUE(std::isnan(found.range[3]));
    EXPECT_EQ(found.range[4], 14.0);
  }
}

TEST_F(Truth, ColumnsAreAppendedRowByRow) {
  TruthColumns all, more;
  more.resize(2, 3);
  for (std::size_t i = 0; i < 3; ++i) {
    more.time_ns[i] = static_cast<std::int64_t>(i);
    more.rotation_angle[1][i] = 0.5 * static_cast<double>(i);
    more.range[i] = 10.0 + static_cast<double>(i);
  }
  all.append(more);
  all.append(more);
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all.prisms(), 2);
  EXPECT_EQ(all.time_ns[4], 1);
  EXPECT_EQ(all.rotation_angle[1], (std::vector<double>{0, 0.5, 1, 0, 0.5, 1}));
  EXPECT_EQ(all.range[5], 12.0);
  EXPECT_EQ(all.azimuth.size(), 6u);
  more.resize(3, 3);
  EXPECT_THROW(all.append(more), InvalidArgument);
}

TEST_F(Truth, VariablesHaveTheNamesAndUnitsOthersRead) {
  TruthWriter writer(path(), 2);
  TruthColumns one = rows(2, 1, 1);
  one.rotation_angle[1][0] = radians_from_degrees(540.0);
  writer.write(one);
  writer.close();
  int id = 0;
  ASSERT_EQ(nc_open(path().c_str(), NC_NOWRITE, &id), NC_NOERR);
  const std::vector<std::pair<std::string, std::string>> expected{
      {"time", "s"},
      {"rotation_angle_a_deg", "degree"},
      {"rotation_angle_b_deg", "degree"},
      {"angular_velocity_a_deg_per_s", "degree s-1"},
      {"angular_velocity_b_deg_per_s", "degree s-1"},
      {"azimuth_deg", "degree"},
      {"zenith_deg", "degree"},
      {"range_m", "m"}};
  for (const auto& [name, unit] : expected) {
    int variable = 0;
    std::size_t length = 0;
    ASSERT_EQ(nc_inq_varid(id, name.c_str(), &variable), NC_NOERR) << name;
    ASSERT_EQ(nc_inq_attlen(id, variable, "units", &length), NC_NOERR);
    std::string found(length, ' ');
    ASSERT_EQ(nc_get_att_text(id, variable, "units", found.data()), NC_NOERR);
    EXPECT_EQ(found, unit) << name;
    EXPECT_EQ(nc_inq_attlen(id, variable, "long_name", &length), NC_NOERR);
  }
  int variable = 0;
  double value = 0;
  const std::size_t row = 0;
  ASSERT_EQ(nc_inq_varid(id, "rotation_angle_b_deg", &variable), NC_NOERR);
  ASSERT_EQ(nc_get_var1_double(id, variable, &row, &value), NC_NOERR);
  EXPECT_DOUBLE_EQ(value, 540.0);
  ASSERT_EQ(nc_inq_varid(id, "time", &variable), NC_NOERR);
  ASSERT_EQ(nc_get_var1_double(id, variable, &row, &value), NC_NOERR);
  EXPECT_DOUBLE_EQ(value, 10'007e-9);
  EXPECT_EQ(nc_close(id), NC_NOERR);
}

TEST_F(Truth, AFileNotClosedLeavesNothing) {
  {
    TruthWriter writer(path(), 2);
    writer.write(rows(2, 0, 10));
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(Truth, WrongColumnsAreRefused) {
  TruthWriter writer(path(), 2);
  EXPECT_THROW(writer.write(rows(3, 0, 10)), InvalidArgument);
  TruthColumns uneven = rows(2, 0, 10);
  uneven.zenith.pop_back();
  EXPECT_THROW(writer.write(uneven), InvalidArgument);
  EXPECT_THROW(TruthWriter(path(), 0), InvalidArgument);
}

TEST_F(Truth, OtherFilesAreRefused) {
  EXPECT_THROW(load_truth(path()), FileError);  // missing
  io::write_text_file(path(), "no NetCDF at all");
  EXPECT_THROW(load_truth(path()), FileError);
  int id = 0;
  ASSERT_EQ(nc_create(path().c_str(), NC_NETCDF4 | NC_CLOBBER, &id), NC_NOERR);
  ASSERT_EQ(nc_close(id), NC_NOERR);
  EXPECT_THAT(refusal<FileError>([&] { load_truth(path()); }),
              ::testing::HasSubstr("is not a truth file"));
}

}  // namespace risley::recordings::truth_test
