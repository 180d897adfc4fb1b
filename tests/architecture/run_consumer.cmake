# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Builds and runs tests/consumer from nothing. Variables: CONSUMER (its folder), WORK (emptied),
# OPTIONS (for its configure step) and either BUILD (ours, installed first) or TREE (our sources).
function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
if(BUILD)
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
  list(APPEND OPTIONS -DCMAKE_PREFIX_PATH=${WORK}/prefix)
else()
  list(APPEND OPTIONS -DRISLEY_TREE=${TREE})
endif()
run(${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/build -G Ninja --log-level=WARNING ${OPTIONS})
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/point_a_beam)
if(EXISTS ${WORK}/prefix/bin/risley)
  run(${WORK}/prefix/bin/risley --version)
endif()
