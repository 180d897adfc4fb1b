// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "risley/tables/netcdf.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"

namespace risley::tables::entries_test {

TEST(Entries, NetcdfDimensionsAskForALength) {
  const io::TestFolder folder;
  NetcdfOutput file(folder.file("a.nc"));
  EXPECT_EQ(refusal([&] { return file.define_dimension("axis", 0); }),
            "length of dimension axis = 0, allowed 1 or more");
}

TEST(Entries, NetcdfVariablesAskForOneOrTwoDimensions) {
  const io::TestFolder folder;
  NetcdfOutput file(folder.file("a.nc"));
  const auto row = file.define_growing_dimension("row"), axis = file.define_dimension("axis", 3);
  EXPECT_EQ(refusal([&] { return file.define<float>("scalar", {}, {}); }),
            "number of dimensions of variable scalar = 0, allowed 1 to 2");
  EXPECT_EQ(refusal([&] {
              return file.define<float>("cube", {&row, &axis, &axis}, {});
            }),
            "number of dimensions of variable cube = 3, allowed 1 to 2");
  EXPECT_EQ(refusal([&] {
              return file.define<float>("turned", {&axis, &row}, {});
            }),
            "length of the inner dimension row = 0, allowed 1 or more");
  EXPECT_EQ(refusal([&] { return file.define<float>("place", {&row, &axis}, {}); }), "");
}

TEST(Entries, NetcdfAsksForValuesThatFitTheirVariable) {
  const io::TestFolder folder;
  NetcdfOutput file(folder.file("a.nc"));
  const auto row = file.define_growing_dimension("row"), axis = file.define_dimension("axis", 3);
  const auto place = file.define<float>("place", {&row, &axis}, {});
  EXPECT_EQ(refusal([&] { file.define_texts("label", axis, "", {"one"}); }),
            "variable label has 1 values, expected 3");
  const auto time = file.define<double>("time", {&row}, {});
  EXPECT_EQ(refusal([&] { file.set_fill(time, 0.0F); }),
            "variable time has the type double, its fill value has float");
  file.end_definitions();
  EXPECT_EQ(refusal([&] { file.put(place, 0, std::vector<float>(4)); }),
            "variable place: 4 values of type float, expected float in groups of 3");
  EXPECT_EQ(refusal([&] { file.put(place, 0, std::vector<double>(3)); }),
            "variable place: 3 values of type double, expected float in groups of 3");
}

TEST(Entries, NetcdfIsReadByDimensionsAndTypesThatItHas) {
  const io::TestFolder folder;
  const std::string path = folder.file("a.nc");
  {
    NetcdfOutput file(path);
    const auto row = file.define_dimension("row", 2);
    const auto time = file.define<double>("time", {&row}, {});
    file.end_definitions();
    file.put(time, 0, std::vector<double>{1, 2});
    file.close();
  }
  const NetcdfInput file(path);
  const auto row = file.dimension("row");
  EXPECT_EQ(refusal([&] { return file.variable<double>("time", {}); }),
            "number of dimensions of variable time = 0, allowed 1 to 2");
  EXPECT_EQ(refusal([&] {
              return file.variable<double>("time", {&row, &row, &row});
            }),
            "number of dimensions of variable time = 3, allowed 1 to 2");
  const auto time = file.variable<double>("time", {&row});
  std::vector<float> wrong;
  EXPECT_EQ(refusal([&] { file.get(time, 0, 1, wrong); }),
            "variable time has the type double, asked for float");
}

}  // namespace risley::tables::entries_test
