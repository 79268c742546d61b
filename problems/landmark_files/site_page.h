// SPDX-License-Identifier: GPL-3.0-or-later
// docs/sites.md: each site's names, its place on the bone, and the tables that have it.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "problems/subject/tissue_table.h"

namespace semblance {

// The page, for the sites of sites.h in their order; picture: the file's name beside it. tables: in
// whose order they are named; all of them are explained below. The same input, the same text.
std::string SitePage(std::span<const TissueTable> tables, const std::string& picture);

// Where a site lies on the bone, in words. landmark: its code without side. Throws InputError for
// one that is not in sites.h.
std::string_view SiteDefinition(std::string_view landmark);

}  // namespace semblance
