// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/depth_spread.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <string_view>

#include "interp/dowels/dowel.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

// configs/tables/t_table_2023.yaml, sd.
const std::map<std::string, double, std::less<>>& TTableSd_mm() {
  static const std::map<std::string, double, std::less<>> sd_mm = {
      {"g", 1},  {"n", 1.5},  {"rhi", 1},   {"mp", 2.5}, {"pr", 3},  {"id", 3},
      {"sm", 2}, {"pg", 2.5}, {"me", 2.5},  {"mso", 2},  {"mio", 3}, {"zy", 3},
      {"go", 6}, {"sM2", 7},  {"iM2", 6.5}, {"mr", 5}};
  return sd_mm;
}

constexpr double kMeanShareOfDepth = 0.29;

}  // namespace

double PublishedSd_mm(const Dowel& dowel) {
  if (std::isfinite(dowel.sd_mm)) {
    return dowel.sd_mm;
  }
  const auto found = TTableSd_mm().find(WithoutSide(dowel.site));
  return found != TTableSd_mm().end() ? found->second : kMeanShareOfDepth * dowel.depth_mm;
}

double DepthSd_mm(const TableDepthOptions& options, const Dowel& dowel) {
  return options.own * PublishedSd_mm(dowel);
}

ImplicitSpread ImplicitSpread_mm(const ImplicitSpreadOptions& options, const TriMesh& implicit,
                                 const TriMesh& shell, std::span<const Dowel> dowels,
                                 const TableDepthOptions* table, int threads) {
  const MeshQuery query(shell);
  ImplicitSpread spread{std::vector<double>(implicit.points.size()),
                        std::vector<double>(implicit.points.size())};
  ParallelFor(implicit.points.size(), threads, 256, [&](std::size_t v) {
    const MeshPoint foot = query.Closest(implicit.points[v]);
    const auto squared_mm = [&](const Dowel& d) { return (d.base - foot.position).squaredNorm(); };
    const Dowel& nearest = *std::ranges::min_element(dowels, {}, squared_mm);
    const double beyond_mm = std::max(0.0, std::sqrt(squared_mm(nearest)) - options.reach_mm),
                 own_mm = table == nullptr ? 0 : DepthSd_mm(*table, nearest);
    const double near_mm = std::hypot(options.sd_mm, options.share * foot.distance_mm, own_mm);
    spread.sd[v] = std::hypot(near_mm, options.rate * beyond_mm);
    spread.error[v] = std::hypot(near_mm, options.sigma_rate * beyond_mm);
  });
  return spread;
}

}  // namespace semblance
