// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace risley::app {

/// Libraries name an option by its field, as in "option shot_rate"; users know --shot-rate-hz.
std::string with_flags(const std::string& text);
void put_flags(std::vector<std::string>& texts);

/// The same in what a verdict says and what follows from it.
template <class Verdict>
requires requires(Verdict verdict) { verdict.to_do; }
void put_flags(Verdict& verdict) {
  verdict.words = with_flags(verdict.words);
  verdict.to_do = with_flags(verdict.to_do);
}

}  // namespace risley::app
