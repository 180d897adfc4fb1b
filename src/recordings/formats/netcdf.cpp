// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <string_view>

#include "recordings/formats/format.hpp"
#include "recordings/formats/netcdf_layout.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kNetcdf4Signature = "\x89HDF\r\n\x1a\n";

}  // namespace

const Format kNetcdfFormat = {
    netcdf::kName,
    ".nc",
    "NetCDF-4, the lossless format: everything a recording holds",
    [](std::string_view head) { return head.starts_with(kNetcdf4Signature); },
    netcdf::open_recording,
    netcdf::create_recording,
    true,
};

}  // namespace risley::recordings
