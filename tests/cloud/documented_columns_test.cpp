// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// docs/files/clouds.md lists the columns of a cloud as kPointColumns does. RISLEY_KEEP_DOCUMENTS=1
// rewrites its table.
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "risley/cloud/points.hpp"
#include "risley/io/text_file.hpp"

#include "cloud/formats/point_fields.hpp"
#include "source_tree.hpp"

namespace risley::cloud::documented_columns_test {

constexpr std::string_view kHead =
    "| field | NetCDF | unit | meaning |\n"
    "|---|---|---|---|\n";

std::string table() {
  CloudHeader header;
  header.has_own_covariance = header.has_point_source = header.has_row = true;
  header.factors = {"one"};
  std::string text(kHead);
  for (const PointColumn& column : kPointColumns) {
    std::vector<std::string> names, variables;
    const std::vector<PointField> fields = fields_of(column, header);
    for (const PointField& field : fields) {
      if (!field.name.empty()) names.push_back(field.name);
      variables.push_back(fmt::format("`{}`", field.variable));
    }
    text += fmt::format("| {} | {} | {} | {}{} |\n", fmt::join(names, ", "),
                        fmt::join(variables, ", "), fields.front().unit(), fields.front().meaning,
                        fields.size() > 1 ? ", ..." : "");
  }
  return text;
}

TEST(DocumentedColumns, AreThoseOfTheList) {
  const std::string path = in_source_tree("docs/files/clouds.md");
  std::string page = io::read_text_file(path);
  const std::size_t begin = page.find(kHead);
  ASSERT_NE(begin, std::string::npos);
  const std::size_t length = page.find("\n\n", begin) + 1 - begin;
  if (std::getenv("RISLEY_KEEP_DOCUMENTS") != nullptr) {
    io::write_text_file(path, page.replace(begin, length, table()));
  } else {
    EXPECT_EQ(page.substr(begin, length), table()) << "RISLEY_KEEP_DOCUMENTS=1 rewrites it";
  }
}

}  // namespace risley::cloud::documented_columns_test
