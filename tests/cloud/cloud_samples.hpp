// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/cloud/points.hpp"

#include "io/test_folder.hpp"

namespace risley::cloud {

/// A cloud to be written: what its points have and how many there are.
struct CloudCase {
  std::string name;
  std::size_t points = 0;
  CloudHeader header;
  double farthest = 450.0;  ///< size of the coordinates, m

  friend std::ostream& operator<<(std::ostream& out, const CloudCase& one) {
    return out << one.name;
  }
};

/// No point, one, many; without covariance, without rotation angles, with loadings, of three
/// prisms, far away.
std::vector<CloudCase> cloud_cases();

/// Random points, the same every time: all signs, all bytes, every seventh incidence unknown.
Points make_points(const CloudCase& one);

/// Points [first, first + count).
Points slice(const Points& points, std::size_t first, std::size_t count);

/// Writes a whole cloud in pieces of uneven lengths, the first and some others empty.
void write_uneven(const std::string& path, const std::string& format, const CloudHeader& header,
                  const Points& points);

/// A field of a file: values as they were before they were given the type.
struct TestColumn {
  std::string name;
  char type = 'f';  ///< 'u' 8-bit, 'i' unsigned 32-bit, 'f' 32-bit, 'd' 64-bit
  std::vector<double> values;
};
using TestTable = std::vector<TestColumn>;

/// All fields of a cloud, worked out without the code under test.
TestTable expected_table(const CloudHeader& header, const Points& points);

/// The column of a name. Fails the test when there is none.
TestColumn& column(TestTable& table, const std::string& name);

/// As PCL wants it: x, y, z and intensity of 32 bits.
void use_pcl_names(TestTable& table);

/// Reads packed little-endian records; the columns have names and types and get their values.
void read_records(const std::string& bytes, TestTable& table);

/// Bytes of a record.
std::size_t record_bytes(const TestTable& table);

/// Same names, types and numbers, bit by bit but for the kind of NaN.
void expect_same(const TestTable& found, const TestTable& expected);

using io::TestFolder;

/// A cloud that a format is written with, and what a file of it has to hold.
class CloudTest : public ::testing::TestWithParam<CloudCase> {
 protected:
  const CloudHeader& header() const { return GetParam().header; }

  TestFolder folder_;
  Points points_ = make_points(GetParam());
  TestTable expected_ = expected_table(header(), points_);
};

/// A Python that has a module; empty when there is none.
std::string find_python(const std::string& module);

}  // namespace risley::cloud
