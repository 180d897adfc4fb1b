// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include <gtest/gtest.h>

#include "risley/io/text_file.hpp"

#include "cloud/cloud_samples.hpp"

namespace risley::cloud::text_clouds_test {

class TextClouds : public CloudTest {};

INSTANTIATE_TEST_SUITE_P(Clouds, TextClouds, ::testing::ValuesIn(cloud_cases()),
                         [](const auto& one) { return one.param.name; });

std::vector<std::string> split(const std::string& line, char separator) {
  std::vector<std::string> words(1);
  for (const char c : line) {
    if (c == separator) {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  return words;
}

/// @param types  of the columns, which the text does not state
TestTable read_text(const std::string& text, char separator, const TestTable& types) {
  std::istringstream lines(text);
  std::string line;
  EXPECT_TRUE(std::getline(lines, line));
  TestTable table;
  for (const std::string& name : split(line, separator)) {
    const char type = table.size() < types.size() ? types[table.size()].type : '?';
    table.push_back({name, type, {}});
  }
  while (std::getline(lines, line)) {
    const std::vector<std::string> words = split(line, separator);
    EXPECT_EQ(words.size(), table.size()) << line;
    for (std::size_t k = 0; k < std::min(words.size(), table.size()); ++k) {
      char* end = nullptr;
      const double value = table[k].type == 'f' ? std::strtof(words[k].c_str(), &end)
                                                : std::strtod(words[k].c_str(), &end);
      EXPECT_TRUE(!words[k].empty() && *end == '\0') << words[k];
      EXPECT_EQ(std::isnan(value), words[k] == "nan") << words[k];
      table[k].values.push_back(value);
    }
  }
  EXPECT_TRUE(text.ends_with('\n'));
  return table;
}

std::string unit_of(const std::string& name) {
  if (name == "Time") return "_s";
  if (name.size() == 1 || name.starts_with("Std") || name.starts_with("Loading") ||
      name == "LidarRange") {
    return "_m";
  }
  if (name.starts_with("Variance") || name.starts_with("Covariance")) return "_m2";
  const bool angle =
      name.ends_with("Angle") || name.starts_with("PrismAngle") || name.starts_with("Residual");
  return angle ? "_deg" : "";
}

TEST_P(TextClouds, CsvLosesNothing) {
  write_uneven(folder_.file("cloud.csv"), "csv", header(), points_);
  for (TestColumn& one : expected_) one.name += unit_of(one.name);
  expect_same(read_text(io::read_text_file(folder_.file("cloud.csv")), ',', expected_), expected_);
}

TEST_P(TextClouds, XyzLosesNothing) {
  write_uneven(folder_.file("cloud.xyz"), "xyz", header(), points_);
  std::rotate(expected_.begin() + 3, expected_.begin() + 4, expected_.begin() + 5);
  ASSERT_EQ(expected_[3].name, "Intensity");
  expected_[0].name = "//X";
  expect_same(read_text(io::read_text_file(folder_.file("cloud.xyz")), ' ', expected_), expected_);
}

TEST(TextCloud, UnknownNumbersHaveNoSign) {
  const TestFolder folder;
  CloudCase one = cloud_cases().at(1);
  Points points = make_points(one);
  points.incidence[0] = -std::numeric_limits<double>::quiet_NaN();
  write_uneven(folder.file("cloud.csv"), "csv", one.header, points);
  const std::string text = io::read_text_file(folder.file("cloud.csv"));
  EXPECT_NE(text.find(",nan,"), std::string::npos);
  EXPECT_EQ(text.find("-nan"), std::string::npos);
}

}  // namespace risley::cloud::text_clouds_test
