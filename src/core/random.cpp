// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/random.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Random123/philox.h>

#include "risley/core/angle.hpp"

namespace risley {
namespace {

/// The generator makes four words at a time, so a block holds four values.
constexpr std::uint64_t kBlock = 4;
using Block = std::array<double, kBlock>;

enum class Kind : std::uint64_t { uniform = 0, normal = 1 };

r123::Philox4x64::ctr_type words(std::uint64_t seed, std::uint64_t stream, Kind kind,
                                 std::uint64_t block) {
  const r123::Philox4x64::ctr_type counter{{block, static_cast<std::uint64_t>(kind), 0, 0}};
  const r123::Philox4x64::key_type key{{seed, stream}};
  return r123::Philox4x64{}(counter, key);
}

/// The upper 52 bits as the middle of one of 2^52 equal steps: exact, never 0 and never 1.
double open_unit(std::uint64_t word) { return (static_cast<double>(word >> 12) + 0.5) * 0x1p-52; }

/// Box and Muller: two uniform values make a radius and an angle, hence two normal values.
Block normal_block(std::uint64_t seed, std::uint64_t stream, std::uint64_t block) {
  const auto word = words(seed, stream, Kind::normal, block);
  Block values;
  for (std::size_t pair = 0; pair < kBlock; pair += 2) {
    const double radius = std::sqrt(-2.0 * std::log(open_unit(word[pair])));
    const double angle = kTwoPi * open_unit(word[pair + 1]);
    values[pair] = radius * std::cos(angle);
    values[pair + 1] = radius * std::sin(angle);
  }
  return values;
}

}  // namespace

double RandomStream::uniform(std::uint64_t index) const {
  return open_unit(words(seed_, stream_, Kind::uniform, index / kBlock)[index % kBlock]);
}

double RandomStream::normal(std::uint64_t index) const {
  return normal_block(seed_, stream_, index / kBlock)[index % kBlock];
}

void RandomStream::fill_normal(std::uint64_t first_index, std::span<double> values) const {
  std::size_t done = 0;
  while (done < values.size()) {
    const std::uint64_t index = first_index + done;
    const std::size_t skip = index % kBlock;
    const std::size_t count = std::min<std::size_t>(kBlock - skip, values.size() - done);
    const Block block = normal_block(seed_, stream_, index / kBlock);
    std::copy_n(block.begin() + static_cast<std::ptrdiff_t>(skip), count,
                values.begin() + static_cast<std::ptrdiff_t>(done));
    done += count;
  }
}

}  // namespace risley
