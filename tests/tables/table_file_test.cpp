// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Tables in two formats hold the same, and appear whole or not at all.
#include "risley/tables/table_file.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netcdf.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/tables/netcdf.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"

namespace risley::tables::table_file_test {

using ::testing::ElementsAre;

const std::vector<TableColumn> kColumns = {{"input", CellKind::text, "", "path"},
                                           {"exit_status", CellKind::integer, "1", "status"},
                                           {"wedge_angle_deg", CellKind::real, "deg", "estimated"}};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const double kThird = 1.0 / 3.0;

void write(const std::string& path) {
  TableFile table(path, kColumns, {{"version", "0.1.0"}});
  table.add({"a, \"b\".lvx", std::int64_t{0}, kThird});
  table.add({std::string("ä\nb.lvx"), {}, kNaN});
  table.add({{}, std::int64_t{9007199254740993}, std::int64_t{2}});
  table.close();
}

TEST(TableFile, WritesText) {
  const io::TestFolder folder;
  write(folder.file("t.csv"));
  EXPECT_EQ(io::read_text_file(folder.file("t.csv")),
            "input,exit_status,wedge_angle_deg\n"
            "\"a, \"\"b\"\".lvx\",0,0.3333333333333333\n"
            "\"ä\nb.lvx\",,\n"
            ",9007199254740993,2\n");
}

TEST(TableFile, AnyEndOfALineWithinATextIsQuoted) {
  const io::TestFolder folder;
  TableFile table(folder.file("t.csv"), kColumns, {});
  table.add({"a\rb", std::int64_t{0}, kThird});
  table.add({"a\nb", std::int64_t{0}, kThird});
  table.close();
  EXPECT_EQ(io::read_text_file(folder.file("t.csv")),
            "input,exit_status,wedge_angle_deg\n"
            "\"a\rb\",0,0.3333333333333333\n"
            "\"a\nb\",0,0.3333333333333333\n");
}

TEST(TableFile, WritesNetcdf) {
  const io::TestFolder folder;
  write(folder.file("t.nc"));
  const NetcdfInput file(folder.file("t.nc"));
  EXPECT_EQ(file.text("version"), "0.1.0");
  const NetcdfDimension row = file.dimension("row", 3);
  std::vector<std::int64_t> status;
  file.get(file.variable<std::int64_t>("exit_status", {&row}), 0, 3, status);
  EXPECT_THAT(status, ElementsAre(0, TableFile::kMissingInteger, 9007199254740993));
  EXPECT_EQ(TableFile::kMissingInteger, NC_FILL_INT64);
  std::vector<double> angle;
  file.get(file.variable<double>("wedge_angle_deg", {&row}), 0, 3, angle);
  EXPECT_EQ(angle[0], kThird);
  EXPECT_TRUE(std::isnan(angle[1]));
  EXPECT_EQ(angle[2], 2.0);
  EXPECT_TRUE(file.has_variable("input"));
}

TEST(TableFile, MayHaveNoRows) {
  const io::TestFolder folder;
  for (const char* name : {"t.csv", "t.nc"}) {
    TableFile(folder.file(name), kColumns, {}).close();
  }
  EXPECT_EQ(folder.names().size(), 2U);
}

TEST(TableFile, IsThereWholeOrNotAtAll) {
  const io::TestFolder folder;
  for (const char* name : {"t.csv", "t.nc"}) {
    io::write_text_file(folder.file(name), "before");
    {
      TableFile table(folder.file(name), kColumns, {});
      table.add({"a", std::int64_t{0}, 1.0});
    }
    EXPECT_EQ(io::read_text_file(folder.file(name)), "before");
    EXPECT_EQ(folder.names().size(), 1U) << name;
    std::filesystem::remove(folder.file(name));
  }
}

TEST(TableFile, RefusesWhatDoesNotFit) {
  const io::TestFolder folder;
  EXPECT_THROW(TableFile::check_name("t.xlsx"), InvalidArgument);
  EXPECT_THROW(TableFile::check_name("t.sqlite"), InvalidArgument);
  EXPECT_THROW(TableFile(folder.file("t.csv"), {}, {}), InvalidArgument);
  EXPECT_THROW(TableFile(folder.file("nowhere/t.csv"), kColumns, {}), FileError);
  TableFile table(folder.file("t.csv"), kColumns, {});
  EXPECT_THROW(table.add({"a", std::int64_t{0}}), InvalidArgument);
  EXPECT_THROW(table.add({"a", std::int64_t{0}, "text"}), InvalidArgument);
  EXPECT_THROW(table.add({"a", 0.5, 1.0}), InvalidArgument);
  EXPECT_THROW(table.add({1.0, std::int64_t{0}, 1.0}), InvalidArgument);
  try {
    TableFile::check_name("t");
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), NamesField(".csv"));
  }
}

}  // namespace risley::tables::table_file_test
