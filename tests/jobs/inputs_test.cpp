// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Which inputs names stand for, and where their results belong.
#include "risley/jobs/inputs.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"

#include "refusal.hpp"

namespace risley::jobs::inputs_test {

namespace fs = std::filesystem;
using ::testing::ElementsAre;

/// A folder of the test's own, which is the current one meanwhile.
class InputsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    before_ = fs::current_path();
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("risley-inputs-" + std::to_string(::getpid()) + "-" + test->name());
    fs::create_directories(folder_);
    fs::current_path(folder_);
  }
  void TearDown() override {
    fs::current_path(before_);
    fs::remove_all(folder_);
  }

  static void make(std::initializer_list<const char*> names) {
    for (const fs::path name : names) {
      if (name.has_parent_path()) fs::create_directories(name.parent_path());
      std::ofstream(name) << name.string();
    }
  }
  static std::vector<std::string> paths(const InputNames& wanted) {
    std::vector<std::string> result;
    for (const Input& input : find_inputs(wanted)) result.push_back(input.path);
    return result;
  }
  static std::vector<std::string> places(const InputNames& wanted) {
    std::vector<std::string> result;
    for (const Input& input : find_inputs(wanted)) result.push_back(input.place);
    return result;
  }
  static std::string refusal(const InputNames& wanted) {
    try {
      find_inputs(wanted);
    } catch (const InvalidArgument& error) {
      return error.what();
    }
    return "taken";
  }

 private:
  fs::path before_, folder_;
};

TEST_F(InputsTest, EverythingBehindANameIsKnown) {
  make({"a.db3", "a.db3-wal", "u.truth.yaml", "u.truth.nc", "u.mount.truth.yaml",
        "est/calibration.yaml", "est/states.nc"});
  EXPECT_THAT(files_behind("a.db3"), ElementsAre("a.db3", "a.db3-wal"));
  EXPECT_THAT(files_behind("u.truth.yaml"),
              ElementsAre("u.mount.truth.yaml", "u.truth.nc", "u.truth.yaml"));
  EXPECT_THAT(files_behind("est"), ElementsAre("est/calibration.yaml", "est/states.nc"));
  EXPECT_TRUE(files_behind("mid-40").empty());
}

TEST_F(InputsTest, AFolderStandsForAllRecordingsInIt) {
  make({"fleet/b/scan.lvx", "fleet/a/scan.LVX", "fleet/a/deep/er/walk.nc", "fleet/a/notes.txt",
        "fleet/a/.hidden.lvx", "fleet/.git/scan.lvx", "fleet/a/scan.truth.nc",
        "fleet/b/states_2.nc", "fleet/bag/metadata.yaml", "fleet/bag/bag_0.db3"});
  EXPECT_THAT(paths({{"fleet"}, "", {}}), ElementsAre("fleet/a/deep/er/walk.nc", "fleet/a/scan.LVX",
                                                      "fleet/b/scan.lvx", "fleet/bag"));
  EXPECT_THAT(places({{"fleet/"}, "", {}}),
              ElementsAre("a/deep/er/walk", "a/scan", "b/scan", "bag"));
  EXPECT_THAT(paths({{"fleet"}, "", {"fleet/a"}}), ElementsAre("fleet/b/scan.lvx", "fleet/bag"));
}

TEST_F(InputsTest, ALinkThatLeadsNowhereIsNotPassedOver) {
  make({"fleet/a.lvx"});
  std::filesystem::create_symlink("gone.lvx", "fleet/b.lvx");
  for (const char* names : {"fleet", "*/*.lvx", "**/*.lvx"}) {
    EXPECT_THAT(paths({{names}, "", {}}), ElementsAre("fleet/a.lvx", "fleet/b.lvx")) << names;
  }
}

// Parts of one recording are no recordings: reading the folder needs its metadata.yaml.
TEST_F(InputsTest, PartsOfABagAreOneRecordingAlsoWithoutMetadata) {
  make({"fleet/drive/drive_0.mcap", "fleet/drive/drive_1.mcap", "fleet/days/monday_0.mcap",
        "fleet/days/tuesday_0.mcap"});
  EXPECT_THAT(paths({{"fleet"}, "", {}}),
              ElementsAre("fleet/days/monday_0.mcap", "fleet/days/tuesday_0.mcap", "fleet/drive"));
  EXPECT_FALSE(are_many({{"fleet/drive"}, "", {}}));
}

TEST_F(InputsTest, PatternsGoThroughFolders) {
  make({"x/scan.lvx", "y/scan.lvx", "y/z/scan.lvx", "y/z/scan.csv", "y/z/.scan.lvx", "top.lvx"});
  EXPECT_THAT(paths({{"*/scan.lvx"}, "", {}}), ElementsAre("x/scan.lvx", "y/scan.lvx"));
  EXPECT_THAT(paths({{"**/*.lvx"}, "", {}}),
              ElementsAre("top.lvx", "x/scan.lvx", "y/scan.lvx", "y/z/scan.lvx"));
  EXPECT_THAT(paths({{"y/**/scan.*"}, "", {}}),
              ElementsAre("y/scan.lvx", "y/z/scan.csv", "y/z/scan.lvx"));
  EXPECT_THAT(paths({{"[xy]/sc?n.lvx"}, "", {}}), ElementsAre("x/scan.lvx", "y/scan.lvx"));
  EXPECT_THAT(paths({{"y/**"}, "", {}}), ElementsAre("y/scan.lvx", "y/z/scan.csv", "y/z/scan.lvx"));
  EXPECT_THAT(paths({{fs::current_path() / "y/*.lvx"}, "", {}}),
              ElementsAre((fs::current_path() / "y/scan.lvx").string()));
  EXPECT_THAT(refusal({{"x/*.nc"}, "", {}}), NamesField("x/*.nc"));
  EXPECT_THAT(refusal({{"nowhere/**/*.nc"}, "", {}}), NamesField("nowhere/**/*.nc"));
}

TEST_F(InputsTest, ANameThatExistsIsNoPattern) {
  make({"scan[1].lvx", "scan1.lvx"});
  EXPECT_THAT(paths({{"scan[1].lvx"}, "", {}}), ElementsAre("scan[1].lvx"));
  EXPECT_FALSE(are_many({{"scan[1].lvx"}, "", {}}));
  EXPECT_TRUE(are_many({{"scan[12].lvx"}, "", {}}));
}

TEST_F(InputsTest, EveryFileIsReadOnce) {
  make({"a/scan.lvx", "b/other.lvx"});
  fs::create_symlink("../a/scan.lvx", "b/link.lvx");
  fs::create_directory_symlink("..", "b/circle");
  EXPECT_THAT(paths({{"a/scan.lvx", "b", "**/*.lvx"}, "", {}}),
              ElementsAre("a/scan.lvx", "b/other.lvx"));
  EXPECT_THAT(refusal({{"a/scan.lvx", "./a/scan.lvx"}, "", {}}), NamesField("a/scan.lvx"));
  EXPECT_THAT(refusal({{"none.lvx", "./none.lvx"}, "", {}}), NamesField("none.lvx"));
}

TEST_F(InputsTest, ListsNameInputs) {
  make({"a/scan.lvx", "b/scan.lvx", "c/c.lvx"});
  std::ofstream("list.txt") << "# of May\nb/scan.lvx\r\n\nmissing.lvx\na/scan.lvx\nb/scan.lvx\nc";
  EXPECT_THAT(paths({{}, "list.txt", {}}),
              ElementsAre("b/scan.lvx", "missing.lvx", "a/scan.lvx", "c/c.lvx"));
  EXPECT_TRUE(are_many({{}, "list.txt", {}}));
  std::ofstream("empty.txt") << "# nothing\n\n";
  EXPECT_THAT(refusal({{}, "empty.txt", {}}), NamesField("empty.txt"));
  EXPECT_THROW(find_inputs({{}, "nowhere.txt", {}}), FileError);
}

TEST_F(InputsTest, ResultsMirrorTheInputs) {
  make({"m/a/scan.lvx", "m/b/scan.lvx", "m/b/scan.csv", "m/b/x.sequence.csv", "n/late.lvx"});
  EXPECT_THAT(places({{"m/a/scan.lvx"}, "", {}}), ElementsAre("scan"));
  EXPECT_THAT(places({{"m/a/scan.lvx", "m/b/scan.lvx"}, "", {}}), ElementsAre("a/scan", "b/scan"));
  EXPECT_THAT(places({{"m/a/*.lvx"}, "", {}}), ElementsAre("scan"));
  EXPECT_THAT(places({{"m", "n/*.lvx"}, "", {}}),
              ElementsAre("m/a/scan", "m/b/scan.csv", "m/b/scan.lvx", "m/b/x.sequence", "n/late"));
}

TEST_F(InputsTest, AnEmptyFolderIsTold) {
  make({"empty/notes.txt"});
  EXPECT_THAT(refusal({{"empty"}, "", {}}), NamesField("empty"));
}

TEST_F(InputsTest, SearchingStops) {
  make({"a/scan.lvx"});
  CancelFlag stop;
  stop.set();
  EXPECT_THROW(find_inputs({{"a"}, "", {}}, {[](double) {}, &stop}), Cancelled);
}

}  // namespace risley::jobs::inputs_test
