# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Draws the diagrams of the pages and the points of clouds: sets `echarts`, `echarts_gl` and `three` to the folders of
# the packages. As a script,
# `cmake -DPROJECT_SOURCE_DIR=. -DPROJECT_BINARY_DIR=FOLDER -P cmake/RisleyCharts.cmake` leaves them in FOLDER/npm/.
include(${PROJECT_SOURCE_DIR}/cmake/RisleyNpm.cmake)
risley_npm_package(echarts echarts 6.1.0
  ab4c9a14f8200bd15476c587e1b95abd15859b176b22875b92828d02326e74023a080f6034fc47b55d917193447a9655964e32bc16243a46e4e87215a48c8764)
risley_npm_package(echarts_gl echarts-gl 2.1.0
  1b1cc03d3609c8e00d6eeec89e474657b40b2e9572b9058dbcdd72c841088aa80cd758a500ed8e92f3cd81175ff39e11f593edfc2d470208cef1476b8fad6539)
risley_npm_package(three three 0.182.0
  19b1da6d3f88aeffa2848d7f7f990822c67e11ff5297903563b8a6bd2e514235a0b533df3e7678dc99a5608ecdb424432bdce2af6d254297e0f3ff58774d8ebd)
