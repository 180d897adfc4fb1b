// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Many inputs: what fails does not stop the rest, and what is whole is not made again.
#include "risley/jobs/many_inputs.hpp"

#include <atomic>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "risley/core/error.hpp"

namespace risley::jobs::many_inputs_test {

namespace fs = std::filesystem;
using ::testing::ElementsAre;

/// Copies of files, which fail where the file says so.
class ManyInputsTest : public ::testing::Test {
 protected:
  ManyInputsTest() {
    fs::create_directories(folder_ / "in/deep");
    for (const char* name : {"in/a.csv", "in/deep/b.csv", "in/fails.csv"}) write(name, name);
    options_.names = {(folder_ / "in").string()};
    options_.output = (folder_ / "new/out").string();
    options_.into_folder = true;
    work_.ending = ".txt";
    work_.run = [this](const InputJob& job, const Progress&) {
      ++runs_;
      if (job.place == "fails") throw std::runtime_error("fails");
      fs::copy_file(job.input, job.output, fs::copy_options::overwrite_existing);
      const ExitStatus status = job.place == "deep/b" ? status_of_b_ : kDone;
      return InputOutcome{status, R"({"of": ")" + job.place + "\"}", job.place, 2};
    };
    work_.failed = [](const InputJob& job) {
      return InputOutcome{kBadFile, "{}", job.place + " failed", 0};
    };
  }
  ~ManyInputsTest() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  /// @return done, skipped, failed, runs
  std::vector<std::size_t> run(const std::string& work_text = "work") {
    runs_ = 0;
    const InputPlan plan = plan_inputs(options_, work_);
    InputRun run(plan, work_, work_text, options_);
    EXPECT_TRUE(run.run({}));
    texts_.clear();
    run.for_each([this](const InputJob&, const InputResult& result) {
      texts_.push_back(result.outcome.text);
    });
    status_ = run.counts().status;
    counted_ = run.counts().counted;
    return {run.counts().done, run.counts().skipped, run.counts().failed, runs_};
  }

  fs::path folder_ = fs::temp_directory_path() / ("risley-many-" + std::to_string(::getpid()));
  ManyInputsOptions options_;
  InputWork work_;
  std::atomic<std::size_t> runs_ = 0;
  ExitStatus status_of_b_ = kDone, status_ = kDone;
  std::vector<std::string> texts_;
  std::uint64_t counted_ = 0;
};

TEST_F(ManyInputsTest, OneThatFailsDoesNotStopTheRest) {
  EXPECT_THAT(run(), ElementsAre(2, 0, 1, 3));
  EXPECT_EQ(status_, kBadFile);
  EXPECT_EQ(counted_, 4U);
  EXPECT_THAT(texts_, ElementsAre("a", "deep/b", "fails failed"));
  EXPECT_TRUE(fs::exists(folder_ / "new/out/deep/b.txt"));
}

TEST_F(ManyInputsTest, WhatIsWholeIsNotMadeAgain) {
  run();
  options_.resume = true;
  EXPECT_THAT(run(), ElementsAre(0, 2, 1, 1));  // what failed may have been the machine's fault
  EXPECT_THAT(texts_, ElementsAre("a", "deep/b", "fails failed"));
  EXPECT_EQ(counted_, 4U);
  EXPECT_THAT(run("other work"), ElementsAre(2, 0, 1, 3));
  EXPECT_THAT(run("other work"), ElementsAre(0, 2, 1, 1));
  write("in/a.csv", "other bytes");
  EXPECT_THAT(run("other work"), ElementsAre(1, 1, 1, 2));
  write("new/out/deep/b.txt", "edited");
  EXPECT_THAT(run("other work"), ElementsAre(1, 1, 1, 2));
  fs::remove(folder_ / "new/out/a.txt");
  EXPECT_THAT(run("other work"), ElementsAre(1, 1, 1, 2));
}

TEST_F(ManyInputsTest, AJournalThatACrashCutOffIsGoneOnWith) {
  run();
  options_.resume = true;
  const fs::path journal = folder_ / "new/out.records.jsonl";
  fs::resize_file(journal, fs::file_size(journal) - 10);
  EXPECT_LE(run()[3], 2U);
  EXPECT_THAT(run(), ElementsAre(0, 2, 1, 1));
  write("new/out.records.jsonl", "somebody's own notes\n");
  EXPECT_THROW(run(), FileError);
}

TEST_F(ManyInputsTest, NumbersThatFailedAreNotMadeAgain) {
  status_of_b_ = kNumbersFailed;
  EXPECT_THAT(run(), ElementsAre(1, 0, 2, 3));
  options_.resume = true;
  EXPECT_THAT(run(), ElementsAre(0, 1, 2, 1));
}

TEST_F(ManyInputsTest, WhatCannotBeMeantIsRefused) {
  work_.ending.clear();
  EXPECT_THROW(plan_inputs(options_, work_), InvalidArgument);
  options_ = {};
  EXPECT_THROW(plan_inputs(options_, work_), InvalidArgument);
  options_.names = {(folder_ / "in").string()};
  options_.resume = true;
  EXPECT_THROW(plan_inputs(options_, work_), InvalidArgument);
}

}  // namespace risley::jobs::many_inputs_test
