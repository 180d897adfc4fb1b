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

/// The default preset of a calibration or plan.
inline constexpr const char* kUsualSensor = "mid-40";

/// How the sensor of a recording was chosen.
enum class ChosenBy {
  option,  ///< the caller named it
  file,    ///< the recording names it
  scan,    ///< no other built-in preset fits the shots as well
  guess,   ///< too few data to decide
};

/// "option", "file", "scan", "guess"
std::string to_string(ChosenBy chosen_by);

/// Fit of a preset to the shots of a recording.
struct PresetMisfit {
  std::string preset;
  double misfit =
      0;  ///< rms of the residuals of its lines, or of its optics if lines did not decide, rad
};

/// The sensor of a recording, with everything known about it.
struct SensorChoice {
  sensors::Sensor sensor;
  ChosenBy chosen_by = ChosenBy::option;
  std::string words;  ///< why this one
  /// Whether the sensor fits the shots; empty if they are too few or this was not checked.
  std::optional<bool> fits;
  /// The sensor and the next best one, if the shots were used.
  std::vector<PresetMisfit> misfits;
  std::vector<Warning> warnings;
  /// Reason why none of these sensors can be the source, if that is clear without trying them:
  /// coordinates that are not in a sensor's frame, a field of view beyond theirs. The sensor is the
  /// default one.
  std::string impossible;
  std::string beyond_reach;  ///< the problem with ranges that the sensor cannot measure, or empty
  int lines = 0;             ///< in the first shots (one more than the highest), 0 if not counted
  /// The times of the recording do not fit its scan, but shots counted at the rate of the sensor
  /// do.
  bool times_at_fault = false;
  /// Firing order of its emitters if beams are counted.
  estimation::FiringOrder order;
  /// The recording's roll about the optical axis, rad; 0 if it is not known or small. Approximate
  /// direction of that axis in the recording.
  double roll = 0;
  estimation::FrameTurn frame;
};

/// The first shots of a recording, up to damage, and findings about them.
struct FirstShots {
  estimation::AngleSeries head;  ///< every shot of the first second
  estimation::BeamSource beams = estimation::BeamSource::recorded;
  estimation::StartFindings found;
};

/// Chooses the sensor of a recording: the requested one, that of the type named in the file, or the
/// built-in preset that fits the shots of the first second best, by speeds of the rotors,
/// deflections of the prisms and emitters together. If times are missing, those of the presets'
/// shot rates are tried, and the result is a guess; so is the preset with the smallest field of
/// view that contains the shots, as a last resort. A type named in the file is kept even if the
/// shots contradict it, with a warning. First, the shots must be those of a scan. If shots
/// contradict the type, or no preset fits them, they are counted, too, to see whether the times are
/// wrong.
/// @param header  of the recording
/// @param given  the requested sensor
/// @param shots  receives the first ones, if they were used
/// @throws FileError, InvalidArgument, Cancelled
SensorChoice choose_sensor(const recordings::Source& source, const recordings::ReadOptions& reading,
                           const recordings::RecordingHeader& header,
                           const std::optional<sensors::Sensor>& given,
                           const Progress& progress = {}, FirstShots* shots = nullptr);

/// @throws InvalidArgument when the recording names more lines than the sensor has emitters
/// @throws FileError when no sensor can have made the recording
void require_possible(const SensorChoice& choice, const std::string& recording);

/// Commercial name of the sensor of a recording; for several, each once.
std::string sensor_name(const recordings::RecordingHeader& header);
/// The same if the scan was used too: "unknown" if nothing fits it.
std::string sensor_name(const SensorChoice& choice);

/// Every shot of a recording's first second, up to damage.
estimation::AngleSeries first_second(const recordings::Source& source,
                                     const recordings::ReadOptions& options,
                                     const Progress& progress = {});

/// The built-in preset of a type of sensors; empty if there is none.
/// @param device_type  as recordings::Device::type
std::optional<sensors::Sensor> preset_of_type(int device_type);

/// The given sensor; empty if none was given. @throws as load_result()
std::optional<sensors::Sensor> given_sensor(const GivenSensor& given);

/// Parameters to hold: by name, at a given value (SI units), otherwise at the sensor's.
using HeldParameters = std::vector<std::pair<std::string, std::optional<double>>>;

/// Sets the values of held parameters. @return their names
/// @throws InvalidArgument for unknown names, values out of bounds, and values of parameters not
/// belonging to the prisms
std::vector<std::string> hold(const HeldParameters& held, sensors::Sensor& sensor);

}  // namespace risley::jobs
