// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/formats/record_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::cloud {
namespace {

/// Longest line of comment: the common PLY reader rply takes 1024 bytes.
constexpr std::size_t kNoteBytes = 900;

/// Largest possible end of a line at or before `end`: not within a character of several bytes
/// (UTF-8).
std::size_t character_end(std::string_view text, std::size_t end) {
  const auto continues = [&](std::size_t i) { return (text[i] & 0xC0) == 0x80; };
  std::size_t i = end;
  while (i > 0 && i < text.size() && continues(i)) --i;
  return i > 0 ? i : end;
}

void add_note(std::vector<std::string>& notes, std::string_view name, std::string_view value) {
  std::string line = fmt::format("{}: {}", name, value);
  for (char& c : line) {
    if (c == '\n' || c == '\r' || c == '\0') c = ' ';
  }
  std::string_view rest = line;
  while (rest.size() > kNoteBytes) {
    const std::size_t end = character_end(rest, kNoteBytes);
    notes.emplace_back(rest.substr(0, end));
    rest.remove_prefix(end);
  }
  notes.emplace_back(rest);
}

}  // namespace

SequentialFile::SequentialFile(const std::string& path)
    : output_(path), stream_(output_.temporary_path(), std::ios::binary) {
  check();
}

void SequentialFile::append(const void* bytes, std::size_t count) {
  stream_.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(count));
  check();
}

void SequentialFile::overwrite_beginning(std::string_view text) {
  stream_.seekp(0);
  append(text);
}

void SequentialFile::close() {
  stream_.close();
  check();
  output_.commit();
}

void SequentialFile::check() {
  if (stream_) return;
  throw FileError(output_.path(), {}, fmt::format("cannot be written: {}", std::strerror(errno)));
}

RecordFile::RecordFile(const std::string& path, std::vector<PointField> fields, HeaderText header)
    : packer_(std::move(fields)), header_(std::move(header)), file_(path) {
  file_.append(header_(0));
}

void RecordFile::write(const Points& points) {
  records_.resize(points.size() * packer_.record_bytes());
  packer_.pack(points, 0, points.size(), records_.data(), packer_.record_bytes());
  file_.append(records_.data(), records_.size());
  points_ += points.size();
}

void RecordFile::close() {
  file_.overwrite_beginning(header_(points_));
  file_.close();
}

std::string header_padding(std::uint64_t points, char fill) {
  constexpr std::size_t kDigits = std::numeric_limits<std::uint64_t>::digits10 + 1;
  return std::string(kDigits + 1 - fmt::formatted_size("{}", points), fill);
}

std::vector<std::string> header_notes(const CloudHeader& header,
                                      const std::vector<PointField>& fields) {
  std::vector<std::string> notes;
  add_note(notes, "sensor", header.sensor);
  if (!header.serial.empty()) add_note(notes, "serial", header.serial);
  add_note(notes, "frame", header.frame.text);
  if (!header.frame.wkt.empty()) add_note(notes, "coordinate_system", header.frame.wkt);
  add_note(notes, "time_reference", recordings::to_string(header.time_reference));
  for (const PointField& field : fields) {
    const std::string unit = field.unit();
    add_note(notes, field.name,
             unit.empty() ? field.note : fmt::format("[{}] {}", unit, field.note));
  }
  for (std::size_t i = 0; i < header.factors.size(); ++i) {
    const bool of_source = i + header.factors_of_source >= header.factors.size();
    add_note(notes, fmt::format("factor {}", i + 1),
             header.factors[i] + (of_source ? " (of one station's points)" : ""));
  }
  for (const auto& [name, value] : header.provenance) add_note(notes, name, value);
  return notes;
}

std::vector<PointField> pcl_fields(const CloudHeader& header) {
  if (header.frame.offset != std::array<double, 3>{}) {
    throw InvalidArgument(
        "this format holds coordinates as float32, which rounds those of a map to some decimetres, "
        "allowed las-1.4, laz, netcdf, csv, npy");
  }
  std::vector<PointField> fields = all_fields(header);
  const auto rename = [&fields](std::string_view from, std::string_view to, PointType type) {
    const auto field =
        std::ranges::find_if(fields, [from](const PointField& one) { return one.name == from; });
    field->name = to;
    field->type = type;
  };
  rename("X", "x", PointType::float32);
  rename("Y", "y", PointType::float32);
  rename("Z", "z", PointType::float32);
  rename("Intensity", "intensity", PointType::float32);
  rename("Time", "time", PointType::float64);
  return fields;
}

}  // namespace risley::cloud
