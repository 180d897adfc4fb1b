# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
set(RISLEY_LAYER_TARGETS "")

# Compiler settings that every target of ours shares, never a consumer.
function(risley_target_defaults target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                         -Wno-sign-conversion
                         # gcc 12 sees overlaps in std::string (gcc.gnu.org/PR105651)
                         $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
                         $<$<BOOL:${RISLEY_WARNINGS_AS_ERRORS}>:-Werror>)
endfunction()

# One layer: a library risley_<name> (alias risley::<name>) of include/risley/<name> and
# src/<name>, linked to the layers it may include and to no other.
function(risley_add_layer name)
  cmake_parse_arguments(arg "" "" "LAYERS" ${ARGN})
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/include/risley/${name}/*.hpp)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${name}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "_kernel\\.cpp$") # built once per instruction set
  set(target risley_${name})
  add_library(${target} STATIC ${sources})
  add_library(risley::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR}/include
                 FILES ${headers})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src) # "<layer>/private.hpp"
  risley_target_defaults(${target})
  foreach(layer IN LISTS arg_LAYERS)
    target_link_libraries(${target} PUBLIC risley_${layer})
  endforeach()
  set(RISLEY_LAYER_TARGETS ${RISLEY_LAYER_TARGETS} ${target} PARENT_SCOPE)
endfunction()
