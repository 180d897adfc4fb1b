// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace risley::json {

// Files of docs/schemas, which CMakeLists.txt embeds.

std::string_view columns_schema();
std::string_view common_schema();
std::string_view estimate_schema();
std::string_view calibrate_schema();
std::string_view report_file_schema();

}  // namespace risley::json
