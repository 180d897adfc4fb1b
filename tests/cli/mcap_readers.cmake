# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Readers of MCAP and of ROS 2's messages that are not ours: sets `mcap_readers` to a folder whose
# node_modules has them. Runs as a script as tests/browser/playwright.cmake does.
include(${PROJECT_SOURCE_DIR}/cmake/RisleyNpm.cmake)
set(mcap_readers ${RISLEY_NPM_FOLDER}/mcap-readers)
function(mcap_reader name version sha512)
  risley_npm_package(package ${name} ${version} ${sha512})
  get_filename_component(folder ${mcap_readers}/node_modules/${name} DIRECTORY)
  file(MAKE_DIRECTORY ${folder})
  file(CREATE_LINK ${package} ${mcap_readers}/node_modules/${name} SYMBOLIC)
endfunction()
mcap_reader(@mcap/core 2.2.2
  5b83458b2a90949b0d8f0f09c40010f3bdaed312d6272d06142dd8166f1b4cb6cdb3e1dd0d67bc0f006ace7af43066295adc3e017f17cc7581e58f6b2c418926)
mcap_reader(@foxglove/crc 0.0.3
  0e3219b272f70b23ffc90fef51803d723ac3d1affc6177a3239666b1a3a24f5e9c2df65c4f0682c48374d7fcace23b32f9d64243ff439d6167ec01056e230368)
mcap_reader(heap-js 2.7.1
  1107decd18343426463658650d1dc4bebc351552f61b72e153b1203e8c6e7d02abb8d052600f0c8913c77966d4fb7ea8f8585e974c0cc0cfac2c488102534b24)
mcap_reader(tslib 2.9.1
  6b8531f552ae20c1ec392ec435b12aea12b66466084f6ed1b65d04e1e0fd2aac3184a89078c644ffdc5bdc8758c166923b220140b1318508170d3628882c6758)
mcap_reader(@foxglove/rosmsg 5.0.5
  faa63ac56fb81dd6cf23722d0251453235e0022a655f246cbfe92a74193c39c5861f7f0198477bb3abff5670a46d8a2f028079adf479822b8a7e63d1373c1bac)
mcap_reader(md5-typescript 1.0.5
  a2f01ce04b6236dd9d63c24f84faffc240bd87853993f9ee0a5355706d066b7575acc958a40636e1969aca6157265cfe71c27a50c3e8dc549a54a7bb73306c5f)
mcap_reader(@foxglove/rosmsg2-serialization 3.1.0
  378dd7728604c1dd9b0935b0c78f558cdf54b8ad7ede78e15af6d7341aeb1d8f372819208fb04790342a9c36ebebd4749c5009474b9f4c5a89a23d39e2db8eee)
mcap_reader(@foxglove/cdr 3.5.0
  b6b8fcb81f89ef54ae5bd83c4db6c38136efaab9941d08e1e6e86a040ada0618388719bb686f4014fbf3df8c89fd7667976f31d0db8b8e9b4960a35252580cf5)
mcap_reader(@foxglove/message-definition 0.5.0
  07fd86bd69f8c114ac3c3cb0726cbab8d5e001f6518623809e6cb7a80692e8c1d5aa21d0aacfd1a03b285ba1b0f6c5d2c1e269787e6a02a02286f9b5a51f5386)
mcap_reader(@foxglove/rostime 1.1.3
  1abdd7cb8b0d6e8d8d717834b411dbfe3554a88703c99d648078fd741ecaf98d40ec0434a120a649722e7fca2a7ad79222cd2997c04939613002d2cd0bdf48ce)
