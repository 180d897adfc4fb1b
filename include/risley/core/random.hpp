// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

namespace risley {

/// A stream of random numbers with access by index: value i depends only on the seed, the stream
/// and i (counter-based generator Philox4x64-10, Salmon et al. 2011). Results therefore do not
/// depend on the order of the calls, on threads or on block sizes. Streams of different seeds or
/// numbers are independent of each other, and so are the uniform and the normal values of one
/// stream.
class RandomStream {
 public:
  /// @param seed    chosen by the user
  /// @param stream  the purpose of the numbers: one number per purpose
  RandomStream(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}

  /// Uniform in the open interval (0, 1), 52 random bits.
  double uniform(std::uint64_t index) const;

  /// Normal with mean 0 and standard deviation 1, never beyond 8.58.
  double normal(std::uint64_t index) const;

  /// normal(first_index), normal(first_index + 1), ... at a third of the cost of single calls.
  void fill_normal(std::uint64_t first_index, std::span<double> values) const;

 private:
  std::uint64_t seed_, stream_;
};

}  // namespace risley
