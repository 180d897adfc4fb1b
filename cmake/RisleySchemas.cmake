# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# What results hold, with units and ranges: docs/schemas, which files that are read back must fit and
# which tables take their columns from.
foreach(name columns common estimate calibrate report_file)
  risley_embed_text(risley_json ${PROJECT_SOURCE_DIR}/docs/schemas/${name}.json
                    risley::json::${name}_schema)
endforeach()
