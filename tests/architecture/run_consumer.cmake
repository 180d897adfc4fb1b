# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Builds and runs tests/consumer from nothing, in the ways that WAY names:
#   installed  what BUILD installs: all of it, one component, and with pkg-config
#   in_tree    TREE as a subfolder, with the kernels of one processor
#   shared     the component optics of TREE as shared libraries: installed, and with pkg-config
# Further variables: CONSUMER (its folder), WORK (emptied), OPTIONS (of configure steps), COMPILER.
function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Configures, builds and runs the consumer in a folder of its own.
function(consume name)
  run(${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/${name} -G Ninja --log-level=WARNING ${OPTIONS}
      -DCMAKE_PREFIX_PATH=${WORK}/prefix ${ARGN})
  run(${CMAKE_COMMAND} --build ${WORK}/${name})
  run(${WORK}/${name}/point_a_beam)
endfunction()

# Expects that configuring ends with a message that matches a pattern.
function(refuse name pattern)
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/${name} -G Ninja ${OPTIONS}
                          -DCMAKE_PREFIX_PATH=${WORK}/prefix ${ARGN}
                  RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  string(REGEX REPLACE "[ \n]+" " " text "${text}") # CMake wraps its messages
  if(status EQUAL 0 OR NOT text MATCHES "${pattern}")
    message(FATAL_ERROR "${name}: expected the message \"${pattern}\", got status ${status}:\n${text}")
  endif()
endfunction()

# Compiles and runs the consumer with nothing but what pkg-config says.
function(consume_pkg_config module)
  set(ENV{PKG_CONFIG_PATH} "")
  file(GLOB_RECURSE found ${WORK}/prefix/*/${module}.pc)
  get_filename_component(folder "${found}" DIRECTORY)
  execute_process(COMMAND pkg-config --with-path=${folder} --cflags --libs ${module}
                  OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(flags UNIX_COMMAND "${flags}")
  get_filename_component(libraries "${folder}" DIRECTORY)
  run(${COMPILER} -std=c++20 ${CONSUMER}/main.cpp -o ${WORK}/${module}_user ${flags}
      -Wl,-rpath,${libraries})
  run(${WORK}/${module}_user)
endfunction()

file(REMOVE_RECURSE ${WORK})
if(WAY STREQUAL "installed")
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
  consume(all)
  # Optics needs no library but fmt, xsimd and Eigen, sensors yaml-cpp beside them.
  set(hidden "")
  foreach(package TBB nlohmann_json OpenSSL SQLite3 ZLIB fastcdr PkgConfig)
    list(APPEND hidden -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
  endforeach()
  consume(sensors -DCOMPONENTS=sensors ${hidden})
  consume(optics -DCOMPONENTS=optics ${hidden} -DCMAKE_DISABLE_FIND_PACKAGE_yaml-cpp=ON)
  refuse(no_such_layer "risley has no component telescope; it has core, " -DCOMPONENTS=telescope)
  refuse(no_package "risley::tables needs packages that are missing.*libsqlite3-dev"
         -DCMAKE_DISABLE_FIND_PACKAGE_SQLite3=ON)
  consume_pkg_config(risley)
  consume_pkg_config(risley-optics)
  if(EXISTS ${WORK}/prefix/bin/risley)
    run(${WORK}/prefix/bin/risley --version)
    foreach(file share/risley/data/hall.yaml share/risley/presets/mid-40.yaml share/doc/risley/LICENSE
                 share/doc/risley/echarts/LICENSE share/doc/risley/echarts/NOTICE
                 share/doc/risley/echarts-gl/LICENSE share/doc/risley/three/LICENSE share/doc/risley/THIRD-PARTY.md share/man/man1/risley.1
                 share/man/man1/risley-estimate.1 share/bash-completion/completions/risley
                 share/zsh/site-functions/_risley share/fish/vendor_completions.d/risley.fish)
      if(NOT EXISTS ${WORK}/prefix/${file})
        message(FATAL_ERROR "${file} is not installed")
      endif()
    endforeach()
    file(GLOB package ${WORK}/prefix/lib/python3*/site-packages)
    if(package)
      run(${CMAKE_COMMAND} -E env PYTHONPATH=${package} PYTHONDONTWRITEBYTECODE=1
          /usr/bin/python3 -c "import risley; print(risley.__version__)")
    endif()
    run(${WORK}/prefix/bin/risley preset check ${WORK}/prefix/share/risley/presets/mid-40.yaml)
  endif()
elseif(WAY STREQUAL "in_tree")
  set(optics -DRISLEY_TREE=${TREE} -DCOMPONENTS=optics)
  consume(in_tree ${optics} -DCMAKE_BUILD_TYPE= -DRISLEY_INSTRUCTION_SETS=native)
  refuse(no_such_set "RISLEY_INSTRUCTION_SETS = sse9, allowed: all, native, or a list of baseline"
         ${optics} -DRISLEY_INSTRUCTION_SETS=sse9)
  # Valgrind's processor has no AVX-512.
  find_program(valgrind valgrind)
  cmake_host_system_information(RESULT architecture QUERY OS_PLATFORM)
  if(valgrind AND architecture STREQUAL x86_64)
    run(${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/in_tree -DRISLEY_INSTRUCTION_SETS=avx512)
    run(${CMAKE_COMMAND} --build ${WORK}/in_tree)
    execute_process(COMMAND ${valgrind} -q ${WORK}/in_tree/point_a_beam
                    RESULT_VARIABLE status OUTPUT_VARIABLE text)
    if(NOT status EQUAL 3 OR NOT text MATCHES "= avx512, of which this processor supports none: build risley")
      message(FATAL_ERROR "with kernels of another processor: status ${status}:\n${text}")
    endif()
  endif()
  refuse(no_package "Packages are missing.*libyaml-cpp-dev" -DRISLEY_TREE=${TREE}
         -DCOMPONENTS=sensors -DCMAKE_DISABLE_FIND_PACKAGE_yaml-cpp=ON)
elseif(WAY STREQUAL "shared")
  run(${CMAKE_COMMAND} -S ${TREE} -B ${WORK}/build -G Ninja --log-level=WARNING ${OPTIONS}
      -DBUILD_SHARED_LIBS=ON -DRISLEY_COMPONENTS=optics -DCMAKE_INSTALL_LIBDIR=lib)
  run(${CMAKE_COMMAND} --build ${WORK}/build)
  run(${CMAKE_COMMAND} --install ${WORK}/build --prefix ${WORK}/prefix)
  consume(optics -DCOMPONENTS=optics)
  consume_pkg_config(risley-optics)
  file(GLOB names RELATIVE ${WORK}/prefix/lib ${WORK}/prefix/lib/librisley_*)
  if(NOT "${names}" MATCHES "librisley_optics.so;librisley_optics.so.[0-9]+.[0-9]+;librisley_optics.so.[0-9]+.[0-9]+.[0-9]+")
    message(FATAL_ERROR "the libraries are ${names}, expected links with the version and the soname")
  endif()
  # Exported are our names and no templates of other libraries, nor kernels.
  foreach(library core optics)
    execute_process(COMMAND nm -D --defined-only -P ${WORK}/prefix/lib/librisley_${library}.so
                    OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
    string(REGEX MATCHALL "[^\n]+" symbols "${symbols}")
    set(ours ${symbols})
    list(FILTER ours INCLUDE REGEX "^_Z[A-Za-z0-9_]*N[K]?6risley")
    set(strange ${symbols})
    list(FILTER strange EXCLUDE REGEX "^_Z[A-Za-z0-9_]*N[K]?6risley")
    set(kernels ${symbols})
    list(FILTER kernels INCLUDE REGEX "kernel_(baseline|avx2|avx512)")
    if(NOT ours OR strange OR kernels)
      list(JOIN strange "\n  " strange)
      list(JOIN kernels "\n  " kernels)
      message(FATAL_ERROR "librisley_${library}.so exports\n  ${strange}\n  ${kernels}")
    endif()
  endforeach()
else()
  message(FATAL_ERROR "WAY = ${WAY}, allowed: installed, in_tree, shared")
endif()
