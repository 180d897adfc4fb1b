// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <cstdint>
#include <limits>
#include <string>

#include <gmock/gmock.h>

#include "risley/io/block_file.hpp"
#include "risley/io/text_table.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"

namespace risley::io::entries_test {

TEST(Entries, BlocksOfFilesLieWithinThem) {
  const TestFolder folder;
  const std::string path = folder.file("a.bin");
  {
    BlockOutput file(path);
    file.append(8);
    EXPECT_EQ(refusal([&] { file.patch_u64(1, 0); }),
              "offset = 1 of 8 bytes, allowed within the 8 written");
    file.patch_u64(0, 7);
    file.commit();
  }
  BlockInput file(path);
  EXPECT_EQ(file.at(0, 8)[0], 7);
  EXPECT_EQ(refusal([&] { file.at(4, 5); }), "bytes = [4, 9), allowed at most 8 within [0, 8)");
  constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();
  EXPECT_THROW(file.at(kLast - 3, 8), InvalidArgument);
  EXPECT_THROW(file.at(4, kLast), InvalidArgument);
}

TEST(Entries, PowersOfTenFit64Bits) {
  EXPECT_EQ(power_of_ten(18), 1'000'000'000'000'000'000);
  EXPECT_EQ(refusal([] { power_of_ten(19); }), "exponent = 19, allowed 0 to 18");
  EXPECT_EQ(refusal([] { power_of_ten(-1); }), "exponent = -1, allowed 0 to 18");
  const TestFolder folder;
  TextOutput output(folder.file("a.txt"));
  EXPECT_EQ(refusal([&] { output.append_fixed(1, 19); }), "exponent = 19, allowed 0 to 18");
  EXPECT_EQ(refusal([&] { output.append_decimal(1, 19); }), "decimals = 19, allowed 0 to 18");
}

}  // namespace risley::io::entries_test
