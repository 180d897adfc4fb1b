// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "tables/netcdf_library.hpp"

#include <cerrno>
#include <cstring>

#include <H5Epublic.h>
#include <fmt/format.h>
#include <netcdf.h>

#include "risley/core/require.hpp"

namespace risley::tables {
namespace {

/// Never destroyed: files may be closed while the process ends.
std::mutex& library_mutex() {
  static auto* const mutex = new std::mutex;
  return *mutex;
}

struct TypeEntry {
  int number;
  std::size_t bytes;
  std::string_view name;
};

TypeEntry entry_of(NetcdfType type) {
  switch (type) {
    case NetcdfType::text:
      return {NC_CHAR, 1, "char"};
    case NetcdfType::uint8:
      return {NC_UBYTE, 1, "ubyte"};
    case NetcdfType::int32:
      return {NC_INT, 4, "int"};
    case NetcdfType::uint32:
      return {NC_UINT, 4, "uint"};
    case NetcdfType::int64:
      return {NC_INT64, 8, "int64"};
    case NetcdfType::uint64:
      return {NC_UINT64, 8, "uint64"};
    case NetcdfType::float32:
      return {NC_FLOAT, 4, "float"};
    case NetcdfType::float64:
      break;
  }
  return {NC_DOUBLE, 8, "double"};
}

}  // namespace

NetcdfLock::NetcdfLock() : lock_(library_mutex()) {
  // Every file is closed by its owner. Data that a full disk rejected on closing are lost, and
  // HDF5's own attempt at process exit crashes.
  static const bool kept_from_exit = H5dont_atexit() >= 0;
  static_cast<void>(kept_from_exit);
  // HDF5 keeps one error stack per thread and prints it; NetCDF silences only the first thread's.
  thread_local bool silent = false;
  if (!silent) silent = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr) >= 0;
  errno = 0;
}

int nc_type_of(NetcdfType type) { return entry_of(type).number; }
std::size_t bytes_of(NetcdfType type) { return entry_of(type).bytes; }
std::string_view name_of(NetcdfType type) { return entry_of(type).name; }

void require_dimensions(const std::string& variable,
                        std::span<const NetcdfDimension* const> dimensions) {
  require_between(fmt::format("number of dimensions of variable {}", variable),
                  static_cast<double>(dimensions.size()), 1, 2);
}

std::string netcdf_reason(int status) {
  switch (errno) {
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
    case EIO:
      if (status == NC_EHDFERR) return std::strerror(errno);
      break;
    default:
      break;
  }
  return nc_strerror(status);
}

}  // namespace risley::tables
