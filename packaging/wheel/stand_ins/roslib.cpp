// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// In place of ROS's libroslib, which librosbag_storage asks where its plugins are. The original looks for an installation
// of ROS, with a Python of its own inside the process; here they are in share/rosbag_storage beside this library's folder.
#include <filesystem>
#include <string>
#include <vector>

#include <dlfcn.h>

namespace ros::package {

std::string getPath(const std::string& package) {
  Dl_info own;
  if (dladdr(reinterpret_cast<const void*>(&getPath), &own) == 0) return {};
  return std::filesystem::path(own.dli_fname).parent_path().parent_path() / "share" / package;
}

void getPlugins(const std::string& package, const std::string&, std::vector<std::string>& found, bool) {
  found = {getPath(package) + "/encryptor_plugins.xml"};
}

}  // namespace ros::package
