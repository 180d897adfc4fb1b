// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What TableFile wrote is read again, and so is what a spreadsheet made of it.
#include "risley/tables/table_input.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/tables/netcdf.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"

namespace risley::tables::table_input_test {

using ::testing::ElementsAre;

const std::vector<TableColumn> kColumns = {{"input", CellKind::text, "", "path"},
                                           {"exit_status", CellKind::integer, "1", "status"},
                                           {"wedge_angle_deg", CellKind::real, "deg", "estimated"}};
const std::vector<std::vector<TableCell>> kRows = {{"a, \"b\".lvx", std::int64_t{0}, 1.0 / 3.0},
                                                   {"ä\nb;.lvx", {}, {}},
                                                   {{}, std::int64_t{9007199254740993}, 2.0}};

void write(const std::string& path, const std::vector<std::vector<TableCell>>& rows = kRows) {
  TableFile table(path, kColumns, {{"version", "0.1.0"}});
  for (const auto& row : rows) table.add(row);
  table.close();
}

std::string problem_of(const std::string& path) {
  try {
    read_table(path, kColumns);
  } catch (const FileError& error) {
    return error.what();
  }
  return "read";
}

TEST(TableInput, ReadsWhatWasWritten) {
  const io::TestFolder folder;
  for (const char* name : {"t.csv", "t.nc"}) {
    SCOPED_TRACE(name);
    write(folder.file(name));
    EXPECT_TRUE(is_table(folder.file(name)));
    EXPECT_EQ(read_table(folder.file(name), kColumns), kRows);
    const std::vector<TableColumn> some = {{"verdict"}, kColumns[0]};
    const auto rows = read_table(folder.file(name), some);
    ASSERT_EQ(rows.size(), 3U);
    EXPECT_THAT(rows[0], ElementsAre(TableCell(), kRows[0][0]));
    EXPECT_THROW(read_table(folder.file(name), {{"verdict"}}), FileError);
    write(folder.file(name), {});
    EXPECT_TRUE(read_table(folder.file(name), {kColumns[1]}).empty());
  }
}

TEST(TableInput, ReadsWhatASpreadsheetSaved) {
  const io::TestFolder folder;
  const std::string path = folder.file("t.csv");
  for (const char delimiter : {';', '\t', ','}) {
    std::string text =
        "\xEF\xBB\xBFinput|exit_status|wedge_angle_deg\r\n\"a, \"\"b\"\".lvx\"|0|"
        "0.3333333333333333\r\n\r\n\"ä\nb;.lvx\"||\r\n|9007199254740993|2";
    for (char& c : text) c = c == '|' ? delimiter : c;
    io::write_text_file(path, text);
    EXPECT_EQ(read_table(path, kColumns), kRows);
  }
}

TEST(TableInput, IsRecognised) {
  const io::TestFolder folder;
  io::write_text_file(folder.file("preset.yaml"), "name: x\n");
  io::write_text_file(folder.file("empty.csv"), "");
  EXPECT_FALSE(is_table(folder.file("preset.yaml")));
  EXPECT_FALSE(is_table(folder.file("empty.csv")));
  EXPECT_FALSE(is_table(folder.file("nowhere.csv")));
  EXPECT_FALSE(is_table(folder.file(".")));
}

TEST(TableInput, NamesWhereTextIsDamaged) {
  const io::TestFolder folder;
  const std::string path = folder.file("t.csv");
  const auto of = [&](const std::string& text) {
    io::write_text_file(path, text);
    return problem_of(path);
  };
  EXPECT_THAT(of(""), NamesField("input, exit_status, wedge_angle_deg"));
  EXPECT_THAT(of("x,y\n1,2\n"), NamesField("input, exit_status, wedge_angle_deg"));
  EXPECT_THAT(of("input,input\n"), NamesField("column input"));
  EXPECT_THAT(of("input,x\na,1\nb\n"), NamesField("found 1", 3));
  EXPECT_THAT(of("input,x\na,1\n\"b\nc,2\n"), NamesField("quotes", 3));
  EXPECT_THAT(of("exit_status\n1.5\n"), NamesField("exit_status", 2));
  EXPECT_THAT(of("wedge_angle_deg\nwide\n"), NamesField("wedge_angle_deg", 2));
  EXPECT_THAT(of("input\n\"" + std::string(40'000, 'a') + "\n" + std::string(40'000, 'a') + "\"\n"),
              NamesField("65536 bytes"));
}

TEST(TableInput, RefusesOtherKinds) {
  const io::TestFolder folder;
  {
    NetcdfOutput file(folder.file("t.nc"));
    const NetcdfDimension row = file.define_dimension("row", 2);
    file.define<double>("exit_status", {&row}, {});
    file.define<std::int32_t>("input", {&row}, {});
    file.end_definitions();
    file.close();
  }
  EXPECT_THAT(problem_of(folder.file("t.nc")), NamesField("variable input"));
  EXPECT_THROW(read_table(folder.file("t.nc"), {kColumns[1]}), FileError);
}

TEST(TableInput, SurvivesAnyChangedByte) {
  const io::TestFolder folder;
  write(folder.file("t.csv"));
  const std::string bytes = io::read_text_file(folder.file("t.csv"));
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
    io::write_text_file(folder.file("t.csv"), changed);
    try {
      ASSERT_LE(read_table(folder.file("t.csv"), kColumns).size(), 100U);
    } catch (const FileError&) {  // named, not obeyed
    }
  }
}

TEST(TableInput, CanBeCancelled) {
  const io::TestFolder folder;
  CancelFlag flag;
  flag.set();
  const Progress progress([](double) {}, &flag);
  write(folder.file("t.csv"));
  EXPECT_THROW(read_table(folder.file("t.csv"), kColumns, progress), Cancelled);
}

}  // namespace risley::tables::table_input_test
