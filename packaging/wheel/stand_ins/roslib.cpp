// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// In place of ROS's libroslib, by which librosbag_storage looks for plugins that decrypt bags. The original runs a
// Python of its own inside the process, to ask a ROS installation that a wheel does not have: here none is found.
#include <string>
#include <vector>

namespace ros::package {
std::string getPath(const std::string&) { return {}; }
void getPlugins(const std::string&, const std::string&, std::vector<std::string>& found, bool) { found.clear(); }
}  // namespace ros::package
