// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/checks.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::jobs {

void check_positive(double value, std::string_view option, std::string_view unit) {
  if (!(value > 0) || !std::isfinite(value)) {
    throw InvalidArgument(fmt::format("option {} = {} {}, allowed above 0", option, value, unit));
  }
}

void check_not_negative(double value, std::string_view option, std::string_view unit) {
  if (!(value >= 0) || !std::isfinite(value)) {
    throw InvalidArgument(
        fmt::format("option {} = {} {}, allowed 0 and above", option, value, unit));
  }
}

void check_truth_name(const std::string& truth) {
  if (std::filesystem::path(truth).extension() != ".yaml") {
    throw InvalidArgument(fmt::format("option truth = {}, expected OUT.truth.yaml", truth));
  }
}

void check_truths(const std::vector<std::string>& truths, std::size_t recordings) {
  if (truths.size() != recordings) {
    throw InvalidArgument(
        fmt::format("{} truth files for {} recordings: option truth takes one each", truths.size(),
                    recordings));
  }
  for (const std::string& truth : truths) check_truth_name(truth);
}

std::string truth_columns(const std::string& truth) {
  return std::filesystem::path(truth).replace_extension(".nc").string();
}

std::string truth_mount(const std::string& truth) {
  std::filesystem::path path(truth);
  path.replace_extension();  // .yaml
  if (path.extension() == ".truth") path.replace_extension();
  return path.string() + ".mount.truth.yaml";
}

}  // namespace risley::jobs
