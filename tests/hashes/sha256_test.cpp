// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/hashes/sha256.hpp"

#include <string>

#include <gtest/gtest.h>

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

}  // namespace risley::hashes::sha256_test
