// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/edge_collapse.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "surfaces/mesh/mesh_query.h"

namespace semblance::surfaces {
namespace {

using OpenMesh::HalfedgeHandle;

// The first half-edge of the fan of faces that h belongs to, which starts at a border.
HalfedgeHandle FirstOfFan(const HalfEdgeMesh& mesh, HalfedgeHandle h) {
  while (!mesh.is_boundary(mesh.opposite_halfedge_handle(h))) {
    h = mesh.cw_rotated_halfedge_handle(h);
  }
  return h;
}

}  // namespace

// Goes counter-clockwise around the start of `from`, up to the half-edge `before` or to a border,
// whose vertex ends the ring.
void EdgeNeighbourhood::AppendFan(const HalfEdgeMesh& mesh, HalfedgeHandle from,
                                  HalfedgeHandle before) {
  const bool around_gone = mesh.from_vertex_handle(from).idx() == gone;
  for (HalfedgeHandle h = from; h != before; h = mesh.ccw_rotated_halfedge_handle(h)) {
    ring.push_back(mesh.to_vertex_handle(h).idx());
    if (mesh.is_boundary(h)) {
      return;
    }
    outer.push_back(mesh.face_handle(h).idx());
    at_gone.push_back(around_gone);
  }
}

void EdgeNeighbourhood::Gather(const HalfEdgeMesh& mesh, HalfedgeHandle h) {
  edge = h;
  keep = mesh.from_vertex_handle(edge).idx();
  gone = mesh.to_vertex_handle(edge).idx();
  inner = {mesh.face_handle(edge).idx()};
  outer.clear();
  at_gone.clear();
  ring.clear();
  const HalfedgeHandle back = mesh.opposite_halfedge_handle(edge),
                       end = mesh.next_halfedge_handle(edge),
                       after = mesh.ccw_rotated_halfedge_handle(edge);
  on_border = mesh.is_boundary(back);
  closed = !mesh.is_boundary(OpenMesh::VertexHandle(keep));
  if (on_border) {
    AppendFan(mesh, FirstOfFan(mesh, end), end);
  } else {
    inner.push_back(mesh.face_handle(back).idx());
    AppendFan(mesh, closed ? after : FirstOfFan(mesh, edge), mesh.next_halfedge_handle(back));
    AppendFan(mesh, mesh.ccw_rotated_halfedge_handle(back), end);
  }
  if (!closed) {
    AppendFan(mesh, after, HalfedgeHandle());
  }
}

namespace {

// 60 degrees. A smaller angle preserves the shape better and allows fewer collapses.
constexpr double kMostTurnCosine = 0.5;
// The least shape of a new triangle that counts as sound; 1 is equilateral. See PreservesQuality.
constexpr double kLeastShape = 0.05;

// Measures how close a triangle is to equilateral.
struct TriangleShape {
  Vec3 normal;   // not unit
  double sides;  // the sum of their squared lengths, mm^2

  TriangleShape(const Vec3& a, const Vec3& b, const Vec3& c)
      : normal((b - a).cross(c - a)),
        sides((b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm()) {}
  // The square of 4 sqrt(3) area / (sum of squared sides): 1 if equilateral, 0 without area.
  double Squared() const { return sides > 0 ? 12 * normal.squaredNorm() / (sides * sides) : 0; }
  bool HasNormal() const { return normal.squaredNorm() > 1e-12 * sides * sides; }
};

bool TurnsFar(const Vec3& before, const Vec3& after) {
  const double dot = before.dot(after);
  return dot < 0 ||
         dot * dot < kMostTurnCosine * kMostTurnCosine * before.squaredNorm() * after.squaredNorm();
}

Vec3 AreaVectorBefore(const CollapseGeometry& collapse) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < collapse.at_gone.size(); ++i) {
    const Vec3& apex = collapse.ApexBefore(i);
    sum += 0.5 * (collapse.ring[i] - apex).cross(collapse.RingAfter(i) - apex);
  }
  return sum;
}

}  // namespace

Vec3 AreaVectorAfter(const CollapseGeometry& collapse) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < collapse.at_gone.size(); ++i) {
    sum +=
        0.5 * (collapse.ring[i] - collapse.target).cross(collapse.RingAfter(i) - collapse.target);
  }
  return sum;
}

bool PreservesQuality(const CollapseGeometry& collapse) {
  double least_before = 1, least_after = 1;
  for (const Vec3& p : collapse.opposite) {
    least_before = std::min(least_before, TriangleShape(collapse.keep, collapse.gone, p).Squared());
  }
  for (std::size_t i = 0; i < collapse.at_gone.size(); ++i) {
    const Vec3 &a = collapse.ring[i], &b = collapse.RingAfter(i);
    const TriangleShape before(collapse.ApexBefore(i), a, b), after(collapse.target, a, b);
    if (TurnsFar(before.HasNormal() ? before.normal : AreaVectorBefore(collapse), after.normal)) {
      return false;
    }
    least_before = std::min(least_before, before.Squared());
    least_after = std::min(least_after, after.Squared());
  }
  return least_after >= kLeastShape * kLeastShape || least_after >= least_before;
}

namespace {

// From here on, corners are relative to the target: x and y lie in the common plane, z is the
// height over it.
double Cross2(const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); }

// The barycentric weights of a triangle's second and third corner at a point, seen in the plane.
struct PlaneWeights {
  double second = kNaN, third = kNaN;
  double Inside() const { return std::min({second, third, 1 - second - third}); }
};

PlaneWeights WeightsOver(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double area = Cross2(ab, ac);
  return {Cross2(ap, ac) / area, Cross2(ab, ap) / area};
}

// Round-off: a point whose least weight is above minus this counts as on the rim of a sheet.
constexpr double kRim = 1e-9;
// The least cosine of a triangle's slope in a height field. Heights over steeper triangles would be
// a poor bound on the distance.
constexpr double kLeastCosine = 0.1;

// The sheets of triangles before and after the collapse as height fields over one plane.
class CollapseDistance {
 public:
  explicit CollapseDistance(const CollapseGeometry& collapse);

  // The largest difference in height between the sheets; NaN unless both are height fields over the
  // same ring.
  double Difference() const;
  // The largest 1 / cosine of the slopes.
  double Steepness() const { return 1 / least_cosine_; }
  // Assigns each sample to a triangle of the new sheet, with the distance from it.
  void AssignSamples(CollapseError& error) const;

 private:
  std::size_t Next(std::size_t i) const { return i + 1 < ring_.size() ? i + 1 : 0; }
  void IncludeSlope(const Vec3& a, const Vec3& b, const Vec3& c);
  bool GoesRoundOnce() const;
  double AtEnd(const Vec3& end) const;
  double AtTarget() const;
  double AtCrossings(const Vec3& from, const Vec3& to) const;
  int SectorOf(const Vec3& p) const;
  int NearestTriangle(const Vec3& p) const;

  const CollapseGeometry& collapse_;
  std::vector<Vec3> ring_, opposite_;  // relative to the target
  Vec3 keep_, gone_;
  Mat3 frame_ = Mat3::Identity();
  double least_cosine_ = 0;  // of the slopes; 0 or less: no height field
};

// An orthonormal frame as rows; the last row is along `up`.
Mat3 FrameAlong(const Vec3& up) {
  Mat3 frame;
  frame.row(2) = up.normalized();
  frame.row(0) = frame.row(2).transpose().unitOrthogonal();
  frame.row(1) = frame.row(2).cross(frame.row(0));
  return frame;
}

CollapseDistance::CollapseDistance(const CollapseGeometry& collapse) : collapse_(collapse) {
  for (const Vec3& p : collapse.ring) {
    ring_.push_back(p - collapse.target);
  }
  Vec3 up = Vec3::Zero();
  for (std::size_t i = 0; i < collapse.at_gone.size(); ++i) {
    up += ring_[i].cross(ring_[Next(i)]);
  }
  if (!(up.squaredNorm() > 0)) {
    return;
  }
  frame_ = FrameAlong(up);
  for (Vec3& p : ring_) {
    p = frame_ * p;
  }
  keep_ = frame_ * (collapse.keep - collapse.target);
  gone_ = frame_ * (collapse.gone - collapse.target);
  for (const Vec3& p : collapse.opposite) {
    opposite_.push_back(frame_ * (p - collapse.target));
  }
  least_cosine_ = 1;
  for (std::size_t i = 0; i < collapse.at_gone.size(); ++i) {
    IncludeSlope(Vec3::Zero(), ring_[i], ring_[Next(i)]);
    if (collapse.on_border) {  // the old sheet reaches beyond its ring
      IncludeSlope(collapse.at_gone[i] ? gone_ : keep_, ring_[i], ring_[Next(i)]);
    }
  }
  if (collapse.on_border) {
    IncludeSlope(keep_, gone_, opposite_.front());
  }
}

void CollapseDistance::IncludeSlope(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  least_cosine_ = std::min(least_cosine_, n.z() / n.norm());
}

// All triangles of the new sheet face up, so the ring always turns the same way around the target.
// It goes round once if it crosses a ray from the target once.
bool CollapseDistance::GoesRoundOnce() const {
  int upward = 0;
  for (std::size_t i = 0; i < collapse_.at_gone.size(); ++i) {
    const Vec3 &a = ring_[i], &b = ring_[Next(i)];
    upward += a.y() <= 0 && b.y() > 0 ? 1 : 0;
  }
  return upward <= 1;
}

// The height of an end of the edge over the new sheet. NaN if the end is outside, which happens
// only at a border.
double CollapseDistance::AtEnd(const Vec3& end) const {
  double most_inside = -kRim, difference = kNaN;
  for (std::size_t i = 0; i < collapse_.at_gone.size(); ++i) {
    const Vec3 &a = ring_[i], &b = ring_[Next(i)];
    const PlaneWeights at = WeightsOver(end, Vec3::Zero(), a, b);
    if (at.Inside() > most_inside) {
      most_inside = at.Inside();
      difference = std::abs(end.z() - at.second * a.z() - at.third * b.z());
    }
  }
  return difference;
}

// The height of the target over the old sheet.
double CollapseDistance::AtTarget() const {
  double most_inside = -kRim, difference = kNaN;
  const auto visit = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const PlaneWeights at = WeightsOver(Vec3::Zero(), a, b, c);
    if (at.Inside() > most_inside) {
      most_inside = at.Inside();
      difference = std::abs(a.z() + at.second * (b.z() - a.z()) + at.third * (c.z() - a.z()));
    }
  };
  for (std::size_t i = 0; i < collapse_.at_gone.size(); ++i) {
    visit(collapse_.at_gone[i] ? gone_ : keep_, ring_[i], ring_[Next(i)]);
  }
  for (const Vec3& p : opposite_) {
    visit(keep_, gone_, p);
  }
  return difference;
}

// The largest height of an edge of the old sheet over those of the new one, all of which start at
// the target.
double CollapseDistance::AtCrossings(const Vec3& from, const Vec3& to) const {
  const Vec3 along = to - from;
  double difference = 0;
  for (const Vec3& spoke : ring_) {
    const double turn = Cross2(spoke, along), whole = std::abs(turn), sign = turn < 0 ? -1 : 1;
    const double on_spoke = sign * Cross2(from, along), on_edge = sign * Cross2(from, spoke);
    if (on_spoke > 0 && on_spoke < whole && on_edge > 0 && on_edge < whole) {
      difference = std::max(
          difference, std::abs((on_spoke * spoke.z() - on_edge * along.z()) / whole - from.z()));
    }
  }
  return difference;
}

double CollapseDistance::Difference() const {
  if (!(least_cosine_ > kLeastCosine) || !GoesRoundOnce()) {
    return kNaN;
  }
  double most = AtCrossings(keep_, gone_);
  for (const double d : {AtEnd(keep_), AtEnd(gone_), AtTarget()}) {
    if (std::isnan(d) && !collapse_.on_border) {
      return kNaN;
    }
    most = std::fmax(most, d);
  }
  for (std::size_t i = 0; i < collapse_.at_gone.size(); ++i) {
    const Vec3& apex = collapse_.at_gone[i] ? gone_ : keep_;
    most = std::max(most, AtCrossings(apex, ring_[i]));
    const std::size_t next = i + 1 < collapse_.at_gone.size() || collapse_.closed ? Next(i) : i;
    if (next == i || collapse_.at_gone[next] != collapse_.at_gone[i]) {
      most = std::max(most, AtCrossings(apex, ring_[Next(i)]));
    }
  }
  return most;
}

// The triangle of the new sheet whose sector around the target contains p; -1 if none does.
int CollapseDistance::SectorOf(const Vec3& p) const {
  double from = Cross2(ring_[0], p);
  for (std::size_t i = 0; i < collapse_.at_gone.size(); ++i) {
    const double to = Cross2(ring_[Next(i)], p);
    if (from >= 0 && to <= 0 && p.head<2>().dot((ring_[i] + ring_[Next(i)]).head<2>()) >= 0) {
      return static_cast<int>(i);
    }
    from = to;
  }
  return -1;
}

double DistanceToFanTriangle(const Vec3& p, const Vec3& a, const Vec3& b) {
  return (p - ClosestPointOnTriangle(p, Vec3::Zero(), a, b).position).norm();
}

int CollapseDistance::NearestTriangle(const Vec3& p) const {
  double least = std::numeric_limits<double>::infinity();
  int nearest = 0;
  for (std::size_t i = 0; i < collapse_.at_gone.size(); ++i) {
    const double distance = DistanceToFanTriangle(p, ring_[i], ring_[Next(i)]);
    if (distance < least) {
      least = distance;
      nearest = static_cast<int>(i);
    }
  }
  return nearest;
}

void CollapseDistance::AssignSamples(CollapseError& error) const {
  error.triangle_of.clear();
  error.distance_mm.clear();
  for (const Vec3& sample : collapse_.samples) {
    const Vec3 p = frame_ * (sample - collapse_.target);
    const int sector = least_cosine_ > kLeastCosine ? SectorOf(p) : -1;
    const int triangle = sector < 0 ? NearestTriangle(p) : sector;
    const Vec3 &a = ring_[triangle], &b = ring_[Next(triangle)];
    const PlaneWeights at = WeightsOver(p, Vec3::Zero(), a, b);
    const bool above = sector >= 0 && at.Inside() >= 0;
    error.triangle_of.push_back(triangle);
    error.distance_mm.push_back(above ? std::abs(p.z() - at.second * a.z() - at.third * b.z())
                                      : DistanceToFanTriangle(p, a, b));
  }
}

// The distance by which the border itself moves. Before the collapse it runs from the ring's end
// over keep and gone to the ring's start; afterwards it runs over the target.
double BorderDistance(const CollapseGeometry& collapse) {
  return std::max({DistanceToSegment(collapse.keep, collapse.ring.back(), collapse.target),
                   DistanceToSegment(collapse.gone, collapse.target, collapse.ring.front()),
                   DistanceToSegment(collapse.target, collapse.keep, collapse.gone)});
}

}  // namespace

void MeasureCollapse(const CollapseGeometry& collapse, CollapseError& error) {
  const CollapseDistance sheets(collapse);
  const double of_ends =
      std::max((collapse.keep - collapse.target).norm(), (collapse.gone - collapse.target).norm());
  const double beside = collapse.on_border ? BorderDistance(collapse) * sheets.Steepness() : 0;
  error.sheets_mm = std::fmin(of_ends, sheets.Difference() + beside);
  sheets.AssignSamples(error);
}

}  // namespace semblance::surfaces
