# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Packages of the npm registry, of which only files are needed: no npm, no install scripts.

set(RISLEY_NPM_FOLDER ${PROJECT_BINARY_DIR}/npm CACHE PATH "Where packages of npm are kept")

# Unpacks one package, once, and sets <out> to its folder. Archives of scripts/source-archive have it in
# third-party/npm; otherwise it is downloaded, and kept in RISLEY_NPM_ARCHIVES if that is set.
# Both the server's certificate and the hash must be right.
function(risley_npm_package out name version sha512)
  set(folder ${RISLEY_NPM_FOLDER}/${name}-${version})
  set(${out} ${folder}/package PARENT_SCOPE)
  if(EXISTS ${folder}/package/package.json)
    return()
  endif()
  get_filename_component(file ${name} NAME) # without the scope, as in @mcap/core
  set(url https://registry.npmjs.org/${name}/-/${file}-${version}.tgz)
  string(REPLACE / - flat ${name})
  set(archive ${PROJECT_SOURCE_DIR}/third-party/npm/${flat}-${version}.tgz)
  if(EXISTS ${archive})
    risley_check_npm_archive(${archive} ${archive} ${sha512})
  else()
    set(archive ${RISLEY_NPM_FOLDER}/${flat}-${version}.tgz)
    risley_download(${url} ${archive} ${folder}/package)
    risley_check_npm_archive(${archive} ${url} ${sha512})
    if(RISLEY_NPM_ARCHIVES)
      file(COPY ${archive} DESTINATION ${RISLEY_NPM_ARCHIVES})
    endif()
  endif()
  file(ARCHIVE_EXTRACT INPUT ${archive} DESTINATION ${folder})
  file(REMOVE ${RISLEY_NPM_FOLDER}/${flat}-${version}.tgz)
endfunction()

function(risley_download url archive place)
  foreach(attempt RANGE 1 3)
    file(DOWNLOAD ${url} ${archive} TLS_VERIFY ON INACTIVITY_TIMEOUT 30 STATUS status)
    list(GET status 0 code)
    if(code EQUAL 0)
      return()
    endif()
  endforeach()
  list(GET status 1 reason)
  file(REMOVE ${archive})
  message(FATAL_ERROR "${url} cannot be downloaded: ${reason}. Certificates of servers are in the "
                      "Debian package ca-certificates. Without a network, unpack the archive on "
                      "another machine and copy its folder \"package\" to ${place}, or build from an "
                      "archive that scripts/source-archive made.")
endfunction()

# An archive with another hash is removed, but for one that came with the sources.
function(risley_check_npm_archive archive source sha512)
  file(SHA512 ${archive} found)
  if(NOT found STREQUAL sha512)
    if(NOT archive STREQUAL source)
      file(REMOVE ${archive})
    endif()
    message(FATAL_ERROR "${source} has the SHA-512 ${found}, expected ${sha512}")
  endif()
endfunction()
