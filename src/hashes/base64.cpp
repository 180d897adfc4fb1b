// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/hashes/base64.hpp"

#include <cstddef>

#include <openssl/evp.h>

namespace risley::hashes {

std::string base64(std::string_view bytes) {
  constexpr std::size_t kPiece = 3 << 20;  // EVP_EncodeBlock() counts in int
  std::string text;
  text.resize(4 * ((bytes.size() + 2) / 3) + 1);  // it appends a terminating zero
  std::size_t written = 0;
  for (std::size_t begin = 0; begin < bytes.size(); begin += kPiece) {
    const std::string_view piece = bytes.substr(begin, kPiece);
    written += static_cast<std::size_t>(EVP_EncodeBlock(
        reinterpret_cast<unsigned char*>(text.data()) + written,
        reinterpret_cast<const unsigned char*>(piece.data()), static_cast<int>(piece.size())));
  }
  text.resize(written);
  return text;
}

}  // namespace risley::hashes
