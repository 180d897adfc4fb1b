// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/hashes/sha256.hpp"

#include <memory>
#include <mutex>
#include <shared_mutex>

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>

#include "risley/core/error.hpp"
#include "risley/hashes/base64.hpp"
#include "risley/io/fork_lock.hpp"
#include "risley/io/read_bytes.hpp"

namespace risley::hashes {

namespace {

/// A call of the library, during which no thread may fork (see ForkLock). The library keeps data
/// for each thread that has called it. It frees them when the thread ends, using tables that it
/// frees itself at process exit, which is when oneTBB's threads end: whichever came second would
/// use freed memory. So no data stay.
class LibraryCall {
 public:
  LibraryCall() = default;
  ~LibraryCall() { ::OPENSSL_thread_stop(); }
  LibraryCall(const LibraryCall&) = delete;
  LibraryCall& operator=(const LibraryCall&) = delete;

 private:
  std::shared_lock<std::shared_mutex> lock_ = io::ForkLock::instance().share();
};

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
  std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context(nullptr, EVP_MD_CTX_free);
  {
    const LibraryCall call;
    context.reset(EVP_MD_CTX_new());
    require_done(context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1);
  }
  io::read_bytes(file, [&](std::span<const char> bytes) {
    progress.check();
    const LibraryCall call;
    require_done(EVP_DigestUpdate(context.get(), bytes.data(), bytes.size()) == 1);
  });
  const LibraryCall call;
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  require_done(EVP_DigestFinal_ex(context.get(), digest, &length) == 1);
  return hexadecimal(digest, length);
}

std::string sha256(std::string_view text) {
  const LibraryCall call;
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  require_done(EVP_Digest(text.data(), text.size(), digest, &length, EVP_sha256(), nullptr) == 1);
  return hexadecimal(digest, length);
}

std::string sha256_base64(std::string_view text) {
  const LibraryCall call;
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  require_done(EVP_Digest(text.data(), text.size(), digest, &length, EVP_sha256(), nullptr) == 1);
  return base64({reinterpret_cast<const char*>(digest), length});
}

}  // namespace risley::hashes
