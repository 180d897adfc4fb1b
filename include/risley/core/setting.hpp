// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace risley {

/// A user setting: an option of the command, a keyword of Python, a key of plans. Libraries use its
/// name in Settings; the front end determines its spelling.
struct Setting {
  std::string_view flag;  ///< of the command, without "--": the other spellings follow from it
};

/// All of them.
struct Settings {
  Setting accuracy{"accuracy"}, anywhere{"anywhere"}, bend{"bend"}, bend_time{"bend-s"},
      calibration{"calibration"}, cell_size{"cell-size-m"}, chunk{"chunk"},
      clock_drift{"clock-drift-ppm"}, clock_jump{"clock-jump-s"}, clock_jump_by{"clock-jump-by-ms"},
      common_factors{"common-factors"}, control{"control"}, covariance{"covariance"}, crs{"crs"},
      data_port{"data-port"}, datum{"datum"}, delay{"delay-ms"}, device{"device"},
      disorder{"disorder"}, disorder_packets{"disorder-packets"}, duplication{"duplication"},
      duration{"duration-s"}, empty_circle{"empty-circle-m"}, extrinsics{"extrinsics"},
      false_alarm{"false-alarm"}, fastest{"fastest-hz"}, find{"find-s"}, fix{"fix"},
      flight{"flight"}, format{"format"}, frame_rate{"frame-rate-hz"}, free{"free"}, from{"from"},
      heartbeat_dies{"heartbeat-dies-s"}, interface_address{"interface"},
      knot_spacing{"knot-spacing-s"}, las_scale{"las-scale-m"}, list{"list"}, loss{"loss"},
      method{"method"}, mirror{"mirror"}, mount{"mount"}, noise_angle{"noise-angle-deg"},
      noise_range{"noise-range-m"}, output{"output"}, patch_thickness{"patch-thickness-m"},
      plan{"plan"}, planes{"planes"}, prior_sigma{"prior-sigma-deg"},
      process_noise{"process-noise"}, range_offset_sigma{"range-offset-sigma-m"}, rate{"rate-hz"},
      reach{"reach-m"}, recording{"recording"}, restart{"restart-s"}, resume{"resume"},
      table{"table"}, restart_takes{"restart-takes-s"}, same_walls{"same-walls"}, scene{"scene"},
      seed{"seed"}, sensor{"sensor"}, sensor_type{"sensor-type"}, serial{"serial"},
      shot_rate{"shot-rate-hz"}, replace{"replace"}, speed{"speed"}, start{"start-s"},
      start_angles{"start-angles-deg"}, states{"states"}, station{"station"}, stations{"stations"},
      time{"time"}, time_from{"time-from-s"}, tolerance{"tolerance-deg"}, topic{"topic"},
      trajectory{"trajectory"}, trajectory_errors{"trajectory-errors"},
      trajectory_topic{"trajectory-topic"}, truth{"truth"}, unlike{"unlike"},
      wrong_checksums{"wrong-checksums"};
};

/// By name: kSetting.noise_angle.
inline constexpr Settings kSetting;

/// Spelling of settings in a front end, so that its users recognise them.
enum class SettingStyle {
  option,   ///< "option noise_angle": without a front end
  flag,     ///< "--noise-angle-deg", values in its unit
  keyword,  ///< "noise_angle", values in SI units
};

/// To be called once, before anything else, by a program with a user interface.
void write_settings_as(SettingStyle style);

/// As spelled by the front end.
std::string name_of(Setting setting);
/// Of the command, "--noise-angle-deg".
std::string flag_of(Setting setting);
/// Of Python: the flag without its unit, "noise_angle".
std::string keyword_of(Setting setting);

/// Whether an option of the command, by its name there, may be an input file: such files are part
/// of the inputs in results, and no output may replace them.
bool names_file_to_read(std::string_view option);

// Each throws InvalidArgument with the name of the setting, its value and unit as spelled by the
// front end, and the allowed range; NaN and infinite values are never allowed. Values are in SI
// units.

/// "--rate-hz = -1 Hz, allowed above 0"
void require_positive(Setting setting, double value);
/// The same with 0.
void require_not_negative(Setting setting, double value);
/// "--find-s = 0 s, allowed 0.1 to 3600"
void require_between(Setting setting, double value, double lowest, double highest);

}  // namespace risley
