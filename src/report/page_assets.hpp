// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace risley::report {

// Texts that cmake/RisleyReportAssets.cmake embeds.

/// page.js: draws the diagrams in the JSON of the element "page-data".
std::string_view page_script();
/// page.css: style sheet with a light and a dark set of colours, and one for paper.
std::string_view page_style();
/// Apache ECharts, and its extension for three dimensions.
std::string_view echarts_script();
std::string_view echarts_gl_script();
/// viewer.html, viewer.css and viewer.js: points that fill the window; and three.js, which draws
/// them.
std::string_view viewer_stage();
std::string_view viewer_style();
std::string_view viewer_script();
std::string_view three_script();

}  // namespace risley::report
