// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace risley {

/// The same with the letters A to Z in lower case, for file name endings.
std::string lower_case(std::string text);

/// The known name that was probably meant by another word: the one with the fewest changed,
/// missing, added or swapped letters, ignoring capitals and the difference of hyphens, underscores
/// and spaces; otherwise the first name that begins with the word, up to such differences. Empty if
/// every name differs by more than a third of its letters.
std::string near_miss(std::string_view word, std::span<const std::string> names);

/// The same for a message: ", did you mean NAME?", or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string> names);

/// The same for a terminal: characters that it would act on are written out, control characters as
/// `\u001b`, marks that change the direction of writing as `\u202e`, invalid UTF-8 bytes as `\x9b`.
/// Tabs stay.
/// @param lines  whether to keep line feeds, too
std::string printable(std::string_view text, bool lines);

/// 1234567 as "1 234 567".
std::string grouped(std::uint64_t number);

}  // namespace risley
