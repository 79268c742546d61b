// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/point_query.h"

#include <CGAL/Kd_tree.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

using PointKernel = CGAL::Simple_cartesian<double>;
using Search = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<PointKernel>>;

std::vector<PointKernel::Point_3> CopyOf(std::span<const Vec3> points) {
  if (points.empty()) {
    throw InputError("point query: there are no points; give at least one");
  }
  std::vector<PointKernel::Point_3> copy;
  copy.reserve(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!points[k].allFinite()) {
      throw InputError(fmt::format("point query: point {} is not finite; leave it out", k));
    }
    copy.emplace_back(points[k].x(), points[k].y(), points[k].z());
  }
  return copy;
}

}  // namespace

struct PointQuery::Tree {
  explicit Tree(const std::vector<PointKernel::Point_3>& points)
      : tree(points.begin(), points.end()) {
    tree.build();  // now, and not at the first question, which several threads may ask
  }
  Search::Tree tree;
};

PointQuery::PointQuery(std::span<const Vec3> points)
    : tree_(std::make_unique<Tree>(CopyOf(points))) {}
PointQuery::~PointQuery() = default;
PointQuery::PointQuery(PointQuery&&) noexcept = default;
PointQuery& PointQuery::operator=(PointQuery&&) noexcept = default;

double PointQuery::DistanceTo(const Vec3& p, int rank) const {
  if (static_cast<std::size_t>(rank) > tree_->tree.size()) {
    return std::numeric_limits<double>::infinity();
  }
  const Search search(tree_->tree, {p.x(), p.y(), p.z()}, static_cast<unsigned>(rank));
  double farthest = 0;
  for (const auto& [point, squared] : search) {
    farthest = std::max(farthest, squared);
  }
  return std::sqrt(farthest);
}

}  // namespace semblance
