// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reproduction/paper_table.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/algebra/distributions.hpp"
#include "risley/core/error.hpp"

namespace risley::reproduction {
namespace {

/// Of a normal distribution: 999 of 1000 lie within so many standard deviations.
constexpr double kBand = 3.2905;

double quantile(const std::vector<double>& sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (place - std::floor(place)) * (sorted[above] - sorted[below]);
}

/// Significant digits that distinguish a check's value from its limits: four, and more for limits
/// that differ little.
int digits_of(const Check& check) {
  constexpr int kDigits = 4, kMostDigits = 12;
  const double spread = check.greatest - check.least;
  const double size = std::max(std::abs(check.least), std::abs(check.greatest));
  if (!std::isfinite(spread) || !(spread > 0) || !(size > spread)) return kDigits;
  return std::min(kDigits + static_cast<int>(std::ceil(std::log10(size / spread))), kMostDigits);
}

std::string limits_text(const Check& check) {
  const int digits = digits_of(check);
  if (std::isinf(check.least)) return fmt::format("at most {:.{}g}", check.greatest, digits);
  if (std::isinf(check.greatest)) return fmt::format("at least {:.{}g}", check.least, digits);
  return fmt::format("from {:.{}g} to {:.{}g}", check.least, digits, check.greatest, digits);
}

template <class Text>
std::string joined(const std::vector<Check>& checks, const Text& text) {
  std::string result;
  for (const Check& check : checks) {
    const std::string one = text(check);
    if (!one.empty()) result += (result.empty() ? "" : "; ") + one;
  }
  return result;
}

}  // namespace

Printed printed(std::string_view text) {
  std::string digits;
  std::size_t decimals = 0;
  bool point = false, sound = !text.empty(), any = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == ',' && !point && any) continue;
    if (c >= '0' && c <= '9') {
      any = true;
      decimals += point;
    } else if (c == '.' && !point) {
      point = true;
    } else if (c != '-' || i != 0) {
      sound = false;
    }
    digits += c;
  }
  if (!sound || !any) {
    throw InvalidArgument(fmt::format("'{}' is no number as the paper prints it", text));
  }
  return {std::string(text), std::stod(digits),
          0.5 * std::pow(10.0, -static_cast<double>(decimals))};
}

Check within(std::string what, double value, double least, double greatest, std::string why) {
  return {std::move(what), value, least, greatest, std::move(why)};
}

Check at_most(std::string what, double value, double greatest, std::string why) {
  Check check{std::move(what), value};
  check.greatest = greatest;
  check.why = std::move(why);
  return check;
}

Check at_least(std::string what, double value, double least, std::string why) {
  Check check{std::move(what), value};
  check.least = least;
  check.why = std::move(why);
  return check;
}

Check at_printed_digits(const Printed& paper, double ours) {
  return within("ours", ours, paper.value - paper.half_digit, paper.value + paper.half_digit,
                "the printed digits");
}

Check rms_ratio(std::string what, double ratio, double degrees_of_freedom, std::string why) {
  Check check = mean_square_ratio(std::move(what), ratio, degrees_of_freedom, std::move(why));
  check.least = std::sqrt(check.least);
  check.greatest = std::sqrt(check.greatest);
  return check;
}

Check mean_square_ratio(std::string what, double ratio, double degrees_of_freedom,
                        std::string why) {
  return within(std::move(what), ratio, algebra::chi_square_per_degree(degrees_of_freedom, -kBand),
                algebra::chi_square_per_degree(degrees_of_freedom, kBand),
                fmt::format("{}: 99.9 % band of chi-square with {:.0f} degrees of freedom", why,
                            degrees_of_freedom));
}

Check holds(std::string what, bool so, std::string why) {
  return within(std::move(what), so ? 1.0 : 0.0, 1.0, 1.0, std::move(why));
}

Distribution distribution_of(std::vector<double> values, double papers_draw) {
  std::sort(values.begin(), values.end());
  const auto below = std::lower_bound(values.begin(), values.end(), papers_draw) - values.begin();
  const auto upto = std::upper_bound(values.begin(), values.end(), papers_draw) - values.begin();
  return {quantile(values, 0.05), quantile(values, 0.5), quantile(values, 0.95),
          50.0 * static_cast<double>(below + upto) / static_cast<double>(values.size()),
          values.size()};
}

bool passes(const Check& check) {
  const auto slack = [](double limit) { return std::isinf(limit) ? 0.0 : 1e-9 * std::abs(limit); };
  return check.value >= check.least - slack(check.least) &&
         check.value <= check.greatest + slack(check.greatest);
}

bool passes(const Row& row) {
  return !row.checks.empty() && std::all_of(row.checks.begin(), row.checks.end(),
                                            [](const Check& check) { return passes(check); });
}

bool passes(const Table& table) {
  return !table.rows.empty() && std::all_of(table.rows.begin(), table.rows.end(),
                                            [](const Row& row) { return passes(row); });
}

std::string bound_text(const Row& row) {
  return joined(row.checks, [](const Check& check) {
    if (check.least == 1.0 && check.greatest == 1.0) {
      return check.what + (check.why.empty() ? "" : fmt::format(" ({})", check.why));
    }
    return fmt::format("{} {} ({})", check.what, limits_text(check), check.why);
  });
}

std::string reason_text(const Row& row) {
  if (row.checks.empty()) return "nothing was checked";
  const bool pass = passes(row);
  return joined(row.checks, [pass](const Check& check) -> std::string {
    if (!pass && passes(check)) return {};
    const char* place = passes(check) ? "within" : "NOT within";
    if (check.least == 1.0 && check.greatest == 1.0) {
      return fmt::format("{}: {}", check.what, passes(check) ? "holds" : "does NOT hold");
    }
    return fmt::format("{} is {:.{}g}, {} its limits", check.what, check.value, digits_of(check),
                       place);
  });
}

}  // namespace risley::reproduction
