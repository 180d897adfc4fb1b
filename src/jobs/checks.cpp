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
#include "risley/core/setting.hpp"

namespace risley::jobs {

void check_truth_name(const std::string& truth) {
  if (std::filesystem::path(truth).extension() != ".yaml") {
    throw InvalidArgument(
        fmt::format("{} = {}, expected OUT.truth.yaml", name_of(kSetting.truth), truth));
  }
}

void check_truths(const std::vector<std::string>& truths, std::size_t recordings) {
  if (truths.size() != recordings) {
    throw InvalidArgument(
        fmt::format("{} truth files for {} recordings: give {} once per recording", truths.size(),
                    recordings, name_of(kSetting.truth)));
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
      "{} = {} belongs to another recording: at the same times its beams point "
      "elsewhere, by {:.3g} degrees in the median, allowed {:.0f}",
      name_of(kSetting.truth), truth, degrees_from_radians(middle), degrees_from_radians(kMost)));
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
