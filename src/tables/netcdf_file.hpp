// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "risley/tables/netcdf.hpp"

namespace risley::tables {

/// A NetCDF file as read by the library: answers the requests of NetcdfInput, in the process that
/// the library may end. No other thread may be inside the library.
class NetcdfFile {
 public:
  explicit NetcdfFile(const std::string& path);
  ~NetcdfFile();
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;

  bool has_attribute(const std::string& name) const;
  std::string text(const std::string& name) const;
  std::uint32_t number(const std::string& name) const;
  std::vector<std::pair<std::string, std::string>> text_group(const std::string& group) const;
  NetcdfDimension dimension(const std::string& name) const;
  bool has_variable(const std::string& name) const;
  std::vector<std::string> texts(const std::string& name, const NetcdfDimension& along) const;
  NetcdfVariable variable(const std::string& name, NetcdfType type,
                          std::span<const NetcdfDimension> dimensions, std::size_t block) const;
  void get(const NetcdfVariable& variable, std::size_t first, std::size_t count,
           void* values) const;

 private:
  [[noreturn]] void fail(const std::string& problem) const;
  void check(int status, const std::string& action) const;
  std::string text_of(int group, const std::string& name) const;
  void refuse_links() const;

  std::string path_;
  std::uint64_t bytes_ = 0;  ///< of the file
  int id_ = 0;
};

}  // namespace risley::tables
