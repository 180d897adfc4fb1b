// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// PLY, PCD and npy: text headers and packed records.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "risley/io/text_file.hpp"

#include "cloud/cloud_samples.hpp"
#include "cloud/formats/point_fields.hpp"

namespace risley::cloud::record_files_test {

class RecordFiles : public CloudTest {};

INSTANTIATE_TEST_SUITE_P(Clouds, RecordFiles, ::testing::ValuesIn(cloud_cases()),
                         [](const auto& one) { return one.param.name; });

/// Takes the text up to and including a line away from a file's bytes.
std::vector<std::string> take_lines(std::string& bytes, const std::string& last) {
  std::vector<std::string> lines;
  do {
    const std::size_t end = bytes.find('\n');
    if (end == std::string::npos) {
      ADD_FAILURE() << "no line " << last;
      break;
    }
    lines.push_back(bytes.substr(0, end));
    bytes.erase(0, end + 1);
  } while (lines.back() != last);
  return lines;
}

/// A PLY file as its specification has it. @param comments  gets them without the key word
TestTable read_ply(std::string bytes, std::vector<std::string>& comments) {
  const std::vector<std::string> lines = take_lines(bytes, "end_header");
  EXPECT_EQ(lines.at(0), "ply");
  EXPECT_EQ(lines.at(1), "format binary_little_endian 1.0");
  const std::map<std::string, char> types{{"uchar", 'u'}, {"float", 'f'}, {"double", 'd'}};
  TestTable table;
  std::size_t points = 0;
  int elements = 0;
  for (const std::string& line : lines) {
    std::istringstream words(line);
    std::string key, first, second;
    words >> key >> first;
    if (key == "comment") {
      comments.push_back(line.substr(std::min(line.size(), std::strlen("comment "))));
      EXPECT_LT(line.size(), 1000U);  // what rply can read
      EXPECT_FALSE(first.empty());
    } else if (key == "element") {
      EXPECT_EQ(first, "vertex");
      EXPECT_TRUE(words >> points);
      ++elements;
    } else if (key == "property") {
      EXPECT_EQ(elements, 1);
      words >> second;
      table.push_back({second, types.at(first), {}});
    } else {
      EXPECT_TRUE(key == "ply" || key == "format" || key == "end_header") << line;
    }
  }
  EXPECT_EQ(elements, 1);
  EXPECT_EQ(bytes.size(), points * record_bytes(table));
  read_records(bytes, table);
  return table;
}

TEST_P(RecordFiles, PlyHoldsEveryField) {
  const std::string path = folder_.file("cloud.ply");
  write_uneven(path, "ply", header(), points_);
  std::vector<std::string> comments;
  const TestTable found = read_ply(io::read_text_file(path), comments);
  for (TestColumn& one : expected_) {
    one.name =
        one.name.size() == 1 ? std::string(1, "xyz"[one.name[0] - 'X']) : "scalar_" + one.name;
  }
  expect_same(found, expected_);
}

TEST_P(RecordFiles, PcdHoldsEveryField) {
  const std::string path = folder_.file("cloud.pcd");
  write_uneven(path, "pcd", header(), points_);
  std::string bytes = io::read_text_file(path);
  std::map<std::string, std::vector<std::string>> entries;
  std::vector<std::string> order;
  for (const std::string& line : take_lines(bytes, "DATA binary")) {
    std::istringstream words(line);
    std::string key, word;
    words >> key;
    if (key.starts_with('#')) continue;
    order.push_back(key);
    while (words >> word) entries[key].push_back(word);
  }
  EXPECT_EQ(order, (std::vector<std::string>{"VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH",
                                             "HEIGHT", "VIEWPOINT", "POINTS", "DATA"}));
  using Words = std::vector<std::string>;
  EXPECT_EQ(entries["VERSION"], Words{"0.7"});
  EXPECT_EQ(entries["WIDTH"], Words{std::to_string(points_.size())});
  EXPECT_EQ(entries["HEIGHT"], Words{"1"});
  EXPECT_EQ(entries["POINTS"], Words{std::to_string(points_.size())});
  EXPECT_EQ(entries["VIEWPOINT"], (Words{"0", "0", "0", "1", "0", "0", "0"}));
  const std::size_t fields = entries["FIELDS"].size();
  ASSERT_EQ(entries["SIZE"].size(), fields);
  ASSERT_EQ(entries["TYPE"].size(), fields);
  EXPECT_EQ(entries["COUNT"], Words(fields, "1"));
  const std::map<std::string, char> types{{"U1", 'u'}, {"F4", 'f'}, {"F8", 'd'}};
  TestTable found;
  for (std::size_t k = 0; k < fields; ++k) {
    found.push_back({entries["FIELDS"][k], types.at(entries["TYPE"][k] + entries["SIZE"][k]), {}});
  }
  EXPECT_EQ(bytes.size(), points_.size() * record_bytes(found));
  read_records(bytes, found);
  use_pcl_names(expected_);
  expect_same(found, expected_);
}

TEST_P(RecordFiles, NumpyReadsEveryField) {
  const std::string path = folder_.file("cloud.npy"), answer = folder_.file("answer");
  write_uneven(path, "npy", header(), points_);
  const std::string head = io::read_text_file(path).substr(0, 10);
  EXPECT_EQ(head.substr(0, 8), std::string("\x93NUMPY\x01\0", 8));
  const std::size_t length =
      static_cast<unsigned char>(head[8]) + std::size_t{256} * static_cast<unsigned char>(head[9]);
  EXPECT_EQ((10 + length) % 64, 0U);
  EXPECT_EQ(io::read_text_file(path).substr(10 + length).size(),
            points_.size() * record_bytes(expected_));
  const std::string python = find_python("numpy");
  if (python.empty()) GTEST_SKIP() << "no Python with numpy";
  const std::string script = folder_.file("read.py");
  io::write_text_file(script, R"(
import sys
import numpy
array = numpy.load(sys.argv[1])
assert array.ndim == 1
with open(sys.argv[2], 'wb') as answer:
    for name in array.dtype.names:
        answer.write(f'{name} {array.dtype[name].str} {len(array)}\n'.encode())
    answer.write(b'values\n')
    for name in array.dtype.names:
        answer.write(array[name].astype('<f8').tobytes())
)");
  const std::string call = python + " '" + script + "' '" + path + "' '" + answer + "'";
  ASSERT_EQ(std::system(call.c_str()), 0);
  std::string bytes = io::read_text_file(answer);
  const std::map<std::string, char> types{{"|u1", 'u'}, {"<f4", 'f'}, {"<f8", 'd'}};
  TestTable found;
  std::vector<std::string> lines = take_lines(bytes, "values");
  lines.pop_back();
  for (const std::string& line : lines) {
    std::istringstream words(line);
    std::string name, type;
    std::size_t points = 0;
    words >> name >> type >> points;
    found.push_back({name, types.at(type), std::vector<double>(points)});
    EXPECT_EQ(points, points_.size());
  }
  ASSERT_EQ(bytes.size(), found.size() * points_.size() * sizeof(double));
  const char* at = bytes.data();
  for (TestColumn& one : found) {
    if (points_.size() > 0) std::memcpy(one.values.data(), at, points_.size() * sizeof(double));
    at += points_.size() * sizeof(double);
  }
  expect_same(found, expected_);
}

TEST(RecordPacker, NoPointsNeedNoRoom) {
  const CloudHeader header = cloud_cases().front().header;
  RecordPacker packer(all_fields(header));
  Points none;
  header.resize(none, 0);
  packer.pack(none, 0, 0, nullptr,
              packer.record_bytes());  // the undefined-behaviour sanitizer looks on
}

TEST(PlyComments, TellTheProvenanceInLinesThatEveryReaderTakes) {
  const TestFolder folder;
  CloudCase one = cloud_cases().front();
  std::string letters;
  for (int i = 0; i < 1200; ++i) letters += "\xC3\xA4";  // two bytes each
  one.header.provenance.emplace_back("long", letters);
  write_uneven(folder.file("cloud.ply"), "ply", one.header, make_points(one));
  std::vector<std::string> comments;
  read_ply(io::read_text_file(folder.file("cloud.ply")), comments);
  const auto has = [&comments](const std::string& text) {
    return std::ranges::find(comments, text) != comments.end();
  };
  EXPECT_TRUE(has("command: risley cloud over two lines"));
  EXPECT_TRUE(has("version: 0.1"));
  EXPECT_TRUE(has("sensor: mid-40"));
  EXPECT_TRUE(has("serial: 0TFDG3B006H2Z11"));
  EXPECT_TRUE(has("scalar_StdX: [m] 1 sigma of X (m)"));
  std::string joined;
  for (const std::string& comment : comments) {
    if (comment.starts_with("long: ")) joined = comment;
    if (comment.starts_with("\xC3")) joined += comment;  // never the second half of a letter
  }
  EXPECT_EQ(joined, "long: " + letters);
}

}  // namespace risley::cloud::record_files_test
