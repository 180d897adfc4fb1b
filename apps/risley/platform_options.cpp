// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "platform_options.hpp"

namespace risley::app {

void add_platform_options(CLI::App& verb, jobs::PlatformFiles& files) {
  verb.add_option("--trajectory", files.trajectory,
                  "Trajectory of a sensor that moved: SBET, Inertial Explorer or POSPac text, CSV, "
                  "poses of a ROS bag");
  verb.add_option("--trajectory-topic", files.topic,
                  "Topic of its poses, of a ROS bag that has several")
      ->type_name("NAME");
  verb.add_option("--mount", files.mount,
                  "How the sensor sits on the moving platform (YAML): axes, lever arm, boresight, "
                  "clock");
  verb.add_option("--accuracy", files.accuracy, "Accuracies of the trajectory (SMRMSG)");
  verb.add_option("--trajectory-errors", files.errors,
                  "How wrong the trajectory may be, and for how long (YAML)");
}

}  // namespace risley::app
