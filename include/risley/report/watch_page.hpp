// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of a running recording. It gets its numbers as events from /events, which are
// json::of(jobs::LiveRecording).
#pragma once

#include <string_view>

namespace risley::report {

std::string_view watch_page();    ///< HTML, at /
std::string_view watch_script();  ///< at /watch.js
std::string_view watch_style();   ///< at /watch.css

}  // namespace risley::report
