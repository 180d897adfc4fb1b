// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/yaml_output.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "risley/io/yaml_map.hpp"

#include "refusal.hpp"

namespace risley::io::yaml_output_test {

TEST(YamlOutput, DecimalsReadAsTheSameBits) {
  const long double degree = std::numbers::pi_v<long double> / 180;
  for (const double value : {0.0, -0.1, 1.0 / 3, 1e-300, 6.02e23, 0.0174532925199433, -1e-5}) {
    for (const long double scale : {1.0L, degree}) {
      const YamlNode node = parse_yaml(yaml_decimal(value, scale), "a.yaml");
      EXPECT_EQ(static_cast<double>(yaml_number(node, "a.yaml", "value") * scale), value);
    }
  }
  EXPECT_EQ(yaml_decimal(0.1), "0.1");
  EXPECT_EQ(yaml_decimal(static_cast<double>(3 * degree), degree), "3");
  EXPECT_EQ(refusal([] { yaml_decimal(std::nan("")); }), "value = nan, allowed finite");
  EXPECT_EQ(refusal([] { yaml_decimal(1, 0); }), "scale = 0, allowed above 0");
}

TEST(YamlOutput, TextsComeBackWhole) {
  const std::string text = "a \"b\" \\ c: # \n\t- d";
  EXPECT_EQ(yaml_text(parse_yaml(yaml_quoted(text), "a.yaml"), "a.yaml", "text"), text);
}

}  // namespace risley::io::yaml_output_test
