// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/prism.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/error.hpp"

namespace risley {

namespace {

struct NamedOrder {
  std::string_view name;
  FaceOrder order;
};
constexpr NamedOrder kNamedOrders[] = {{"PA", FaceOrder::perpendicular_angled},
                                       {"AP", FaceOrder::angled_perpendicular},
                                       {"AA", FaceOrder::angled_angled},
                                       {"PMU", FaceOrder::perpendicular_mirror_upright}};

}  // namespace

void refuse_layout(const TrainLayout& layout) {
  throw InvalidArgument(
      fmt::format("number of prisms = {}, allowed 1 to {}", layout.elements, kMaxPrisms));
}

TrainLayout layout_of(const std::vector<FaceOrder>& face_order) {
  TrainLayout layout(static_cast<int>(face_order.size()));
  if (face_order.empty() || face_order.size() > kMaxPrisms) refuse_layout(layout);
  for (std::size_t i = 0; i < face_order.size(); ++i) {
    layout.kind[i] = kind_of(face_order[i]);
    if (layout.kind[i] != ElementKind::prism) layout.axis_up = true;
  }
  if (layout.axis_up && !same_layout(layout, kWedgeAndReflector)) {
    throw InvalidArgument(
        fmt::format("face order \"{}\", allowed 1 to {} times PA or AP in beam order, or AA-PMU",
                    to_string(face_order), kMaxPrisms));
  }
  return layout;
}

std::vector<FaceOrder> parse_face_order(std::string_view text) {
  std::vector<FaceOrder> orders;
  for (std::string_view rest = text;;) {
    const std::string_view word = rest.substr(0, rest.find('-'));
    const auto* const found = std::ranges::find(kNamedOrders, word, &NamedOrder::name);
    if (found == std::end(kNamedOrders) || orders.size() == kMaxPrisms) {
      throw InvalidArgument(
          fmt::format("face order \"{}\", allowed 1 to {} times PA or AP in beam order, such as "
                      "PA-AP, or AA-PMU",
                      text, kMaxPrisms));
    }
    orders.push_back(found->order);
    if (word.size() == rest.size()) break;
    rest.remove_prefix(word.size() + 1);
  }
  layout_of(orders);
  return orders;
}

std::string to_string(const std::vector<FaceOrder>& face_order) {
  std::vector<std::string_view> words;
  words.reserve(face_order.size());
  for (const FaceOrder order : face_order) {
    words.push_back(std::ranges::find(kNamedOrders, order, &NamedOrder::order)->name);
  }
  return fmt::format("{}", fmt::join(words, "-"));
}

}  // namespace risley
