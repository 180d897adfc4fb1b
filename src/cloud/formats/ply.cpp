// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// PLY, binary little-endian 1.0: one element "vertex" with x, y, z in double precision, and every
// other field as a property with the prefix by which CloudCompare knows a scalar field.
#include <fmt/format.h>

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

std::vector<PointField> ply_fields(const CloudHeader& header) {
  std::vector<PointField> fields = all_fields(header);
  for (PointField& field : fields) {
    const bool coordinate = field.name == "X" || field.name == "Y" || field.name == "Z";
    field.name = coordinate ? std::string(1, static_cast<char>(field.name[0] - 'A' + 'a'))
                            : fmt::format("scalar_{}", field.name);
  }
  return fields;
}

std::unique_ptr<CloudWriter> create_ply(const std::string& path, const CloudHeader& header,
                                        const CloudWriterOptions&) {
  std::vector<PointField> fields = ply_fields(header);
  std::string notes, properties;
  for (const std::string& note : header_notes(header, fields)) {
    notes += fmt::format("comment {}\n", note);
  }
  for (const PointField& field : fields) {
    properties += fmt::format("property {} {}\n", names_of(field.type).ply, field.name);
  }
  const auto text = [notes, properties](std::uint64_t points) {
    return fmt::format(
        "ply\nformat binary_little_endian 1.0\n{}comment padding {}\nelement vertex {}\n{}"
        "end_header\n",
        notes, header_padding(points, '.'), points, properties);
  };
  return std::make_unique<RecordFile>(path, std::move(fields), text);
}

}  // namespace

const CloudWriterFormat kPlyFormat = {
    "ply", ".ply", "PLY, binary, all fields with the names of CloudCompare", create_ply};

}  // namespace risley::cloud
