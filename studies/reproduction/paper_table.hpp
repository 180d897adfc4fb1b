// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// A table of the paper beside ours. Numbers of the paper stand as printed text; what a row has to
/// hold is declared, and whether it does is worked out in one place.
namespace risley::reproduction {

/// A number as the paper prints it.
struct Printed {
  std::string text;
  double value = 0;
  double half_digit = 0;  ///< half of the last printed digit: the number's own uncertainty
};

/// "-43,789.8": value -43789.8, half digit 0.05. @throws InvalidArgument for anything else
Printed printed(std::string_view text);

/// One thing that must hold: a number within limits, both included.
struct Check {
  std::string what;  ///< the number, in words
  double value = std::numeric_limits<double>::quiet_NaN();
  double least = -std::numeric_limits<double>::infinity();
  double greatest = std::numeric_limits<double>::infinity();
  std::string why = {};  ///< where the limits come from
};

/// Ours has the digits that the paper prints.
Check at_printed_digits(const Printed& paper, double ours);
Check within(std::string what, double value, double least, double greatest, std::string why);
Check at_most(std::string what, double value, double greatest, std::string why);
Check at_least(std::string what, double value, double least, std::string why);
/// A root mean square over its expected value, from so many independent errors: within the band
/// that holds it in 999 of 1000 cases.
Check rms_ratio(std::string what, double ratio, double degrees_of_freedom, std::string why);
/// A normalised squared error per degree of freedom, in the band of 999 of 1000 cases.
Check mean_square_ratio(std::string what, double ratio, double degrees_of_freedom, std::string why);
/// Something that is so or is not.
Check holds(std::string what, bool so, std::string why);

/// How ours scatters where the paper shows one random draw.
struct Distribution {
  double low = 0, median = 0, high = 0;  ///< 5, 50 and 95 % quantiles
  double percentile = 0;                 ///< where the paper's draw falls, %
  std::size_t draws = 0;
};
/// @param values  at least one
Distribution distribution_of(std::vector<double> values, double papers_draw);

/// One row: the paper's number beside ours.
struct Row {
  std::string term, unit;             ///< unit "1" for a pure number
  std::optional<Printed> paper = {};  ///< nothing where the paper says it in words
  double ours = std::numeric_limits<double>::quiet_NaN();
  std::optional<double> sigma = {};  ///< of ours
  std::optional<Distribution> distribution = {};
  std::vector<Check> checks = {};
  std::string note = {};  ///< what a reader should know of the difference
};

/// One table, or one section's numbers.
struct Table {
  std::string name;    ///< "table_a1"
  std::string title;   ///< "Table A1: ..."
  std::string method;  ///< what the paper did and how it is done here
  std::vector<Row> rows = {};
};

/// Whether a check holds: its value is a number within its limits. A billionth of the limits is
/// forgiven, since 3.0 + 0.05 has no exact value.
bool passes(const Check& check);
/// Whether every check of a row holds. A row without a check does not pass: nothing was shown.
bool passes(const Row& row);
bool passes(const Table& table);
/// "difference ... at most 0.05 (printed digits); ..."
std::string bound_text(const Row& row);
/// "difference ... is 0.01; ..." of what fails if anything does, otherwise of everything.
std::string reason_text(const Row& row);

}  // namespace risley::reproduction
