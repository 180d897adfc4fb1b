// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <optional>

#include <gtest/gtest.h>
#include <netcdf.h>

#include "cloud/cloud_samples.hpp"

namespace risley::cloud::netcdf_cloud_test {

/// A NetCDF file as others read it.
class Reader {
 public:
  explicit Reader(const std::string& path) {
    EXPECT_EQ(nc_open(path.c_str(), NC_NOWRITE, &id_), NC_NOERR);
  }
  ~Reader() { nc_close(id_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  int id() const { return id_; }

  std::optional<int> find(const std::string& name) const {
    int variable = 0;
    if (nc_inq_varid(id_, name.c_str(), &variable) != NC_NOERR) return std::nullopt;
    return variable;
  }

  std::vector<std::string> dimensions(const std::string& name) const {
    int count = 0;
    std::array<int, NC_MAX_VAR_DIMS> ids{};
    EXPECT_EQ(nc_inq_varndims(id_, find(name).value(), &count), NC_NOERR);
    EXPECT_EQ(nc_inq_vardimid(id_, find(name).value(), ids.data()), NC_NOERR);
    std::vector<std::string> names;
    for (int k = 0; k < count; ++k) {
      std::array<char, NC_MAX_NAME + 1> text{};
      EXPECT_EQ(nc_inq_dimname(id_, ids[k], text.data()), NC_NOERR);
      names.emplace_back(text.data());
    }
    return names;
  }

  std::size_t length(const std::string& dimension) const {
    int id = 0;
    std::size_t length = 0;
    EXPECT_EQ(nc_inq_dimid(id_, dimension.c_str(), &id), NC_NOERR);
    EXPECT_EQ(nc_inq_dimlen(id_, id, &length), NC_NOERR);
    return length;
  }

  /// A variable along "point" under another name, with the type it has in the file.
  TestColumn values(const std::string& name, const std::string& as) const {
    if (!find(name)) {
      ADD_FAILURE() << "no variable " << name;
      return {};
    }
    EXPECT_EQ(dimensions(name), std::vector<std::string>{"point"}) << name;
    TestColumn found{as, type(name), std::vector<double>(length("point"))};
    EXPECT_EQ(nc_get_var_double(id_, *find(name), found.values.data()), NC_NOERR);
    return found;
  }

  char type(const std::string& name) const {
    nc_type type = NC_NAT;
    EXPECT_EQ(nc_inq_vartype(id_, find(name).value(), &type), NC_NOERR);
    return type == NC_UBYTE ? 'u' : type == NC_FLOAT ? 'f' : type == NC_DOUBLE ? 'd' : '?';
  }

  /// A text attribute of a variable; of the file for an empty name.
  std::string text(const std::string& name, const std::string& attribute) const {
    const int variable = name.empty() ? NC_GLOBAL : find(name).value();
    std::size_t length = 0;
    EXPECT_EQ(nc_inq_attlen(id_, variable, attribute.c_str(), &length), NC_NOERR) << attribute;
    std::string value(length, '\0');
    EXPECT_EQ(nc_get_att_text(id_, variable, attribute.c_str(), value.data()), NC_NOERR);
    return value;
  }

 private:
  int id_ = 0;
};

class NetcdfCloud : public ::testing::TestWithParam<CloudCase> {
 protected:
  const CloudHeader& header() const { return GetParam().header; }
  std::string write() {
    std::string path = folder_.file("cloud.nc");
    write_uneven(path, "netcdf", header(), points_);
    return path;
  }

  TestFolder folder_;
  Points points_ = make_points(GetParam());
};

INSTANTIATE_TEST_SUITE_P(Clouds, NetcdfCloud, ::testing::ValuesIn(cloud_cases()),
                         [](const auto& one) { return one.param.name; });

TEST_P(NetcdfCloud, HoldsEveryField) {
  const Reader file(write());
  const std::vector<std::pair<std::string, std::string>> names{
      {"X", "x_m"},
      {"Y", "y_m"},
      {"Z", "z_m"},
      {"Time", "time"},
      {"Intensity", "intensity"},
      {"ReturnNumber", "return_number"},
      {"NumberOfReturns", "number_of_returns"},
      {"Tag", "tag"},
      {"Beam", "beam"},
      {"StdX", "std_x_m"},
      {"StdY", "std_y_m"},
      {"StdZ", "std_z_m"},
      {"VarianceX", "covariance_xx_m2"},
      {"VarianceY", "covariance_yy_m2"},
      {"VarianceZ", "covariance_zz_m2"},
      {"CovarianceXY", "covariance_xy_m2"},
      {"CovarianceXZ", "covariance_xz_m2"},
      {"CovarianceYZ", "covariance_yz_m2"},
      {"LidarRange", "range_m"},
      {"IncidenceAngle", "incidence_angle_deg"},
      {"PrismAngle1", "rotation_angle_a_deg"},
      {"PrismAngle2", "rotation_angle_b_deg"},
      {"PrismAngle3", "rotation_angle_c_deg"},
      {"ResidualAzimuth", "azimuth_residual_deg"},
      {"ResidualZenith", "zenith_residual_deg"},
  };
  TestTable expected, found;
  for (const TestColumn& one : expected_table(header(), points_)) {
    if (!one.name.starts_with("Loading")) expected.push_back(one);
  }
  for (const auto& [field, variable] : names) {
    if (file.find(variable)) found.push_back(file.values(variable, field));
  }
  expect_same(found, expected);
  const auto units = [&file](const std::string& name) { return file.text(name, "units"); };
  for (const char* name : {"x_m", "y_m", "z_m", "range_m"}) EXPECT_EQ(units(name), "m");
  EXPECT_EQ(units("incidence_angle_deg"), "degree");
  EXPECT_EQ(units("time"), "s");
  for (const auto& [field, variable] : names) {
    if (!file.find(variable)) continue;
    EXPECT_FALSE(file.text(variable, "long_name").empty()) << variable;
  }
}

TEST_P(NetcdfCloud, HoldsTimesToTheNanosecond) {
  const Reader file(write());
  nc_type type = NC_NAT;
  EXPECT_EQ(nc_inq_vartype(file.id(), file.find("time_ns").value(), &type), NC_NOERR);
  EXPECT_EQ(type, NC_INT64);
  std::vector<long long> times(file.length("point"));
  EXPECT_EQ(nc_get_var_longlong(file.id(), file.find("time_ns").value(), times.data()), NC_NOERR);
  EXPECT_EQ(times, std::vector<long long>(points_.time_ns.begin(), points_.time_ns.end()));
}

TEST_P(NetcdfCloud, HoldsLoadingsByPointAndFactor) {
  const Reader file(write());
  const auto& factors = header().factors;
  const std::array<const char*, 3> names{"loading_x_m", "loading_y_m", "loading_z_m"};
  if (factors.empty()) {
    for (const char* name : names) EXPECT_FALSE(file.find(name));
    EXPECT_FALSE(file.find("factor_name"));
    return;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(file.dimensions(names[axis]), (std::vector<std::string>{"point", "factor"}));
    EXPECT_EQ(file.type(names[axis]), 'f');
    std::vector<float> values(points_.size() * factors.size());
    ASSERT_EQ(nc_get_var_float(file.id(), file.find(names[axis]).value(), values.data()), NC_NOERR);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      for (std::size_t k = 0; k < factors.size(); ++k) {
        ASSERT_EQ(values[i * factors.size() + k], static_cast<float>(points_.loading[k][axis][i]));
      }
    }
  }
  std::vector<char*> texts(file.length("factor"));
  ASSERT_EQ(texts.size(), factors.size());
  ASSERT_EQ(nc_get_var_string(file.id(), file.find("factor_name").value(), texts.data()), NC_NOERR);
  for (std::size_t k = 0; k < factors.size(); ++k) EXPECT_EQ(texts[k], factors[k]);
  nc_free_string(texts.size(), texts.data());
}

TEST_P(NetcdfCloud, TellsWhatItIs) {
  const Reader file(write());
  EXPECT_EQ(file.text("", "Conventions"), "CF-1.9");
  EXPECT_EQ(file.text("", "featureType"), "point");
  EXPECT_EQ(file.text("", "sensor"), header().sensor);
  EXPECT_EQ(file.text("", "serial"), header().serial);
  EXPECT_EQ(file.text("", "time_reference"), recordings::to_string(header().time_reference));
  EXPECT_NE(file.text("", "frame").find("X forward"), std::string::npos);
  for (const auto& [name, value] : header().provenance) EXPECT_EQ(file.text("", name), value);
  int unlimited = 0, point = 0;
  EXPECT_EQ(nc_inq_unlimdim(file.id(), &unlimited), NC_NOERR);
  EXPECT_EQ(nc_inq_dimid(file.id(), "point", &point), NC_NOERR);
  EXPECT_EQ(unlimited, point);
}

TEST(NetcdfClouds, HaveDatesWhenTheClockIsUtc) {
  const TestFolder folder;
  CloudCase one = cloud_cases().at(1);
  one.header.time_reference = recordings::TimeReference::utc;
  write_uneven(folder.file("cloud.nc"), "netcdf", one.header, make_points(one));
  const Reader file(folder.file("cloud.nc"));
  EXPECT_EQ(file.text("time", "units"), "seconds since 1970-01-01 00:00:00");
  EXPECT_EQ(file.text("time", "standard_name"), "time");
}

TEST(NetcdfClouds, GoOverManyBlocks) {
  const TestFolder folder;
  CloudCase one = cloud_cases().at(5);
  one.points = 70'000;
  const Points points = make_points(one);
  write_uneven(folder.file("cloud.nc"), "netcdf", one.header, points);
  const Reader file(folder.file("cloud.nc"));
  TestTable expected = expected_table(one.header, points);
  expect_same({file.values("x_m", "X"), file.values("range_m", "LidarRange")},
              {column(expected, "X"), column(expected, "LidarRange")});
}

}  // namespace risley::cloud::netcdf_cloud_test
