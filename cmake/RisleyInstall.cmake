# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# What `cmake --install` gives: headers, libraries, a package that find_package(risley) finds with
# the same target names as in the tree (risley::risley and one risley::<layer> each), the command
# and the completion of its verbs.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/risley)

install(TARGETS ${RISLEY_LAYER_TARGETS} risley_all EXPORT risleyTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT risleyTargets NAMESPACE risley:: DESTINATION ${package_dir})

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/risleyConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/risleyConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/risleyConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/risleyConfig.cmake
              ${PROJECT_BINARY_DIR}/risleyConfigVersion.cmake
              ${CMAKE_CURRENT_LIST_DIR}/RisleyRosbag.cmake
        DESTINATION ${package_dir})

if(TARGET risley)
  install(TARGETS risley RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  if(EXISTS ${PROJECT_SOURCE_DIR}/completions/risley.bash)
    install(FILES ${PROJECT_SOURCE_DIR}/completions/risley.bash RENAME risley
            DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  endif()
endif()
