// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/sensor_recognition.hpp"
#include "risley/jobs/given.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// The preset of a calibration or plan where nothing names another.
inline constexpr const char* kUsualSensor = "mid-40";

/// Who says which sensor made a recording.
enum class ChosenBy {
  option,  ///< whoever asked
  file,    ///< the recording names it
  scan,    ///< no other built-in preset describes the shots as well
  guess,   ///< too few data to decide
};

/// "option", "file", "scan", "guess"
std::string to_string(ChosenBy chosen_by);

/// How well a preset describes the shots of a recording.
struct PresetMisfit {
  std::string preset;
  double misfit =
      0;  ///< rms of what its lines leave, or its optics where lines did not decide, rad
};

/// The sensor that made a recording, as far as it is known.
struct SensorChoice {
  sensors::Sensor sensor;
  ChosenBy chosen_by = ChosenBy::option;
  std::string words;  ///< why this one
  /// Whether the sensor describes the shots; empty if they are too few or this was not checked.
  std::optional<bool> fits;
  /// The sensor and the next best one, where the shots were asked.
  std::vector<PresetMisfit> misfits;
  std::vector<Warning> warnings;
  /// Why no sensor of these can have made it, where that shows before any is asked for: coordinates
  /// that are none of a sensor's frame, a field of view beyond theirs. The sensor is the usual one.
  std::string impossible;
  std::string beyond_reach;  ///< what is wrong with ranges that the sensor cannot measure, or empty
  int lines = 0;             ///< in the first shots (one more than the highest), 0 if not counted
  /// The times of the recording do not describe its scan, and shots that are counted at the rate of
  /// the sensor do.
  bool times_at_fault = false;
  /// Order in which its emitters fire where beams are counted.
  estimation::FiringOrder order;
  /// The recording's roll about the optical axis, rad; 0 where it is not known or small. And where
  /// that axis stands in the recording, roughly.
  double roll = 0;
  estimation::FrameTurn frame;
};

/// The first shots of a recording, up to damage, and what was found out about them.
struct FirstShots {
  estimation::AngleSeries head;  ///< every shot of the first second
  estimation::BeamSource beams = estimation::BeamSource::recorded;
  estimation::StartFindings found;
};

/// Chooses the sensor of a recording: the one that was asked for, that of the type which the file
/// names, or the built-in preset that describes the shots of the first second best, by speeds of
/// the rotors, how far the prisms bend and emitters together. Where times are missing, those of
/// the presets' shot rates are tried, and the answer is a guess; so is the preset with the smallest
/// field of view that holds the shots, where that is all there is. A type that the file names and
/// the shots contradict is kept, with a warning. Before any is asked, the shots must be those of a
/// scan. Where shots contradict the type, or no preset describes them, they are counted, too, to
/// see whether the times are at fault.
/// @param header  of the recording
/// @param given   sensor that was asked for
/// @param shots   gets the first ones, where they were looked at
/// @throws FileError, InvalidArgument, Cancelled
SensorChoice choose_sensor(const recordings::Source& source, const recordings::ReadOptions& reading,
                           const recordings::RecordingHeader& header,
                           const std::optional<sensors::Sensor>& given,
                           const Progress& progress = {}, FirstShots* shots = nullptr);

/// @throws InvalidArgument when the recording names more lines than the sensor has emitters
/// @throws FileError when no sensor can have made the recording
void require_possible(const SensorChoice& choice, const std::string& recording);

/// Commercial name of the sensor that made a recording; of several, each once.
std::string sensor_name(const recordings::RecordingHeader& header);
/// The same where the scan was asked too: "unknown" where nothing describes it.
std::string sensor_name(const SensorChoice& choice);

/// Every shot of a recording's first second, up to damage.
estimation::AngleSeries first_second(const recordings::Source& source,
                                     const recordings::ReadOptions& options,
                                     const Progress& progress = {});

/// The built-in preset of a type of sensors; empty where there is none.
/// @param device_type  as recordings::Device::type
std::optional<sensors::Sensor> preset_of_type(int device_type);

/// The sensor that was given; empty where none was. @throws as load_result()
std::optional<sensors::Sensor> given_sensor(const GivenSensor& given);

/// Parameters to hold: by name, at a value if there is one (SI units), at the sensor's otherwise.
using HeldParameters = std::vector<std::pair<std::string, std::optional<double>>>;

/// Sets the values of held parameters. @return their names
/// @throws InvalidArgument for unknown names, values out of bounds, and values of other parameters
///         than those of the prisms
std::vector<std::string> hold(const HeldParameters& held, sensors::Sensor& sensor);

}  // namespace risley::jobs
