# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Drives the browser: sets `playwright` to the folder of the package. As a script,
# `cmake -DPROJECT_SOURCE_DIR=. -DPROJECT_BINARY_DIR=FOLDER -P tests/browser/playwright.cmake`
# leaves it in FOLDER/npm/.
include(${PROJECT_SOURCE_DIR}/cmake/RisleyNpm.cmake)
risley_npm_package(playwright playwright-core 1.56.1
  86eb6b6b29f29f7d45f8189f99ef8fb3d56ae7d84ab940b3ec7d640ce701b3eda81a0b8a9164d4e746c15abb73df83945a6230a414d60f16913d7ac85e482f99)
