// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <mutex>
#include <string>

#include "risley/tables/netcdf.hpp"

namespace risley::tables {

/// Held around every call of the NetCDF library, for the whole process.
class NetcdfLock {
 public:
  NetcdfLock();

 private:
  std::lock_guard<std::mutex> lock_;
};

/// The library's number of a type.
int nc_type_of(NetcdfType type);
std::size_t bytes_of(NetcdfType type);
std::string_view name_of(NetcdfType type);

/// All variables have one or two dimensions. @throws InvalidArgument
void require_dimensions(const std::string& variable,
                        std::span<const NetcdfDimension* const> dimensions);

/// The library's message for a status; for a disk error the system's.
std::string netcdf_reason(int status);

}  // namespace risley::tables
