// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/join_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr double kRounding = 1e-12;  // of t

struct JoinPlace {
  double t = kNaN;
  int level = 0;  // that is asked of the span there
  bool has_normal = true;
};

bool Overlap(double begin, double end, double other_begin, double other_end) {
  return begin < other_end - kRounding && other_begin < end - kRounding;
}

// The most patches, of the whole edge, that a span of the given edge beside ours is one of.
int DensestBeside(const EdgeSpan& span, int patches, const EdgeSpans& its, int its_patches) {
  int densest = 0;
  for (const EdgeSpan& other : its) {
    if (Overlap(span.Begin(patches), span.End(patches), other.Begin(its_patches),
                other.End(its_patches))) {
      densest = std::max(densest, its_patches << other.level);
    }
  }
  return densest;
}

// Splits spans while `wanted` says so, in the order of t.
template <class Wanted>
EdgeSpans SplitWhile(const EdgeSpans& spans, const Wanted& wanted) {
  EdgeSpans finer, left(spans.rbegin(), spans.rend());
  while (!left.empty()) {
    const EdgeSpan span = left.back();
    left.pop_back();
    if (wanted(span)) {
      left.push_back({span.level + 1, 2 * span.index + 1});
      left.push_back({span.level + 1, 2 * span.index});
    } else {
      finer.push_back(span);
    }
  }
  return finer;
}

std::vector<double> PlacesOf(const EdgeSpans& spans, int patches, bool closed) {
  std::vector<double> places;
  const std::size_t last = spans.size() - 1;
  for (std::size_t k = 0; k < spans.size(); ++k) {
    const double begin = spans[k].Begin(patches), end = spans[k].End(patches);
    const auto add = [&](double share) { places.push_back(begin + share * (end - begin)); };
    add(0);
    if (!closed && last == 0) {
      add(1 / 3.0);
      add(2 / 3.0);
    } else if (!closed && (k == 0 || k == last)) {
      add(0.5);
    }
  }
  if (!closed) {
    places.push_back(1);
  }
  return places;
}

std::vector<JoinPlace> PlacesOf(const HeldEdge& edge, int patches, bool closed) {
  std::vector<JoinPlace> places;
  auto asked = edge.asked.begin();
  for (const double t : PlacesOf(edge.spans, patches, closed)) {
    while (asked + 1 != edge.asked.end() && asked->End(patches) <= t) {
      ++asked;
    }
    places.push_back({t, asked->level});
  }
  return places;
}

// At t = 0 or 1, where two joins share a corner: the curves give both tangents. The first join's
// normal beside it gives the mixed derivative, and the second one's could only contradict.
void YieldAt(double t, bool is_second, std::vector<JoinPlace>& places) {
  const std::size_t last = places.size() - 1;
  places[t == 0 ? 0 : last].has_normal = false;
  if (is_second) {
    places[t == 0 ? 1 : last - 1].has_normal = false;
  }
}

HeldTangents AcrossEdge(SurfaceEdge edge) {
  return RunsAlongV(edge) ? HeldTangents::kAlongU : HeldTangents::kAlongV;
}

ExactPoint HeldAt(const OpenedJoin& opened, const JoinPlace& place) {
  const SurfaceFrame its = opened.surface.Frame(opened.ItsPlace(place.t));
  ExactPoint point{.uv = OnEdge(opened.join.edge, place.t),
                   .position = its.point,
                   .tangents = AcrossEdge(opened.join.edge),
                   .level = place.level};
  if (!place.has_normal || opened.join.continuity == JoinContinuity::kPosition) {
    return point;
  }
  if (!its.regular) {
    throw InputError(fmt::format(
        "joins: {} has no tangent plane at t = {:.6g} of its edge {}; join with continuity: "
        "position",
        opened.join.surface.filename().string(), place.t, NameOf(opened.join.its_edge)));
  }
  point.normal = its.Normal();
  return point;
}

Vec3 TangentAlong(const OpenedJoin& opened, const SurfaceFrame& frame) {
  return RunsAlongV(opened.join.its_edge) ? frame.dv : frame.du;
}

// How far a curve leaves the tangent plane of a join at its end; 0 if the join does not ask.
double Leaving_deg(const OpenedJoin& join, const SurfaceFrame& plane, const Vec3& curve) {
  constexpr double kDegree = std::numbers::pi / 180;
  const bool asks = join.join.continuity == JoinContinuity::kTangentPlane && plane.regular;
  return asks ? std::asin(std::min(
                    1.0, std::abs(plane.Normal().dot(curve)) / std::max(curve.norm(), 1e-300))) /
                    kDegree
              : 0;
}

}  // namespace

EdgeSpans AsFineAsItsEdge(const EdgeSpans& spans, const OpenedJoin& join, std::string_view name,
                          const NewShape& shape) {
  const int patches = PatchesAlong(shape.level0, join.join.edge), its_patches = join.ItsPatches();
  const EdgeSpans its = join.ItsSpans();
  return SplitWhile(spans, [&](const EdgeSpan& span) {
    const int densest = DensestBeside(span, patches, its, its_patches);
    const bool split = (patches << span.level) < densest;
    if (split && span.level == shape.finest) {
      throw InputError(fmt::format(
          "{}: the edge {} of {} is as fine as {} patches along it, the new edge {} may have {} "
          "({}: {}, finest level {}); give more patches or a larger fit.plan.finest",
          name, NameOf(join.join.its_edge), join.join.surface.filename().string(), densest,
          NameOf(join.join.edge), patches << shape.finest,
          RunsAlongV(join.join.edge) ? "patches_v" : "patches_u", patches, shape.finest));
    }
    return split;
  });
}

EdgeSpans FinerOf(const EdgeSpans& a, const EdgeSpans& b, int patches) {
  return SplitWhile(a, [&](const EdgeSpan& span) {
    return patches << span.level < DensestBeside(span, patches, b, patches);
  });
}

EdgeSpans Reached(const EdgeSpans& asked, int patches) {
  return SplitWhile(asked, [&](const EdgeSpan& span) {
    const double begin = span.Begin(patches), end = span.End(patches), beside = end - begin;
    return std::ranges::any_of(asked, [&](const EdgeSpan& other) {
      return other.level > span.level &&
             Overlap(begin - beside, end + beside, other.Begin(patches), other.End(patches));
    });
  });
}

EdgeSpans Levelled(const EdgeSpans& spans) {
  const int finest = std::ranges::max(spans, {}, &EdgeSpan::level).level;
  return SplitWhile(spans, [&](const EdgeSpan& span) { return span.level < finest; });
}

HeldEdge Halved(const HeldEdge& edge, std::span<const double> at, int levels, int patches,
                int finest) {
  const EdgeSpans asked = SplitWhile(edge.asked, [&](const EdgeSpan& span) {
    const bool holds_one = std::ranges::any_of(
        at, [&](double t) { return span.Begin(patches) <= t && t <= span.End(patches); });
    const int wanted =
        std::min(DensestBeside(span, patches, edge.spans, patches) << levels, patches << finest);
    return holds_one && patches << span.level < wanted;
  });
  return {.asked = asked, .spans = FinerOf(Reached(asked, patches), edge.spans, patches)};
}

std::vector<JoinCorner> CornersOf(std::span<const OpenedJoin> joins) {
  std::vector<JoinCorner> corners;
  for (std::size_t a = 0; a < joins.size(); ++a) {
    for (std::size_t b = a + 1; b < joins.size(); ++b) {
      for (const double t : {0.0, 1.0}) {
        for (const double s : {0.0, 1.0}) {
          if (OnEdge(joins[a].join.edge, t) == OnEdge(joins[b].join.edge, s)) {
            corners.push_back({a, b, t, s});
          }
        }
      }
    }
  }
  return corners;
}

void CheckCorners(std::span<const OpenedJoin> joins, double extent_mm) {
  for (const JoinCorner& corner : CornersOf(joins)) {
    const OpenedJoin &a = joins[corner.first], &b = joins[corner.second];
    const SurfaceFrame at_a = a.surface.Frame(a.ItsPlace(corner.first_t)),
                       at_b = b.surface.Frame(b.ItsPlace(corner.second_t));
    const std::string where =
        fmt::format("joins[{}] and joins[{}]: at the corner of {} and {}", corner.first,
                    corner.second, NameOf(a.join.edge), NameOf(b.join.edge));
    if (const double gap_mm = (at_a.point - at_b.point).norm(); gap_mm > kMostJoinGap * extent_mm) {
      throw InputError(fmt::format(
          "{} the given surfaces are {:.3g} mm apart; choose other edges or `reversed`, or join "
          "one of them",
          where, gap_mm));
    }
    const double angle_deg = std::max(Leaving_deg(a, at_a, TangentAlong(b, at_b)),
                                      Leaving_deg(b, at_b, TangentAlong(a, at_a)));
    if (angle_deg > kMostJoinAngle_deg) {
      throw InputError(fmt::format(
          "{} one edge leaves the other's tangent plane by {:.3g} degrees; join with continuity: "
          "position, or one of them",
          where, angle_deg));
    }
  }
}

std::vector<ExactPoint> ExactPointsOf(std::span<const OpenedJoin> joins,
                                      std::span<const HeldEdge> edges, const HSplineShape& shape) {
  const std::vector<JoinCorner> corners = CornersOf(joins);
  std::vector<ExactPoint> exact;
  for (std::size_t k = 0; k < joins.size(); ++k) {
    const SurfaceEdge edge = joins[k].join.edge;
    std::vector<JoinPlace> places =
        PlacesOf(edges[k], PatchesAlong(shape, edge), IsClosedAlong(shape, edge));
    for (const JoinCorner& corner : corners) {
      if (corner.first == k) {
        YieldAt(corner.first_t, /*is_second=*/false, places);
      } else if (corner.second == k) {
        YieldAt(corner.second_t, /*is_second=*/true, places);
      }
    }
    for (const JoinPlace& place : places) {
      const bool is_there = std::ranges::any_of(corners, [&](const JoinCorner& corner) {
        return corner.second == k && corner.second_t == place.t;
      });
      if (!is_there) {
        exact.push_back(HeldAt(joins[k], place));
      }
    }
  }
  return exact;
}

int PlacesAlong(const EdgeSpans& spans, bool closed) {
  return static_cast<int>(spans.size()) + (closed ? 0 : 3);
}

}  // namespace semblance
