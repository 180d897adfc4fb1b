// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "risley/optics/parameters.hpp"

namespace risley::report {

/// Names of a flight's unknowns on pages.
struct UnknownInfo {
  std::string long_name, symbol, unit;
  double scale = 1;  ///< from a number in the unit of files to the displayed one
};

/// Whether a name does not belong to mount, ranges or clock.
bool is_of_train(std::string_view name);

/// A name that belongs neither to the mount nor to the train is shown unchanged.
UnknownInfo unknown_info(const std::string& name, TrainShape shape);

/// A sentence with names of unknowns replaced by words.
std::string words_of_unknowns(std::string_view text, TrainShape shape);

}  // namespace risley::report
