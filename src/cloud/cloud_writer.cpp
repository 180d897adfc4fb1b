// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/cloud_writer.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/optics/prism.hpp"

#include "cloud/entry_checks.hpp"
#include "cloud/formats/cloud_format.hpp"

namespace risley::cloud {
namespace {

/// A writer of any format that gets points as announced in the cloud's header, and nothing more
/// once it has failed or was closed.
class CheckedWriter final : public CloudWriter {
 public:
  CheckedWriter(std::unique_ptr<CloudWriter> writer, std::string path, CloudHeader header)
      : writer_(std::move(writer)), path_(std::move(path)), header_(std::move(header)) {}

  void write(const Points& points) override {
    require_columns(points, header_, points.size());
    require_sound();
    sound_ = false;  // unless all goes well
    writer_->write(points);
    sound_ = true;
  }
  void close() override {
    if (closed_) return;
    require_sound();
    sound_ = false;
    writer_->close();
    closed_ = true;
  }

 private:
  void require_sound() const {
    if (sound_) return;
    throw FileError(path_, {}, "is incomplete: earlier points could not be written");
  }

  std::unique_ptr<CloudWriter> writer_;
  std::string path_;
  CloudHeader header_;
  bool sound_ = true, closed_ = false;
};

}  // namespace

const std::vector<CloudFormat>& cloud_formats() {
  static const std::vector<CloudFormat> formats = [] {
    std::vector<CloudFormat> list;
    for (const CloudWriterFormat* format : all_cloud_formats()) {
      list.push_back({std::string(format->name), std::string(format->ending),
                      std::string(format->description)});
    }
    return list;
  }();
  return formats;
}

const CloudFormat& find_cloud_format(const std::string& path, const std::string& format) {
  const std::string name = lower_case(path);
  std::string known;
  for (const CloudFormat& one : cloud_formats()) {
    if (format.empty() ? name.ends_with(one.ending) : one.name == format) return one;
    const std::string& word = format.empty() ? one.ending : one.name;
    if (!known.ends_with(word)) known += fmt::format("{}{}", known.empty() ? "" : ", ", word);
  }
  if (!format.empty()) throw InvalidArgument(fmt::format("format = {}, allowed {}", format, known));
#ifndef RISLEY_HAS_LASZIP
  if (name.ends_with(".laz")) {
    throw InvalidArgument(
        fmt::format("{}: this build has no LASzip (Debian 13 has it), allowed {}", path, known));
  }
#endif
  throw InvalidArgument(fmt::format("{}: unknown ending, allowed {}", path, known));
}

std::unique_ptr<CloudWriter> create_cloud(const std::string& path, const CloudHeader& header,
                                          const CloudWriterOptions& options) {
  require_between("number of prisms", header.prisms, 1, kMaxPrisms);
  const CloudFormat& found = find_cloud_format(path, options.format);
  const auto& formats = all_cloud_formats();
  const auto it = std::ranges::find_if(
      formats, [&found](const auto* format) { return format->name == found.name; });
  return std::make_unique<CheckedWriter>((*it)->create(path, header, options), path, header);
}

}  // namespace risley::cloud
