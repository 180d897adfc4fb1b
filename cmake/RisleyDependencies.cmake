# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Every C++ library comes from the distribution; scripts/install-dependencies names the packages.
# What only building needs is named here, what users of the installed library need in RisleyPackages.
include(RisleyPackages)
risley_package(random123 TARGET risley_random123 DEBIAN librandom123-dev)
risley_package(boost TARGET Boost::headers DEBIAN libboost-dev FIND Boost 1.74)
risley_package(cli11 TARGET CLI11::CLI11 DEBIAN libcli11-dev FIND CLI11)
risley_package(spdlog TARGET spdlog::spdlog DEBIAN libspdlog-dev FIND spdlog)
risley_package(gtest TARGET GTest::gmock DEBIAN libgmock-dev FIND GTest)
risley_package(ceres TARGET Ceres::ceres DEBIAN libceres-dev FIND Ceres)
risley_package(benchmark TARGET benchmark::benchmark DEBIAN libbenchmark-dev FIND benchmark)
# The interpreter is the system's, never the first python3 in the path; scikit-build-core
# and a set Python_EXECUTABLE choose another.
if(NOT DEFINED Python_EXECUTABLE AND NOT SKBUILD AND EXISTS /usr/bin/python3)
  set(Python_EXECUTABLE /usr/bin/python3)
endif()
risley_package(python TARGET Python::Module DEBIAN python3-dev
               FIND Python 3.9 COMPONENTS Interpreter Development.Module)
set(PYBIND11_NOPYTHON ON) # it is found above
risley_package(pybind11 TARGET pybind11::headers DEBIAN pybind11-dev FIND pybind11 2.10)

find_path(RISLEY_RANDOM123_INCLUDE_DIR Random123/philox.h)
mark_as_advanced(RISLEY_RANDOM123_INCLUDE_DIR)
if(RISLEY_RANDOM123_INCLUDE_DIR AND NOT TARGET risley_random123)
  add_library(risley_random123 INTERFACE IMPORTED)
  target_include_directories(risley_random123 INTERFACE ${RISLEY_RANDOM123_INCLUDE_DIR})
endif()

# Looks for all packages of the list, or ends with the names of those that are missing.
macro(risley_require_packages) # a macro: variables of find_package are for the caller
  risley_find_packages(missing ${ARGN})
  if(missing)
    list(JOIN missing " " missing)
    message(FATAL_ERROR "Packages are missing. On Debian: apt-get install ${missing}\n"
                        "scripts/install-dependencies installs all that is needed.")
  endif()
endmacro()
