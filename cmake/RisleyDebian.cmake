# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Debian packages of the components, by CPack. scripts/package builds them: it writes the changelog to
# <build>/debian, and gives cpack the version, revision and maintainer.
if(NOT BUILD_SHARED_LIBS OR NOT RISLEY_BUILD_APPS OR NOT RISLEY_BUILD_PYTHON)
  message(FATAL_ERROR "Debian packages hold shared libraries, the command and the Python package: use the preset "
                      "package, or scripts/package")
endif()
find_package(Python 3.9 REQUIRED COMPONENTS Interpreter) # its version
set(debian_library librisley${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
find_program(RISLEY_GZIP gzip REQUIRED)
mark_as_advanced(RISLEY_GZIP)

# risley_debian_package(<component> <package> SECTION <section> [DEPENDS <packages>] [RECOMMENDS <packages>]
#                       SYNOPSIS <a few words> DESCRIPTION <sentences>)
function(risley_debian_package component package)
  cmake_parse_arguments(arg "" "SECTION;SYNOPSIS;DESCRIPTION" "DEPENDS;RECOMMENDS" ${ARGN})
  string(TOUPPER ${component} upper)
  foreach(field DEPENDS RECOMMENDS)
    list(JOIN arg_${field} ", " CPACK_DEBIAN_${upper}_PACKAGE_${field})
    set(CPACK_DEBIAN_${upper}_PACKAGE_${field} "${CPACK_DEBIAN_${upper}_PACKAGE_${field}}" PARENT_SCOPE)
  endforeach()
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${arg_SECTION} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${arg_SYNOPSIS}\n${arg_DESCRIPTION}" PARENT_SCOPE)
  set(documents ${CMAKE_INSTALL_DATADIR}/doc/${package})
  install(FILES ${PROJECT_SOURCE_DIR}/packaging/debian/copyright DESTINATION ${documents} COMPONENT ${component})
  install(FILES ${PROJECT_BINARY_DIR}/debian/changelog.Debian.gz DESTINATION ${documents} COMPONENT ${component})
endfunction()

# Compressed as Debian asks: without time or name.
function(risley_debian_compress file compressed)
  add_custom_command(OUTPUT ${compressed} COMMAND ${RISLEY_GZIP} -9nc ${file} > ${compressed} DEPENDS ${file})
endfunction()
set(changelogs ${PROJECT_BINARY_DIR}/debian/changelog.Debian.gz ${PROJECT_BINARY_DIR}/debian/changelog.gz)
risley_debian_compress(${PROJECT_BINARY_DIR}/debian/changelog ${PROJECT_BINARY_DIR}/debian/changelog.Debian.gz)
risley_debian_compress(${PROJECT_SOURCE_DIR}/CHANGELOG.md ${PROJECT_BINARY_DIR}/debian/changelog.gz)
add_custom_target(risley_debian_changelogs ALL DEPENDS ${changelogs})
install(FILES ${PROJECT_BINARY_DIR}/debian/changelog.gz DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT command)

# Dependencies of programs that include the headers.
set(header_packages "")
foreach(layer IN LISTS RISLEY_LAYERS)
  foreach(key IN LISTS RISLEY_${layer}_PUBLIC)
    get_property(package GLOBAL PROPERTY RISLEY_PACKAGE_${key}_DEBIAN)
    list(APPEND header_packages ${package})
  endforeach()
endforeach()
list(REMOVE_DUPLICATES header_packages)

set(about "The open model of lidars that steer their beam with spinning wedge
prisms, as Livox's Mid-40, Mid-70, Avia, Horizon and Tele-15: simulation,
estimation and calibration with honest sigmas.")
risley_debian_package(library ${debian_library} SECTION libs
  SYNOPSIS "model of Risley-prism lidars, shared libraries"
  DESCRIPTION "${about}")
risley_debian_package(development librisley-dev SECTION libdevel DEPENDS ${header_packages}
  SYNOPSIS "model of Risley-prism lidars, files for development"
  DESCRIPTION "${about}
.
This package has the headers, and the files by which CMake and pkg-config
find the libraries.")
risley_debian_package(command risley SECTION science RECOMMENDS risley-data
  SYNOPSIS "simulate, estimate and calibrate Risley-prism lidars"
  DESCRIPTION "${about}
.
This package has the command risley.")
math(EXPR next_minor "${Python_VERSION_MINOR} + 1")
risley_debian_package(python python3-risley SECTION python
  DEPENDS "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}~)"
          "python3 (<< ${Python_VERSION_MAJOR}.${next_minor})" python3-numpy
  SYNOPSIS "model of Risley-prism lidars, Python package"
  DESCRIPTION "${about}
.
This package has the module risley: the observation model, recordings and
estimates as numpy arrays.")
risley_debian_package(data risley-data SECTION science
  SYNOPSIS "presets and scenes of Risley-prism lidars"
  DESCRIPTION "${about}
.
This package has the presets of sensors, the scenes, mounts and flights of
the tutorials, and the notices of the works that risley includes.")

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL library development command python data)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
foreach(component DEVELOPMENT COMMAND PYTHON)
  set(CPACK_COMPONENT_${component}_DEPENDS library)
endforeach()
foreach(component COMMAND LIBRARY PYTHON)
  set(CPACK_DEBIAN_${component}_PACKAGE_SHLIBDEPS ON)
endforeach()
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})
set(CPACK_DEBIAN_DATA_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/debian/triggers)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/debian/postinst
                                              ${PROJECT_SOURCE_DIR}/packaging/debian/prerm)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SOURCE risley)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CONTACT "The risley authors")
unset(CPACK_PACKAGE_DESCRIPTION_SUMMARY) # it would go before what each package says of itself
set(CPACK_VERBATIM_VARIABLES ON)
include(CPack)
