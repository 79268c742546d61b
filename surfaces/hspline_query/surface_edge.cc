// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/surface_edge.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "surfaces/hspline/patch_tree.h"

namespace semblance {
namespace {

bool IsAtStart(SurfaceEdge edge) { return edge == SurfaceEdge::kU0 || edge == SurfaceEdge::kV0; }

// The patch's place across the edge, counted from it.
int RowFrom(SurfaceEdge edge, const HSplineShape& shape, const PatchId& patch) {
  const int across = RunsAlongV(edge) ? patch.i : patch.j;
  const int last =
      (RunsAlongV(edge) ? shape.PatchesU(patch.level) : shape.PatchesV(patch.level)) - 1;
  return IsAtStart(edge) ? across : last - across;
}

double AngleBetweenPlanes_deg(const Vec3& n, const Vec3& m) {
  constexpr double kDegree = std::numbers::pi / 180;
  return std::atan2(n.cross(m).norm(), std::abs(n.dot(m))) / kDegree;
}

EdgeMeeting MeetingAt(double t, const SurfaceFrame& first, const SurfaceFrame& second) {
  EdgeMeeting meeting{.t = t, .gap_mm = (first.point - second.point).norm()};
  if (first.regular && second.regular) {
    meeting.angle_deg = AngleBetweenPlanes_deg(first.Normal(), second.Normal());
  }
  return meeting;
}

}  // namespace

std::string_view NameOf(SurfaceEdge edge) {
  return EnumNames(edge)[static_cast<std::size_t>(edge)];
}

Vec2 OnEdge(SurfaceEdge edge, double t) {
  const double across = IsAtStart(edge) ? 0 : 1;
  return RunsAlongV(edge) ? Vec2(across, t) : Vec2(t, across);
}

bool HasEdge(const HSplineShape& shape, SurfaceEdge edge) {
  return RunsAlongV(edge) ? !shape.ClosedU() : !shape.ClosedV();
}

bool IsClosedAlong(const HSplineShape& shape, SurfaceEdge edge) {
  return RunsAlongV(edge) ? shape.ClosedV() : shape.ClosedU();
}

int PatchesAlong(const HSplineShape& shape, SurfaceEdge edge) {
  return RunsAlongV(edge) ? shape.patches_v : shape.patches_u;
}

std::vector<EdgeSpan> SpansAlong(const HSplineSurface& surface, SurfaceEdge edge) {
  const PatchTree tree(surface);
  std::vector<EdgeSpan> spans;
  for (const PatchId& patch : tree.leaves()) {
    if (RowFrom(edge, surface.shape(), patch) == 0) {
      spans.push_back({patch.level, RunsAlongV(edge) ? patch.j : patch.i});
    }
  }
  const int patches = PatchesAlong(surface.shape(), edge);
  std::ranges::sort(spans, {}, [&](const EdgeSpan& span) { return span.Begin(patches); });
  return spans;
}

std::vector<EdgeMeeting> MeetingsAlong(const EdgeOfSurface& first, const EdgeOfSurface& second,
                                       const EdgeComparison& how) {
  std::vector<EdgeMeeting> meetings;
  for (int k = 1; k <= how.places; ++k) {
    const double whole = k * std::numbers::phi, t = whole - std::floor(whole);
    const double its_t = how.reversed ? 1 - t : t;
    meetings.push_back(MeetingAt(t, first.surface.Frame(OnEdge(first.edge, t)),
                                 second.surface.Frame(OnEdge(second.edge, its_t))));
  }
  std::ranges::sort(meetings, {}, &EdgeMeeting::t);
  return meetings;
}

}  // namespace semblance
