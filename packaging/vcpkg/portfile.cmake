# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# UNTRIED: no port has been built of this file yet. tests/architecture/recipes_test.py checks its form.
# Builds the layers that need no ROS library; the sources are this repository's.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../.." ABSOLUTE)

vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS
    "-DRISLEY_COMPONENTS=sensors;scenes"
    -DRISLEY_INSTALL=ON
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME risley CONFIG_PATH lib/cmake/risley)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE" "${SOURCE_PATH}/THIRD-PARTY.md")
