// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/campaign.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// The answer in one sentence: whether errors agree with the covariances.
std::string campaign_words(const jobs::CampaignResult& merged);

/// One self-contained HTML page on a campaign: errors over their bounds and squared errors over
/// covariances, setting by setting and parameter by parameter.
/// @param provenance  how to reproduce it: name and value pairs
std::string campaign_page(const jobs::CampaignResult& merged, const jobs::Provenance& provenance);

}  // namespace risley::report
