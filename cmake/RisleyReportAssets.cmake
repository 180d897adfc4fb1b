# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# What pages of results carry with them, so that they need no network: styles, scripts, the charting
# library Apache ECharts with its 3-D part, and three.js.
include(RisleyCharts)

# three.js comes as two modules, and a page that is opened from a file cannot import modules. Makes
# one script of them that sets window.THREE.
function(risley_join_three out)
  set(name "[A-Za-z0-9_$]+")
  set(core_file "\"./three.core.min.js\";")
  file(READ ${three}/build/three.core.min.js core)
  string(FIND "${core}" "export{" at REVERSE)
  string(SUBSTRING "${core}" ${at} -1 core_exports)
  string(SUBSTRING "${core}" 0 ${at} core)
  string(REGEX REPLACE "(${name}) as (${name})" "\\2:\\1" core_exports "${core_exports}")
  string(REPLACE "export{" "return{" core_exports "${core_exports}")
  file(READ ${three}/build/three.module.min.js module)
  string(FIND "${module}" "import{" begin)
  string(FIND "${module}" "}from${core_file}export{" middle)
  string(FIND "${module}" "}from${core_file}" end REVERSE)
  string(FIND "${module}" "export{" at REVERSE)
  if(begin EQUAL -1 OR middle EQUAL -1 OR NOT middle LESS end OR NOT end LESS at)
    message(FATAL_ERROR "the modules of three.js in ${three} are not as expected")
  endif()
  math(EXPR length "${middle} - ${begin}")
  string(SUBSTRING "${module}" ${begin} ${length} imports)
  string(REGEX REPLACE "(${name}) as (${name})" "\\1:\\2" imports "${imports}")
  string(REPLACE "import{" "const{" imports "${imports}")
  string(SUBSTRING "${module}" ${at} -1 exports)
  string(REGEX REPLACE "(${name}) as (${name})" "\\2:\\1" exports "${exports}")
  string(REPLACE "export{" "window.THREE={...core," exports "${exports}")
  string(LENGTH "}from${core_file}" skipped)
  math(EXPR end "${end} + ${skipped}")
  math(EXPR length "${at} - ${end}")
  string(SUBSTRING "${module}" ${end} ${length} module)
  set(joined "(()=>{'use strict';const core=(()=>{${core}${core_exports}})();${imports}}=core;${module}${exports}})();\n")
  file(CONFIGURE OUTPUT ${out} CONTENT "@joined@" @ONLY)
endfunction()

risley_embed_text(risley_report ${echarts}/dist/echarts.min.js risley::report::echarts_script)
risley_embed_text(risley_report ${echarts_gl}/dist/echarts-gl.min.js
                  risley::report::echarts_gl_script)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/page.js
                  risley::report::page_script)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/page.css
                  risley::report::page_style)
risley_join_three(${PROJECT_BINARY_DIR}/generated/three.js)
risley_embed_text(risley_report ${PROJECT_BINARY_DIR}/generated/three.js risley::report::three_script)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/viewer.html risley::report::viewer_stage)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/viewer.css risley::report::viewer_style)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/viewer.js risley::report::viewer_script)
# The page of a recording that runs.
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/watch.html risley::report::watch_page)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/watch.js risley::report::watch_script)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/watch.css risley::report::watch_style)
