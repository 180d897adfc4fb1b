// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Every text format in the dialects of locales and programs.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "recordings/format_tests.hpp"

namespace risley::recordings::text_dialects_test {

using namespace format_tests;

Recording load(const std::string& bytes) {
  const TestFolder folder;
  put_bytes(folder.file("a"), bytes);
  return load_recording(folder.file("a"));
}

/// Semicolons for commas, and commas for points.
std::string german(std::string text) {
  for (char& c : text) c = c == ',' ? ';' : c == '.' ? ',' : c;
  return text;
}

std::string utf16(const std::string& text) {
  std::string bytes = "\xFF\xFE";
  for (const char c : text) bytes += {c, '\0'};
  return bytes;
}

/// Header and rows of each format.
std::vector<std::pair<std::string, std::string>> tables() {
  std::string viewer =
      "Version,Slot ID,LiDAR Index,Rsvd,Error Code,Timestamp Type,Data Type,Timestamp,X,Y,Z,"
      "Reflectivity,Tag,Ori_x,Ori_y,Ori_z,Ori_radius,Ori_theta,Ori_phi\n";
  std::string captured = "//X,Y,Z,Inten-sity,Time\n", sequence = "Time/s,Azimuth/deg,Zenith/deg\n",
              named = "x,y,z,intensity,time\n";
  for (int i = 0; i < 200; ++i) {
    const int x = 7541 + 5 * i, y = 1322 - 3 * i, z = 2182 + i;
    const auto m = [](int mm) { return fmt::format("{:.3f}", 1e-3 * mm); };
    viewer += fmt::format("5,7,1,0,0x00000000,0,0,{},{},{},{},33,0,{},{},{},0,0,0\n",
                          1'000'000'000 + i / 100 * 1'000'000, m(x), m(y), m(z), x, y, z);
    captured += fmt::format("{},{},{},33,{:.6f}\n", m(x), m(y), m(z), 1e-5 * i);
    named += fmt::format("{},{},{},33,{:.6f}\n", m(x), m(y), m(z), 1e-5 * i);
    sequence += fmt::format("{:.6f},{:.4f},{:.4f}\n", 1e-5 * i, 0.05 * i - 5, 90 + 0.01 * i);
  }
  return {{"livox-viewer-csv", viewer},
          {"openpylivox-csv", captured},
          {"named-csv", named},
          {"scan-sequence-csv", sequence}};
}

TEST(TextDialects, EveryTextFormatReadsThem) {
  for (const auto& [format, text] : tables()) {
    SCOPED_TRACE(format);
    const Recording plain = load(text);
    EXPECT_EQ(plain.header.format, format);
    ASSERT_EQ(plain.data.observations.size(), 200U);
    for (const std::string& other : {german(text), utf16(text), utf16(german(text))}) {
      const Recording read = load(other);
      EXPECT_EQ(read.header.format, format);
      EXPECT_TRUE(is_same(read.data.observations, plain.data.observations)) << other.substr(0, 80);
    }
  }
}

TEST(TextDialects, DecimalCommasInQuotesAndBetweenBlanks) {
  std::string quoted = "\"x\",\"y\",\"z\"\n", blanks = "X Y Z\n", tabs = "x\ty\tz\n",
              plain = "x,y,z\n";
  for (int i = 0; i < 50; ++i) {
    const std::string x = fmt::format("{:.3f}", 7.541 + 0.001 * i);
    std::string with_comma = x;
    with_comma.replace(x.find('.'), 1, ",");
    quoted += fmt::format("\"{}\",\"1,322\",\"2,182\"\n", with_comma);
    blanks += fmt::format("{} 1,322 2,182\n", with_comma);
    tabs += fmt::format("{}\t1,322\t2,182\n", with_comma);
    plain += fmt::format("{},1.322,2.182\n", x);
  }
  const Recording wanted = load(plain);
  std::string sheet = plain;
  for (char& c : sheet) c = c == ',' ? ';' : c == '.' ? ',' : c;
  for (const std::string& text : {quoted, blanks, tabs, "sep=;\r\n" + sheet}) {
    EXPECT_TRUE(is_same(load(text).data.observations, wanted.data.observations)) << text;
  }
}

TEST(TextDialects, NumberOfRowsBeforeThem) {
  const std::string rows = "7.541 1.322 2.182\n7.596 1.334 2.194\n7.605 1.338 2.192\n";
  const Recording wanted = load("x y z\n" + rows);
  for (const char* head :
       {"//X Y Z\n3\n", "3\n//X Y Z\n", "X Y Z\n3\n", "# made by hand\n3\n", "3\n", "3\r\n"}) {
    SCOPED_TRACE(head);
    const Recording read = load(head + rows);
    EXPECT_EQ(read.header.format, "named-csv");
    EXPECT_TRUE(is_same(read.data.observations, wanted.data.observations));
  }
  // PTS: x y z intensity red green blue.
  const Recording pts = load("2\n7.5 1.3 2.1 17 200 100 50\n7.6 1.3 2.1 18 200 100 50\n");
  EXPECT_EQ(pts.data.observations.intensity[1], 18);
  EXPECT_FALSE(load("2\n7.5 1.3 2.1 200 100 50\n7.6 1.3 2.1 200 100 50\n").header.has_intensity);
  // Fewer and more rows than counted are damage, behind all sound ones.
  for (const char* head : {"//X Y Z\n2\n", "//X Y Z\n4\n"}) {
    const TestFolder folder;
    put_bytes(folder.file("a"), head + rows);
    const auto reader = open_recording(folder.file("a"));
    Chunk chunk;
    std::size_t count = 0;
    EXPECT_THROW(while (reader->read(chunk, 1)) count += chunk.observations.size(), FileError);
    EXPECT_EQ(count, head[8] == '2' ? 2U : 3U);
  }
}

TEST(TextDialects, FilesThatStandForOthersAreRefusedByTheirRemedy) {
  const auto problem = [](const std::string& bytes) {
    try {
      load(bytes);
    } catch (const FileError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(problem("version https://git-lfs.github.com/spec/v1\noid sha256:c8\nsize 599\n"),
              NamesField("git lfs pull"));
  EXPECT_THAT(problem(std::string("\x1F\x8B\x08\x00\x01", 5)), NamesField("gunzip"));
}

}  // namespace risley::recordings::text_dialects_test
