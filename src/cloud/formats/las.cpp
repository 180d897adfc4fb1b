// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/las_layout.hpp"

namespace risley::cloud {
namespace {

/// A LAS file without compression.
class LasWriter final : public CloudWriter {
 public:
  LasWriter(const std::string& path, las::Layout layout)
      : layout_(std::move(layout)),
        output_(path),
        file_(::open(output_.temporary_path().c_str(), O_WRONLY | O_CLOEXEC)) {
    if (file_ < 0) fail(0);
    const std::vector<std::uint8_t> head = layout_.head({});
    buffer_.resize(kBufferBytes + las::Layout::kBlock * layout_.record_bytes());
    std::copy(head.begin(), head.end(), buffer_.begin());
    used_ = head.size();
  }
  ~LasWriter() override {
    if (file_ >= 0) ::close(file_);
  }
  LasWriter(const LasWriter&) = delete;
  LasWriter& operator=(const LasWriter&) = delete;

  void write(const Points& points) override {
    check_sound();
    sound_ = false;  // unless all goes well
    for (std::size_t first = 0; first < points.size();) {
      const std::size_t rows = std::min(las::Layout::kBlock, points.size() - first);
      layout_.pack(points, first, rows, buffer_.data() + used_, summary_);
      used_ += rows * layout_.record_bytes();
      first += rows;
      if (used_ >= kBufferBytes) flush(kBufferBytes);
    }
    sound_ = true;
  }

  void close() override {
    if (file_ < 0) return;
    check_sound();
    sound_ = false;
    flush(used_);
    const std::vector<std::uint8_t> head = layout_.head(summary_);
    write_at(head.data(), head.size(), 0);
    if (::close(std::exchange(file_, -1)) != 0) fail(written_);
    output_.commit();
  }

 private:
  static constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

  [[noreturn]] void fail(std::uint64_t offset) const {
    throw FileError(output_.path(), {offset, {}},
                    fmt::format("cannot be written: {}", std::strerror(errno)));
  }

  void check_sound() const {
    if (sound_) return;
    throw FileError(output_.path(), {}, "is incomplete: points given before could not be written");
  }

  /// Writes the first bytes of the buffer and moves the others to its beginning.
  void flush(std::size_t count) {
    write_at(buffer_.data(), count, written_);
    written_ += count;
    std::copy(buffer_.data() + count, buffer_.data() + used_, buffer_.data());
    used_ -= count;
  }

  void write_at(const std::uint8_t* bytes, std::size_t count, std::uint64_t offset) const {
    while (count > 0) {
      const ssize_t done = ::pwrite(file_, bytes, count, static_cast<off_t>(offset));
      if (done < 0 && errno == EINTR) continue;
      if (done <= 0) fail(offset);
      bytes += done;
      count -= static_cast<std::size_t>(done);
      offset += static_cast<std::uint64_t>(done);
    }
  }

  las::Layout layout_;
  las::Summary summary_;
  io::OutputFile output_;
  int file_;
  bool sound_ = true;
  std::vector<std::uint8_t> buffer_;
  std::size_t used_ = 0;
  std::uint64_t written_ = 0;
};

template <las::Version kVersion>
std::unique_ptr<CloudWriter> create_las(const std::string& path, const CloudHeader& header,
                                        const CloudWriterOptions& options) {
  return std::make_unique<LasWriter>(path, las::Layout(kVersion, header, options));
}

}  // namespace

const CloudWriterFormat kLas14Format{"las-1.4", ".las",
                                     "LAS 1.4, point format 6, uncertainty as extra bytes",
                                     create_las<las::Version::las_1_4>};
const CloudWriterFormat kLas12Format{"las-1.2", ".las",
                                     "LAS 1.2, point format 1, uncertainty as extra bytes",
                                     create_las<las::Version::las_1_2>};

}  // namespace risley::cloud
