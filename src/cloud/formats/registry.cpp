// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/formats/cloud_format.hpp"

namespace risley::cloud {

const std::vector<const CloudWriterFormat*>& all_cloud_formats() {
  static const std::vector<const CloudWriterFormat*> formats{
      &kLasFormat,
#ifdef RISLEY_HAS_LASZIP
      &kLazFormat,
#endif
      &kPlyFormat,    &kPcdFormat,     &kNpyFormat,     &kCsvFormat,  &kXyzFormat,
      &kNetcdfFormat, &kRos1BagFormat, &kRos2BagFormat, &kMcapFormat,
  };
  return formats;
}

}  // namespace risley::cloud
