// SPDX-License-Identifier: GPL-3.0-or-later
// How far it is to the nearest of many points, with the search tree kept for many questions.
#pragma once

#include <memory>
#include <span>

#include "surfaces/base/geometry.h"

namespace semblance {

// Keeps its own copy of the points; const calls are safe from several threads at once.
class PointQuery {
 public:
  // Throws InputError if there is no point, or one that is not finite.
  explicit PointQuery(std::span<const Vec3> points);
  ~PointQuery();
  PointQuery(PointQuery&&) noexcept;
  PointQuery& operator=(PointQuery&&) noexcept;

  // In mm, from p to the point that is `rank`-th nearest: 1 is the nearest, which is p itself if it
  // is one of the points. rank >= 1; infinite where there are fewer points.
  double DistanceTo(const Vec3& p, int rank = 1) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace semblance
