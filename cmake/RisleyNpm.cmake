# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Packages of the npm registry, of which only files are needed: no npm, no install scripts.

set(RISLEY_NPM_FOLDER ${PROJECT_BINARY_DIR}/npm CACHE PATH "Where packages of npm are kept")

# Downloads one package, once, and sets <out> to its folder.
# Both the server's certificate and the hash must be right.
function(risley_npm_package out name version sha512)
  set(folder ${RISLEY_NPM_FOLDER}/${name}-${version})
  set(${out} ${folder}/package PARENT_SCOPE)
  if(EXISTS ${folder}/package/package.json)
    return()
  endif()
  set(url https://registry.npmjs.org/${name}/-/${name}-${version}.tgz)
  set(archive ${RISLEY_NPM_FOLDER}/${name}-${version}.tgz)
  foreach(attempt RANGE 1 3)
    file(DOWNLOAD ${url} ${archive} TLS_VERIFY ON INACTIVITY_TIMEOUT 30 STATUS status)
    list(GET status 0 code)
    if(code EQUAL 0)
      break()
    endif()
  endforeach()
  if(NOT code EQUAL 0)
    list(GET status 1 reason)
    file(REMOVE ${archive})
    message(FATAL_ERROR "${url} cannot be downloaded: ${reason}. Certificates of servers are in the "
                        "Debian package ca-certificates. Without a network, unpack the archive on "
                        "another machine and copy its folder \"package\" to ${folder}/package.")
  endif()
  file(SHA512 ${archive} found)
  if(NOT found STREQUAL sha512)
    file(REMOVE ${archive})
    message(FATAL_ERROR "${url} has the SHA-512 ${found}, expected ${sha512}")
  endif()
  file(ARCHIVE_EXTRACT INPUT ${archive} DESTINATION ${folder})
  file(REMOVE ${archive})
endfunction()
