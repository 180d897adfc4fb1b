// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <type_traits>
#include <utility>
#include <variant>

namespace risley {

// Tables of columns are structs whose columns are described once, by a list. Each entry of such a
// list is a place, or has a member `place`, which locates the table's column, or several alike
// within arrays and vectors.

/// A place: a pointer to a member of one of some types.
template <class Table, class... Columns>
using ColumnPlace = std::variant<Columns Table::*...>;

/// The place of an entry.
template <const auto& List, std::size_t I>
consteval auto place_of() {
  if constexpr (requires { List[I].place; }) {
    return List[I].place;
  } else {
    return List[I];
  }
}

/// Whether a list covers all members of a table that consists only of columns.
template <class Table, const auto& List>
consteval bool lists_all_columns() {
  const std::array places = []<std::size_t... I>(std::index_sequence<I...>) {
    return std::array{place_of<List, I>()...};
  }
  (std::make_index_sequence<std::size(List)>());
  std::size_t bytes = 0;
  for (auto place = places.begin(); place != places.end(); ++place) {
    if (std::find(places.begin(), place, *place) != place) continue;  // in another form
    bytes += std::visit([](auto at) { return sizeof(std::declval<Table>().*at); }, *place);
  }
  return bytes == sizeof(Table);
}

/// Calls visit(column...) with a column of numbers of every table, or with each of those within
/// columns of columns, in order. Tables after the first must have as many.
template <class Visit, class First, class... Others>
void visit_numbers(const Visit& visit, First& first, Others&... others) {
  if constexpr (std::is_arithmetic_v<typename First::value_type>) {
    visit(first, others...);
  } else {
    for (std::size_t i = 0; i < first.size(); ++i) visit_numbers(visit, first[i], others[i]...);
  }
}

/// Calls visit(entry, column...) for every column of numbers in the list, with types known to the
/// compiler.
template <const auto& List, class Visit, class... Tables>
void for_each_entry(const Visit& visit, Tables&... tables) {
  const auto one = [&]<std::size_t I>() {
    constexpr auto any = place_of<List, I>();
    constexpr auto place = std::get<any.index()>(any);
    visit_numbers([&](auto&... columns) { visit(List[I], columns...); }, (tables.*place)...);
  };
  [&]<std::size_t... I>(std::index_sequence<I...>) { (one.template operator()<I>(), ...); }
  (std::make_index_sequence<std::size(List)>());
}

/// The same with visit(column...).
template <const auto& List, class Visit, class... Tables>
void for_each_column(const Visit& visit, Tables&... tables) {
  for_each_entry<List>([&](const auto&, auto&... columns) { visit(columns...); }, tables...);
}

}  // namespace risley
