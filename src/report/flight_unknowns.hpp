// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "risley/optics/parameters.hpp"

namespace risley::report {

/// How pages speak of an unknown of a flight.
struct UnknownInfo {
  std::string long_name, symbol, unit;
  double scale = 1;  ///< of a number in the unit of files to the one shown
};

/// Whether a name is none of mount, ranges and clock.
bool is_of_train(std::string_view name);

/// A name that is neither of the mount nor of the train stands for itself.
UnknownInfo unknown_info(const std::string& name, TrainShape shape);

/// A sentence in which names of unknowns stand as words in place of names.
std::string words_of_unknowns(std::string_view text, TrainShape shape);

}  // namespace risley::report
