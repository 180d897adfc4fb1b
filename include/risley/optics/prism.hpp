// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace risley {

/// Largest number of prisms in one train (Livox builds two and three).
inline constexpr int kMaxPrisms = 4;

/// @throws InvalidArgument naming the number and what is allowed
[[noreturn]] void refuse_prism_count(int prisms);

/// Calls `function.template operator()<N>()` for the run-time number of prisms: the one place
/// where run-time and compile-time sizes meet.
/// @throws InvalidArgument unless 1 <= prisms <= kMaxPrisms
template <class Function>
decltype(auto) with_prism_count(int prisms, Function&& function) {
  switch (prisms) {
    case 1:
      return function.template operator()<1>();
    case 2:
      return function.template operator()<2>();
    case 3:
      return function.template operator()<3>();
    case 4:
      return function.template operator()<4>();
    default:
      refuse_prism_count(prisms);
  }
}

/// Which face of a prism the beam meets first. The angled normal leans towards +Z at rotation
/// angle zero when the perpendicular face comes first and towards -Z when it comes second, so the
/// thick end of every prism points down there.                                     [B21 Fig. 3]
enum class FaceOrder : std::uint8_t {
  perpendicular_angled,  ///< PA
  angled_perpendicular,  ///< AP
};

/// Face orders of a train in beam order from text such as "PA-AP".
/// @throws InvalidArgument naming the text and what is allowed
std::vector<FaceOrder> parse_face_order(std::string_view text);

/// The inverse of parse_face_order.
std::string to_string(const std::vector<FaceOrder>& face_order);

}  // namespace risley
