// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Points as text, one line each. Numbers have the fewest digits that give the same number of their
// type again (of 32 bits except for time and coordinates); unknown values are nan.
#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/compile.h>
#include <fmt/format.h>

#include "risley/io/little_endian.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

constexpr std::size_t kBufferBytes = 1 << 20;

class TextWriter final : public CloudWriter {
 public:
  TextWriter(const std::string& path, std::vector<PointField> fields, const std::string& head,
             char separator)
      : packer_(std::move(fields)), separator_(separator), file_(path) {
    file_.append(head);
  }

  void write(const Points& points) override {
    const std::size_t stride = packer_.record_bytes();
    records_.resize(points.size() * stride);
    packer_.pack(points, 0, points.size(), records_.data(), stride);
    for (std::size_t i = 0; i < points.size(); ++i) {
      print_record(records_.data() + i * stride);
      if (text_.size() >= kBufferBytes) flush();
    }
    flush();
  }

  void close() override { file_.close(); }

 private:
  void print_record(const std::uint8_t* record) {
    for (std::size_t k = 0; k < packer_.fields().size(); ++k) {
      if (k > 0) text_.push_back(separator_);
      const std::uint8_t* number = record + packer_.offset(k);
      with_number_type(packer_.fields()[k].type, [&]<class T>() {
        T value = io::load<T>(number);
        if constexpr (std::is_floating_point_v<T>) {
          if (std::isnan(value)) value = std::abs(value);  // never "-nan"
        }
        fmt::format_to(std::back_inserter(text_), FMT_COMPILE("{}"), value);
      });
    }
    text_.push_back('\n');
  }

  void flush() {
    file_.append(text_.data(), text_.size());
    text_.clear();
  }

  RecordPacker packer_;
  char separator_;
  SequentialFile file_;
  std::vector<std::uint8_t> records_;
  fmt::memory_buffer text_;
};

/// "StdX_m": names include their units.
std::unique_ptr<CloudWriter> create_csv(const std::string& path, const CloudHeader& header,
                                        const CloudWriterOptions&) {
  std::vector<PointField> fields = all_fields(header);
  std::string head;
  for (const PointField& field : fields) {
    if (!head.empty()) head += ',';
    head += field.name;
    const std::string unit = names_of(field.column->unit).suffix;
    if (!unit.empty()) head += "_" + unit;
  }
  return std::make_unique<TextWriter>(path, std::move(fields), head + '\n', ',');
}

/// The intensity follows the coordinates, as most readers of .xyz expect, and the names are in a
/// comment from which CloudCompare names its scalar fields.
std::unique_ptr<CloudWriter> create_xyz(const std::string& path, const CloudHeader& header,
                                        const CloudWriterOptions&) {
  std::vector<PointField> fields = all_fields(header);
  const auto fourth = fields.begin() + 3;
  const auto intensity = std::find_if(
      fourth, fields.end(), [](const PointField& field) { return field.name == "Intensity"; });
  std::rotate(fourth, intensity, intensity + 1);
  std::string head;
  for (const PointField& field : fields) head += (head.empty() ? "//" : " ") + field.name;
  return std::make_unique<TextWriter>(path, std::move(fields), head + '\n', ' ');
}

}  // namespace

const CloudWriterFormat kCsvFormat = {"csv", ".csv", "text, comma-separated, names with units",
                                      create_csv};
const CloudWriterFormat kXyzFormat = {"xyz", ".xyz", "text, separated by spaces, for CloudCompare",
                                      create_xyz};

}  // namespace risley::cloud
