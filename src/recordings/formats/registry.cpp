// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/format.hpp"

namespace risley::recordings {

const std::vector<const Format*>& all_formats() {
  static const std::vector<const Format*> formats{
      &kLvx11Format,
      &kLvx10Format,
      &kLvx2Format,
      &kNetcdfFormat,
      &kOpenpylivoxBinFormat,
      &kViewerCsvFormat,
      &kOpenpylivoxCsvFormat,
      &kScanSequenceCsvFormat,
      &kRos1BagFormat,
      &kRos2BagFormat,
      &kMcapFormat,
      &kPcapFormat,
      &kLasFormat,
      &kLazFormat,
      &kPcdFormat,
      &kPlyFormat,
      &kNpyFormat,
      &kNpzFormat,
      &kNamedCsvFormat,
  };
  return formats;
}

}  // namespace risley::recordings
