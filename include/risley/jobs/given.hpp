// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

namespace risley::sensors {
struct Sensor;
}
namespace risley::trajectories {
struct Mount;
struct Trajectory;
}  // namespace risley::trajectories

namespace risley::jobs {

/// Value of an option: a file by its path, a preset by its name, or an object in memory.
/// recordings::Source is the same for a recording.
template <class T>
class Given {
 public:
  Given() = default;
  // A path or a name converts to it.
  Given(std::string path) : name_(std::move(path)) {}        // NOLINT(google-explicit-constructor)
  Given(const char* path) : name_(path) {}                   // NOLINT(google-explicit-constructor)
  Given(const std::filesystem::path& path) : name_(path) {}  // NOLINT(google-explicit-constructor)

  /// @param name  for messages and reports, such as "sensor in memory"
  Given(std::shared_ptr<const T> value, std::string name)
      : name_(std::move(name)), value_(std::move(value)) {}

  /// The path, or the name of the object in memory.
  const std::string& name() const { return name_; }
  /// The object in memory; none for a path.
  const std::shared_ptr<const T>& value() const { return value_; }
  /// The path; empty for an object in memory.
  std::string path() const { return value_ ? std::string() : name_; }
  bool empty() const { return name_.empty() && !value_; }

 private:
  std::string name_;
  std::shared_ptr<const T> value_;
};

/// A preset by name, a preset or calibration file or its folder, or a sensor: see load_result().
using GivenSensor = Given<sensors::Sensor>;
/// A mount or its file: see mount_of().
using GivenMount = Given<trajectories::Mount>;
/// A trajectory or its file: see trajectory_of().
using GivenTrajectory = Given<trajectories::Trajectory>;

}  // namespace risley::jobs
