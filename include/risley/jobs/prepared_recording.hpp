// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/extrinsics.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::jobs {

/// What happens to shots whose times the rotors do not reveal.
enum class UntoldShots {
  left_out,  ///< they lose their directions
  guessed,   ///< they get times in their order
};

/// What is to be found out about a recording before its rows are used.
struct Preparation {
  /// Rows are wanted in the sensor's frame, each with its shot's time; otherwise as recorded.
  bool sensor_frame = false;
  std::optional<sensors::Sensor> sensor = {};  ///< that was asked for
  UntoldShots untold = UntoldShots::left_out;
};

/// A recording that was opened once, with all that was found out about it: how its rows are to be
/// read, and the sensor that made it.
struct PreparedRecording {
  recordings::Source source;  ///< held open
  /// As asked for, and with what was found: the rate of shots that are counted, emitters and their
  /// order, slips, places in packets, the pose by which rows are turned back.
  recordings::ReadOptions reading;
  std::unique_ptr<recordings::Reader> reader;  ///< as reading says, at its first row
  std::optional<SensorChoice> choice;          ///< where the sensor was needed
  FirstShots first;                            ///< as they were when it was chosen
  std::vector<Warning> warnings;               ///< what was done about times, pose and sensor
  double time_uncertainty = 0;  ///< by which guessed times may be off, s; 0: there are none
  bool turned_back = false;     ///< by a pose, stated or given, or a roll that was found
  bool cut_mended = false;      ///< points were moved to the middle of where they were before a cut

  /// All so far, those of the reader first.
  std::vector<Warning> all_warnings() const {
    std::vector<Warning> all = reader->warnings();
    append(all, warnings);
    return all;
  }
  /// Refuses damage that was met while questions were answered. @throws FileError
  void require_whole() const {
    if (const auto damage = source.damage()) throw FileError(*damage);
  }
  /// Leaves what only questions need, before all rows are read.
  void close_questions() {
    source = {};
    first = {};
  }
  /// Begins at the first row again.
  void read_again(const Progress& progress);
  /// What is wrong with the shots of a recording without times where those without a return were
  /// removed; empty where they were not. From its first shots if the sensor is unknown.
  std::string removed_shots_words(const Progress& progress) const;
  /// The sensor, chosen here unless it was before. @throws as choose_sensor()
  const SensorChoice& choose(const std::optional<sensors::Sensor>& given, const Progress& progress);
};

/// Opens a recording and finds out how it is to be read.
///
/// Where packets lack points, it is found when their shots were fired, which needs the sensor.
///
/// For the sensor's frame its sensor is chosen, and it is decided what a pose in its header means
/// where the options do not give one: the first second of shots shows whether the points were
/// moved by it (see estimation/stored_pose.hpp), and where it does not, a recording made
/// through a hub counts as moved, because hubs move points, and any other one does not, because LVX
/// keeps points as they are. Moved points are turned back. Where emitters show that the recording
/// is rolled about the optical axis, and no pose says so, it is turned back.
///
/// Where times are counted, here or evidently by the writer of the file (each row of a file without
/// packets follows the one before it by the same time), the rotors are followed to find slips of
/// the count and, where the file does not say which of a sensor's emitters fired, the order in
/// which they do: see estimation/shot_slips.hpp. Both are mended. Such a recording is read twice,
/// and all of its directions are held in memory meanwhile. Shots of a recording whose times are all
/// the same are counted at the rate of its sensor where that is given or named by the file; so are
/// those whose times choose_sensor() finds at fault.
/// @throws FileError, for a trajectory too; InvalidArgument; EstimationError where counted shots
///         lack those without a return, or next to no shot of a packet has a place;
///         recordings::MissingTimes; Cancelled
PreparedRecording prepare_recording(const recordings::Source& source,
                                    const recordings::ReadOptions& reading,
                                    const Preparation& wishes, const Progress& progress);

/// "yaw 90 pitch -2.25 roll 1.5 deg, translation 0.1 0.2 -0.3 m"
std::string pose_text(const recordings::Extrinsics& pose);

}  // namespace risley::jobs
