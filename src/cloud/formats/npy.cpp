// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// npy 1.0: a one-dimensional structured array, which numpy.load reads or maps into memory.
#include <algorithm>

#include <fmt/format.h>

#include "risley/core/error.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kMagic = "\x93NUMPY\x01\x00"sv;
constexpr std::size_t kAlignment = 64;      ///< of the first record, as numpy has it
constexpr std::size_t kTextLimit = 0xFFFF;  ///< its length is a 16-bit number

const char* npy_type(FieldType type) {
  switch (type) {
    case FieldType::uint8:
      return "|u1";
    case FieldType::float32:
      return "<f4";
    case FieldType::float64:
      return "<f8";
  }
  return "";
}

/// The array's description, with all that stands before it.
std::string header_text(const std::string& types, std::uint64_t points) {
  std::string text = fmt::format("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}{}",
                                 types, points, header_padding(points, ' '));
  const std::size_t before = kMagic.size() + sizeof(std::uint16_t);
  const std::size_t size = before + text.size() + 1;
  text.append((kAlignment - size % kAlignment) % kAlignment, ' ');
  text += '\n';
  if (text.size() > kTextLimit) {
    throw InvalidArgument(
        fmt::format("npy: a header of {} bytes, allowed up to {}: too many "
                    "common factors",
                    text.size(), kTextLimit));
  }
  const char length[] = {static_cast<char>(text.size() & 0xFF),
                         static_cast<char>(text.size() >> 8)};
  return std::string(kMagic) + std::string(length, sizeof length) + text;
}

std::unique_ptr<CloudWriter> create_npy(const std::string& path, const CloudHeader& header,
                                        const CloudWriterOptions&) {
  std::vector<PointField> fields = all_fields(header);
  std::string types;
  for (const PointField& field : fields) {
    types +=
        fmt::format("{}('{}', '{}')", types.empty() ? "" : ", ", field.name, npy_type(field.type));
  }
  return std::make_unique<RecordFile>(path, std::move(fields), [types](std::uint64_t points) {
    return header_text(types, points);
  });
}

}  // namespace

const CloudWriterFormat kNpyFormat = {"npy", ".npy", "structured array of numpy", create_npy};

}  // namespace risley::cloud
