// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/triangulation/even_points.h"

#include <CGAL/Kd_tree.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Search_traits_adapter.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/property_map.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

using SearchKernel = CGAL::Simple_cartesian<double>;
using Indexed = std::pair<SearchKernel::Point_3, std::uint32_t>;
using SearchTraits = CGAL::Search_traits_adapter<Indexed, CGAL::First_of_pair_property_map<Indexed>,
                                                 CGAL::Search_traits_3<SearchKernel>>;
using Search = CGAL::Orthogonal_k_neighbor_search<SearchTraits>;

// The points nearest to a place, with the tree kept.
class Neighbours {
 public:
  explicit Neighbours(std::span<const Vec3> points) : points_(points) {
    std::vector<Indexed> indexed;
    indexed.reserve(points.size());
    for (std::uint32_t k = 0; k < points.size(); ++k) {
      indexed.emplace_back(SearchKernel::Point_3(points[k].x(), points[k].y(), points[k].z()), k);
    }
    tree_.insert(indexed.begin(), indexed.end());
    tree_.build();
  }

  // Nearest first.
  std::vector<std::uint32_t> NearestTo(const Vec3& p, int count) const {
    const Search search(tree_, SearchKernel::Point_3(p.x(), p.y(), p.z()),
                        static_cast<unsigned>(count));
    std::vector<std::uint32_t> nearest;
    for (const auto& [point, squared] : search) {
      nearest.push_back(point.second);
    }
    return nearest;
  }

  const Vec3& operator[](std::uint32_t k) const { return points_[k]; }

 private:
  std::span<const Vec3> points_;
  Search::Tree tree_;
};

// In an order of their own, each place once, and at most so many.
std::vector<Vec3> SomeInOrder(std::span<const Vec3> points) {
  constexpr std::size_t kMost = 200000;
  std::vector<Vec3> sorted(points.begin(), points.end());
  std::sort(sorted.begin(), sorted.end(), [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  const std::size_t every = std::max<std::size_t>((sorted.size() + kMost - 1) / kMost, 1);
  std::vector<Vec3> some;
  for (std::size_t k = 0; k < sorted.size(); k += every) {
    some.push_back(sorted[k]);
  }
  return some;
}

double Reach(const Neighbours& all, const Vec3& p, const std::vector<std::uint32_t>& nearest) {
  return (all[nearest.back()] - p).norm();
}

// Whether a point has much more room than some of what lies around it.
bool IsAlone(const Neighbours& all, const Vec3& p, int per_place, double reach_mm) {
  constexpr double kMoreRoom = 2.5;
  const std::vector<std::uint32_t> around = all.NearestTo(p, 4 * per_place);
  std::vector<double> rooms_mm;
  for (std::size_t k = around.size() / 5; k < around.size();
       k += std::max<std::size_t>(around.size() / 5, 1)) {
    const Vec3& other = all[around[k]];
    rooms_mm.push_back(Reach(all, other, all.NearestTo(other, per_place + 1)));
  }
  std::sort(rooms_mm.begin(), rooms_mm.end());
  return rooms_mm.size() > 1 && reach_mm > kMoreRoom * rooms_mm[1];
}

EvenPoints Thinned(const Neighbours& all, std::size_t count, int per_place) {
  std::vector<char> covered(count, 0);
  EvenPoints kept;
  for (std::uint32_t k = 0; k < count; ++k) {
    if (covered[k] != 0) {
      continue;
    }
    const std::vector<std::uint32_t> nearest = all.NearestTo(all[k], per_place + 1);
    const double reach_mm = Reach(all, all[k], nearest);
    if (!IsAlone(all, all[k], per_place, reach_mm)) {
      kept.positions.push_back(all[k]);
      kept.spacings_mm.push_back(reach_mm);
      for (const std::uint32_t n : nearest) {
        covered[n] = 1;
      }
    }
  }
  return kept;
}

// Onto the plane of least squares through what lies around it. Returns how thick that is, over how
// wide in its narrower direction.
double MoveOntoPlane(const Neighbours& all, int count, Vec3& p) {
  const std::vector<std::uint32_t> nearest = all.NearestTo(p, count);
  Vec3 mean = Vec3::Zero();
  for (const std::uint32_t n : nearest) {
    mean += all[n] / static_cast<double>(nearest.size());
  }
  Mat3 moments = Mat3::Zero();
  for (const std::uint32_t n : nearest) {
    moments += (all[n] - mean) * (all[n] - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(moments);
  const Vec3 normal = eigen.eigenvectors().col(0);
  p -= (p - mean).dot(normal) * normal;
  const double thick = std::max(eigen.eigenvalues()[0], 0.0), wide = eigen.eigenvalues()[1];
  return wide > 0 ? std::sqrt(thick / wide) : 1;
}

// Returns how thick what lies around each is.
std::vector<double> Smooth(const Neighbours& all, int count, std::vector<Vec3>& positions) {
  constexpr int kRounds = 3;
  std::vector<double> thickness(positions.size(), kNaN);
  for (std::size_t k = 0; k < positions.size(); ++k) {
    for (int round = 0; round < kRounds; ++round) {
      thickness[k] = MoveOntoPlane(all, count, positions[k]);
    }
  }
  return thickness;
}

// Those about which points lie much thicker than about most are on no surface.
void LeaveOutThick(const std::vector<double>& thickness, EvenPoints& points) {
  constexpr double kMoreThan = 2, kThin = 0.4, kThickest = 0.6;
  const double most = std::clamp(kMoreThan * points.thickness, kThin, kThickest);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < thickness.size(); ++k) {
    if (thickness[k] <= most) {
      points.positions[kept] = points.positions[k];
      points.spacings_mm[kept++] = points.spacings_mm[k];
    }
  }
  points.positions.resize(kept);
  points.spacings_mm.resize(kept);
}

// Points that lay above each other come together when they are smoothed.
void KeepApart(EvenPoints& points) {
  constexpr double kLeast = 0.7;  // of the spacing
  constexpr int kAsked = 16;
  const std::vector<Vec3> before = points.positions;
  const Neighbours all(before);
  std::vector<char> dropped(before.size(), 0);
  std::size_t kept = 0;
  for (std::uint32_t k = 0; k < before.size(); ++k) {
    if (dropped[k] != 0) {
      continue;
    }
    const double least_mm = kLeast * points.spacings_mm[k];
    for (const std::uint32_t n : all.NearestTo(before[k], kAsked)) {
      if (n > k && (before[n] - before[k]).norm() < least_mm) {
        dropped[n] = 1;
      }
    }
    points.positions[kept] = before[k];
    points.spacings_mm[kept++] = points.spacings_mm[k];
  }
  points.positions.resize(kept);
  points.spacings_mm.resize(kept);
}

}  // namespace

EvenPoints EvenlySpread(std::span<const Vec3> points, int per_place) {
  const std::vector<Vec3> some = SomeInOrder(points);
  const Neighbours all(some);
  EvenPoints even = Thinned(all, some.size(), per_place);
  const std::vector<double> thickness = Smooth(all, 4 * per_place, even.positions);
  if (!thickness.empty()) {
    std::vector<double> sorted = thickness;
    even.thickness = UpperMedian(sorted);
    LeaveOutThick(thickness, even);
  }
  KeepApart(even);
  return even;
}

}  // namespace semblance
