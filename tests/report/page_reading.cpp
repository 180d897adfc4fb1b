// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/page_reading.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "source_tree.hpp"

namespace risley::testing {
namespace {

/// What stands in a page between two texts.
std::string between(const std::string& html, const std::string& begin, const std::string& end) {
  const std::size_t first = html.find(begin), last = html.find(end, first);
  EXPECT_NE(first, std::string::npos) << begin;
  EXPECT_NE(last, std::string::npos) << end;
  if (first == std::string::npos || last == std::string::npos) return {};
  return html.substr(first + begin.size(), last - first - begin.size());
}

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// What a golden text keeps of an element's beginning.
std::string mark_of(const std::string& tag) {
  static const std::regex name("^<([a-z0-9]+)"), kept(R"re(( id| class)="([^"]*)"| (open)\b)re");
  static const std::set<std::string> begin_lines = {"p",   "tr",     "h1", "ul",      "dl",
                                                    "div", "figure", "ol", "section", "details"};
  static const std::set<std::string> apart = {"br", "dd", "dt", "span", "a", "button", "code"};
  static const std::regex meaningful("verdict.*|far|bad|same|plot");
  std::smatch found;
  if (!std::regex_search(tag, found, name)) return "";
  const std::string element = found[1];
  std::string marks;
  for (std::sregex_iterator i(tag.begin(), tag.end(), kept), end; i != end; ++i) {
    const std::string attribute = (*i)[1], value = (*i)[2];
    if (attribute == " class" && !std::regex_match(value, meaningful)) continue;
    marks +=
        (marks.empty() ? "" : " ") + (attribute == " id" ? "#" + value : value + (*i)[3].str());
  }
  if (!marks.empty()) marks = "{" + marks + "} ";
  if (element == "td" || element == "th") return "| " + marks;
  if (element == "h2") return "\n## " + marks;
  if (element == "h3") return "\n### " + marks;
  if (element == "li") return "\n* " + marks;
  return (begin_lines.contains(element) ? "\n" : apart.contains(element) ? " " : "") + marks;
}

/// The fewest lines to take out and to put in that make b of a.
std::string differences(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  // How many lines their rests have in common.
  std::vector common(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = a.size(); i-- > 0;) {
    for (std::size_t j = b.size(); j-- > 0;) {
      common[i][j] =
          a[i] == b[j] ? common[i + 1][j + 1] + 1 : std::max(common[i + 1][j], common[i][j + 1]);
    }
  }
  std::string text;
  for (std::size_t i = 0, j = 0; i < a.size() || j < b.size();) {
    if (i < a.size() && j < b.size() && a[i] == b[j]) {
      ++i, ++j;
    } else if (j == b.size() || (i < a.size() && common[i + 1][j] >= common[i][j + 1])) {
      text += "- " + a[i++] + "\n";
    } else {
      text += "+ " + b[j++] + "\n";
    }
  }
  return text;
}

}  // namespace

std::string visible(const std::string& html) { return between(html, "<main", "</main>"); }

std::string page_text(const std::string& html) {
  const std::string shown = visible(html);
  std::string text;
  for (std::size_t at = shown.find('>') + 1; at < shown.size();) {
    const bool is_tag = shown[at] == '<';
    const std::size_t end = is_tag ? shown.find('>', at) + 1 : shown.find('<', at);
    const std::string part = shown.substr(at, end == std::string::npos ? end : end - at);
    text += is_tag ? mark_of(part) : part;
    at = std::min(end, shown.size());
    if (is_tag && (part == "</td>" || part == "</th>")) text += " ";
  }
  std::string result;
  for (const std::string& line : lines_of(text)) {
    std::istringstream words(line);
    std::string word, all;
    while (words >> word) all += (all.empty() ? "" : " ") + word;
    if (!all.empty()) result += all + "\n";
  }
  return result;
}

GoldenPage::GoldenPage(std::string name, const std::string& html)
    : name_(std::move(name)), text_(page_text(html)), lines_(lines_of(text_)) {
  expect_sound(html);
}

void GoldenPage::differs(const std::string& when, const std::string& html) {
  SCOPED_TRACE(when);
  expect_sound(html);
  const std::string other = page_text(html), found = differences(lines_, lines_of(other));
  EXPECT_FALSE(found.empty());
  text_ += "\n======== " + when + "\n" + (found.size() < other.size() ? found : other);
}

GoldenPage::~GoldenPage() {
  const std::string file = "tests/report/golden/" + name_ + ".txt", path = in_source_tree(file);
  std::ifstream stream(path);
  const std::string golden{std::istreambuf_iterator<char>(stream), {}};
  if (golden == text_) return;
  ADD_FAILURE() << file << ": - golden, + found; RISLEY_UPDATE_GOLDEN=1 writes it\n"
                << differences(lines_of(golden), lines_of(text_));
  if (std::getenv("RISLEY_UPDATE_GOLDEN")) std::ofstream(path) << text_;
}

nlohmann::json data(const std::string& html, const std::string& id) {
  const std::string begin = "<script type=\"application/json\" id=\"" + id + "\">";
  return nlohmann::json::parse(between(html, begin, "</script>"));
}

nlohmann::json chart(const std::string& html, const std::string& title) {
  for (const auto& one : data(html)) {
    if (one.at("title") == title) return one;
  }
  throw std::runtime_error("no diagram " + title);
}

nlohmann::json series(const nlohmann::json& chart, const std::string& label) {
  for (const auto& one : chart.at("series")) {
    if (one.at("label") == label) return one;
  }
  throw std::runtime_error("no series " + label);
}

void expect_sound(const std::string& html) {
  const std::string shown = visible(html);
  const std::regex not_finite("(^|[^A-Za-z])(nan|inf)([^A-Za-z]|$)", std::regex::icase);
  std::smatch found;
  EXPECT_FALSE(std::regex_search(shown, found, not_finite)) << found.suffix().str().substr(0, 200);
  EXPECT_NE(html.find("Content-Security-Policy"), std::string::npos);
  const nlohmann::json charts = data(html);
  EXPECT_FALSE(std::regex_search(charts.dump(), not_finite));
  const std::regex caption("<figcaption>");
  EXPECT_EQ(std::distance(std::sregex_iterator(shown.begin(), shown.end(), caption), {}),
            static_cast<std::ptrdiff_t>(charts.size()));
  const std::set<std::string> colours = {"a", "b", "c", "d", "ink", "bad"};
  for (const auto& one : charts) {
    EXPECT_NE(shown.find("class=\"plot\" id=\"" + one.at("id").get<std::string>() + "\""),
              std::string::npos);
    for (const auto& drawn : one.at("series")) {
      EXPECT_EQ(drawn.at("x").size(), drawn.at("y").size());
      EXPECT_TRUE(colours.contains(drawn.at("colour").get<std::string>()));
      for (const auto& x : drawn.at("x")) EXPECT_TRUE(x.is_number());
    }
  }
}

}  // namespace risley::testing
