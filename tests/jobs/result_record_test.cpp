// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Records of results: what they say when read again, and what makes a result be made again.
#include "risley/jobs/result_record.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "risley/core/error.hpp"

namespace risley::jobs::result_record_test {

namespace fs = std::filesystem;

class ResultRecordTest : public ::testing::Test {
 protected:
  ResultRecordTest() {
    std::string name = (fs::temp_directory_path() / "risley-record-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    folder_ = name;
    write("one.nc", "one");
    write("two.yaml", "two");
    record_ = {
        "work\n", {"00ff"}, hashes_of({file("one.nc"), file("two.yaml"), file("none")}), "{}"};
  }
  ~ResultRecordTest() override { fs::remove_all(folder_); }

  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
  }
  bool whole() const { return is_whole(record_, "work\n", {"00ff"}); }

  fs::path folder_;
  ResultRecord record_;
};

TEST_F(ResultRecordTest, ThatWasEditedIsNone) {
  const std::string path = file("record.json");
  record_.outcome = R"({"wedge": 18.0})";
  save_record(path, record_);
  ASSERT_TRUE(load_record(path));
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  std::string edited = text.str();
  edited.replace(edited.find("18.0"), 4, "19.0");
  write("record.json", edited);
  EXPECT_FALSE(load_record(path));
}

TEST_F(ResultRecordTest, IsReadAsWritten) {
  const std::string path = file("a/b/record.json");
  save_record(path, record_);
  const auto found = load_record(path);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->work, record_.work);
  EXPECT_EQ(found->inputs, record_.inputs);
  EXPECT_EQ(found->outputs, record_.outputs);
  EXPECT_EQ(found->outcome, record_.outcome);
  EXPECT_EQ(found->outputs.size(), 2U);
}

TEST_F(ResultRecordTest, WhatIsNoneCountsAsNone) {
  EXPECT_FALSE(load_record(file("nowhere.json")));
  for (const char* text : {"", "{", "[]", "{\"risley_record\": 2}", "{\"risley_record\": 1}",
                           "{\"risley_record\": 1, \"work\": 3, \"inputs_sha256\": []}"}) {
    write("bad.json", text);
    EXPECT_FALSE(load_record(file("bad.json"))) << text;
  }
  fs::create_directory(file("folder"));
  EXPECT_FALSE(load_record(file("folder")));
}

TEST_F(ResultRecordTest, ContentsDecide) {
  EXPECT_TRUE(whole());
  EXPECT_FALSE(is_whole(record_, "other work\n", {"00ff"}));
  EXPECT_FALSE(is_whole(record_, "work\n", {"00fe"}));
  EXPECT_FALSE(is_whole(record_, "work\n", {"00ff", "00ff"}));
  fs::last_write_time(file("one.nc"), fs::file_time_type::clock::now() + std::chrono::hours(1));
  EXPECT_TRUE(whole());
  write("one.nc", "ono");
  EXPECT_FALSE(whole());
  write("one.nc", "one");
  EXPECT_TRUE(whole());
  fs::remove(file("two.yaml"));
  EXPECT_FALSE(whole());
}

TEST_F(ResultRecordTest, AFolderThatCannotBeMadeIsTold) {
  EXPECT_THROW(save_record(file("one.nc") + "/record.json", record_), FileError);
}

}  // namespace risley::jobs::result_record_test
