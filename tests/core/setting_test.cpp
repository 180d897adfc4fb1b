// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How front ends write settings, and what values are refused.
#include "risley/core/setting.hpp"

#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley::setting_test {

class SettingTest : public ::testing::Test {
 protected:
  ~SettingTest() override { write_settings_as(SettingStyle::option); }

  static std::string refusal(Setting setting, double value) {
    try {
      require_positive(setting, value);
    } catch (const InvalidArgument& error) {
      return error.what();
    }
    return {};
  }
};

TEST_F(SettingTest, EveryFrontEndWritesNameAndUnitAsItsUsersDo) {
  const double angle = radians_from_degrees(-0.3);
  EXPECT_EQ(name_of(kSetting.noise_angle), "option noise_angle");
  write_settings_as(SettingStyle::flag);
  EXPECT_EQ(refusal(kSetting.noise_angle, angle), "--noise-angle-deg = -0.3 deg, allowed above 0");
  EXPECT_EQ(refusal(kSetting.rate, 0), "--rate-hz = 0 Hz, allowed above 0");
  EXPECT_EQ(refusal(kSetting.delay, -0.25), "--delay-ms = -250 ms, allowed above 0");
  write_settings_as(SettingStyle::keyword);
  EXPECT_EQ(refusal(kSetting.noise_angle, -1), "noise_angle = -1 rad, allowed above 0");
  EXPECT_EQ(refusal(kSetting.clock_drift, -1e-6), "clock_drift = -1e-06, allowed above 0");
  EXPECT_EQ(name_of(kSetting.bend_time), "bend_s");
}

TEST_F(SettingTest, WhatIsNoNumberIsNeverAllowed) {
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(require_positive(kSetting.rate, value), InvalidArgument);
    EXPECT_THROW(require_not_negative(kSetting.rate, value), InvalidArgument);
    EXPECT_THROW(require_between(kSetting.rate, value, 0, 1), InvalidArgument);
  }
  EXPECT_NO_THROW(require_not_negative(kSetting.rate, 0));
  EXPECT_NO_THROW(require_between(kSetting.loss, 1, 0, 1));
}

TEST_F(SettingTest, FilesToReadAreKnownByTheirOptions) {
  EXPECT_TRUE(names_file_to_read("--trajectory-errors"));
  EXPECT_FALSE(names_file_to_read("--output"));
  EXPECT_FALSE(names_file_to_read("sensor"));
}

}  // namespace risley::setting_test
