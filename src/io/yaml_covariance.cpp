// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/yaml_covariance.hpp"

#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/yaml_output.hpp"

namespace risley::io {

using Eigen::Index;

algebra::NamedCovariance read_covariance(const YamlMap& root, const ScaleOfName& scale_of) {
  const YamlMap map(root.at("covariance").value, root.path(), "covariance");
  map.allow_only({"names", "matrix"});
  const YamlMap::Entry& names = map.at("names");
  if (!names.value.is_list() || names.value.items.empty()) {
    fail_at(map.path(), names.line, "covariance.names: expected a list of parameter names");
  }
  algebra::NamedCovariance result;
  std::vector<long double> scale;
  for (const YamlNode& node : names.value.items) {
    std::string name = yaml_text(node, map.path(), "covariance.names");
    try {
      scale.push_back(scale_of(name));
    } catch (const InvalidArgument& error) {
      fail_at(map.path(), node.line, fmt::format("covariance.names: {}", error.what()));
    }
    if (result.find(name) >= 0) {
      fail_at(map.path(), node.line, fmt::format("covariance.names: {} appears twice", name));
    }
    result.names.push_back(std::move(name));
  }
  const YamlMap::Entry& matrix = map.at("matrix");
  const std::size_t n = scale.size();
  if (!matrix.value.is_list() || matrix.value.items.size() != n) {
    fail_at(map.path(), matrix.line,
            fmt::format("covariance.matrix: expected {} rows, one per name, found {}", n,
                        matrix.value.items.size()));
  }
  const auto size = static_cast<Index>(n);
  result.matrix.resize(size, size);
  std::vector<std::size_t> line(n);
  for (std::size_t i = 0; i < n; ++i) {
    const YamlNode& row = matrix.value.items[i];
    line[i] = row.line;
    if (!row.is_list() || row.items.size() != n) {
      fail_at(map.path(), line[i],
              fmt::format("covariance.matrix[{}]: expected {} numbers, found {}", i, n,
                          row.items.size()));
    }
    for (std::size_t j = 0; j < n; ++j) {
      const std::string field = fmt::format("covariance.matrix[{}][{}]", i, j);
      result.matrix(static_cast<Index>(i), static_cast<Index>(j)) =
          static_cast<double>(yaml_number(row.items[j], map.path(), field) * (scale[i] * scale[j]));
    }
  }
  if (const auto fault = algebra::covariance_fault(result.matrix)) {
    const bool in_a_row = fault->row >= 0;
    fail_at(map.path(), in_a_row ? line[static_cast<std::size_t>(fault->row)] : matrix.line,
            map.field("matrix") + fault->words);
  }
  return result;
}

std::string covariance_text(const algebra::NamedCovariance& covariance,
                            const ScaleOfName& scale_of) {
  const auto n = static_cast<Index>(covariance.names.size());
  if (covariance.matrix.rows() != n || covariance.matrix.cols() != n) {
    throw InvalidArgument(fmt::format("covariance is {} x {}, expected {} x {}, one row per name",
                                      covariance.matrix.rows(), covariance.matrix.cols(), n, n));
  }
  if (!covariance.matrix.allFinite()) {
    throw InvalidArgument("covariance: expected finite numbers");
  }
  std::vector<long double> scale;
  for (const std::string& name : covariance.names) scale.push_back(scale_of(name));
  std::string text = "# Element [i][j] is in the unit of names[i] times the unit of names[j].\n";
  text += fmt::format("covariance:\n  names: [{}]\n  matrix:\n", fmt::join(covariance.names, ", "));
  for (Index i = 0; i < n; ++i) {
    std::vector<std::string> row;
    for (Index j = 0; j < n; ++j) {
      const auto unit = scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
      row.push_back(yaml_decimal(covariance.matrix(i, j), unit));
    }
    text += fmt::format("    - [{}]\n", fmt::join(row, ", "));
  }
  return text;
}

}  // namespace risley::io
