# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# risley_rosbag: the library that reads and writes ROS 1 bags. Debian's own CMake and pkg-config files
# for it ask for packages that it does not depend on, so headers and libraries are named here.
include_guard(GLOBAL)
add_library(risley_rosbag INTERFACE IMPORTED GLOBAL)
foreach(library rosbag_storage roscpp_serialization rostime cpp_common console_bridge class_loader)
  find_library(RISLEY_ROSBAG_${library} ${library} REQUIRED)
  mark_as_advanced(RISLEY_ROSBAG_${library})
  target_link_libraries(risley_rosbag INTERFACE ${RISLEY_ROSBAG_${library}})
endforeach()
foreach(header rosbag/bag.h pluginlib/class_loader.hpp class_loader/class_loader.hpp
        rcpputils/filesystem_helper.hpp rcutils/macros.h ament_index_cpp/get_resource.hpp)
  get_filename_component(folder ${header} DIRECTORY)
  find_path(RISLEY_ROSBAG_${folder}_HEADERS ${header} PATH_SUFFIXES ${folder} REQUIRED)
  mark_as_advanced(RISLEY_ROSBAG_${folder}_HEADERS)
  target_include_directories(risley_rosbag INTERFACE ${RISLEY_ROSBAG_${folder}_HEADERS})
endforeach()
