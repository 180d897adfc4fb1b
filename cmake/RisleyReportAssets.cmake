# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# What every page of results carries with it, so that it needs no network: style, script and the
# charting library Apache ECharts with its 3-D part.
include(RisleyCharts)
risley_embed_text(risley_report ${echarts}/dist/echarts.min.js risley::report::echarts_script)
risley_embed_text(risley_report ${echarts_gl}/dist/echarts-gl.min.js
                  risley::report::echarts_gl_script)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/page.js
                  risley::report::page_script)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/page.css
                  risley::report::page_style)
# The page of a recording that runs.
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/watch.html risley::report::watch_page)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/watch.js risley::report::watch_script)
risley_embed_text(risley_report ${PROJECT_SOURCE_DIR}/src/report/watch.css risley::report::watch_style)
