// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/growing_file.hpp"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/statfs.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "risley/core/error.hpp"

#include "io/test_folder.hpp"

namespace {

/// Whether waiting for the disk fails.
std::atomic<bool> disk_fails{false};

}  // namespace

// Instead of the system library's.
extern "C" int sync_file_range(int file, off64_t from, off64_t bytes, unsigned how) {
  if (disk_fails && (how & SYNC_FILE_RANGE_WAIT_AFTER) != 0) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_sync_file_range, file, from, bytes, how));
}

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

/// Whether the system holds the byte of a file in memory.
bool is_in_memory(const std::string& path, std::size_t byte) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  void* page = ::mmap(nullptr, 1, PROT_READ, MAP_SHARED, file.get(), static_cast<off_t>(byte));
  unsigned char resident = 0;
  EXPECT_EQ(::mincore(page, 1, &resident), 0);
  ::munmap(page, 1);
  return (resident & 1U) != 0;
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
  TestFolder folder_;
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

// A recording that fills the memory makes the system drop packets.
TEST_F(GrowingFileTest, WhatIsOnTheDiskLeavesMemory) {
  GrowingFile file(path_);
  struct statfs system {};
  ASSERT_EQ(::statfs(unfinished_.c_str(), &system), 0);
  if (system.f_type == TMPFS_MAGIC) GTEST_SKIP() << "a file system that is in memory";
  for (int i = 0; i < 96; ++i) file.append(bytes(1 << 20, i));
  file.settle();
  EXPECT_FALSE(is_in_memory(unfinished_, 0));
  EXPECT_TRUE(is_in_memory(unfinished_, std::size_t{90} << 20U));
  EXPECT_EQ(content(unfinished_).at((std::size_t{5} << 20U) + 7), '\5');
}

// The system reports it once, and not again when the file gets its name.
TEST_F(GrowingFileTest, ADiskThatFailsLaterIsToldOf) {
  GrowingFile file(path_);
  disk_fails = true;
  const auto write = [&] {
    for (int i = 0; i < 96; ++i) file.append(bytes(1 << 20, i));
    file.settle();
  };
  EXPECT_THROW(write(), FileError);
  disk_fails = false;
  EXPECT_THROW(file.commit(), FileError);
  EXPECT_FALSE(fs::exists(path_));
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
