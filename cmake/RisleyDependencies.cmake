# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Every C++ library comes from the distribution; scripts/install-dependencies names the packages.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(TBB REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(xsimd REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(NETCDF REQUIRED IMPORTED_TARGET GLOBAL netcdf)
include(RisleyRosbag)
find_package(SQLite3 REQUIRED)
find_package(ZLIB REQUIRED)
find_package(fastcdr REQUIRED)
find_library(RISLEY_LASZIP_LIBRARY laszip) # optional: Debian 13 has it, Debian 12 does not
find_path(RISLEY_RANDOM123_INCLUDE_DIR Random123/philox.h REQUIRED)

# yaml-cpp calls its target yaml-cpp up to 0.7 and yaml-cpp::yaml-cpp from 0.8 on.
if(NOT TARGET yaml-cpp::yaml-cpp)
  add_library(yaml-cpp::yaml-cpp ALIAS yaml-cpp)
endif()
