// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/checks.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"

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
        fmt::format("{} truth files for {} recordings: give option truth once per recording",
                    truths.size(), recordings));
  }
  for (const std::string& truth : truths) check_truth_name(truth);
}

void check_truth_is_of_recording(std::span<const Vector3<double>> recorded,
                                 std::span<const Vector3<double>> beams, const std::string& truth) {
  constexpr double kMost = 5 * kRadiansPerDegree;  // a bent unit's are some tenths
  std::vector<double> apart;
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const double angle = angle_between(recorded[i], beams[i]);
    if (std::isfinite(angle)) apart.push_back(angle);
  }
  const double middle = median(apart);
  if (!(middle > kMost)) return;
  throw InvalidArgument(fmt::format(
      "option truth = {} belongs to another recording: at the same times its beams point "
      "elsewhere, by {:.3g} degrees in the median, allowed {:.0f}",
      truth, degrees_from_radians(middle), degrees_from_radians(kMost)));
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
