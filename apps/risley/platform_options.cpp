// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "platform_options.hpp"

namespace risley::app {

void add_platform_options(CLI::App& verb, jobs::PlatformFiles& files) {
  verb.add_option("--trajectory", files.trajectory,
                  "Trajectory of a moving sensor: SBET, Inertial Explorer or POSPac text, CSV, or "
                  "the poses in a ROS bag (default: the sensor stands still)");
  verb.add_option("--trajectory-topic", files.topic, "Topic of the poses, if a ROS bag has several")
      ->type_name("NAME");
  verb.add_option("--mount", files.mount,
                  "Mount of the sensor on the moving platform (YAML): axes, lever arm, boresight, "
                  "clock");
  verb.add_option("--accuracy", files.accuracy, "Accuracies of the trajectory (SMRMSG file)");
  verb.add_option("--trajectory-errors", files.errors,
                  "Sizes and correlation times of the trajectory's errors (YAML)");
}

}  // namespace risley::app
