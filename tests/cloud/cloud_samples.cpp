// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/cloud_samples.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

namespace risley::cloud {

std::vector<CloudCase> cloud_cases() {
  CloudHeader header;
  header.sensor = "mid-40";
  header.serial = "0TFDG3B006H2Z11";
  header.provenance = {{"command", "risley cloud\nover two lines"}, {"version", "0.1"}};
  const auto make = [&header](const char* name, std::size_t points, auto&& change) {
    CloudCase one{name, points, header};
    change(one);
    return one;
  };
  const auto nothing = [](CloudCase&) {};
  return {
      make("no_points", 0, nothing),
      make("one_point", 1, nothing),
      make("many_points", 5000, nothing),
      make("no_covariance", 300, [](CloudCase& one) { one.header.has_covariance = false; }),
      make("no_rotation_angles", 300,
           [](CloudCase& one) { one.header.has_rotation_angles = false; }),
      make("loadings", 300,
           [](CloudCase& one) {
             one.header.factors = {"range offset", "wedge a", "wedge b"};
           }),
      make("three_prisms", 300, [](CloudCase& one) { one.header.prisms = 3; }),
      make("far", 300, [](CloudCase& one) { one.farthest = 6.4e6; }),
      make("bare", 300,
           [](CloudCase& one) {
             one.header.has_covariance = one.header.has_rotation_angles = false;
             one.header.serial.clear();
             one.header.provenance.clear();
           }),
  };
}

Points make_points(const CloudCase& one) {
  std::mt19937_64 engine(20240229);
  const auto random = [&engine](double low, double high) {
    return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
  };
  const auto byte = [&engine] { return static_cast<std::uint8_t>(engine() >> 56); };
  Points points;
  one.header.resize(points, one.points);
  for (std::size_t i = 0; i < one.points; ++i) {
    // Several points per shot, and 0.33 s in 5000 points.
    points.time_ns[i] = 1'700'000'000'000'000'003 + static_cast<std::int64_t>(i / 3) * 200'001;
    for (auto* values : {&points.x, &points.y, &points.z}) {
      (*values)[i] = random(-one.farthest, one.farthest);
    }
    points.range[i] = random(0.0, 450.0);
    points.incidence[i] = i % 7 == 3 ? std::numeric_limits<double>::quiet_NaN() : random(0.0, 1.6);
    points.intensity[i] = byte();
    points.return_number[i] = byte();
    points.number_of_returns[i] = byte();
    points.tag[i] = byte();
    points.beam[i] = byte();
    for (std::size_t term = 0; one.header.has_covariance && term < kCovarianceTerms; ++term) {
      const bool variance = term == kXX || term == kYY || term == kZZ;
      points.covariance[term][i] = random(variance ? 1e-7 : -1e-7, 1e-3);
    }
    for (auto& angle : points.rotation_angle) angle[i] = random(0.0, 2.0 * std::numbers::pi);
    if (one.header.has_rotation_angles) {
      points.azimuth_residual[i] = random(-1e-3, 1e-3);
      points.zenith_residual[i] = random(-1e-3, 1e-3);
    }
    for (auto& factor : points.loading) {
      for (auto& axis : factor) axis[i] = random(-0.01, 0.01);
    }
  }
  return points;
}

Points slice(const Points& points, std::size_t first, std::size_t count) {
  std::vector<std::size_t> rows(count);
  std::iota(rows.begin(), rows.end(), first);
  Points part = points;
  part.keep(rows);
  return part;
}

void write_uneven(const std::string& path, const std::string& format, const CloudHeader& header,
                  const Points& points) {
  constexpr std::size_t kLengths[] = {0, 1, 7, 0, 1000, 2, 613};
  CloudWriterOptions options;
  options.format = format;
  const auto writer = create_cloud(path, header, options);
  std::size_t first = 0, piece = 0;
  do {
    const std::size_t count =
        std::min(kLengths[piece++ % std::size(kLengths)], points.size() - first);
    writer->write(slice(points, first, count));
    first += count;
  } while (first < points.size());
  writer->close();
}

TestTable expected_table(const CloudHeader& header, const Points& points) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  TestTable table;
  const auto add = [&](const std::string& name, char type, auto&& value) {
    TestColumn& one = table.emplace_back(TestColumn{name, type, {}});
    for (std::size_t i = 0; i < points.size(); ++i) {
      one.values.push_back(static_cast<double>(value(i)));
    }
  };
  add("X", 'd', [&](std::size_t i) { return points.x[i]; });
  add("Y", 'd', [&](std::size_t i) { return points.y[i]; });
  add("Z", 'd', [&](std::size_t i) { return points.z[i]; });
  add("Time", 'd', [&](std::size_t i) { return 1e-9 * static_cast<double>(points.time_ns[i]); });
  add("Intensity", 'u', [&](std::size_t i) { return points.intensity[i]; });
  add("ReturnNumber", 'u', [&](std::size_t i) { return points.return_number[i]; });
  add("NumberOfReturns", 'u', [&](std::size_t i) { return points.number_of_returns[i]; });
  add("Tag", 'u', [&](std::size_t i) { return points.tag[i]; });
  add("Beam", 'u', [&](std::size_t i) { return points.beam[i]; });
  if (header.has_covariance) {
    const auto& c = points.covariance;
    add("StdX", 'f', [&](std::size_t i) { return std::sqrt(c[kXX][i]); });
    add("StdY", 'f', [&](std::size_t i) { return std::sqrt(c[kYY][i]); });
    add("StdZ", 'f', [&](std::size_t i) { return std::sqrt(c[kZZ][i]); });
    add("VarianceX", 'f', [&](std::size_t i) { return c[kXX][i]; });
    add("VarianceY", 'f', [&](std::size_t i) { return c[kYY][i]; });
    add("VarianceZ", 'f', [&](std::size_t i) { return c[kZZ][i]; });
    add("CovarianceXY", 'f', [&](std::size_t i) { return c[kXY][i]; });
    add("CovarianceXZ", 'f', [&](std::size_t i) { return c[kXZ][i]; });
    add("CovarianceYZ", 'f', [&](std::size_t i) { return c[kYZ][i]; });
  }
  add("LidarRange", 'f', [&](std::size_t i) { return points.range[i]; });
  add("IncidenceAngle", 'f', [&](std::size_t i) { return kDegrees * points.incidence[i]; });
  if (header.has_rotation_angles) {
    for (std::size_t k = 0; k < points.rotation_angle.size(); ++k) {
      add("PrismAngle" + std::to_string(k + 1), 'f',
          [&](std::size_t i) { return kDegrees * points.rotation_angle[k][i]; });
    }
    add("ResidualAzimuth", 'f',
        [&](std::size_t i) { return kDegrees * points.azimuth_residual[i]; });
    add("ResidualZenith", 'f', [&](std::size_t i) { return kDegrees * points.zenith_residual[i]; });
  }
  for (std::size_t k = 0; k < points.loading.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      add("Loading" + std::to_string(k + 1) + "XYZ"[axis], 'f',
          [&](std::size_t i) { return points.loading[k][axis][i]; });
    }
  }
  return table;
}

TestColumn& column(TestTable& table, const std::string& name) {
  for (TestColumn& one : table) {
    if (one.name == name) return one;
  }
  ADD_FAILURE() << "no column " << name;
  static TestColumn none;
  return none;
}

void use_pcl_names(TestTable& table) {
  for (const auto& [from, to] : {std::pair{"X", "x"},
                                 {"Y", "y"},
                                 {"Z", "z"},
                                 {"Intensity", "intensity"},
                                 {"Time", "time"}}) {
    TestColumn& one = column(table, from);
    one.name = to;
    one.type = one.name == "time" ? 'd' : 'f';
  }
}

std::size_t record_bytes(const TestTable& table) {
  std::size_t bytes = 0;
  for (const TestColumn& one : table) bytes += one.type == 'u' ? 1 : one.type == 'd' ? 8 : 4;
  return bytes;
}

void read_records(const std::string& bytes, TestTable& table) {
  ASSERT_EQ(bytes.size() % record_bytes(table), 0U);
  auto next = [at = bytes.data()](auto number) mutable {
    std::memcpy(&number, at, sizeof number);
    at += sizeof number;
    return static_cast<double>(number);
  };
  for (std::size_t i = 0; i < bytes.size() / record_bytes(table); ++i) {
    for (TestColumn& one : table) {
      one.values.push_back(one.type == 'u'   ? next(std::uint8_t{})
                           : one.type == 'f' ? next(float{})
                           : one.type == 'i' ? next(std::uint32_t{})
                                             : next(double{}));
    }
  }
}

void expect_same(const TestTable& found, const TestTable& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    SCOPED_TRACE(expected[k].name);
    EXPECT_EQ(found[k].name, expected[k].name);
    EXPECT_EQ(found[k].type, expected[k].type);
    ASSERT_EQ(found[k].values.size(), expected[k].values.size());
    for (std::size_t i = 0; i < expected[k].values.size(); ++i) {
      double value = expected[k].values[i];
      if (expected[k].type == 'f') value = static_cast<float>(value);
      if (std::isnan(value)) {
        ASSERT_TRUE(std::isnan(found[k].values[i])) << "point " << i;
      } else {
        ASSERT_EQ(found[k].values[i], value) << "point " << i;
      }
    }
  }
}

std::string find_python(const std::string& module) {
  for (const char* python : {"python3", "/usr/bin/python3"}) {
    std::string call = python;
    call += " -c 'import ";
    call += module;
    call += "' >/dev/null 2>&1";
    if (std::system(call.c_str()) == 0) return python;
  }
  return "";
}

}  // namespace risley::cloud
