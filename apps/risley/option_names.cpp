// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "option_names.hpp"

#include <algorithm>
#include <string_view>

namespace risley::app {
namespace {

struct OptionName {
  std::string_view field, flag;
};

constexpr OptionName kNames[] = {
    {"accuracy", "--accuracy"},
    {"additional", "--free"},
    {"angle_noise", "--noise-angle-deg"},
    {"anywhere", "--anywhere"},
    {"cell_size", "--cell-size-m"},
    {"chunk", "--chunk"},
    {"clock_drift", "--clock-drift-ppm"},
    {"common_factors", "--common-factors"},
    {"covariance", "--covariance"},
    {"crs", "--crs"},
    {"data_port", "--data-port"},
    {"datum", "--datum"},
    {"device", "--device"},
    {"duration", "--duration-s"},
    {"extrinsics", "--extrinsics"},
    {"find_time", "--find-s"},
    {"fixed", "--fix"},
    {"flight", "--flight"},
    {"interface", "--interface"},
    {"knot_spacing", "--knot-spacing-s"},
    {"las_scale", "--las-scale-m"},
    {"method", "--method"},
    {"list", "--list"},
    {"mirrored", "--mirror"},
    {"mount", "--mount"},
    {"patch_thickness", "--patch-thickness-m"},
    {"planes", "--planes"},
    {"prior_sigma", "--prior-sigma-deg"},
    {"range_noise", "--noise-range-m"},
    {"range_offset_sigma", "--range-offset-sigma-m"},
    {"rate", "--rate-hz"},
    {"recordings", "INPUT"},
    {"rotor_process", "--process-noise"},
    {"same_walls", "--same-walls"},
    {"scene", "--scene"},
    {"sensor", "--sensor"},
    {"sensor_type", "--sensor-type"},
    {"shot_rate", "--shot-rate-hz"},
    {"speed", "--speed"},
    {"start", "--start-s"},
    {"start_angles", "--start-angles-deg"},
    {"states", "--states"},
    {"station", "--station"},
    {"stations", "--stations"},
    {"tolerance", "--tolerance-deg"},
    {"trajectory", "--trajectory"},
    {"trajectory_errors", "--trajectory-errors"},
    {"trajectory_topic", "--trajectory-topic"},
    {"truth", "--truth"},
    {"unlike", "--unlike"},
};

constexpr std::string_view kWord = "ption ";  // after "o" or "O"

/// What stands beside the words of a sentence, and not within the name of a file.
bool ends_word(const std::string& text, std::size_t at) {
  if (at >= text.size()) return true;
  const bool ends_sentence = at + 1 == text.size() || text[at + 1] == ' ';
  return text[at] == '.' ? ends_sentence : std::string_view(" ,;:)\n").find(text[at]) != text.npos;
}

}  // namespace

std::string with_flags(const std::string& text) {
  std::string result;
  std::size_t done = 0;
  for (std::size_t at = text.find(kWord); at != std::string::npos; at = text.find(kWord, at + 1)) {
    if (at == 0 || (text[at - 1] != 'o' && text[at - 1] != 'O') || at - 1 < done) continue;
    if (at > 1 && text[at - 2] != ' ' && text[at - 2] != '(') continue;  // "adoption"
    const std::size_t begin = at + kWord.size();
    const std::size_t end =
        std::min(text.find_first_not_of("abcdefghijklmnopqrstuvwxyz_", begin), text.size());
    const std::string_view field = std::string_view(text).substr(begin, end - begin);
    const auto* const found =
        std::find_if(std::begin(kNames), std::end(kNames),
                     [field](const OptionName& name) { return name.field == field; });
    if (found == std::end(kNames) || !ends_word(text, end)) continue;
    result.append(text, done, at - 1 - done).append(found->flag);
    done = end;
  }
  return result.append(text, done);
}

void put_flags(std::vector<std::string>& texts) {
  for (std::string& text : texts) text = with_flags(text);
}

}  // namespace risley::app
