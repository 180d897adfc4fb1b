// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/hashes/base64.hpp"

#include <string>

#include <gtest/gtest.h>

namespace risley::hashes::base64_test {

TEST(Base64, IsThatOfItsStandard) {  // RFC 4648, section 10
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, OfMuchIsThatOfItsPieces) {
  const std::string bytes(10'000'001, '\xfb');
  const std::string text = base64(bytes);
  ASSERT_EQ(text.size(), 4 * ((bytes.size() + 2) / 3));
  EXPECT_EQ(text.substr(text.size() - 8), "+/v7+/s=");
  EXPECT_EQ(text.find('='), text.size() - 1);
}

}  // namespace risley::hashes::base64_test
