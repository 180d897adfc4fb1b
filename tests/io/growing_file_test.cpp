// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/growing_file.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "risley/core/error.hpp"

#include "io/temporary_folder.hpp"

namespace risley::io {
namespace {

namespace fs = std::filesystem;

std::vector<std::uint8_t> bytes(std::size_t count, int value) {
  return std::vector<std::uint8_t>(count, static_cast<std::uint8_t>(value));
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// No file of this process can become longer, as on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t most) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{most, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

class GrowingFileTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  std::string path_ = folder_.file("grows"), unfinished_ = path_ + ".unfinished";
};

TEST_F(GrowingFileTest, BytesAreThereInTheirOrder) {
  GrowingFile file(path_);
  std::string expected;
  for (int i = 0; i < 200; ++i) {
    const std::size_t count = 1000 + 1000 * static_cast<std::size_t>(i % 90);
    file.append(bytes(count, i));
    expected += std::string(count, static_cast<char>(i));
  }
  EXPECT_EQ(file.size(), expected.size());
  file.settle();
  EXPECT_EQ(content(unfinished_), expected);
  file.commit();
  EXPECT_EQ(content(path_), expected);
  EXPECT_FALSE(fs::exists(unfinished_));
}

TEST_F(GrowingFileTest, WhatWaitsIsWrittenAtTheEnd) {
  {
    GrowingFile file(path_);
    for (int i = 0; i < 50; ++i) file.append(bytes(1 << 20, i));  // more than may wait
  }
  EXPECT_EQ(fs::file_size(unfinished_), std::uintmax_t{50} << 20U);
}

TEST_F(GrowingFileTest, ADiskThatRefusesEndsTheFileBefore) {
  GrowingFile file(path_);
  {
    const FileSizeLimit limit(4096);
    file.append(bytes(3000, 1));
    file.settle();
    file.append(bytes(3000, 2));
    EXPECT_THROW(file.settle(), FileError);
  }
  EXPECT_THROW(file.append(bytes(10, 3)), FileError);
  EXPECT_THROW(file.commit(), FileError);
  EXPECT_EQ(content(unfinished_), std::string(3000, '\1'));
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(GrowingFileTest, WhatIsDiscardedIsGone) {
  GrowingFile file(path_);
  file.append(bytes(1000, 1));
  file.discard();
  EXPECT_TRUE(fs::is_empty(fs::path(path_).parent_path()));
}

}  // namespace
}  // namespace risley::io
