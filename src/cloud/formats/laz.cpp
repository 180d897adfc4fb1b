// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#ifdef RISLEY_HAS_LASZIP

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <laszip/laszip_api.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/output_file.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/las_layout.hpp"

namespace risley::cloud {
namespace {

using io::load;

/// LAS 1.4 compressed by LASzip. The records are those of the uncompressed format; LASzip takes
/// them apart again, which costs little beside its compression.
class LazWriter final : public CloudWriter {
 public:
  LazWriter(const std::string& path, las::Layout layout)
      : layout_(std::move(layout)),
        output_(path),
        stream_(output_.temporary_path(), std::ios::binary | std::ios::trunc),
        block_(las::Layout::kBlock * layout_.record_bytes()) {
    if (!stream_) fail_to_write();
    if (laszip_create(&laszip_) != 0) {
      throw FileError(output_.path(), {}, "cannot be written: LASzip cannot be set up");
    }
    try {
      open();
    } catch (...) {
      if (open_) laszip_close_writer(laszip_);
      laszip_destroy(laszip_);
      throw;
    }
  }
  ~LazWriter() override {
    if (open_) laszip_close_writer(laszip_);
    laszip_destroy(laszip_);
  }
  LazWriter(const LazWriter&) = delete;
  LazWriter& operator=(const LazWriter&) = delete;

  void write(const Points& points) override {
    for (std::size_t first = 0; first < points.size();) {
      const std::size_t rows = std::min(las::Layout::kBlock, points.size() - first);
      layout_.pack(points, first, rows, block_.data(), summary_);
      for (std::size_t i = 0; i < rows; ++i) write_record(&block_[i * layout_.record_bytes()]);
      first += rows;
    }
    if (!stream_) fail_to_write();
  }

  void close() override {
    open_ = false;
    check(laszip_close_writer(laszip_));
    write_summary();
    stream_.close();
    if (!stream_) fail_to_write();
    output_.commit();
  }

 private:
  void open() {
    laszip_header_struct* header = nullptr;
    check(laszip_get_header_pointer(laszip_, &header));
    header->file_source_ID = 1;
    header->global_encoding = layout_.global_encoding();
    header->version_major = 1;
    header->version_minor = 4;
    put_text(header->system_identifier, layout_.system_identifier());
    put_text(header->generating_software, layout_.generating_software());
    header->file_creation_day = 0;
    header->file_creation_year = 0;
    header->header_size = static_cast<laszip_U16>(layout_.header_bytes());
    header->offset_to_point_data = header->header_size;  // without compression; records add to it
    header->point_data_format = layout_.point_format();
    header->point_data_record_length = static_cast<laszip_U16>(layout_.record_bytes());
    header->x_scale_factor = header->y_scale_factor = header->z_scale_factor = layout_.scale();
    header->x_offset = layout_.offset()[0];
    header->y_offset = layout_.offset()[1];
    header->z_offset = layout_.offset()[2];
    for (const las::VariableLengthRecord& record : layout_.records()) {
      check(laszip_add_vlr(laszip_, record.user.c_str(), record.number,
                           static_cast<laszip_U16>(record.data.size()), record.description.c_str(),
                           reinterpret_cast<const laszip_U8*>(record.data.data())));
    }
    check(laszip_preserve_generating_software(laszip_, 1));
    check(laszip_request_native_extension(laszip_, 1));
    constexpr laszip_BOOL kCompress = 1, kWithoutHeader = 0;
    check(laszip_open_writer_stream(laszip_, stream_, kCompress, kWithoutHeader));
    open_ = true;
    check(laszip_get_point_pointer(laszip_, &point_));
    const auto extra = layout_.record_bytes() - layout_.base_record_bytes();
    if (point_->num_extra_bytes != static_cast<laszip_I32>(extra)) {
      throw FileError(output_.path(), {},
                      fmt::format("cannot be written: LASzip has room for {} extra bytes of {}",
                                  point_->num_extra_bytes, extra));
    }
  }

  template <std::size_t kLength>
  static void put_text(laszip_CHAR (&field)[kLength], std::string_view text) {
    std::memset(field, 0, kLength);
    std::memcpy(field, text.data(), std::min(text.size(), kLength));
  }

  void write_record(const std::uint8_t* record) {
    laszip_point_struct& point = *point_;
    point.X = load<laszip_I32>(record);
    point.Y = load<laszip_I32>(record + 4);
    point.Z = load<laszip_I32>(record + 8);
    point.intensity = load<laszip_U16>(record + 12);
    const unsigned number = record[14] & 15U, returns = record[14] >> 4U;
    point.extended_point_type = 1;
    point.extended_return_number = number & 15U;
    point.extended_number_of_returns = returns & 15U;
    // LASzip requires consistent legacy fields.
    point.return_number = std::min(number, 7U) & 7U;
    point.number_of_returns = std::min(returns, 7U) & 7U;
    point.point_source_ID = load<laszip_U16>(record + 20);
    point.gps_time = load<laszip_F64>(record + 22);
    const std::size_t base = layout_.base_record_bytes();
    std::memcpy(point.extra_bytes, record + base, layout_.record_bytes() - base);
    check(laszip_write_point(laszip_));
  }

  /// Fills in the header's statistics of the points, LAS 1.4. LASzip's own inventory counts with 32
  /// bits.
  void write_summary() {
    const las::HeaderNumbers numbers = layout_.numbers(summary_);
    put_at(90, numbers.creation_day);
    put_at(92, numbers.creation_year);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      put_at(179 + 16 * axis, numbers.high[axis]);
      put_at(187 + 16 * axis, numbers.low[axis]);
    }
    put_at(247, summary_.points);
    for (std::size_t k = 0; k < summary_.points_by_return.size(); ++k) {
      put_at(255 + 8 * k, summary_.points_by_return[k]);
    }
  }

  template <class T>
  void put_at(std::size_t offset, T number) {
    std::uint8_t bytes[sizeof(T)];
    io::store<T>(bytes, number);
    stream_.seekp(static_cast<std::streamoff>(offset));
    stream_.write(reinterpret_cast<const char*>(bytes), sizeof(T));
  }

  void check(laszip_I32 failed) const {
    if (failed == 0) return;
    if (!stream_) fail_to_write();
    laszip_CHAR* problem = nullptr;
    const bool known = laszip_get_error(laszip_, &problem) == 0 && problem != nullptr;
    throw FileError(output_.path(), {},
                    fmt::format("cannot be written: LASzip: {}", known ? problem : "no message"));
  }

  [[noreturn]] void fail_to_write() const {
    throw FileError(output_.path(), {}, fmt::format("cannot be written: {}", std::strerror(errno)));
  }

  las::Layout layout_;
  las::Summary summary_;
  io::OutputFile output_;
  std::ofstream stream_;
  std::vector<std::uint8_t> block_;
  laszip_POINTER laszip_ = nullptr;
  laszip_point_struct* point_ = nullptr;
  bool open_ = false;  ///< LASzip's writer
};

}  // namespace

const CloudWriterFormat kLazFormat{
    "laz", ".laz", "LAS 1.4 compressed by LASzip",
    [](const std::string& path, const CloudHeader& header,
       const CloudWriterOptions& options) -> std::unique_ptr<CloudWriter> {
      return std::make_unique<LazWriter>(path, las::Layout(header, options));
    }};

}  // namespace risley::cloud

#endif
