// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "risley/bags/bag.hpp"
#include "risley/cloud/cloud_writer.hpp"
#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"

namespace risley::cloud {

/// Receives the points of a lidar's topic (of CloudMaker, with CloudHeader::has_row) and rewrites
/// its bag with these coordinates in the messages of the topic, and everything else unchanged.
/// Messages of all topics keep their bytes, times and order; of the lidar's, only the coordinates
/// change. Points without a return stay unchanged, and those without a direction become shots
/// without a return: 0, 0, 0. Memory does not grow with the bag.
class RectifiedBag final : public CloudWriter {
 public:
  /// @param input  the bag to read, a file or a folder
  /// @param topic   of the lidar
  /// @param output  path of the new bag
  /// @param kind    of the new bag
  /// @throws InvalidArgument for a bag without the topic, and when the new bag cannot hold the
  /// contents of the old one; FileError
  RectifiedBag(const std::string& input, const std::string& topic, const std::string& output,
               bags::BagKind kind, const Progress& progress = {});
  ~RectifiedBag() override;

  /// @throws InvalidArgument also when the points do not match the messages one by one: rows were
  /// reordered, or several lidars share the topic
  void write(const Points& points) override;
  void close() override;

  /// Damage of the old bag; the part before it is in the new one.
  const std::optional<FileError>& damage() const;

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

}  // namespace risley::cloud
