// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <utility>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/io/little_endian.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/las_layout.hpp"

namespace risley::cloud {
namespace {

/// A LAS file without compression.
class LasWriter final : public CloudWriter {
 public:
  LasWriter(const std::string& path, las::Layout layout)
      : layout_(std::move(layout)), output_(path) {
    const std::vector<std::uint8_t> head = layout_.head({});
    std::ranges::copy(head, output_.append(head.size()));
  }

  void write(const Points& points) override {
    for (std::size_t first = 0; first < points.size();) {
      const std::size_t rows = std::min(las::Layout::kBlock, points.size() - first);
      layout_.pack(points, first, rows, output_.append(rows * layout_.record_bytes()), summary_);
      first += rows;
    }
  }

  void close() override {
    // Only the public header depends on the points; its last eight bytes may overlap those before.
    const std::vector<std::uint8_t> head = layout_.head(summary_);
    for (std::size_t at = 0; at < layout_.header_bytes(); at += 8) {
      const std::size_t offset = std::min(at, layout_.header_bytes() - 8);
      output_.patch_u64(offset, io::load<std::uint64_t>(head.data() + offset));
    }
    output_.commit();
  }

 private:
  las::Layout layout_;
  las::Summary summary_;
  io::BlockOutput output_;
};

}  // namespace

const CloudWriterFormat kLasFormat{
    "las-1.4", ".las", "LAS 1.4, point format 6, uncertainty as extra bytes",
    [](const std::string& path, const CloudHeader& header,
       const CloudWriterOptions& options) -> std::unique_ptr<CloudWriter> {
      return std::make_unique<LasWriter>(path, las::Layout(header, options));
    }};

}  // namespace risley::cloud
