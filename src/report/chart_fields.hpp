// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <type_traits>
#include <vector>

#include "risley/report/chart.hpp"

#include "report/json_archive.hpp"

namespace risley::report {

// Diagrams as JSON, for the script of the page and for report.json alike.

/// Significant digits that a diagram needs of numbers: seven, and more where they differ little
/// beside their size, as the speeds of a steady rotor do.
int digits_of(const std::vector<double>& values);
/// Numbers with so many digits.
std::vector<double> shortened(const std::vector<double>& values);

std::span<const char* const> enum_names(SeriesKind);
std::span<const char* const> enum_names(ChartKind);
std::span<const char* const> enum_names(Palette);

/// A column of a diagram: the writer shortens it, the reader takes it as it is.
template <class Archive, class Column>
void column(Archive& archive, const char* name, Column& values) {
  if constexpr (std::is_const_v<Column>) {
    archive(name, shortened(values));
  } else {
    archive(name, values);
  }
}

template <class Archive, FieldsOf<Series> T>
void fields(Archive& archive, T& series) {
  archive("label", series.label);
  archive("colour", series.colour);
  archive("kind", series.kind);
  column(archive, "x", series.x);
  column(archive, "y", series.y);
  column(archive, "z", series.z);
  column(archive, "value", series.value);
  archive("cell_width", series.cell_width);
  archive("cell_height", series.cell_height);
}

template <class Archive, FieldsOf<Colouring> T>
void fields(Archive& archive, T& colouring) {
  archive("label", colouring.label);
  column(archive, "value", colouring.value);
  archive("value_range", colouring.value_range);
}

template <class Archive, FieldsOf<Chart> T>
void fields(Archive& archive, T& chart) {
  archive("title", chart.title);
  archive("kind", chart.kind);
  archive("x_label", chart.x_label);
  archive("y_label", chart.y_label);
  archive("z_label", chart.z_label);
  archive("value_label", chart.value_label);
  archive("palette", chart.palette);
  archive("value_range", chart.value_range);
  archive("grows_for", chart.grows_for);
  archive("colourings", chart.colourings);
  archive("note", chart.note);
  archive("series", chart.series);
}

}  // namespace risley::report
