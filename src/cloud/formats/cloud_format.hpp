// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "risley/cloud/cloud_writer.hpp"

namespace risley::cloud {

/// One cloud format. Adding a format means one source in this folder that defines one of these, and
/// one line in formats/registry.cpp.
struct CloudWriterFormat {
  std::string_view name;         ///< CloudFormat::name
  std::string_view ending;       ///< ".las"
  std::string_view description;  ///< one line for the help
  std::unique_ptr<CloudWriter> (*create)(const std::string& path, const CloudHeader& header,
                                         const CloudWriterOptions& options);
};

extern const CloudWriterFormat kLasFormat;      // las.cpp
extern const CloudWriterFormat kLazFormat;      // laz.cpp, where there is LASzip
extern const CloudWriterFormat kPlyFormat;      // ply.cpp
extern const CloudWriterFormat kPcdFormat;      // pcd.cpp
extern const CloudWriterFormat kNpyFormat;      // npy.cpp
extern const CloudWriterFormat kCsvFormat;      // csv.cpp
extern const CloudWriterFormat kXyzFormat;      // csv.cpp
extern const CloudWriterFormat kNetcdfFormat;   // netcdf.cpp
extern const CloudWriterFormat kRos1BagFormat;  // bags.cpp
extern const CloudWriterFormat kRos2BagFormat;  // bags.cpp
extern const CloudWriterFormat kMcapFormat;     // bags.cpp

/// All formats of this build, in the order of the help.
const std::vector<const CloudWriterFormat*>& all_cloud_formats();

}  // namespace risley::cloud
