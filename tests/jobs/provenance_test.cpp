// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/provenance.hpp"

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "risley/core/error.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/recordings/reader.hpp"

#include "io/test_folder.hpp"

namespace risley::jobs::provenance_test {

class InputHashesTest : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.file(name)) << text;
    return folder_.file(name);
  }

  io::TestFolder folder_;
  const Provenance command_{{"command", "risley test"}};
};

TEST_F(InputHashesTest, AreThoseOfTheFilesInTheirOrderForEveryNumberOfThreads) {
  const std::string a = file("a", "abc"), b = file("b", std::string(3'000'000, 'x'));
  auto columns = std::make_shared<recordings::Recording>();
  columns->header.devices.resize(1);
  const std::vector<recordings::Source> inputs{a, recordings::Source(columns, "in memory"), b};
  const Provenance expected{
      {"command", "risley test"},
      {"input", a},
      {"input_sha256", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
      {"input_2", "in memory"},
      {"input_3", b},
      {"input_3_sha256", hashes::sha256(std::string(3'000'000, 'x'))}};
  for (const int threads : {1, 2, 4}) {
    parallel::Threads(threads).run([&] {
      InputHashes hashes(inputs);
      EXPECT_EQ(hashes.with_inputs(command_), expected) << threads;
      EXPECT_EQ(hashes.with_input({}, 2),
                (Provenance{{"input", b}, {"input_sha256", expected.back().second}}));
      EXPECT_EQ(with_inputs(command_, inputs), expected) << threads;
    });
  }
}

TEST_F(InputHashesTest, TellOfAMissingFileWhenItIsAskedFor) {
  const std::string a = file("a", "abc"), missing = folder_.file("missing");
  InputHashes hashes({a, missing});
  EXPECT_EQ(hashes.with_input({}, 0).size(), 2U);
  EXPECT_THROW(hashes.with_input({}, 1), FileError);
  EXPECT_THROW(hashes.with_input({}, 2), InvalidArgument);
  EXPECT_THROW(with_inputs({}, {a, missing}), FileError);
}

TEST_F(InputHashesTest, AreNotThoseOfPipesWhichWouldWaitForever) {
  const std::string pipe = folder_.file("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(with_inputs({}, {pipe}), (Provenance{{"input", pipe}}));
}

TEST_F(InputHashesTest, AreGivenUpWithTheWork) {
  CancelFlag flag;
  flag.set();
  InputHashes hashes({file("a", "abc")}, Progress([](double) {}, &flag));
  EXPECT_THROW(hashes.with_inputs({}), Cancelled);
}

}  // namespace risley::jobs::provenance_test
