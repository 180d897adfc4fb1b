// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/hashes/sha256.hpp"

#include <memory>

#include <fmt/format.h>
#include <openssl/evp.h>

#include "risley/core/error.hpp"
#include "risley/io/fork_lock.hpp"
#include "risley/io/read_bytes.hpp"

namespace risley::hashes {

namespace {

void require_done(bool done) {
  if (!done) throw Error("SHA-256 is not available in the cryptographic library (OpenSSL)");
}

std::string hexadecimal(const unsigned char* digest, unsigned int length) {
  std::string text;
  for (unsigned int i = 0; i < length; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

}  // namespace

std::string sha256_of_file(const io::InputFile& file, const Progress& progress) {
  auto in_library = io::ForkLock::instance().share();
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context(EVP_MD_CTX_new(),
                                                                   EVP_MD_CTX_free);
  require_done(context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1);
  in_library.unlock();
  io::read_bytes(file, [&](std::span<const char> bytes) {
    progress.check();
    const auto again = io::ForkLock::instance().share();
    require_done(EVP_DigestUpdate(context.get(), bytes.data(), bytes.size()) == 1);
  });
  in_library = io::ForkLock::instance().share();
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  require_done(EVP_DigestFinal_ex(context.get(), digest, &length) == 1);
  return hexadecimal(digest, length);
}

std::string sha256(std::string_view text) {
  const auto in_library = io::ForkLock::instance().share();
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  require_done(EVP_Digest(text.data(), text.size(), digest, &length, EVP_sha256(), nullptr) == 1);
  return hexadecimal(digest, length);
}

std::string sha256_base64(std::string_view text) {
  const auto in_library = io::ForkLock::instance().share();
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  require_done(EVP_Digest(text.data(), text.size(), digest, &length, EVP_sha256(), nullptr) == 1);
  unsigned char encoded[2 * EVP_MAX_MD_SIZE];
  const int characters = EVP_EncodeBlock(encoded, digest, static_cast<int>(length));
  return {encoded, encoded + characters};
}

}  // namespace risley::hashes
