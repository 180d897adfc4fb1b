# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# The libraries that layers need: how CMake and pkg-config find each, and which Debian package holds it.
# Installed as well, so that a project that uses risley looks for them the same way.
include_guard(GLOBAL)

# risley_package(<key> TARGET <target> DEBIAN <package> [PKG_CONFIG <modules> | LIBS <flags>]
#                [FIND <arguments of find_package>])
function(risley_package key)
  cmake_parse_arguments(arg "" "TARGET;DEBIAN" "PKG_CONFIG;LIBS;FIND" ${ARGN})
  foreach(field TARGET DEBIAN PKG_CONFIG LIBS FIND)
    set_property(GLOBAL PROPERTY RISLEY_PACKAGE_${key}_${field} "${arg_${field}}")
  endforeach()
endfunction()

risley_package(eigen TARGET Eigen3::Eigen DEBIAN libeigen3-dev PKG_CONFIG eigen3
               FIND Eigen3 3.4 NO_MODULE)
risley_package(fmt TARGET fmt::fmt DEBIAN libfmt-dev PKG_CONFIG fmt FIND fmt)
risley_package(xsimd TARGET risley_xsimd DEBIAN libxsimd-dev PKG_CONFIG xsimd)
risley_package(tbb TARGET TBB::tbb DEBIAN libtbb-dev PKG_CONFIG tbb FIND TBB)
risley_package(yaml-cpp TARGET yaml-cpp::yaml-cpp DEBIAN libyaml-cpp-dev PKG_CONFIG yaml-cpp
               FIND yaml-cpp)
risley_package(crypto TARGET OpenSSL::Crypto DEBIAN libssl-dev PKG_CONFIG libcrypto
               FIND OpenSSL COMPONENTS Crypto)
risley_package(netcdf TARGET PkgConfig::NETCDF DEBIAN libnetcdf-dev PKG_CONFIG netcdf hdf5)
risley_package(rosbag TARGET risley_rosbag DEBIAN librosbag-storage-dev
               LIBS -lrosbag_storage -lroscpp_serialization -lrostime -lcpp_common
                    -lconsole_bridge -lclass_loader)
risley_package(sqlite TARGET SQLite::SQLite3 DEBIAN libsqlite3-dev PKG_CONFIG sqlite3
               FIND SQLite3)
risley_package(fastcdr TARGET fastcdr DEBIAN libfastcdr-dev LIBS -lfastcdr FIND fastcdr)
risley_package(lz4 TARGET PkgConfig::LZ4 DEBIAN liblz4-dev PKG_CONFIG liblz4)
risley_package(zstd TARGET PkgConfig::ZSTD DEBIAN libzstd-dev PKG_CONFIG libzstd)
risley_package(zlib TARGET ZLIB::ZLIB DEBIAN zlib1g-dev PKG_CONFIG zlib FIND ZLIB)
risley_package(pcap TARGET PkgConfig::PCAP DEBIAN libpcap-dev PKG_CONFIG libpcap)
risley_package(microhttpd TARGET PkgConfig::MICROHTTPD DEBIAN libmicrohttpd-dev PKG_CONFIG libmicrohttpd)
risley_package(proj TARGET PROJ::proj DEBIAN libproj-dev PKG_CONFIG proj FIND PROJ)
risley_package(nlohmann-json TARGET nlohmann_json::nlohmann_json DEBIAN nlohmann-json3-dev
               PKG_CONFIG nlohmann_json FIND nlohmann_json)
risley_package(laszip TARGET risley_laszip DEBIAN liblaszip-dev LIBS -llaszip)
find_library(RISLEY_FASTDDS_LIBRARY NAMES fastdds fastrtps) # its name from version 3, and up to 2
mark_as_advanced(RISLEY_FASTDDS_LIBRARY)
if(RISLEY_FASTDDS_LIBRARY MATCHES fastrtps)
  risley_package(fastdds TARGET risley_fastdds DEBIAN libfastrtps-dev LIBS -lfastrtps -lfastcdr)
else()
  risley_package(fastdds TARGET risley_fastdds DEBIAN libfastdds-dev LIBS -lfastdds -lfastcdr)
endif()

# Looks for one package by its key; its target exists afterwards if it was found.
function(risley_find_package key)
  get_property(target GLOBAL PROPERTY RISLEY_PACKAGE_${key}_TARGET)
  get_property(arguments GLOBAL PROPERTY RISLEY_PACKAGE_${key}_FIND)
  if(TARGET ${target})
    return()
  elseif(target MATCHES "^PkgConfig::(.+)$") # no CMake files, or such that name libraries that need not be there
    set(prefix ${CMAKE_MATCH_1})
    get_property(modules GLOBAL PROPERTY RISLEY_PACKAGE_${key}_PKG_CONFIG)
    find_package(PkgConfig QUIET)
    if(PKG_CONFIG_FOUND)
      pkg_check_modules(${prefix} QUIET IMPORTED_TARGET GLOBAL ${modules})
    endif()
  elseif(key STREQUAL "rosbag")
    include(${CMAKE_CURRENT_FUNCTION_LIST_DIR}/RisleyRosbag.cmake)
  elseif(key STREQUAL "xsimd") # Debian's own CMake files link xtl, which nothing here needs
    find_path(RISLEY_XSIMD_HEADERS xsimd/xsimd.hpp)
    mark_as_advanced(RISLEY_XSIMD_HEADERS)
    if(RISLEY_XSIMD_HEADERS)
      add_library(risley_xsimd INTERFACE IMPORTED GLOBAL)
      target_include_directories(risley_xsimd INTERFACE ${RISLEY_XSIMD_HEADERS})
    endif()
  elseif(key STREQUAL "laszip")
    find_library(RISLEY_LASZIP_LIBRARY laszip)
    find_path(RISLEY_LASZIP_HEADERS laszip/laszip_api.h)
    mark_as_advanced(RISLEY_LASZIP_LIBRARY RISLEY_LASZIP_HEADERS)
    if(RISLEY_LASZIP_LIBRARY AND RISLEY_LASZIP_HEADERS)
      add_library(risley_laszip INTERFACE IMPORTED GLOBAL)
      target_link_libraries(risley_laszip INTERFACE ${RISLEY_LASZIP_LIBRARY})
      target_include_directories(risley_laszip INTERFACE ${RISLEY_LASZIP_HEADERS})
      target_compile_definitions(risley_laszip INTERFACE RISLEY_HAS_LASZIP)
    endif()
  elseif(key STREQUAL "fastdds") # the CMake files of version 2 ask for libraries that nothing here needs
    find_path(RISLEY_FASTDDS_HEADERS fastdds/dds/domain/DomainParticipant.hpp)
    mark_as_advanced(RISLEY_FASTDDS_HEADERS)
    risley_find_package(fastcdr)
    get_property(debian GLOBAL PROPERTY RISLEY_PACKAGE_fastdds_DEBIAN)
    if(RISLEY_FASTDDS_LIBRARY AND RISLEY_FASTDDS_HEADERS AND TARGET fastcdr)
      add_library(risley_fastdds INTERFACE IMPORTED GLOBAL)
      target_link_libraries(risley_fastdds INTERFACE ${RISLEY_FASTDDS_LIBRARY} fastcdr)
      target_include_directories(risley_fastdds INTERFACE ${RISLEY_FASTDDS_HEADERS})
      target_compile_definitions(risley_fastdds INTERFACE
                                 RISLEY_HAS_FASTDDS=$<IF:$<STREQUAL:${debian},libfastrtps-dev>,2,3>)
    endif()
  else()
    find_package(${arguments} QUIET)
  endif()
  if(key STREQUAL "yaml-cpp" AND TARGET yaml-cpp AND NOT TARGET yaml-cpp::yaml-cpp)
    add_library(yaml-cpp::yaml-cpp ALIAS yaml-cpp) # its name up to 0.7
  endif()
endfunction()

# Looks for packages by their keys and sets <missing> to the Debian packages of those not found.
function(risley_find_packages missing)
  set(debian "")
  foreach(key IN LISTS ARGN)
    risley_find_package(${key})
    get_property(target GLOBAL PROPERTY RISLEY_PACKAGE_${key}_TARGET)
    if(NOT TARGET ${target})
      get_property(package GLOBAL PROPERTY RISLEY_PACKAGE_${key}_DEBIAN)
      list(APPEND debian ${package})
      if(target MATCHES "^PkgConfig::" AND NOT PKG_CONFIG_FOUND)
        find_package(PkgConfig QUIET)
        if(NOT PKG_CONFIG_FOUND)
          list(APPEND debian pkgconf)
        endif()
      endif()
    endif()
  endforeach()
  list(REMOVE_DUPLICATES debian)
  set(${missing} "${debian}" PARENT_SCOPE)
endfunction()
