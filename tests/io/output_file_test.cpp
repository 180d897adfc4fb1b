// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/output_file.hpp"

#include <fstream>
#include <regex>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"

namespace risley::io::output_file_test {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

void put(const std::string& path, const std::string& text) {
  std::ofstream stream(path, std::ios::binary | std::ios::trunc);
  stream << text;
  stream.close();
  ASSERT_TRUE(stream) << path;
}

mode_t mode_of(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(::lstat(path.c_str(), &status), 0) << path;
  return status.st_mode;
}

TEST(OutputFile, AppearsWhole) {
  const TestFolder folder;
  const std::string path = folder.file("out");
  put(path, "before");
  {
    OutputFile output(path);
    put(output.temporary_path(), "after");
    EXPECT_EQ(read_text_file(path), "before");
    EXPECT_EQ(fs::path(output.temporary_path()).parent_path(), folder.path());
    output.commit();
    EXPECT_EQ(read_text_file(path), "after");
  }
  {
    OutputFile given_up(path);
    put(given_up.temporary_path(), "half");
    const OutputFile moved(std::move(given_up));
    EXPECT_EQ(folder.names().size(), 2U);
  }
  EXPECT_THAT(folder.names(), ElementsAre("out"));
  EXPECT_EQ(read_text_file(path), "after");
}

TEST(OutputFile, NobodyForeseesItsTemporaryName) {
  const TestFolder folder;
  const std::string path = folder.file("out");
  std::set<std::string> names;
  for (int i = 0; i < 20; ++i) {
    const OutputFile output(path);
    EXPECT_TRUE(std::regex_match(output.temporary_path().substr(path.size()),
                                 std::regex("\\.part-[a-z2-7]{12}")))
        << output.temporary_path();
    names.insert(output.temporary_path());
  }
  EXPECT_EQ(names.size(), 20U);
}

TEST(OutputFile, PlantedLinksAreNotFollowed) {
  // The name that earlier versions would have used, and a link in the place of the temporary.
  const TestFolder folder;
  const std::string path = folder.file("out"), victim = folder.file("victim");
  put(victim, "precious");
  fs::create_symlink(victim, fmt::format("{}.part-{}", path, ::getpid()));
  write_text_file(path, "new");
  EXPECT_EQ(read_text_file(victim), "precious");
  EXPECT_EQ(read_text_file(path), "new");

  OutputFile output(path);
  fs::remove(output.temporary_path());
  fs::create_symlink(victim, output.temporary_path());
  EXPECT_THAT(refusal<FileError>([&] { output.commit(); }), HasSubstr("replaced"));
  EXPECT_EQ(read_text_file(path), "new");
  EXPECT_EQ(read_text_file(victim), "precious");
}

TEST(OutputFile, KeepsTheModeOfWhatItReplaces) {
  const TestFolder folder;
  const std::string path = folder.file("out");
  const mode_t mask = ::umask(022);
  write_text_file(path, "new");
  EXPECT_EQ(mode_of(path), S_IFREG | 0644U);
  for (const mode_t mode : {0600U, 0664U, 0755U}) {
    ASSERT_EQ(::chmod(path.c_str(), mode), 0);
    OutputFile output(path);
    EXPECT_EQ(mode_of(output.temporary_path()) & 0077U & ~mode, 0U) << "open to more meanwhile";
    put(output.temporary_path(), "again");
    output.commit();
    EXPECT_EQ(mode_of(path), S_IFREG | mode);
  }
  ::umask(mask);
}

TEST(OutputFile, WritesBehindLinks) {
  const TestFolder folder;
  const std::string path = folder.file("out");
  fs::create_directory(folder.file("elsewhere"));
  put(folder.file("elsewhere/real"), "old");
  fs::create_symlink("elsewhere/link", path);
  fs::create_symlink("real", folder.file("elsewhere/link"));
  write_text_file(path, "new");
  EXPECT_TRUE(fs::is_symlink(path));
  EXPECT_EQ(read_text_file(folder.file("elsewhere/real")), "new");

  fs::create_symlink("to be made", folder.file("dangling"));
  write_text_file(folder.file("dangling"), "made");
  EXPECT_EQ(read_text_file(folder.file("to be made")), "made");

  fs::create_symlink("circle", folder.file("circle"));
  EXPECT_THROW(OutputFile(folder.file("circle")), FileError);
}

TEST(OutputFile, DevicesAreWrittenAndSurvive) {
  write_text_file("/dev/null", "nothing");
  EXPECT_TRUE(S_ISCHR(mode_of("/dev/null")));
  EXPECT_THROW(write_text_file("/dev/full", "too much"), FileError);
  EXPECT_TRUE(S_ISCHR(mode_of("/dev/full")));
}

TEST(OutputFile, FifosGetTheBytes) {
  const TestFolder folder;
  const std::string path = folder.file("fifo");
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  const std::string text(300'000, 'x');  // more than a pipe holds
  std::string found;
  std::thread reader([&] { found = read_text_file(path); });
  write_text_file(path, text);
  reader.join();
  EXPECT_TRUE(found == text);
  EXPECT_TRUE(S_ISFIFO(mode_of(path)));
  EXPECT_THAT(folder.names(), ElementsAre("fifo"));
}

TEST(OutputFile, OpenFilesAreWrittenByTheirNames) {
  const TestFolder folder;
  const std::string path = folder.file("log");
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_GE(descriptor, 0);
  write_text_file(fmt::format("/proc/self/fd/{}", descriptor), "through its number");
  char start[8] = {};
  EXPECT_EQ(::pread(descriptor, start, 7, 0), 7);
  EXPECT_STREQ(start, "through") << "the open file was replaced";
  ::close(descriptor);
}

TEST(OutputFile, RemovesWhatKilledRunsLeft) {
  const TestFolder folder;
  const std::string path = folder.file("out");
  const pid_t child = ::fork();
  if (child == 0) {
    const OutputFile given_up(path);
    ::_exit(0);  // as a kill ends it: nothing is removed
  }
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  ASSERT_EQ(folder.names().size(), 1U);
  const std::string orphan = folder.file(*folder.names().begin());
  for (const char* name : {"other.part-aaaaaaaaaaaa", "out.part-AAAAAAAAAAAA", "out.part-aaaa"}) {
    put(folder.file(name), "of somebody else");
  }
  fs::create_symlink(folder.file("other"), folder.file("out.part-bbbbbbbbbbbb"));
  const OutputFile output(path);
  EXPECT_FALSE(fs::exists(orphan));
  EXPECT_EQ(folder.names().size(), 5U);
}

TEST(OutputFile, LeavesWhatAnotherIsWritingAlone) {
  const TestFolder folder;
  const std::string path = folder.file("out");
  int ready[2], done[2];
  ASSERT_EQ(::pipe(ready), 0);
  ASSERT_EQ(::pipe(done), 0);
  const pid_t child = ::fork();
  char byte = 0;
  if (child == 0) {
    ::close(done[1]);
    OutputFile output(path);
    put(output.temporary_path(), "of the other");
    const bool told = ::write(ready[1], "r", 1) == 1 && ::read(done[0], &byte, 1) == 0;
    if (told) output.commit();
    ::_exit(told ? 0 : 1);
  }
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  write_text_file(path, "of this process");
  EXPECT_EQ(folder.names().size(), 2U);
  for (const int end : {done[1], done[0], ready[0], ready[1]}) ::close(end);
  int status = 1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read_text_file(path), "of the other");
  EXPECT_THAT(folder.names(), ElementsAre("out"));
}

TEST(OutputFile, NamesMayBeAsLongAsTheSystemAllows) {
  const TestFolder folder;
  const std::string path = folder.file(std::string(255, 'n'));
  write_text_file(path, "long");
  EXPECT_EQ(read_text_file(path), "long");
  EXPECT_EQ(folder.names().size(), 1U);
  EXPECT_THROW(OutputFile(path + "n"), FileError);
}

TEST(OutputFile, SaysAtOnceWhatCannotBeWritten) {
  const TestFolder folder;
  EXPECT_THROW(OutputFile(folder.path().string()), FileError);
  EXPECT_THROW(OutputFile(folder.file("no/such/folder")), FileError);
  EXPECT_THROW(OutputFile(""), FileError);
  put(folder.file("file"), "");
  EXPECT_THROW(OutputFile(folder.file("file/below")), FileError);
}

TEST(Reading, ErrorsNeverGiveAText) {
  const TestFolder folder;
  EXPECT_THROW(read_text_file(folder.path().string()), FileError);
  EXPECT_THROW(read_text_file(folder.file("missing")), FileError);
  // Opens, and then every read of it fails with EIO: address 0 is mapped nowhere.
  EXPECT_THROW(read_text_file("/proc/self/mem"), FileError);
  if (::geteuid() != 0) {
    put(folder.file("secret"), "");
    fs::permissions(folder.file("secret"), fs::perms::none);
    EXPECT_THROW(read_text_file(folder.file("secret")), FileError);
  }
}

}  // namespace risley::io::output_file_test
