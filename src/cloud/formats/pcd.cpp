// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// PCD 0.7, binary, of the Point Cloud Library: coordinates in single precision, as in its point
// types.
#include <fmt/format.h>

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

std::unique_ptr<CloudWriter> create_pcd(const std::string& path, const CloudHeader& header,
                                        const CloudWriterOptions&) {
  std::vector<PointField> fields = pcl_fields(header);
  std::string notes, names, sizes, types, counts;
  for (const std::string& note : header_notes(header, fields)) {
    notes += fmt::format("# {}\n", note);
  }
  for (const PointField& field : fields) {
    names += fmt::format(" {}", field.name);
    sizes += fmt::format(" {}", names_of(field.type).bytes);
    types += fmt::format(" {}", names_of(field.type).pcd);
    counts += " 1";
  }
  const auto text = [notes, names, sizes, types, counts](std::uint64_t points) {
    // The header states the number of points twice.
    const std::string padding = header_padding(points, '.');
    return fmt::format(
        "# .PCD v0.7 - Point Cloud Data file format\n{}# padding {}{}\nVERSION 0.7\nFIELDS{}\n"
        "SIZE{}\nTYPE{}\nCOUNT{}\nWIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\n"
        "DATA binary\n",
        notes, padding, padding, names, sizes, types, counts, points, points);
  };
  return std::make_unique<RecordFile>(path, std::move(fields), text);
}

}  // namespace

const CloudWriterFormat kPcdFormat = {"pcd", ".pcd", "PCD of the Point Cloud Library, binary",
                                      create_pcd};

}  // namespace risley::cloud
