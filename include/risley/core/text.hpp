// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace risley {

/// The same with the letters A to Z in lower case, for endings of file names.
std::string lower_case(std::string text);

/// The known name that was probably meant by another word: the one that fewest changed,
/// missing, added or swapped letters separate from it, where capitals and hyphens, underscores and
/// spaces do not count; else the first name that the word is the beginning of, up to such a mark.
/// Empty when every name is further than a third of its letters away.
std::string near_miss(std::string_view word, std::span<const std::string> names);

/// The same for a message: ", did you mean NAME?", or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string> names);

/// The same for a terminal: what it would obey instead of showing is written out, control
/// characters as `\u001b`, marks that turn the direction of writing as `\u202e`, bytes that are no
/// UTF-8 as `\x9b`. Tabs stay.
/// @param lines  whether line feeds stay, too
std::string printable(std::string_view text, bool lines);

/// 1234567 as "1 234 567".
std::string grouped(std::uint64_t number);

}  // namespace risley
