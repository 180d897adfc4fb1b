// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Reads pages in tests: their words, compared with golden texts, and the data of their diagrams.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace risley::testing {

/// The page's own part: no style, no scripts.
std::string visible(const std::string& html);

/// The page's words, one line per paragraph, row or caption. "{...}" holds meaningful classes, and
/// the ids that links and diagrams need. Texts stay escaped.
std::string page_text(const std::string& html);

/// Compares a page, and the differences of its variants, with tests/report/golden/NAME.txt.
/// RISLEY_UPDATE_GOLDEN=1 writes the file.
class GoldenPage {
 public:
  GoldenPage(std::string name, const std::string& html);
  GoldenPage(const GoldenPage&) = delete;
  GoldenPage& operator=(const GoldenPage&) = delete;
  ~GoldenPage();  ///< compares

  /// Adds a variant: the lines that it lacks ("- ") and adds ("+ "), or the whole variant if that
  /// is shorter.
  void differs(const std::string& when, const std::string& html);

 private:
  std::string name_, text_;
  std::vector<std::string> lines_;
};

/// The data of the diagrams, from an element of the page.
nlohmann::json data(const std::string& html, const std::string& id = "page-data");
nlohmann::json chart(const std::string& html, const std::string& title);
nlohmann::json series(const nlohmann::json& chart, const std::string& label);

/// A page whose words and data hold no number that is not finite, and data for each diagram.
void expect_sound(const std::string& html);

}  // namespace risley::testing
