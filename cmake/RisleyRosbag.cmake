# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# risley_rosbag: the library that reads and writes ROS 1 bags, if it is here. Debian's own CMake and
# pkg-config files for it ask for packages that it does not depend on, so headers and libraries are named here.
if(TARGET risley_rosbag)
  return()
endif()
set(libraries "")
foreach(library rosbag_storage roscpp_serialization rostime cpp_common console_bridge class_loader)
  find_library(RISLEY_ROSBAG_${library} ${library})
  mark_as_advanced(RISLEY_ROSBAG_${library})
  list(APPEND libraries ${RISLEY_ROSBAG_${library}})
endforeach()
set(folders "")
foreach(header rosbag/bag.h pluginlib/class_loader.hpp class_loader/class_loader.hpp
        rcpputils/filesystem_helper.hpp rcutils/macros.h ament_index_cpp/get_resource.hpp)
  get_filename_component(folder ${header} DIRECTORY)
  find_path(RISLEY_ROSBAG_${folder}_HEADERS ${header} PATH_SUFFIXES ${folder})
  mark_as_advanced(RISLEY_ROSBAG_${folder}_HEADERS)
  list(APPEND folders ${RISLEY_ROSBAG_${folder}_HEADERS})
endforeach()
if(NOT "${libraries};${folders}" MATCHES "-NOTFOUND")
  add_library(risley_rosbag INTERFACE IMPORTED GLOBAL)
  target_link_libraries(risley_rosbag INTERFACE ${libraries})
  target_include_directories(risley_rosbag INTERFACE ${folders})
endif()
