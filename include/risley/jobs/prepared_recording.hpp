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

/// Treatment of shots with times that the rotors do not reveal.
enum class UntoldShots {
  left_out,  ///< they lose their directions
  guessed,   ///< they get times in their order
};

/// Properties of a recording to determine before its rows are used.
struct Preparation {
  /// Rows are needed in the sensor's frame, each with its shot's time; otherwise as recorded.
  bool sensor_frame = false;
  std::optional<sensors::Sensor> sensor = {};  ///< that was asked for
  UntoldShots untold = UntoldShots::left_out;
};

/// A recording that was opened once, with its properties: how to read its rows, and its sensor.
struct PreparedRecording {
  recordings::Source source;  ///< held open
  /// As requested, with the properties found: the rate of counted shots, emitters and their order,
  /// slips, places in packets, the pose by which rows are turned back.
  recordings::ReadOptions reading;
  std::unique_ptr<recordings::Reader> reader;  ///< as stated in its settings, at its first row
  std::optional<SensorChoice> choice;          ///< where the sensor was needed
  FirstShots first;                            ///< the properties when it was chosen
  std::vector<Warning> warnings;               ///< corrections of times, pose and sensor
  double time_uncertainty = 0;  ///< possible error of guessed times, s; 0: there are none
  bool turned_back = false;     ///< by a pose, stated or given, or a roll that was detected
  bool cut_mended = false;      ///< points were moved to the middle of their interval before
                                ///< truncation

  /// All so far, those of the reader first.
  std::vector<Warning> all_warnings() const {
    std::vector<Warning> all = reader->warnings();
    append(all, warnings);
    return all;
  }
  /// Throws for damage found during the preparation. @throws FileError
  void require_whole() const {
    if (const auto damage = source.damage()) throw FileError(*damage);
  }
  /// Frees the data needed only for the preparation, before all rows are read.
  void close_questions() {
    source = {};
    first = {};
  }
  /// Restarts at the first row.
  void read_again(const Progress& progress);
  /// The defect of a recording without times from which shots without a return were removed; empty
  /// if there is none. From its first shots if the sensor is unknown.
  std::string removed_shots_words(const Progress& progress) const;
  /// The sensor, chosen here unless it already was. @throws as choose_sensor()
  const SensorChoice& choose(const std::optional<sensors::Sensor>& given, const Progress& progress);
};

/// Opens a recording and determines how to read it.
///
/// If packets lack points, the firing times of their shots are determined, which needs the sensor.
///
/// For the sensor's frame its sensor is chosen, and the meaning of a pose in its header is decided
/// unless the options give one: the first second of shots shows whether the points were moved by it
/// (see estimation/stored_pose.hpp), and if it does not, a recording made through a hub counts as
/// moved, because hubs move points, and any other one does not, because LVX keeps points unchanged.
/// Moved points are turned back. If emitters show that the recording is rolled about the optical
/// axis, and no pose states it, it is turned back.
///
/// If times are counted, here or evidently by the writer of the file (each row of a file without
/// packets follows the one before it by the same time), the rotors are followed to find slips of
/// the count and, if the file does not state which of a sensor's emitters fired, the order in which
/// they do: see estimation/shot_slips.hpp. Both are mended. Such a recording is read twice, with
/// all of its directions in memory. Shots of a recording whose times are all the same are counted
/// at the rate of its sensor if that is given or named by the file; so are those whose times
/// choose_sensor() finds to be wrong.
/// @throws FileError, for a trajectory too; InvalidArgument; EstimationError if counted shots lack
/// those without a return, or almost no shot of a packet has a place; recordings::MissingTimes;
/// Cancelled
PreparedRecording prepare_recording(const recordings::Source& source,
                                    const recordings::ReadOptions& reading,
                                    const Preparation& wishes, const Progress& progress);

/// "yaw 90 pitch -2.25 roll 1.5 deg, translation 0.1 0.2 -0.3 m"
std::string pose_text(const recordings::Extrinsics& pose);

}  // namespace risley::jobs
