// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/dowel.h"

namespace semblance::interp {

Side SideOfSite(std::string_view site) {
  if (site.size() <= 2) {
    return Side::kMidline;
  }
  return site.ends_with("_l") ? Side::kLeft : site.ends_with("_r") ? Side::kRight : Side::kMidline;
}

std::string WithoutSide(std::string_view site) {
  const std::size_t suffix = SideOfSite(site) == Side::kMidline ? 0 : 2;
  return std::string(site.substr(0, site.size() - suffix));
}
}  // namespace semblance::interp
