// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/prism.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley {

void refuse_prism_count(int prisms) {
  throw InvalidArgument(fmt::format("number of prisms = {}, allowed 1 to {}", prisms, kMaxPrisms));
}

std::vector<FaceOrder> parse_face_order(std::string_view text) {
  const auto fail = [&] {
    return InvalidArgument(fmt::format(
        "face order \"{}\", allowed 1 to {} times PA or AP in beam order, such as PA-AP", text,
        kMaxPrisms));
  };
  std::vector<FaceOrder> order;
  for (std::size_t at = 0;; at += 3) {
    const std::string_view prism = at < text.size() ? text.substr(at, 2) : std::string_view{};
    if (prism == "PA") {
      order.push_back(FaceOrder::perpendicular_angled);
    } else if (prism == "AP") {
      order.push_back(FaceOrder::angled_perpendicular);
    } else {
      throw fail();
    }
    if (at + 2 == text.size()) break;
    if (text[at + 2] != '-') throw fail();
  }
  if (order.size() > kMaxPrisms) throw fail();
  return order;
}

std::string to_string(const std::vector<FaceOrder>& face_order) {
  std::string text;
  for (const FaceOrder order : face_order) {
    if (!text.empty()) text += '-';
    text += order == FaceOrder::perpendicular_angled ? "PA" : "AP";
  }
  return text;
}

}  // namespace risley
