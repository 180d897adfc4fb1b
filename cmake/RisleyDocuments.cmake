# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Manual pages and completions of the command, made from its own --help, in RISLEY_DOCUMENTS.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(RISLEY_DOCUMENTS ${PROJECT_BINARY_DIR}/documents)
set(maker ${PROJECT_SOURCE_DIR}/tools/command_documents.py)
set(compress "")
set(dated "")
if(RISLEY_DEBIAN_PACKAGES)
  set(compress --compress)
  set(dated ${PROJECT_BINARY_DIR}/debian/changelog)
endif()
add_custom_command(OUTPUT ${RISLEY_DOCUMENTS}/completions/risley.fish
                   COMMAND ${Python3_EXECUTABLE} ${maker} $<TARGET_FILE:risley> ${RISLEY_DOCUMENTS} ${compress}
                   DEPENDS risley ${maker} ${dated} COMMENT "Making manual pages and completions" VERBATIM)
add_custom_target(risley_documents ALL DEPENDS ${RISLEY_DOCUMENTS}/completions/risley.fish)
