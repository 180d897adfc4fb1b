// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "recordings/formats/las_points.hpp"

#ifdef RISLEY_HAS_LASZIP

#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>

#include <laszip/laszip_api.h>

#include "risley/io/little_endian.hpp"

namespace risley::recordings::las {
namespace {

using io::load;

/// Points that LASzip unpacks one by one. It reads the header again, which has been checked.
class LazPoints final : public PointSource {
 public:
  LazPoints(io::BlockInput input, const PublicHeader& header, std::vector<Warning>& warnings)
      : path_(input.path()), header_(header), size_(input.size()) {
    if (header_.points == 0 && size_ > header_.points_at + sizeof(std::int64_t)) {
      warnings.push_back({kWarning.content_left_out,
                          "the header says that there are 0 points; the data after it were ignored",
                          {header_.points_at, {}}});
    }
    if (header_.points > 0) check_chunk_table(input);
    stream_.open(input.file().name_for_libraries(), std::ios::binary);
    if (!stream_) fail({}, fmt::format("cannot be read: {}", std::strerror(errno)));
    if (laszip_create(&laszip_) != 0) fail({}, "cannot be read: LASzip could not be started");
    try {
      open();
    } catch (...) {
      release();
      throw;
    }
  }
  ~LazPoints() override { release(); }
  LazPoints(const LazPoints&) = delete;
  LazPoints& operator=(const LazPoints&) = delete;

  std::size_t read(std::span<Point> points) override {
    if (failure_) throw FileError(*failure_);
    std::size_t done = 0;
    for (; done < points.size() && next_ < header_.points; ++done, ++next_) {
      if (laszip_read_point(laszip_) != 0) {
        failure_.emplace(path_, place(),
                         fmt::format("point {} of {} cannot be unpacked: LASzip: {}", next_ + 1,
                                     header_.points, problem()));
        break;
      }
      points[done] = unpacked();
    }
    if (done == 0 && failure_) throw FileError(*failure_);
    return done;
  }

  FilePlace gps_time_place(std::uint64_t) const override { return {}; }  // no byte of its own

  double fraction_read() const override {
    return header_.points == 0 ? 1.0
                               : static_cast<double>(next_) / static_cast<double>(header_.points);
  }

 private:
  /// LASzip allocates memory for as many chunks as the table states: each begins with a whole
  /// point.
  void check_chunk_table(io::BlockInput& input) const {
    constexpr std::uint64_t kTableHeaderBytes = 8;
    if (size_ - header_.points_at < sizeof(std::int64_t)) {
      fail(
          {size_, {}},
          fmt::format("expected the place of the chunk table at byte {}, found the end of the file",
                      header_.points_at));
    }
    const auto place = load<std::int64_t>(input.at(header_.points_at, sizeof(std::int64_t)));
    if (place == -1) return;  // at the end of the file, where LASzip finds it
    const auto table = static_cast<std::uint64_t>(place);
    if (place < 0 || table < header_.points_at || table > size_ ||
        size_ - table < kTableHeaderBytes) {
      fail({header_.points_at, {}}, fmt::format("expected the chunk table between byte {} and the "
                                                "end of the file at byte {}, found byte {}",
                                                header_.points_at, size_, place));
    }
    const std::uint64_t chunks = load<std::uint32_t>(input.at(table + 4, 4));
    if (chunks * header_.record_bytes > size_) {
      fail({table + 4, {}},
           fmt::format("expected at most {} chunks in a file of {} bytes, found {}",
                       size_ / header_.record_bytes, size_, chunks));
    }
  }

  void open() {
    laszip_BOOL compressed = 0;
    if (laszip_open_reader_stream(laszip_, stream_, &compressed) != 0) {
      fail(place(), fmt::format("cannot be unpacked: LASzip: {}", problem()));
    }
    open_ = true;
    if (laszip_get_point_pointer(laszip_, &point_) != 0) {
      fail({}, fmt::format("cannot be unpacked: LASzip: {}", problem()));
    }
    const std::size_t base = kRecordBytes[static_cast<std::size_t>(header_.point_format)];
    if (point_->num_extra_bytes < 0 ||
        static_cast<std::size_t>(point_->num_extra_bytes) != header_.record_bytes - base) {
      fail({},
           fmt::format("expected {} extra bytes per point, as the header says, LASzip unpacks {}",
                       header_.record_bytes - base, point_->num_extra_bytes));
    }
  }

  void release() {
    if (open_) laszip_close_reader(laszip_);
    open_ = false;
    if (laszip_ != nullptr) laszip_destroy(laszip_);
    laszip_ = nullptr;
  }

  Point unpacked() const {
    const laszip_point_struct& from = *point_;
    Point point;
    point.steps = {from.X, from.Y, from.Z};
    point.intensity = from.intensity;
    if (is_modern(header_.point_format)) {
      point.return_number = from.extended_return_number;
      point.number_of_returns = from.extended_number_of_returns;
      point.beam = from.extended_scanner_channel;
    } else {
      point.return_number = from.return_number;
      point.number_of_returns = from.number_of_returns;
    }
    if (gps_time_at(header_.point_format)) point.gps_time = from.gps_time;
    const std::size_t base = kRecordBytes[static_cast<std::size_t>(header_.point_format)];
    if (header_.tag_at) point.tag = from.extra_bytes[*header_.tag_at - base];
    if (header_.beam_at) point.beam = from.extra_bytes[*header_.beam_at - base];
    return point;
  }

  /// Approximate position of LASzip in the file.
  FilePlace place() {
    stream_.clear();
    const auto at = static_cast<std::streamoff>(stream_.tellg());
    return {at < 0 ? size_ : static_cast<std::uint64_t>(at), {}};
  }

  std::string problem() const {
    laszip_CHAR* text = nullptr;
    const bool known = laszip_get_error(laszip_, &text) == 0 && text != nullptr;
    return known ? text : "no message";
  }

  [[noreturn]] void fail(FilePlace place, const std::string& problem) const {
    throw FileError(path_, place, problem);
  }

  std::string path_;
  PublicHeader header_;
  std::uint64_t size_;
  std::ifstream stream_;
  laszip_POINTER laszip_ = nullptr;
  laszip_point_struct* point_ = nullptr;
  bool open_ = false;  ///< LASzip's reader
  std::uint64_t next_ = 0;
  std::optional<FileError> failure_;
};

}  // namespace

std::unique_ptr<PointSource> open_compressed_points(io::BlockInput input,
                                                    const PublicHeader& header,
                                                    std::vector<Warning>& warnings) {
  return std::make_unique<LazPoints>(std::move(input), header, warnings);
}

}  // namespace risley::recordings::las

#else

namespace risley::recordings::las {

std::unique_ptr<PointSource> open_compressed_points(io::BlockInput input,
                                                    const PublicHeader& /*header*/,
                                                    std::vector<Warning>& /*warnings*/) {
  const io::BlockInput own = std::move(input);
  throw FileError(
      own.path(), {kPointFormatAt, {}},
      "is compressed by LASzip, and this build has no LASzip, because Debian 12 does not package "
      "it. Build with liblaszip-dev (Debian 13), or convert the file to LAS "
      "with another program (laszip, PDAL, laspy)");
}

}  // namespace risley::recordings::las

#endif
