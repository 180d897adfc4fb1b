// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/hashes/sha256.hpp"

#include <climits>
#include <cstdlib>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "io/test_folder.hpp"

namespace risley::hashes::sha256_test {

TEST(Sha256, ErrorsNeverGiveAHash) {
  const io::TestFolder folder;
  EXPECT_THROW(sha256_of_file(folder.path().string()), FileError);
  EXPECT_THROW(sha256_of_file(folder.file("missing")), FileError);
  EXPECT_THROW(sha256_of_file(std::string("/proc/self/mem")),
               FileError);  // opens, every read of it fails
}

TEST(Sha256, InBase64AsBrowsersTakeIt) {
  EXPECT_EQ(sha256_base64(""), "47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=");
  EXPECT_EQ(sha256_base64("abc"), "ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=");
}

TEST(Sha256, KnownAnswers) {
  // FIPS 180-2, appendix B, and the empty message.
  const io::TestFolder folder;
  const std::string path = folder.file("message");
  io::write_text_file(path, "");
  EXPECT_EQ(sha256_of_file(path),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  io::write_text_file(path, "abc");
  EXPECT_EQ(sha256_of_file(path),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  io::write_text_file(path, std::string(1'000'000, 'a'));
  EXPECT_EQ(sha256_of_file(path),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

// What a library frees when a thread ends, it may have freed with the process. It keeps most with
// the thread that calls it first, hence a process of its own.
TEST(Sha256DeathTest, LeavesNothingWithAThread) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto things_of_thread = [] {
    int count = 0;
    for (pthread_key_t key = 0; key < PTHREAD_KEYS_MAX; ++key) {
      if (::pthread_getspecific(key) != nullptr) ++count;
    }
    return count;
  };
  const auto hash = [&] {
    int more = 0;
    std::thread([&] {
      const int before = things_of_thread();
      sha256("abc");
      more = things_of_thread() - before;
    }).join();
    std::exit(more <= 1 ? 0 : 1);  // one is a mark of the library's start, which nothing frees
  };
  EXPECT_EXIT(hash(), testing::ExitedWithCode(0), "");
}

}  // namespace risley::hashes::sha256_test
