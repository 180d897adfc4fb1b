# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# What `cmake --install` gives: headers, libraries, a package for find_package(risley) whose components
# are the layers, with the same target names as in the tree (risley::risley is all of them), pkg-config
# files (risley, risley-<layer>), the command, its manual pages and completions, presets and the scenes,
# mounts and flights of the tutorials to look at, and the licences of risley and of what its pages hold.
# The components are the packages of RisleyDebian: library, development, command, python, data.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/risley)
set(pkg_config_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# risley<suffix>.pc; a static library hands on all that it is linked with, a shared one nothing: pkg-config
# would ask for the packages of Requires.private, which no user of it needs.
function(risley_install_pkg_config suffix description requires requires_private libs libs_private)
  if(NOT BUILD_SHARED_LIBS)
    list(APPEND requires ${requires_private})
    list(APPEND libs ${libs_private})
  endif()
  foreach(field requires libs)
    list(REMOVE_ITEM ${field} "")
    list(JOIN ${field} " " ${field})
  endforeach()
  string(REGEX REPLACE "[^/]+" ".." up ${pkg_config_dir})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/risley${suffix}.pc @ONLY CONTENT
[[prefix=${pcfiledir}/@up@
libdir=${prefix}/@CMAKE_INSTALL_LIBDIR@
includedir=${prefix}/@CMAKE_INSTALL_INCLUDEDIR@

Name: risley@suffix@
Description: @description@
Version: @PROJECT_VERSION@
Requires: @requires@
Libs: @libs@
Cflags: -I${includedir}
]])
  install(FILES ${PROJECT_BINARY_DIR}/risley${suffix}.pc DESTINATION ${pkg_config_dir} COMPONENT development)
endfunction()

# Splits package keys into modules of pkg-config and flags of the linker.
function(risley_pkg_config_of modules flags)
  set(found_modules "")
  set(found_flags "")
  foreach(key IN LISTS ARGN)
    get_property(module GLOBAL PROPERTY RISLEY_PACKAGE_${key}_PKG_CONFIG)
    get_property(libs GLOBAL PROPERTY RISLEY_PACKAGE_${key}_LIBS)
    list(APPEND found_modules ${module})
    list(APPEND found_flags ${libs})
  endforeach()
  set(${modules} "${found_modules}" PARENT_SCOPE)
  set(${flags} "${found_flags}" PARENT_SCOPE)
endfunction()

set(layer_facts "")
foreach(layer IN LISTS RISLEY_LAYERS)
  install(TARGETS risley_${layer} EXPORT risley-${layer}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development
          FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
  install(EXPORT risley-${layer} NAMESPACE risley:: DESTINATION ${package_dir} COMPONENT development)

  set(packages ${RISLEY_${layer}_PUBLIC})
  if(NOT BUILD_SHARED_LIBS)
    list(APPEND packages ${RISLEY_${layer}_PRIVATE})
  endif()
  list(JOIN RISLEY_${layer}_CLOSURE " " closure)
  list(JOIN packages " " packages)
  string(APPEND layer_facts "set(risley_${layer}_LAYERS ${closure})\n"
                            "set(risley_${layer}_PACKAGES ${packages})\n")

  risley_pkg_config_of(modules flags ${RISLEY_${layer}_PUBLIC})
  risley_pkg_config_of(modules_private flags_private ${RISLEY_${layer}_PRIVATE})
  list(TRANSFORM RISLEY_${layer}_LAYERS PREPEND risley- OUTPUT_VARIABLE below)
  list(REVERSE below) # a linker reads users first
  risley_install_pkg_config(-${layer} "The layer ${layer} of risley" "${below};${modules}"
    "${modules_private}" "-L\${libdir};-lrisley_${layer};${flags}" "${flags_private}")
endforeach()
list(TRANSFORM RISLEY_LAYERS PREPEND risley- OUTPUT_VARIABLE modules)
list(REVERSE modules)
risley_install_pkg_config("" "${PROJECT_DESCRIPTION}" "${modules}" "" "" "")

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/risleyConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/risleyConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/risleyConfigVersion.cmake
                                 COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/risleyConfig.cmake
              ${PROJECT_BINARY_DIR}/risleyConfigVersion.cmake
              ${CMAKE_CURRENT_LIST_DIR}/RisleyPackages.cmake
              ${CMAKE_CURRENT_LIST_DIR}/RisleyRosbag.cmake
        DESTINATION ${package_dir} COMPONENT development)

set(notices_dir ${CMAKE_INSTALL_DOCDIR})
set(zsh_dir ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
if(RISLEY_DEBIAN_PACKAGES)
  set(notices_dir ${CMAKE_INSTALL_DATADIR}/doc/risley-data)
  set(zsh_dir ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
  include(RisleyDebian)
else() # packages have both under other names
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
endif()
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CITATION.cff ${PROJECT_SOURCE_DIR}/SECURITY.md
        DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT command)
install(FILES ${PROJECT_SOURCE_DIR}/THIRD-PARTY.md DESTINATION ${notices_dir} COMPONENT data)
if(TARGET risley)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/data ${PROJECT_SOURCE_DIR}/presets
          DESTINATION ${CMAKE_INSTALL_DATADIR}/risley COMPONENT data FILES_MATCHING PATTERN *.yaml)
  install(FILES ${echarts}/LICENSE ${echarts}/NOTICE DESTINATION ${notices_dir}/echarts COMPONENT data)
  install(FILES ${echarts_gl}/LICENSE DESTINATION ${notices_dir}/echarts-gl COMPONENT data)
  install(FILES ${three}/LICENSE DESTINATION ${notices_dir}/three COMPONENT data)
  install(TARGETS risley RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
  install(DIRECTORY ${RISLEY_DOCUMENTS}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT command)
  install(FILES ${RISLEY_DOCUMENTS}/completions/risley.bash RENAME risley
          DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT command)
  install(FILES ${RISLEY_DOCUMENTS}/completions/_risley DESTINATION ${zsh_dir} COMPONENT command)
  install(FILES ${RISLEY_DOCUMENTS}/completions/risley.fish
          DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT command)
endif()
