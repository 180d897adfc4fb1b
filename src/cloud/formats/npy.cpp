// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// npy 1.0: a one-dimensional structured array, which numpy.load reads or maps into memory.
#include <fmt/format.h>

#include "risley/io/npy_head.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

std::unique_ptr<CloudWriter> create_npy(const std::string& path, const CloudHeader& header,
                                        const CloudWriterOptions&) {
  std::vector<PointField> fields = all_fields(header);
  std::string types;
  for (const PointField& field : fields) {
    types += fmt::format("{}('{}', '{}')", types.empty() ? "" : ", ", field.name,
                         names_of(field.type).npy);
  }
  return std::make_unique<RecordFile>(path, std::move(fields), [types](std::uint64_t points) {
    return io::npy_head(fmt::format("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}{}",
                                    types, points, header_padding(points, ' ')));
  });
}

}  // namespace

const CloudWriterFormat kNpyFormat = {"npy", ".npy", "structured array of numpy", create_npy};

}  // namespace risley::cloud
