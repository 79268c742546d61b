// SPDX-License-Identifier: GPL-3.0-or-later
// docs/reference/sites.md: each site's names, its place on the bone, and the tables that have it.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "problems/subject/tissue_table.h"

namespace semblance::problems {

// Makes the page with the sites of sites.h in their order. `picture` is the name of the picture's
// file in the same folder. The tables are named in the given order and explained below. The same
// input gives the same text.
std::string SitePage(std::span<const TissueTable> tables, const std::string& picture);

// The place of a site on the bone, in words. `landmark` is its code without side. Throws InputError
// for a landmark that is not in sites.h.
std::string_view SiteDefinition(std::string_view landmark);

}  // namespace semblance::problems
