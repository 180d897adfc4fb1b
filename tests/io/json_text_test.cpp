// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/json_text.hpp"

#include <string>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley::io::json_text_test {

TEST(JsonText, IsNoDeeperThanAnyProgramWritesIt) {
  EXPECT_NO_THROW(require_shallow_json("a", R"({"a": [[1, 2], {"b": []}]})"));
  EXPECT_NO_THROW(require_shallow_json("a", std::string(100, '[')));
  try {
    require_shallow_json("a", "{\"a\": " + std::string(100000, '['));
    FAIL();
  } catch (const FileError& error) {
    EXPECT_EQ(error.place().byte_offset, 6U + 99U);
  }
  EXPECT_THROW(require_shallow_json("a", std::string(101, '{')), FileError);
  // Not what stands in a text, nor lists beside each other.
  EXPECT_NO_THROW(require_shallow_json(
      "a", "\"" + std::string(200, '[') + "\\\"" + std::string(200, '[') + "\""));
  std::string flat;
  for (int i = 0; i < 1000; ++i) flat += "[],";
  EXPECT_NO_THROW(require_shallow_json("a", flat));
}

}  // namespace risley::io::json_text_test
