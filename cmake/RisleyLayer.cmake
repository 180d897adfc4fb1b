# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Layers are declared lowest first with risley_add_layer, get their dependencies with risley_layer_needs,
# and made by risley_make_layers: the components that are asked for, with the layers below them.
set(RISLEY_LAYERS "")

set(RISLEY_SANITIZED OFF)
if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  set(RISLEY_SANITIZED ON)
endif()

# Compiler settings that every target of ours shares, never a consumer.
function(risley_target_defaults target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wno-sign-conversion
                         # gcc 12 sees overlaps in std::string (gcc.gnu.org/PR105651)
                         $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
                         # sources compiled together look to gcc like headers with types of their own, and
                         # see each other's names
                         $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${CMAKE_UNITY_BUILD}>>:-Wno-subobject-linkage>
                         $<IF:$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${CMAKE_UNITY_BUILD}>>,-Wshadow=local,-Wshadow>
                         # ccache reads from the preprocessor which parsed headers were used
                         $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${CMAKE_CXX_COMPILER_LAUNCHER}>>:-fpch-preprocess>
                         # and gives back parsed headers that are not as old as what they were parsed from
                         "$<$<AND:$<CXX_COMPILER_ID:Clang>,$<BOOL:${CMAKE_CXX_COMPILER_LAUNCHER}>>:SHELL:-Xclang -fno-pch-timestamp>"
                         # gcc looks for unused memory at 128 MB and whenever it has doubled; not below 1 GB, a
                         # build takes 8 % less time and a large source 0.3 GB more
                         "$<$<CXX_COMPILER_ID:GNU>:SHELL:--param ggc-min-heapsize=1000000>"
                         $<$<BOOL:${RISLEY_WARNINGS_AS_ERRORS}>:-Werror>)
endfunction()

# Headers of other libraries that most sources include, parsed once: by a target that lends them to others,
# which must have all its definitions and the same flags.
# ccache needs to know them (CCACHE_SLOPPINESS, as in scripts/build); otherwise they are not used.
set(precompile ON)
if(CMAKE_CXX_COMPILER_LAUNCHER)
  set(precompile OFF)
endif()
option(RISLEY_PRECOMPILE_HEADERS "Parse common headers once" ${precompile})
set(RISLEY_STANDARD_HEADERS <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory>
    <optional> <span> <string> <string_view> <vector> <fmt/format.h>)
set(RISLEY_EIGEN_HEADERS ${RISLEY_STANDARD_HEADERS} <Eigen/Core> <Eigen/Geometry>)
function(risley_parse_headers target)
  if(RISLEY_PRECOMPILE_HEADERS)
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()
function(risley_borrow_headers target lender)
  if(RISLEY_PRECOMPILE_HEADERS)
    target_precompile_headers(${target} REUSE_FROM ${lender})
  endif()
endfunction()

# An object library without code that lends layers parsed headers.
function(risley_add_headers target)
  if(RISLEY_PRECOMPILE_HEADERS)
    cmake_parse_arguments(arg "" "" "HEADERS;LINK" ${ARGN})
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/${target}.cpp CONTENT "// no code\n")
    add_library(${target} OBJECT ${PROJECT_BINARY_DIR}/generated/${target}.cpp)
    risley_target_defaults(${target})
    target_link_libraries(${target} PRIVATE ${arg_LINK})
    risley_parse_headers(${target} ${arg_HEADERS})
  endif()
endfunction()

# For targets of which nothing takes long to run: half the time of building them is optimisation. Headers
# that another target has parsed were parsed for its own optimisation.
function(risley_optimise_little target)
  get_target_property(lender ${target} PRECOMPILE_HEADERS_REUSE_FROM)
  if(lender)
    set_target_properties(${target} PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)
  endif()
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release,RelWithDebInfo>:-O1>)
endfunction()

# For targets that compute much. Clang counts what the sanitizers add to a function and then inlines hardly anything of
# Eigen; with a higher limit, such code runs three times as fast under them and takes 1.7 times as long to compile.
function(risley_inline_sanitized target)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND RISLEY_SANITIZED)
    target_compile_options(${target} PRIVATE "SHELL:-mllvm -inline-threshold=2500")
  endif()
endfunction()

# One layer: a library risley_<name> (alias risley::<name>) of include/risley/<name> and
# src/<name>, linked to the layers it may include and to no other.
function(risley_add_layer name)
  cmake_parse_arguments(arg "" "" "LAYERS" ${ARGN})
  set(closure "")
  foreach(layer IN LISTS arg_LAYERS)
    list(APPEND closure ${RISLEY_${layer}_CLOSURE})
  endforeach()
  list(APPEND closure ${name})
  list(REMOVE_DUPLICATES closure)
  set(RISLEY_LAYERS ${RISLEY_LAYERS} ${name} PARENT_SCOPE)
  set(RISLEY_${name}_LAYERS "${arg_LAYERS}" PARENT_SCOPE)
  set(RISLEY_${name}_CLOSURE ${closure} PARENT_SCOPE) # with itself, lowest first
endfunction()

# Packages of RisleyPackages and RisleyDependencies that a layer needs. PUBLIC: seen in its headers;
# PRIVATE: linked; OPTIONAL: linked if found; BUILD: headers only, so that users of the layer never need them.
function(risley_layer_needs name)
  cmake_parse_arguments(arg "" "" "PUBLIC;PRIVATE;OPTIONAL;BUILD" ${ARGN})
  foreach(key IN LISTS arg_OPTIONAL)
    risley_find_packages(missing ${key})
    if(NOT missing)
      list(APPEND arg_PRIVATE ${key})
    endif()
  endforeach()
  foreach(kind PUBLIC PRIVATE BUILD)
    set(RISLEY_${name}_${kind} "${arg_${kind}}" PARENT_SCOPE)
  endforeach()
endfunction()

function(risley_make_layer name)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/include/risley/${name}/*.hpp)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${name}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "_kernel\\.cpp$") # built once per instruction set
  set(target risley_${name})
  add_library(${target} ${sources})
  add_library(risley::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} DEFINE_SYMBOL "" # static or shared, the same objects
                        VERSION ${PROJECT_VERSION} INSTALL_RPATH $ORIGIN
                        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  if(BUILD_SHARED_LIBS) # what is ours is exported, templates of other libraries stay inside
    set(script ${PROJECT_SOURCE_DIR}/cmake/exports.map)
    target_link_options(${target} PRIVATE -Wl,--version-script=${script})
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${script})
  endif()
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/include
                 FILES ${headers})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src) # "<layer>/private.hpp"
  risley_target_defaults(${target})
  if(name IN_LIST RISLEY_COVERED_LAYERS)
    target_compile_options(${target} PRIVATE --coverage -O1)
    target_link_options(${target} PUBLIC --coverage)
    set_target_properties(${target} PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)
  endif()
  if(eigen IN_LIST RISLEY_${name}_PUBLIC)
    risley_borrow_headers(${target} risley_eigen_headers)
  else()
    risley_borrow_headers(${target} risley_standard_headers)
  endif()
  foreach(layer IN LISTS RISLEY_${name}_LAYERS)
    target_link_libraries(${target} PUBLIC risley_${layer})
  endforeach()
  foreach(kind PUBLIC PRIVATE BUILD)
    foreach(key IN LISTS RISLEY_${name}_${kind})
      get_property(package GLOBAL PROPERTY RISLEY_PACKAGE_${key}_TARGET)
      if(kind STREQUAL "BUILD") # linking would hand the package on to users
        target_include_directories(${target} SYSTEM PRIVATE
                                   $<TARGET_PROPERTY:${package},INTERFACE_INCLUDE_DIRECTORIES>)
      else()
        target_link_libraries(${target} ${kind} ${package})
      endif()
    endforeach()
  endforeach()
endfunction()

# Makes the layers of the components that are asked for (all when none is), after their packages are found.
# Afterwards RISLEY_LAYERS lists those that were made, RISLEY_LAYER_TARGETS what risley::risley links.
macro(risley_make_layers)
  set(wanted "")
  foreach(layer ${ARGN})
    if(NOT layer IN_LIST RISLEY_LAYERS)
      list(JOIN RISLEY_LAYERS ", " known)
      message(FATAL_ERROR "RISLEY_COMPONENTS = ${layer}, allowed: ${known}")
    endif()
    list(APPEND wanted ${RISLEY_${layer}_CLOSURE})
  endforeach()
  if(wanted)
    foreach(layer IN LISTS RISLEY_LAYERS)
      if(NOT layer IN_LIST wanted)
        list(REMOVE_ITEM RISLEY_LAYERS ${layer})
      endif()
    endforeach()
  endif()
  set(packages "")
  foreach(layer IN LISTS RISLEY_LAYERS)
    list(APPEND packages ${RISLEY_${layer}_PUBLIC} ${RISLEY_${layer}_PRIVATE}
                         ${RISLEY_${layer}_BUILD})
  endforeach()
  if(RISLEY_BUILD_APPS)
    list(APPEND packages cli11 spdlog tbb nlohmann-json)
  endif()
  if(RISLEY_BUILD_PYTHON)
    list(APPEND packages python pybind11)
  endif()
  if(RISLEY_BUILD_TESTS)
    list(APPEND packages gtest ceres)
  endif()
  if(RISLEY_BUILD_BENCHMARKS)
    list(APPEND packages benchmark ceres)
  endif()
  list(REMOVE_DUPLICATES packages)
  risley_require_packages(${packages})
  risley_add_headers(risley_standard_headers HEADERS ${RISLEY_STANDARD_HEADERS} LINK fmt::fmt)
  if(TARGET Eigen3::Eigen)
    risley_add_headers(risley_eigen_headers HEADERS ${RISLEY_EIGEN_HEADERS}
                       LINK fmt::fmt Eigen3::Eigen)
  endif()
  set(RISLEY_LAYER_TARGETS "")
  foreach(layer IN LISTS RISLEY_LAYERS)
    risley_make_layer(${layer})
    list(APPEND RISLEY_LAYER_TARGETS risley_${layer})
  endforeach()
endmacro()
