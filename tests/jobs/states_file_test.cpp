// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/states_file.hpp"

#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <netcdf.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "io/test_folder.hpp"

namespace risley::jobs::states_file_test {

namespace fs = std::filesystem;

/// A NetCDF file as others read it.
class Reader {
 public:
  explicit Reader(const std::string& path) {
    EXPECT_EQ(nc_open(path.c_str(), NC_NOWRITE, &id_), NC_NOERR);
  }
  ~Reader() { nc_close(id_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  bool has(const std::string& name) const {
    int variable = 0;
    return nc_inq_varid(id_, name.c_str(), &variable) == NC_NOERR;
  }
  /// The whole column of a variable along one dimension.
  std::vector<double> values(const std::string& name, const std::string& dimension) const {
    const int variable = find(name);
    int dimensions = 0, along = 0;
    char found[NC_MAX_NAME + 1];
    std::size_t length = 0;
    EXPECT_EQ(nc_inq_varndims(id_, variable, &dimensions), NC_NOERR);
    EXPECT_EQ(dimensions, 1) << name;
    EXPECT_EQ(nc_inq_vardimid(id_, variable, &along), NC_NOERR);
    EXPECT_EQ(nc_inq_dim(id_, along, found, &length), NC_NOERR);
    EXPECT_EQ(found, dimension) << name;
    std::vector<double> column(length);
    EXPECT_EQ(nc_get_var_double(id_, variable, column.data()), NC_NOERR);
    return column;
  }
  std::vector<long long> integers(const std::string& name) const {
    std::vector<long long> column(values(name, "time").size());
    EXPECT_EQ(nc_get_var_longlong(id_, find(name), column.data()), NC_NOERR);
    return column;
  }
  /// A text attribute of a variable; of the file for an empty name.
  std::string text(const std::string& name, const std::string& attribute) const {
    const int variable = name.empty() ? NC_GLOBAL : find(name);
    std::size_t length = 0;
    EXPECT_EQ(nc_inq_attlen(id_, variable, attribute.c_str(), &length), NC_NOERR) << name;
    std::string value(length, ' ');
    EXPECT_EQ(nc_get_att_text(id_, variable, attribute.c_str(), value.data()), NC_NOERR) << name;
    return value;
  }
  std::vector<unsigned char> flags(const std::string& name) const {
    std::vector<unsigned char> value(2, 9);
    EXPECT_EQ(nc_get_att_uchar(id_, find(name), "flag_values", value.data()), NC_NOERR);
    return value;
  }
  int variables() const {
    int count = 0;
    EXPECT_EQ(nc_inq_nvars(id_, &count), NC_NOERR);
    return count;
  }

 private:
  int find(const std::string& name) const {
    int variable = 0;
    EXPECT_EQ(nc_inq_varid(id_, name.c_str(), &variable), NC_NOERR) << name;
    return variable;
  }
  int id_ = 0;
};

class StatesFile : public ::testing::Test {
 protected:
  std::string path() const { return folder_.file("states.nc"); }

  /// A number that no other column and no other row has.
  static double number(int column, std::size_t row) {
    return column + 1.0 + 1e-6 * static_cast<double>(row);
  }
  static std::int64_t time_of(std::size_t row) {
    return 1'700'000'000'123'456'789 + static_cast<std::int64_t>(row) * 10'001;
  }
  static bool is_outlier(std::size_t row) { return row % 7 == 3; }

  /// Rows whose columns are numbered: angles, speeds, their sigmas, covariances, residuals.
  static estimation::RotorStates states(int prisms, estimation::ShotRange rows) {
    estimation::RotorStates s;
    s.resize(prisms, rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::size_t row = rows.begin + i;
      int column = 0;
      s.time_ns[i] = time_of(row);
      s.outlier[i] = is_outlier(row);
      for (auto* columns : {&s.rotation_angle, &s.angular_velocity, &s.angular_velocity_sigma,
                            &s.rotation_angle_covariance}) {
        for (auto& values : *columns) values[i] = number(column++, row);
      }
      s.azimuth_residual[i] = -number(column++, row);
      s.zenith_residual[i] = number(column++, row);
    }
    return s;
  }

  static StatesContent content(int prisms, std::size_t rows) {
    return {rows, prisms, [prisms](estimation::ShotRange r) { return states(prisms, r); }, {}};
  }

  static void expect_column(const Reader& file, const std::string& name, const std::string& units,
                            std::size_t rows, const auto& expected) {
    EXPECT_EQ(file.text(name, "units"), units) << name;
    EXPECT_FALSE(file.text(name, "long_name").empty()) << name;
    const std::vector<double> found = file.values(name, "time");
    ASSERT_EQ(found.size(), rows) << name;
    for (std::size_t row = 0; row < rows; ++row) {
      ASSERT_DOUBLE_EQ(found[row], expected(row)) << name << ", row " << row;
    }
  }

  io::TestFolder folder_;
};

TEST_F(StatesFile, EveryColumnComesBackInTheUnitsOfTheFile) {
  constexpr std::size_t kRows = 40'000;
  const auto degrees = [](int column) {
    return [column](std::size_t row) { return degrees_from_radians(number(column, row)); };
  };
  const auto root = [](int column) {
    return
        [column](std::size_t row) { return degrees_from_radians(std::sqrt(number(column, row))); };
  };
  std::vector<estimation::ShotRange> asked;
  StatesContent two = content(2, kRows);
  two.block = [&](estimation::ShotRange rows) {
    asked.push_back(rows);
    return states(2, rows);
  };
  write_states(path(), two, {{"command", "risley estimate x.lvx"}, {"seed", "7"}});
  // Each row once, in order, and never all at once.
  std::size_t next = 0;
  for (const estimation::ShotRange& rows : asked) {
    EXPECT_EQ(rows.begin, next);
    EXPECT_GT(rows.size(), 0u);
    EXPECT_LE(rows.size(), 20'000u);
    next = rows.end;
  }
  EXPECT_EQ(next, kRows);
  const Reader file(path());
  EXPECT_EQ(file.text("", "Conventions"), "CF-1.9");
  EXPECT_EQ(file.text("", "command"), "risley estimate x.lvx");
  EXPECT_EQ(file.text("", "seed"), "7");
  // Columns 0 1: angles, 2 3: speeds, 4 5: their sigmas, 6 7 8: covariances aa ab bb, 9 10.
  expect_column(file, "rotation_angle_a_deg", "degree", kRows, degrees(0));
  expect_column(file, "rotation_angle_b_deg", "degree", kRows, degrees(1));
  expect_column(file, "angular_velocity_a_deg_per_s", "degree s-1", kRows, degrees(2));
  expect_column(file, "angular_velocity_b_deg_per_s", "degree s-1", kRows, degrees(3));
  expect_column(file, "angular_velocity_sigma_a_deg_per_s", "degree s-1", kRows, degrees(4));
  expect_column(file, "angular_velocity_sigma_b_deg_per_s", "degree s-1", kRows, degrees(5));
  expect_column(file, "rotation_angle_sigma_a_deg", "degree", kRows, root(6));
  expect_column(file, "rotation_angle_covariance_ab_deg2", "degree2", kRows, [](std::size_t row) {
    return degrees_from_radians(degrees_from_radians(number(7, row)));
  });
  expect_column(file, "rotation_angle_sigma_b_deg", "degree", kRows, root(8));
  expect_column(file, "azimuth_residual_deg", "degree", kRows,
                [](std::size_t row) { return -degrees_from_radians(number(9, row)); });
  expect_column(file, "zenith_residual_deg", "degree", kRows, degrees(10));
  expect_column(file, "time", "s", kRows,
                [](std::size_t row) { return 1e-9 * static_cast<double>(time_of(row)); });
  EXPECT_EQ(file.text("time_ns", "units"), "ns");
  const std::vector<long long> time = file.integers("time_ns");
  const std::vector<long long> outlier = file.integers("outlier");
  ASSERT_EQ(time.size(), kRows);
  for (std::size_t row = 0; row < kRows; ++row) {
    ASSERT_EQ(time[row], time_of(row));
    ASSERT_EQ(outlier[row], is_outlier(row) ? 1 : 0);
  }
  EXPECT_EQ(file.flags("outlier"), (std::vector<unsigned char>{0, 1}));
  EXPECT_EQ(file.text("outlier", "flag_meanings"), "used left_out");
  EXPECT_EQ(file.variables(), 14);
}

TEST_F(StatesFile, EveryPairOfPrismsHasItsCovariance) {
  write_states(path(), content(3, 50), {});
  const Reader file(path());
  // Columns 9 to 14: aa ab ac bb bc cc.
  const auto square = [](int column) {
    return [column](std::size_t row) {
      return degrees_from_radians(degrees_from_radians(number(column, row)));
    };
  };
  expect_column(file, "rotation_angle_covariance_ab_deg2", "degree2", 50, square(10));
  expect_column(file, "rotation_angle_covariance_ac_deg2", "degree2", 50, square(11));
  expect_column(file, "rotation_angle_covariance_bc_deg2", "degree2", 50, square(13));
  expect_column(file, "rotation_angle_sigma_c_deg", "degree", 50,
                [](std::size_t row) { return degrees_from_radians(std::sqrt(number(14, row))); });
  EXPECT_FALSE(file.has("prism_angle"));
}

TEST_F(StatesFile, ResidualsOverTheRotationAngleComeBack) {
  constexpr std::size_t kBins = 36;
  StatesContent two = content(2, 10);
  for (const int prism : {0, 1}) {
    estimation::AngleProfile profile;
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      profile.count.push_back(1000 * (prism + 1) + bin);
      profile.mean_azimuth.push_back(number(prism, bin));
      profile.mean_zenith.push_back(-number(prism, 100 + bin));
    }
    two.residuals_over_angle.push_back(profile);
  }
  two.residuals_over_angle[1].mean_zenith[5] = std::numeric_limits<double>::quiet_NaN();
  write_states(path(), two, {});
  const Reader file(path());
  const std::vector<double> middle = file.values("prism_angle", "prism_angle");
  ASSERT_EQ(middle.size(), kBins);
  EXPECT_EQ(file.text("prism_angle", "units"), "degree");
  for (const int prism : {0, 1}) {
    const std::string letter(1, static_cast<char>('a' + prism));
    const std::string azimuth_name = "azimuth_residual_by_angle_" + letter + "_deg";
    const std::string zenith_name = "zenith_residual_by_angle_" + letter + "_deg";
    const auto count = file.values("residual_shots_by_angle_" + letter, "prism_angle");
    const auto azimuth = file.values(azimuth_name, "prism_angle");
    const auto zenith = file.values(zenith_name, "prism_angle");
    EXPECT_EQ(file.text("residual_shots_by_angle_" + letter, "units"), "1");
    EXPECT_EQ(file.text(azimuth_name, "units"), "degree");
    EXPECT_EQ(file.text(zenith_name, "units"), "degree");
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      EXPECT_DOUBLE_EQ(middle[bin], 5.0 + 10.0 * static_cast<double>(bin));
      EXPECT_EQ(count[bin], 1000.0 * (prism + 1) + static_cast<double>(bin));
      EXPECT_DOUBLE_EQ(azimuth[bin], degrees_from_radians(number(prism, bin)));
      if (prism == 1 && bin == 5) {
        EXPECT_TRUE(std::isnan(zenith[bin]));
      } else {
        EXPECT_DOUBLE_EQ(zenith[bin], -degrees_from_radians(number(prism, 100 + bin)));
      }
    }
  }
}

TEST_F(StatesFile, AFileWithoutRowsIsStillOne) {
  write_states(path(), content(1, 0), {});
  const Reader file(path());
  EXPECT_TRUE(file.values("time", "time").empty());
  EXPECT_TRUE(file.values("rotation_angle_a_deg", "time").empty());
}

TEST_F(StatesFile, AFailureLeavesNoFile) {
  StatesContent failing = content(2, 40'000);
  failing.block = [](estimation::ShotRange rows) {
    if (rows.begin > 0) throw std::runtime_error("no more");
    return states(2, rows);
  };
  EXPECT_THROW(write_states(path(), failing, {}), std::runtime_error);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(StatesFile, AFailureKeepsTheFileThatWasThere) {
  write_states(path(), content(1, 5), {{"command", "first"}});
  StatesContent failing = content(2, 40'000);
  failing.block = [](estimation::ShotRange) -> estimation::RotorStates {
    throw std::runtime_error("nothing");
  };
  EXPECT_THROW(write_states(path(), failing, {{"command", "second"}}), std::runtime_error);
  const Reader file(path());
  EXPECT_EQ(file.text("", "command"), "first");
}

TEST_F(StatesFile, AMissingFolderIsSaid) {
  EXPECT_THROW(write_states(folder_.file("missing/states.nc"), content(1, 5), {}), FileError);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

}  // namespace risley::jobs::states_file_test
