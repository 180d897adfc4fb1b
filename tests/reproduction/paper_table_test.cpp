// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reproduction/paper_table.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley::reproduction::paper_table_test {

TEST(Printed, KeepsDigits) {
  EXPECT_DOUBLE_EQ(printed("-43,789.8").value, -43789.8);
  EXPECT_DOUBLE_EQ(printed("-43,789.8").half_digit, 0.05);
  EXPECT_EQ(printed("0.010").text, "0.010");
  EXPECT_DOUBLE_EQ(printed("0.010").half_digit, 0.0005);
  EXPECT_DOUBLE_EQ(printed("1,081").value, 1081.0);
  EXPECT_DOUBLE_EQ(printed("20").half_digit, 0.5);
  for (const char* wrong : {"", "-", "1.2.3", "12-3", "two", ",5", "1e3", "+4"}) {
    EXPECT_THROW(printed(wrong), InvalidArgument) << wrong;
  }
}

Row row_of(double ours) {
  Row row{"term", "mm", printed("3.0"), ours};
  row.checks = {at_printed_digits(*row.paper, ours)};
  return row;
}

TEST(Row, PassesUpToHalfADigitAndNotBeyond) {
  EXPECT_TRUE(passes(row_of(3.0)));
  EXPECT_TRUE(passes(row_of(3.05)));
  EXPECT_TRUE(passes(row_of(2.95)));
  EXPECT_FALSE(passes(row_of(3.0501)));
  EXPECT_FALSE(passes(row_of(2.9499)));
  EXPECT_FALSE(passes(row_of(std::numeric_limits<double>::quiet_NaN())));
}

TEST(Row, NeedsEveryCheckAndAtLeastOne) {
  Row row = row_of(3.0);
  row.checks.push_back(at_most("error", 0.2, 0.1, "a reason"));
  EXPECT_FALSE(passes(row));
  EXPECT_NE(reason_text(row).find("error is 0.2"), std::string::npos);
  EXPECT_EQ(reason_text(row).find("ours"), std::string::npos);  // that one holds
  EXPECT_NE(bound_text(row).find("error at most 0.1 (a reason)"), std::string::npos);
  row.checks.back() = at_most("error", 0.1, 0.1, "a reason");
  EXPECT_TRUE(passes(row));
  row.checks.push_back(holds("it is so", false, "a reason"));
  EXPECT_FALSE(passes(row));
  row.checks.clear();
  EXPECT_FALSE(passes(row));
  Table table{"name", "title", "method"};
  EXPECT_FALSE(passes(table));
  table.rows = {row_of(3.0)};
  EXPECT_TRUE(passes(table));
  table.rows.push_back(row_of(4.0));
  EXPECT_FALSE(passes(table));
}

TEST(Check, LimitsHoldOnBothSides) {
  EXPECT_TRUE(passes(at_least("x", 1.0, 1.0, "")));
  EXPECT_FALSE(passes(at_least("x", 0.999, 1.0, "")));
  EXPECT_FALSE(passes(within("x", -1.1, -1.0, 1.0, "")));
  EXPECT_FALSE(passes(within("x", 1.1, -1.0, 1.0, "")));
}

TEST(Check, BandsAreThoseOfChiSquare) {
  EXPECT_TRUE(passes(rms_ratio("x", 1.0, 8, "")));
  EXPECT_TRUE(passes(rms_ratio("x", 1.8, 8, "")));
  EXPECT_FALSE(passes(rms_ratio("x", 2.0, 8, "")));
  EXPECT_FALSE(passes(rms_ratio("x", 0.2, 8, "")));
  EXPECT_FALSE(passes(rms_ratio("x", 1.8, 20, "")));
}

TEST(Distribution, SaysWhereADrawFalls) {
  std::vector<double> values;
  for (int i = 100; i >= 0; --i) values.push_back(i);
  const Distribution all = distribution_of(values, 25.0);
  EXPECT_DOUBLE_EQ(all.low, 5.0);
  EXPECT_DOUBLE_EQ(all.median, 50.0);
  EXPECT_DOUBLE_EQ(all.high, 95.0);
  EXPECT_NEAR(all.percentile, 25.25, 0.01);
  EXPECT_DOUBLE_EQ(distribution_of(values, -1.0).percentile, 0.0);
  EXPECT_DOUBLE_EQ(distribution_of(values, 101.0).percentile, 100.0);
  EXPECT_EQ(distribution_of({1.0}, 1.0).draws, 1u);
}

}  // namespace risley::reproduction::paper_table_test
