// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/decimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/decimate/edge_collapse.h"
#include "surfaces/decimate/original_vertices.h"
#include "surfaces/mesh/half_edges.h"
#include "surfaces/mesh/neighbour_order.h"

namespace semblance {
namespace {

// The largest error of a sound collapse, as a share of the square root of the area around it.
constexpr double kMostErrorOfSize = 0.15;
// Keep the merged vertex at the middle of its edge where the surface says little; see MinimumNear.
constexpr double kDamping = 1e-6;
constexpr int kNewtonSteps = 3;
// Refused edges are tried again as long as this share of the triangles went since the last time.
constexpr double kLeastGain = 0.005;
// The share of waiting edges, the cheapest, that may collapse in one sweep.
constexpr double kShareOfSweep = 0.15;
// Makes short edges go first where the surface is flat.
constexpr double kShortFirst = 1e-8;
// If a smaller share of all edges waits, because the others were refused, no costlier ones are
// taken: the few that are left would pay for all.
constexpr double kLeastWaiting = 0.2;
constexpr float kNever = std::numeric_limits<float>::infinity();

// A sum of weighted squared distances from planes and lines: q(x) = x' A x - 2 b' x + c, A
// symmetric (Garland & Heckbert 1997).
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // A
  double x = 0, y = 0, z = 0;                             // b
  double c = 0;

  // area_vector: the triangle's normal times its area, not zero; the weight is the area.
  static Quadric OfTriangle(const Vec3& p, const Vec3& area_vector) {
    const double area = area_vector.norm();
    const Vec3 n = area_vector / area, m = area_vector;
    const double d = n.dot(p), e = area * d;
    return {m.x() * n.x(), m.x() * n.y(), m.x() * n.z(), m.y() * n.y(), m.y() * n.z(),
            m.z() * n.z(), e * n.x(),     e * n.y(),     e * n.z(),     e * d};
  }

  // Of the line through p and q, which are apart; the weight is the squared length.
  static Quadric OfLine(const Vec3& p, const Vec3& q) {
    const Vec3 e = q - p;
    const double l = e.squaredNorm();
    Quadric line{l - e.x() * e.x(), -e.x() * e.y(), -e.x() * e.z(),
                 l - e.y() * e.y(), -e.y() * e.z(), l - e.z() * e.z()};
    const Vec3 b = line.TimesA(p);
    line.x = b.x();
    line.y = b.y();
    line.z = b.z();
    line.c = p.dot(b);
    return line;
  }

  void Add(const Quadric& o, double times = 1) {
    xx += times * o.xx, xy += times * o.xy, xz += times * o.xz;
    yy += times * o.yy, yz += times * o.yz, zz += times * o.zz;
    x += times * o.x, y += times * o.y, z += times * o.z;
    c += times * o.c;
  }

  Vec3 TimesA(const Vec3& p) const {
    return {xx * p.x() + xy * p.y() + xz * p.z(), xy * p.x() + yy * p.y() + yz * p.z(),
            xz * p.x() + yz * p.y() + zz * p.z()};
  }
  double Trace() const { return xx + yy + zz; }
  double At(const Vec3& p) const {
    return p.dot(TimesA(p)) - 2 * (x * p.x() + y * p.y() + z * p.z()) + c;
  }

  // The minimum, found by Newton steps from `start`, each damped by a share of A's trace: so
  // `start` is kept in the directions in which the quadric does not rise.
  Vec3 MinimumNear(const Vec3& start, double damping, int steps) const {
    const double hold = damping * Trace();
    const double a = xx + hold, d = yy + hold, f = zz + hold;
    const double c00 = d * f - yz * yz, c01 = xz * yz - xy * f, c02 = xy * yz - xz * d,
                 c11 = a * f - xz * xz, c12 = xy * xz - a * yz, c22 = a * d - xy * xy;
    const double determinant = a * c00 + xy * c01 + xz * c02;
    if (!(determinant > 0)) {
      return start;
    }
    const double inverse = 1 / determinant;
    Vec3 p = start;
    for (int step = 0; step < steps; ++step) {
      const Vec3 r = (Vec3(x, y, z) - TimesA(p)) * inverse;
      p += Vec3(c00 * r.x() + c01 * r.y() + c02 * r.z(), c01 * r.x() + c11 * r.y() + c12 * r.z(),
                c02 * r.x() + c12 * r.y() + c22 * r.z());
    }
    return p;
  }
};

// What each attempt looks at stands first, in one line of the cache.
struct alignas(64) DecimatedVertex {
  Vec3 position;
  int changed = 0;  // the last collapse that changed the quadric
  int met = 0;      // the last attempt that met it; see KeepsTopology
  Quadric quadric;  // of the triangles around, and of the border
};

// Of an edge, stored at the lower of its half-edges.
struct EdgeCost {
  float cost = kNever;
  int evaluated = 0;  // the number of collapses by then
};

// Where the ends of an edge would merge. Cost NaN: they must not.
struct MergeTarget {
  double cost = kNaN;
  Vec3 position = Vec3::Constant(kNaN);
};

// What is left, in the order that the mesh has.
struct Remains {
  TriMesh mesh;                         // with all points of that mesh
  std::vector<std::int32_t> triangles;  // of each of its triangles, the index in that mesh
  DecimateSummary summary;
};

class Decimator {
 public:
  Decimator(const TriMesh& mesh, const DecimateOptions& options);
  Remains Run();

 private:
  void AddQuadrics(std::int32_t triangle, double times);
  MergeTarget TargetOf(HalfEdgeIndex h) const;
  void Evaluate(HalfEdgeIndex h);
  void EvaluateAll();
  bool IsStale(HalfEdgeIndex edge) const;
  void FindWaiting();
  float CostLimitOfSweep();
  void Sweep(float cost_limit);
  void TryCollapse(HalfEdgeIndex edge);
  bool KeepsTopology();
  void SetGeometry(const Vec3& target);
  void GatherSamples();
  bool IsWithinBounds();
  void Collapse();
  void ForgetTrianglesAtEdge();
  void AddQuadricsAround(double times);
  void EvaluateAround();
  void ReassignSamples();
  TriMesh RemainingMesh();
  DecimateSummary Summary() const;

  DecimateOptions options_;
  Vec3 centre_;  // quadrics are of positions relative to it
  HalfEdges edges_;
  std::vector<DecimatedVertex> vertices_;
  OriginalVertices originals_;
  std::vector<std::int32_t> alive_;  // triangles, ascending
  std::vector<EdgeCost> costs_;
  std::vector<HalfEdgeIndex> waiting_;  // edges that have a cost, ascending
  std::vector<float> cheapest_;
  float dearest_ = 0;  // the highest limit of a sweep so far
  EdgeNeighbourhood around_;
  CollapseGeometry geometry_;
  CollapseError error_;
  std::vector<std::int32_t> sampled_;  // original vertices; geometry_.samples are their positions
  int collapses_ = 0, attempts_ = 0, triangles_ = 0;
  bool tolerance_refused_ = false, retrying_ = false;
};

Decimator::Decimator(const TriMesh& mesh, const DecimateOptions& options)
    : options_(options),
      centre_(Bounds(mesh).center()),
      edges_(mesh, "decimate"),
      originals_(mesh),
      costs_(edges_.End()),
      triangles_(static_cast<int>(mesh.triangles.size())) {
  vertices_.reserve(mesh.points.size());
  for (const Vec3& p : mesh.points) {
    vertices_.push_back({.position = p, .quadric = {}});
  }
  alive_.resize(mesh.triangles.size());
  std::iota(alive_.begin(), alive_.end(), 0);
  waiting_.reserve(costs_.size() / 2);
  cheapest_.reserve(costs_.size() / 2);
  for (const std::int32_t t : alive_) {
    AddQuadrics(t, 1);
  }
}

void Decimator::AddQuadrics(std::int32_t triangle, double times) {
  const Triangle corners = edges_.Corners(triangle);
  const Vec3 &a = vertices_[corners[0]].position, &b = vertices_[corners[1]].position,
             &c = vertices_[corners[2]].position;
  const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
  if (area_vector.squaredNorm() > 0) {
    const Quadric quadric = Quadric::OfTriangle(a - centre_, area_vector);
    for (const std::int32_t v : corners) {
      vertices_[v].quadric.Add(quadric, times);
    }
  }
  for (HalfEdgeIndex h = 4 * triangle; h < 4 * triangle + 3; ++h) {
    if (edges_.Twin(h) < 0) {
      DecimatedVertex &from = vertices_[edges_.From(h)], &to = vertices_[edges_.To(h)];
      const Quadric quadric = Quadric::OfLine(from.position - centre_, to.position - centre_);
      from.quadric.Add(quadric, times);
      to.quadric.Add(quadric, times);
    }
  }
}

MergeTarget Decimator::TargetOf(HalfEdgeIndex h) const {
  const DecimatedVertex &from = vertices_[edges_.From(h)], &to = vertices_[edges_.To(h)];
  const bool from_border = edges_.IsOnBorder(edges_.From(h)),
             to_border = edges_.IsOnBorder(edges_.To(h));
  if (from_border && to_border && edges_.Twin(h) >= 0) {
    return {};
  }
  Quadric sum = from.quadric;
  sum.Add(to.quadric);
  Vec3 at = from_border ? from.position : to.position;
  if (from_border == to_border) {
    at = centre_ +
         sum.MinimumNear(0.5 * (from.position + to.position) - centre_, kDamping, kNewtonSteps);
  }
  const double flat = kShortFirst * sum.Trace() * (to.position - from.position).squaredNorm();
  return {std::max(0.0, sum.At(at - centre_)) + flat, at};
}

void Decimator::Evaluate(HalfEdgeIndex h) {
  const HalfEdgeIndex edge = edges_.EdgeOf(h);
  const double cost = TargetOf(edge).cost;
  costs_[edge] = {cost < kNever ? static_cast<float>(cost) : kNever, collapses_};
}

void Decimator::EvaluateAll() {
  for (HalfEdgeIndex h = 0; h < edges_.End(); ++h) {
    if (edges_.IsAlive(h) && edges_.EdgeOf(h) == h) {
      Evaluate(h);
    }
  }
}

bool Decimator::IsStale(HalfEdgeIndex edge) const {
  return std::max(vertices_[edges_.From(edge)].changed, vertices_[edges_.To(edge)].changed) >
         costs_[edge].evaluated;
}

Remains Decimator::Run() {
  int gained_from = triangles_;
  EvaluateAll();
  while (triangles_ > options_.target_triangles) {
    const float cost_limit = CostLimitOfSweep();
    if (cost_limit < kNever) {
      Sweep(cost_limit);
      continue;
    }
    if (gained_from - triangles_ < kLeastGain * gained_from) {
      break;
    }
    gained_from = triangles_;
    tolerance_refused_ = false;
    retrying_ = true;
    EvaluateAll();
  }
  TriMesh mesh = RemainingMesh();
  return {std::move(mesh), std::move(alive_), Summary()};
}

DecimateSummary Decimator::Summary() const {
  DecimateSummary summary{.triangles = triangles_, .error_mm = originals_.LargestDistance_mm()};
  summary.stop = triangles_ <= options_.target_triangles ? DecimateStop::kTarget
                 : tolerance_refused_                    ? DecimateStop::kTolerance
                                                         : DecimateStop::kNoSoundCollapse;
  return summary;
}

void Decimator::FindWaiting() {
  waiting_.clear();
  cheapest_.clear();
  std::erase_if(alive_, [this](std::int32_t t) { return !edges_.IsAlive(4 * t); });
  for (const std::int32_t t : alive_) {
    for (HalfEdgeIndex h = 4 * t; h < 4 * t + 3; ++h) {
      if (costs_[h].cost < kNever) {
        waiting_.push_back(h);
        cheapest_.push_back(costs_[h].cost);
      }
    }
  }
}

// What the cheapest waiting edges cost: a share of them, but no more than are needed. Infinite: no
// edge should collapse.
float Decimator::CostLimitOfSweep() {
  FindWaiting();
  if (waiting_.empty()) {
    return kNever;
  }
  const auto needed = static_cast<std::size_t>(triangles_ - options_.target_triangles) / 2;
  const auto share = static_cast<std::size_t>(kShareOfSweep * double(waiting_.size()));
  const auto nth = cheapest_.begin() + static_cast<std::ptrdiff_t>(std::min(needed, share));
  std::nth_element(cheapest_.begin(), nth, cheapest_.end());
  const bool few = double(waiting_.size()) < kLeastWaiting * 1.5 * triangles_;
  if (std::isfinite(options_.tolerance_mm) || (!retrying_ && !few)) {
    dearest_ = std::max(dearest_, *nth);
  }
  const float cheapest = *std::min_element(cheapest_.begin(), nth + 1);
  return cheapest > dearest_ ? kNever : std::min(*nth, dearest_);
}

void Decimator::Sweep(float cost_limit) {
  for (const HalfEdgeIndex edge : waiting_) {
    if (costs_[edge].cost <= cost_limit && IsStale(edge)) {
      Evaluate(edge);
    }
    if (costs_[edge].cost <= cost_limit && triangles_ > options_.target_triangles) {
      TryCollapse(edge);
    }
  }
}

// An edge that is refused waits again only once one of its ends has changed.
void Decimator::TryCollapse(HalfEdgeIndex edge) {
  costs_[edge].cost = kNever;
  around_.Gather(edges_, edge);
  if (!KeepsTopology()) {
    return;
  }
  SetGeometry(TargetOf(edge).position);
  if (!PreservesQuality(geometry_)) {
    return;
  }
  GatherSamples();
  MeasureCollapse(geometry_, error_);
  if (IsWithinBounds()) {
    Collapse();
  }
}

// The link condition: the ends have no common neighbours but those of their common triangles. Also,
// triangles are left.
bool Decimator::KeepsTopology() {
  ++attempts_;
  for (const std::int32_t v : around_.ring) {
    if (v < 0 || vertices_[v].met == attempts_) {
      return false;
    }
    vertices_[v].met = attempts_;
  }
  return around_.spokes.size() >= (around_.closed ? 3u : 1u);
}

void Decimator::SetGeometry(const Vec3& target) {
  geometry_.keep = vertices_[around_.keep].position;
  geometry_.gone = vertices_[around_.gone].position;
  geometry_.target = target;
  geometry_.closed = around_.closed;
  geometry_.on_border = around_.on_border;
  geometry_.opposite.clear();
  for (const HalfEdgeIndex h : {around_.edge, edges_.Twin(around_.edge)}) {
    if (h >= 0) {
      geometry_.opposite.push_back(vertices_[edges_.From(HalfEdges::Previous(h))].position);
    }
  }
  geometry_.ring.clear();
  for (const std::int32_t v : around_.ring) {
    geometry_.ring.push_back(vertices_[v].position);
  }
  geometry_.at_gone.clear();
  for (const HalfEdgeIndex spoke : around_.spokes) {
    geometry_.at_gone.push_back(edges_.From(spoke) == around_.gone);
  }
}

// The original vertices that belong to the triangles around the edge.
void Decimator::GatherSamples() {
  sampled_.clear();
  originals_.AppendOf(HalfEdges::TriangleOf(around_.edge), sampled_);
  if (!around_.on_border) {
    originals_.AppendOf(HalfEdges::TriangleOf(edges_.Twin(around_.edge)), sampled_);
  }
  for (const HalfEdgeIndex spoke : around_.spokes) {
    originals_.AppendOf(HalfEdges::TriangleOf(spoke), sampled_);
  }
  geometry_.samples.clear();
  for (const std::int32_t v : sampled_) {
    geometry_.samples.push_back(originals_.Position(v));
  }
}

bool Decimator::IsWithinBounds() {
  double error_mm = error_.sheets_mm;
  for (const double distance_mm : error_.distance_mm) {
    error_mm = std::max(error_mm, distance_mm);
  }
  if (!(error_mm * error_mm <=
        kMostErrorOfSize * kMostErrorOfSize * AreaVectorAfter(geometry_).norm())) {
    return false;
  }
  if (std::isfinite(options_.tolerance_mm)) {
    error_mm = std::max(error_mm, originals_.DistanceBound_mm(geometry_.target, sampled_));
  }
  tolerance_refused_ |= error_mm > options_.tolerance_mm;
  return error_mm <= options_.tolerance_mm;
}

void Decimator::ReassignSamples() {
  for (const HalfEdgeIndex spoke : around_.spokes) {
    originals_.Clear(HalfEdges::TriangleOf(spoke));
  }
  for (std::size_t n = 0; n < sampled_.size(); ++n) {
    originals_.Assign(HalfEdges::TriangleOf(around_.spokes[error_.triangle_of[n]]), sampled_[n],
                      error_.distance_mm[n]);
  }
}

void Decimator::Collapse() {
  ForgetTrianglesAtEdge();
  AddQuadricsAround(-1);
  triangles_ -= around_.on_border ? 1 : 2;
  edges_.Collapse(around_.edge, around_.of_gone);
  ++collapses_;
  vertices_[around_.keep].position = geometry_.target;
  AddQuadricsAround(1);
  ReassignSamples();
  EvaluateAround();
}

// Those that disappear: takes out their quadrics and the costs of their edges.
void Decimator::ForgetTrianglesAtEdge() {
  for (const HalfEdgeIndex h : {around_.edge, edges_.Twin(around_.edge)}) {
    if (h >= 0) {
      for (const HalfEdgeIndex side : {h, HalfEdges::Next(h), HalfEdges::Previous(h)}) {
        costs_[edges_.EdgeOf(side)].cost = kNever;
      }
      AddQuadrics(HalfEdges::TriangleOf(h), -1);
    }
  }
}

void Decimator::AddQuadricsAround(double times) {
  for (const HalfEdgeIndex spoke : around_.spokes) {
    AddQuadrics(HalfEdges::TriangleOf(spoke), times);
  }
}

// The edges at the merged vertex; those farther out at the ring are stale now, and evaluated when
// their turn comes.
void Decimator::EvaluateAround() {
  vertices_[around_.keep].changed = collapses_;
  for (const std::int32_t v : around_.ring) {
    vertices_[v].changed = collapses_;
  }
  for (const HalfEdgeIndex spoke : around_.spokes) {
    Evaluate(spoke);
  }
  if (!around_.closed) {
    Evaluate(HalfEdges::Previous(around_.spokes.back()));
  }
}

// Without a tolerance the vertices settle: where there is one, they stay where they were proven to
// be within it.
TriMesh Decimator::RemainingMesh() {
  TriMesh all;
  all.points.reserve(vertices_.size());
  for (const DecimatedVertex& vertex : vertices_) {
    all.points.push_back(vertex.position);
  }
  std::erase_if(alive_, [this](std::int32_t t) { return !edges_.IsAlive(4 * t); });
  for (const std::int32_t t : alive_) {
    all.triangles.push_back(edges_.Corners(t));
  }
  if (std::isinf(options_.tolerance_mm)) {
    originals_.Settle(
        alive_, [this](std::int32_t v) { return edges_.IsOnBorder(v); }, all);
  }
  return all;
}

void CheckDecimation(const TriMesh& mesh, const DecimateOptions& options) {
  if (options.target_triangles < 4) {
    throw InputError(fmt::format("decimate: {} triangles are too few; at least 4 are needed",
                                 options.target_triangles));
  }
  if (!(options.tolerance_mm > 0)) {
    throw InputError(
        fmt::format("decimate: a tolerance of {} mm is not possible; it must be positive",
                    options.tolerance_mm));
  }
  for (const Vec3& p : mesh.points) {
    if (!p.allFinite()) {
      throw InputError("decimate: the mesh has a point that is not finite; repair it first");
    }
  }
}

}  // namespace

DecimateResult Decimate(const TriMesh& mesh, const DecimateOptions& options) {
  CheckDecimation(mesh, options);
  const int triangles = static_cast<int>(mesh.triangles.size());
  if (triangles <= options.target_triangles) {
    return {mesh, {triangles, 0, DecimateStop::kTarget}};
  }
  const bool scattered = IsScattered(mesh);
  const OrderedMesh ordered = scattered ? InOrderOfNeighbours(mesh) : OrderedMesh{};
  Remains left = Decimator(scattered ? ordered.mesh : mesh, options).Run();
  if (scattered) {
    PutBackInOrder(ordered, left.triangles, left.mesh);
  }
  return {Submesh(left.mesh, std::vector<bool>(left.mesh.triangles.size(), true)), left.summary};
}

}  // namespace semblance
