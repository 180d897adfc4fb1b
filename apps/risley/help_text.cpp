// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "help_text.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"

namespace risley::app {
namespace {

constexpr std::size_t kTextColumn = 30;  // where descriptions begin
constexpr const char* kUsualGroup = "Options";
constexpr const char* kOtherGroup = "Other options";

struct Group {
  const char* heading;
  std::string_view options;
};
constexpr std::array<Group, 10> kGroups = {{
    {"Many recordings", "--list --table --resume --no-report"},
    {"How the recording is read",
     "--sensor --rate-hz --device --every-device --shot-rate-hz --extrinsics --mirror "
     "--sensor-type"},
    {"Noise and parameters",
     "--noise-angle-deg --noise-range-m --noise-model --process-noise --fix --free --set "
     "--reported --prior-sigma-deg --range-offset-sigma-m --method --beam-origin --tolerance-deg"},
    {"What is simulated",
     "--quantize --no-rounding --rotor --start-angles-deg --firing --integration-s --cell-deg"},
    {"What sensors send", "--coordinates --return-mode --imu --data-port --find-s"},
    {"Walls", "--planes --stations --station --walls --same-walls --patch-thickness-m"},
    {"Flights and other trajectories",
     "--trajectory --trajectory-topic --mount --accuracy --trajectory-errors "
     "--trajectory-format --flight --start-s --clock-drift-ppm --control --knot-spacing-s "
     "--cell-size-m --crs --datum --distribution"},
    {"Planning", "--plan --duration-s --scene --empty-circle-m --report"},
    {"What is written",
     "--states --force --truth --covariance --beam-divergence --common-factors --las-scale-m "
     "--time --beam-origin-map --directions --format --topic --frame-id --frame-rate-hz --message"},
    {"Running", "--no-progress --verbose --threads --seed"},
}};

/// Placeholder for the value of an option whose type is not informative.
constexpr std::pair<std::string_view, const char*> kValues[] = {
    {"--sensor", "NAME|FILE"},
    {"--calibration", "NAME|FILE"},
    {"--from", "NAME|FILE"},
    {"--station", "NAME"},
    {"--rate-hz", "HZ"},
    {"--process-noise", "VALUE"},
    {"--crs", "EPSG:N"},
    {"--datum", "EPSG:N"},
    {"--serial", "SERIAL"},
    {"--start-angles-deg", "A,B"},
    {"--integration-s", "T,T,..."},
    {"--output", "PATH"},
    {"--table", "FILE"},
    {"--report", "FILE"},
    {"--distribution", "FILE"},
    {"--beam-origin-map", "FILE"},
};

bool holds_word(std::string_view words, std::string_view word) {
  for (std::size_t begin = 0; begin < words.size();) {
    const std::size_t end = std::min(words.find(' ', begin), words.size());
    if (words.substr(begin, end - begin) == word) return true;
    begin = end + 1;
  }
  return false;
}

/// Start of the last column's text in a line.
std::size_t hanging_indent(std::string_view line) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", begin);
  return gap == std::string_view::npos ? begin : line.find_first_not_of(' ', gap);
}

std::string wrapped_line(std::string_view line, std::size_t columns) {
  const std::size_t indent = hanging_indent(line);
  std::string result;
  std::size_t room = columns, before = indent;  // no line breaks at spaces up to there
  while (line.size() > room) {
    std::size_t end = line.rfind(' ', room);
    if (end == std::string_view::npos || end <= before) {
      end = line.find(' ', std::max(room, before + 1));
    }
    if (end == std::string_view::npos) break;
    result += line.substr(0, end);
    result += '\n' + std::string(indent, ' ');
    line.remove_prefix(end + 1);
    room = columns - indent;
    before = 0;
  }
  return result + std::string(line);
}

/// The allowed values of an option, empty unless they are a list of words.
std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();  // such as TEXT:{map,ekf}
  const std::size_t begin = type.find(":{"), end = type.rfind('}');
  std::vector<std::string> choices;
  if (begin == std::string::npos || end == std::string::npos) return choices;
  const std::string list = type.substr(begin + 2, end - begin - 2);
  for (std::size_t from = 0; from <= list.size();) {
    const std::size_t comma = std::min(list.find(',', from), list.size());
    choices.push_back(list.substr(from, comma - from));
    from = comma + 1;
  }
  return choices;
}

std::string names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Placeholder for the value of an option. Empty: it takes none.
std::string value_of(const CLI::Option& option, const std::vector<std::string>& choices) {
  if (option.get_type_size() == 0) return {};
  constexpr std::size_t kRoom = 18;
  if (const auto joined = fmt::format("{}", fmt::join(choices, "|")); !choices.empty()) {
    return joined.size() <= kRoom ? joined : "NAME";
  }
  const std::string name = option.get_name();
  std::string type = option.get_type_name();
  const std::string own = type.substr(0, type.find(':'));
  const bool is_number = own == "FLOAT" || own == "INT" || own == "UINT";
  if (own != "TEXT" && !is_number) return type;  // declared with the option
  for (const auto& [known, value] : kValues) {
    if (known == name) return value;
  }
  if (is_number) return own == "FLOAT" ? "NUMBER" : "N";
  return names_file_to_read(name) ? "FILE" : "TEXT";
}

std::string entry(std::string_view head, std::string_view text) {
  std::string line = fmt::format("  {}", head);
  if (line.size() + 2 > kTextColumn) {
    line += '\n' + std::string(kTextColumn, ' ');
  } else {
    line.resize(kTextColumn, ' ');
  }
  const std::string lines = wrapped(text, kHelpColumns - kTextColumn);
  for (const char c : lines) {
    line += c;
    if (c == '\n') line += std::string(kTextColumn, ' ');
  }
  while (line.ends_with(' ')) line.pop_back();
  return line + '\n';
}

std::string option_entry(const CLI::Option& option) {
  const std::vector<std::string> choices = choices_of(option);
  const std::string value = value_of(option, choices);
  std::string text = option.get_description();
  if (value == "NAME" && !choices.empty()) {
    const bool is_list = text.find('\n') != std::string::npos;
    text += fmt::format("{}one of: {}", is_list ? "\n" : "; ", fmt::join(choices, ", "));
  }
  const std::string preset = option.get_default_str();
  const bool has_default = !preset.empty() && preset != "false" && preset.front() != '[';
  if (option.get_required()) text = "Required. " + text;
  if (has_default && text.find("default: ") == std::string::npos) {
    text += fmt::format(" (default: {})", preset);
  }
  return entry(names_of(option) + (value.empty() ? "" : " ") + value, text);
}

using Options = std::vector<const CLI::Option*>;

Options options_of(const CLI::App& app, std::string_view group) {
  return app.get_options(
      [&](const CLI::Option* one) { return one->nonpositional() && one->get_group() == group; });
}

Options positionals_of(const CLI::App& app) {
  return app.get_options(
      [](const CLI::Option* one) { return one->get_positional() && !one->get_group().empty(); });
}

std::string section(std::string_view heading, const Options& options) {
  if (options.empty()) return {};
  std::string text = fmt::format("\n{}:\n", heading);
  for (const CLI::Option* option : options) text += option_entry(*option);
  return text;
}

/// The headings of an app's options other than the usual and the common ones.
std::vector<std::string> headings_of(const CLI::App& app) {
  std::vector<std::string> found, headings = app.get_groups();
  const auto take = [&](const std::string& heading) {
    const auto one = std::find(headings.begin(), headings.end(), heading);
    if (one == headings.end()) return;
    if (!options_of(app, heading).empty()) found.push_back(heading);
    headings.erase(one);
  };
  for (const Group& group : kGroups) {
    if (std::string_view(group.heading) != kGroups.back().heading) take(group.heading);
  }
  for (const std::string& heading : std::vector<std::string>(headings)) {
    const bool is_last = heading == kUsualGroup || heading == kCommonGroup ||
                         heading == kGroups.back().heading || heading.empty();
    if (!is_last) take(heading);
  }
  take(kGroups.back().heading);
  return found;
}

std::string usage(const CLI::App& app, const std::string& name, const Options& positionals) {
  const bool has_verbs = !app.get_subcommands({}).empty();
  std::string line = fmt::format("\nUsage: {}{} [OPTIONS]", name,
                                 !has_verbs                    ? ""
                                 : app.get_parent() == nullptr ? " VERB"
                                                               : " ACTION");
  for (const CLI::Option* option : positionals) {
    std::string one = option->get_name(true, false);
    if (option->get_expected_max() > 1) one += "...";
    line += option->get_required() ? " " + one : fmt::format(" [{}]", one);
  }
  return line + '\n';
}

}  // namespace

void arrange_options(CLI::App& verb, std::string_view usual) {
  for (CLI::Option* option : verb.get_options([](CLI::Option*) { return true; })) {
    // CLI11 2.5 writes OPTIONS.
    if (!option->nonpositional() || lower_case(option->get_group()) != "options") continue;
    const std::string name = option->get_name();
    const auto group = std::find_if(kGroups.begin(), kGroups.end(), [&](const Group& one) {
      return holds_word(one.options, name);
    });
    option->group(holds_word(usual, name)  ? kUsualGroup
                  : group == kGroups.end() ? kOtherGroup
                                           : group->heading);
  }
  for (CLI::App* action : verb.get_subcommands([](CLI::App*) { return true; })) {
    arrange_options(*action, usual);
    action->get_help_ptr()->group(kCommonGroup)->description("Print this help");
  }
}

std::string wrapped(std::string_view text, std::size_t columns) {
  std::string result;
  for (;;) {
    const std::size_t end = text.find('\n');
    result += wrapped_line(text.substr(0, end), columns);
    if (end == std::string_view::npos) return result;
    result += '\n';
    text.remove_prefix(end + 1);
  }
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string name,
                                     CLI::AppFormatMode mode) const {
  const bool is_verb = app->get_parent() != nullptr;
  std::string text = app->get_description() + '\n';
  if (is_verb && !app->get_footer().empty()) {
    text += fmt::format("\nExamples:\n{}\n", app->get_footer());
  }
  const Options positionals = positionals_of(*app);
  text += usage(*app, name, positionals);
  for (const CLI::Option* option : positionals) {
    text += entry(option->get_name(true, false), option->get_description());
  }
  std::string heading;
  for (const CLI::App* below : app->get_subcommands({})) {
    const std::string own = is_verb ? "Actions" : below->get_group();
    if (own != heading) text += fmt::format("\n{}:\n", heading = own);
    text += entry(below->get_name(), below->get_description());
  }
  text += section(kUsualGroup, options_of(*app, kUsualGroup));
  const std::vector<std::string> headings = headings_of(*app);
  if (mode == CLI::AppFormatMode::All) {
    for (const std::string& one : headings) text += section(one, options_of(*app, one));
  }
  text += section(kCommonGroup, options_of(*app, kCommonGroup));
  if (mode != CLI::AppFormatMode::All && !headings.empty()) {
    text += wrapped(fmt::format("\n{} --help-all shows more: {}.\n", name,
                                lower_case(fmt::format("{}", fmt::join(headings, ", ")))),
                    kHelpColumns);
  }
  if (!is_verb) text += '\n' + app->get_footer() + '\n';
  return text;
}

}  // namespace risley::app
