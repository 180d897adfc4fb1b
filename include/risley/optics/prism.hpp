// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace risley {

/// Largest number of elements in one train (Livox builds two and three).
inline constexpr int kMaxPrisms = 4;

/// An element's surfaces in beam order, by their normals at rotation angle zero: P stands across
/// the axis, A is angled against P, M is a mirror, U stands along the axis (upright). An angled
/// normal leans towards +Z where it comes last and towards -Z where it comes first, so the thick
/// end of every prism points down there.                                            [B21 Fig. 3]
enum class FaceOrder : std::uint8_t {
  perpendicular_angled,         ///< PA: a prism
  angled_perpendicular,         ///< AP: a prism
  angled_angled,                ///< AA: a wedge whose faces each have their own angle
  perpendicular_mirror_upright  ///< PMU: a body that deflects the beam by a reflection within it
};

/// Properties of an element for templates: its surfaces and the angles that lean them.
enum class ElementKind : std::uint8_t {
  prism,      ///< two faces; one angle, between them
  wedge,      ///< two faces; an angle each
  reflector,  ///< two faces and a mirror between them; one angle, the mirror's
};

/// @return prism for both of a prism's face orders
constexpr ElementKind kind_of(FaceOrder order) {
  if (order == FaceOrder::angled_angled) return ElementKind::wedge;
  if (order == FaceOrder::perpendicular_mirror_upright) return ElementKind::reflector;
  return ElementKind::prism;
}

/// The part of a train that is a template argument: its elements and the direction of their axis.
/// If a number is needed, such as in 2 * N, it is the number of its elements.
struct TrainLayout {
  int elements = 0;
  ElementKind kind[kMaxPrisms] = {};  ///< beam order; prism beyond the last element
  bool axis_up = false;               ///< the axis is the sensor's Z, not its X

  constexpr TrainLayout() = default;
  /// Prisms that turn about X. (Implicit: most trains are these.)
  constexpr TrainLayout(int prisms) : elements(prisms) {}  // NOLINT(google-explicit-constructor)
  // NOLINTNEXTLINE(google-explicit-constructor)
  [[gnu::always_inline]] constexpr operator int() const { return elements; }

  /// Whether an element reflects.
  [[gnu::always_inline]] constexpr bool is_reflector(std::size_t element) const {
    return kind[element] == ElementKind::reflector;
  }
  /// Whether the last element reflects; no other may.
  [[gnu::always_inline]] constexpr bool reflects() const {
    return elements > 0 && is_reflector(static_cast<std::size_t>(elements) - 1);
  }
  /// Whether the axis of an element leans in the sensor's frame. X is the last one's by definition;
  /// if the axes point up, the sensor's housing defines the frame and all may lean.
  [[gnu::always_inline]] constexpr bool has_bearing(std::size_t element) const {
    return axis_up || element != static_cast<std::size_t>(elements) - 1;
  }
  /// Of all elements; those of an element begin at twice its number.
  [[gnu::always_inline]] constexpr std::size_t surfaces() const {
    return 2 * static_cast<std::size_t>(elements) + (reflects() ? 1 : 0);
  }
  /// Of one element.
  [[gnu::always_inline]] constexpr std::size_t surfaces(std::size_t element) const {
    return is_reflector(element) ? 3 : 2;
  }
};

/// The number of a layout's elements as a plain number: gcc 12 does not unroll loops with other
/// bounds.
template <TrainLayout N>
inline constexpr auto kElements = static_cast<std::size_t>(N.elements);

/// A wedge and a reflector that turn about Z: Livox Mid-360.
inline constexpr TrainLayout kWedgeAndReflector = [] {
  TrainLayout layout(2);
  layout.kind[0] = ElementKind::wedge;
  layout.kind[1] = ElementKind::reflector;
  layout.axis_up = true;
  return layout;
}();

/// Whether both are the same in everything.
constexpr bool same_layout(const TrainLayout& a, const TrainLayout& b) {
  if (a.elements != b.elements || a.axis_up != b.axis_up) return false;
  for (int i = 0; i < kMaxPrisms; ++i) {
    if (a.kind[i] != b.kind[i]) return false;
  }
  return true;
}

/// The layout of elements in beam order.
/// @throws InvalidArgument if the model does not support such a train, naming the supported ones
TrainLayout layout_of(const std::vector<FaceOrder>& face_order);

/// @throws InvalidArgument naming the layout and the allowed ones
[[noreturn]] void refuse_layout(const TrainLayout& layout);

/// Calls `function.template operator()<N>()` for a layout: the one place where run-time and
/// compile-time layouts meet.
/// @throws InvalidArgument unless it is one of 1 to kMaxPrisms prisms or kWedgeAndReflector
template <class Function>
decltype(auto) with_layout(const TrainLayout& layout, Function&& function) {
  if (layout.axis_up) return function.template operator()<kWedgeAndReflector>();
  switch (layout.elements) {
    case 1:
      return function.template operator()<TrainLayout(1)>();
    case 2:
      return function.template operator()<TrainLayout(2)>();
    case 3:
      return function.template operator()<TrainLayout(3)>();
    case 4:
      return function.template operator()<TrainLayout(4)>();
    default:
      refuse_layout(layout);
  }
}

/// Face orders of a train in beam order from text such as "PA-AP" or "AA-PMU".
/// @throws InvalidArgument naming the text and the allowed ones
std::vector<FaceOrder> parse_face_order(std::string_view text);

/// The inverse of parse_face_order.
std::string to_string(const std::vector<FaceOrder>& face_order);

}  // namespace risley
