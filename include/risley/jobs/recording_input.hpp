// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/packed_series.hpp"
#include "risley/estimation/shot_slips.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/extrinsics.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/time_audit.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// A recording of single shots with times whose rows stand in its sensor's frame, as far as that is
/// known.
struct SensorFrameRecording {
  std::unique_ptr<recordings::Reader> reader;
  SensorChoice choice;  ///< its warnings are among these:
  /// Of the sensor, and what was done about poses, rolls and the count of shots.
  std::vector<std::string> warnings;
  bool turned_back = false;  ///< by a pose, stated or given, or a roll that was found
  bool cut_mended = false;   ///< points were moved to the middle of where they were before a cut
};

/// Opens a recording and decides what a pose in its header means where the options do not give one:
/// the first second of the shots tells whether the points were moved by it (see
/// estimation/stored_pose.hpp), and where they do not tell, a recording made through a hub counts
/// as moved, because hubs move points, and any other one does not, because LVX keeps points as they
/// are. Moved points are turned back.
///
/// Chooses the sensor, too. Where emitters show that the recording is rolled about the optical
/// axis, and no pose says so, it is turned back by that.
///
/// Where times are counted, here or evidently by who wrote the file (each row of a file without
/// packets follows the one before it by the same time), the rotors are followed to find slips of
/// the count and, where the file does not tell which of a sensor's emitters fired, the order in
/// which they do: see estimation/shot_slips.hpp. Both are mended. Such a recording is read twice,
/// and all of its directions are held in memory meanwhile.
/// Shots of a recording whose times are all the same are counted at the rate of its sensor where
/// that is given or named by the file; so are those whose times choose_sensor() finds at fault.
/// @param given  sensor that was asked for, see choose_sensor()
/// @throws recordings::MissingTimes; EstimationError where counted shots lack those without a
///         return; Cancelled, and as recordings::open_recording, choose_sensor()
SensorFrameRecording open_in_sensor_frame(const recordings::Source& source,
                                          const recordings::ReadOptions& reading,
                                          const std::optional<sensors::Sensor>& given,
                                          const Progress& progress = {});

/// One recording that was read to its end.
struct ReadRecording {
  std::string path;  ///< as recordings::Source::name()
  recordings::RecordingHeader header;
  recordings::TimeAuditResult audit;

  /// Of the sensor; empty when unknown.
  const std::string& serial() const { return header.devices.front().serial; }
};

/// What is to be read for an estimation.
struct EstimationInputOptions {
  recordings::Source recording;     ///< of one sensor, with times
  recordings::ReadOptions reading;  ///< see open_in_sensor_frame() where it holds no extrinsics
  std::string sensor;               ///< as given_sensor()
  estimation::SelectionOptions selection;  ///< ranges of whole steps are kept all the same
};

/// What reading a recording leaves for an estimation.
struct EstimationInput {
  ReadRecording recording;
  SensorChoice choice;
  estimation::PackedSeries series;  ///< the chosen shots, in the sensor's frame
  estimation::AngleSeries head;     ///< every shot of the first second
  estimation::SelectionCounts counts;
  std::vector<std::string> warnings;  ///< of the reader, about frame, sensor and clock
  bool whole_steps = false;           ///< directions come from coordinates in whole steps
  double reading_time = 0;            ///< s
};

/// Reads all of a recording of one sensor in the sensor's frame.
/// @throws InvalidArgument for a recording of several sensors; as open_in_sensor_frame(); FileError
///         at damage
EstimationInput read_for_estimation(const EstimationInputOptions& options,
                                    const Progress& progress = {});

/// What is wrong with a count of shots where those without a return were removed; empty where they
/// were not. @param emitters  of the sensor, which fire in turn
std::string removed_shots_words(const estimation::CountedShots& shots, int emitters);

/// The first shots of a recording without times, which tell whether others were removed.
class UntimedShots {
 public:
  /// Takes the next rows of the recording.
  void add(const recordings::Observations& rows) { selector_.add(rows); }
  /// Whether there are enough to tell.
  bool enough() const { return selector_.rows().size() >= kMost; }
  /// As removed_shots_words(), of a sensor that nobody knows. Leaves no shot here.
  std::string removed_words();

 private:
  static constexpr std::size_t kMost = 100'000;
  estimation::ShotSelector selector_{{.rate = std::nullopt, .ranges = false, .rows = true}};
};

/// Says which shots were left out because their times do not tell when they were fired.
void add_left_out_words(const estimation::SelectionCounts& counts, std::vector<std::string>& words);

/// A warning of a reader with its place: "... (at byte 17)", "... (line 3)".
std::string warning_text(const recordings::ReadWarning& warning);

/// "yaw 90 pitch -2.25 roll 1.5 deg, translation 0.1 0.2 -0.3 m"
std::string pose_text(const recordings::Extrinsics& pose);

}  // namespace risley::jobs
