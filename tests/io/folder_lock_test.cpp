// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/folder_lock.hpp"

#include <cstdlib>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "risley/core/error.hpp"

#include "io/test_folder.hpp"

namespace risley::io::folder_lock_test {

/// What another process says. @param ask  its exit status
template <class Ask>
int in_other_process(const Ask& ask) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(ask());
  int status = 0;
  ::waitpid(child, &status, 0);
  return WEXITSTATUS(status);
}

TEST(FolderLock, OneWriterHasAFolder) {
  const TestFolder folder;
  const std::string path = folder.path().string();
  {
    const FolderLock lock(path);
    EXPECT_THROW(const FolderLock second(path), FileError);
    EXPECT_FALSE(is_locked_by_other(path)) << "it is our own";
    EXPECT_TRUE(folder.names().empty()) << "no file is left behind";
  }
  EXPECT_NO_THROW(const FolderLock again(path));
}

TEST(FolderLock, OthersSeeIt) {
  const TestFolder folder;
  const std::string path = folder.path().string();
  int ready[2], done[2];
  ASSERT_EQ(::pipe(ready), 0);
  ASSERT_EQ(::pipe(done), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const FolderLock lock(path);
    char byte = 0;
    [[maybe_unused]] auto count = ::write(ready[1], &byte, 1);
    count = ::read(done[0], &byte, 1);
    ::_exit(0);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_TRUE(is_locked_by_other(path));
  EXPECT_THROW(const FolderLock second(path), FileError);
  ASSERT_EQ(::write(done[1], &byte, 1), 1);
  ::waitpid(child, nullptr, 0);
  EXPECT_FALSE(is_locked_by_other(path));
  EXPECT_EQ(in_other_process([&] { return is_locked_by_other(path) ? 1 : 0; }), 0);
}

}  // namespace risley::io::folder_lock_test
