// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Tables as other locales and programs write them, and files that stand for others.
#include "risley/io/text_dialect.hpp"

#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/file_head.hpp"
#include "risley/io/text_table.hpp"

#include "io/test_folder.hpp"

namespace risley::io::text_dialect_test {

using namespace std::string_literals;

void put_file(const std::string& path, const std::string& bytes) {
  std::ofstream stream(path, std::ios::binary);
  stream << bytes;
}

/// ASCII as UTF-16.
std::string utf16(const std::string& text, bool little, bool mark) {
  std::string bytes;
  const auto put = [&](unsigned char high, unsigned char low) {
    bytes += static_cast<char>(little ? low : high);
    bytes += static_cast<char>(little ? high : low);
  };
  if (mark) put(0xFE, 0xFF);
  for (const char c : text) put(0, static_cast<unsigned char>(c));
  return bytes;
}

std::vector<std::string> lines_of_table(const std::string& bytes) {
  const TestFolder folder;
  put_file(folder.file("a"), bytes);
  LineReader lines(folder.file("a"), LinesOf::table);
  std::vector<std::string> all;
  for (std::string_view line; lines.next(line);) all.emplace_back(line);
  EXPECT_DOUBLE_EQ(lines.fraction_read(), 1.0);
  return all;
}

TEST(TextDialect, EveryDialectOfATableReadsAlike) {
  const std::vector<std::string> plain = {"x,y,z", "7.541,-1.322,2", "7.596,1.334,-2.194"};
  for (const char* text : {
           "x,y,z\n7.541,-1.322,2\n7.596,1.334,-2.194\n",
           "x;y;z\n7,541;-1,322;2\n7,596;1,334;-2,194\n",
           "x;y;z\r\n7.541;-1.322;2\r\n7.596;1.334;-2.194\r\n",
           "\"x\",\"y\",\"z\"\n\"7,541\",\"-1,322\",\"2\"\n\"7,596\",\"1,334\",\"-2,194\"\n",
           "\"x\";\"y\";\"z\"\n\"7,541\";\"-1,322\";\"2\"\n\"7,596\";\"1,334\";\"-2,194\"\n",
           "x,y,z\n\"7.541\",\"-1.322\",2\n\"7.596\",\"1.334\",\"-2.194\"\n",
       }) {
    EXPECT_EQ(lines_of_table(text), plain) << text;
    for (const bool little : {false, true}) {
      for (const bool mark : {false, true}) {
        const std::string bytes = utf16(text, little, mark);
        EXPECT_EQ(lines_of_table(bytes), plain) << text;
        EXPECT_EQ(encoding_of(bytes),
                  little ? TextEncoding::utf16_little : TextEncoding::utf16_big);
      }
    }
  }
  EXPECT_EQ(lines_of_table("sep=;\r\nx;y\r\n7,5;1\r\n"),
            (std::vector<std::string>{"#", "x,y", "7.5,1"}));
  EXPECT_EQ(lines_of_table("x\ty\n7,5\t1,25e-3\n"),
            (std::vector<std::string>{"x\ty", "7.5\t1.25e-3"}));
  EXPECT_EQ(lines_of_table("// x y z\n3\n7,5 +1,25 -2\n0 1,5 2,5\n1 2 3\n"),
            (std::vector<std::string>{"// x y z", "3", "7.5 +1.25 -2", "0 1.5 2.5", "1 2 3"}));
}

TEST(TextDialect, WhatIsPlainStaysAsItIs) {
  for (const std::string& text : {
           "x, y, z\n1, 2, 3\n4, 5, 6"s,
           "1,2 3,4,5\n6,7 8,9,10\n"s,
           "a;b, c\n1;2, 3\n"s,
           "date,x\n2023-11-16 12:00:00,1\n2023-11-16 12:00:01,2\n"s,
           "name,x\n\"Smith, J\",1.5\n\"Doe, J\",2.5\n"s,
           "20231116 120000,5\n20231116 120001,5\n"s,
           "  2023/11/16  55225.00  47.5\n  2023/11/16  55225.05  47.5\n"s,
           "one\n2\n3\n"s,
           ""s,
           "\x93NUMPY\x01\x00;1,5;2,5\n;1,5;2,5\n"s,
       }) {
    EXPECT_TRUE(dialect_of(text).is_plain()) << text;
  }
  // Only tables are rewritten.
  const TestFolder folder;
  put_file(folder.file("list"), "a;b.lvx\nc;d,5.lvx\n");
  LineReader lines(folder.file("list"));
  std::string_view line;
  ASSERT_TRUE(lines.next(line));
  EXPECT_EQ(line, "a;b.lvx");
}

TEST(TextDialect, Utf16InPiecesAndBeyondAscii) {
  // A degree sign, an umlaut, the euro, a pair of surrogates, and half of one.
  const std::string bytes = "\xFF\xFE\xB0\x00\xE4\x00\xAC\x20\x3D\xD8\x00\xDE\x00\xDE"s;
  for (std::size_t piece = 1; piece <= bytes.size(); ++piece) {
    TextDecoder decoder(TextEncoding::utf16_little);
    std::string text;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      decoder.append(std::string_view(bytes).substr(at, piece), text);
    }
    EXPECT_EQ(text, "\xC2\xB0\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80\xEF\xBF\xBD");
  }
  // Longer than a block, at an odd number of bytes.
  std::string rows = "x,y\n";
  for (int i = 0; i < 60'000; ++i) rows += "123.25,4\n";
  const std::vector<std::string> lines = lines_of_table(utf16(rows, true, false) + "z");
  ASSERT_EQ(lines.size(), 60'001U);
  EXPECT_EQ(lines.back(), "123.25,4");
}

TEST(FileHead, TellsWhatStandsForAFile) {
  const TestFolder folder;
  const auto words = [&](const std::string& name, const std::string& bytes) {
    put_file(folder.file(name), bytes);
    return stands_for_another(folder.file(name), read_file_head(folder.file(name), 4096))
        .value_or("");
  };
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(has(words("a.bag", "version https://git-lfs.github.com/spec/v1\noid sha256:12\n"),
                  "git lfs pull"));
  EXPECT_TRUE(has(words("b.bag", "/annex/objects/SHA256E-s5--12.bag\n"), "git annex get b.bag"));
  EXPECT_TRUE(has(words("c.bag", "<!DOCTYPE html><html>"), "page"));
  EXPECT_TRUE(has(words("a.lvx.gz", "\x1F\x8B\x08"s), "gunzip -c a.lvx.gz > a.lvx"));
  EXPECT_TRUE(has(words("a.db3.zstd", "\x28\xB5\x2F\xFD"s), "unzstd -c a.db3.zstd > a.db3"));
  EXPECT_TRUE(has(words("a.csv.bz2", "BZh91AY"), "bunzip2 -c a.csv.bz2 > a.csv"));
  EXPECT_TRUE(has(words("a.las.XZ",
                        "\xFD"
                        "7zXZ\0"s),
                  "unxz -c a.las.XZ > a.las"));
  EXPECT_TRUE(has(words("a.pcap", "\x04\x22\x4D\x18"s), "unlz4 -c a.pcap > a.pcap.unpacked"));
  EXPECT_TRUE(has(words("a.zip", "PK\x03\x04"s), "unzip a.zip"));
  EXPECT_TRUE(has(words("a.tar", std::string(257, 'a') + "ustar"), "tar xf a.tar"));
  EXPECT_EQ(words("a.txt", "x,y,z\n1,2,3\n"), "");
  EXPECT_THROW(read_file_head(folder.file("none"), 16), FileError);
  EXPECT_THROW(read_file_head(folder.path().string(), 16), FileError);
}

}  // namespace risley::io::text_dialect_test
