// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/decimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/decimate/edge_patch.h"
#include "surfaces/decimate/given_points.h"
#include "surfaces/decimate/patch_move.h"
#include "surfaces/decimate/patch_shape.h"
#include "surfaces/decimate/quadric.h"
#include "surfaces/mesh/half_edges.h"

namespace semblance {
namespace {

// What a sound collapse keeps to, besides KeepsShape.
constexpr double kMostErrorOfSize = 0.15;  // of the square root of the area around
// How a new point is held to the middle of its edge where the surface says little; see Quadric.
constexpr double kHeldBack = 1e-6;
constexpr int kNewtonSteps = 3;
// Edges that were refused are asked again as long as that pays.
constexpr double kLeastGain = 0.005;
// Of all edges, those that may collapse in one sweep: the cheapest.
constexpr double kShareOfSweep = 0.1;
// What makes short edges go first where the surface is flat.
constexpr double kShortFirst = 1e-8;
// Where so few of all edges still wait, for the others were refused, no costlier ones are taken:
// what is left would pay for all.
constexpr double kLeastWaiting = 0.2;
constexpr float kNever = std::numeric_limits<float>::infinity();

struct DecimatePoint {
  Vec3 at;
  Quadric quadric;  // of the triangles around, and of the border
  int changed = 0;  // by which collapse the quadric was last
  int met = 0;      // at which question; see KeepsTopology
};

// Of an edge, at the place of the lower of its half-edges.
struct EdgeCost {
  float cost = kNever;
  int evaluated = 0;  // after which collapse
};

struct Placement {
  double cost = kNaN;
  Vec3 at = Vec3::Constant(kNaN);
};

class Decimator {
 public:
  Decimator(const TriMesh& mesh, const DecimateOptions& options);
  DecimateResult Run();

 private:
  void AddQuadrics(std::int32_t triangle, double times);
  Placement Place(HalfEdgeIndex h) const;
  void Evaluate(HalfEdgeIndex h);
  void EvaluateAll();
  bool IsStale(HalfEdgeIndex edge) const;
  void FindWaiting();
  float MostOfSweep();
  void Sweep(float most);
  void Try(HalfEdgeIndex edge);
  bool KeepsTopology();
  void SetPlaces(const Vec3& place);
  void SetSamples();
  bool IsWithinBounds();
  void Collapse();
  void MoveSamples();
  TriMesh Rest() const;
  DecimateSummary Summary() const;

  const TriMesh& mesh_;
  DecimateOptions options_;
  Vec3 centre_;  // quadrics are of places relative to it
  HalfEdges edges_;
  std::vector<DecimatePoint> points_;
  GivenPoints given_;
  std::vector<std::int32_t> alive_;  // triangles, ascending
  std::vector<EdgeCost> costs_;
  std::vector<HalfEdgeIndex> waiting_;  // edges that have a cost, ascending
  std::vector<float> cheapest_;
  float dearest_ = 0;  // that was taken, or could have been
  EdgePatch patch_;
  PatchPlaces places_;
  PatchMove move_;
  std::vector<std::int32_t> sampled_;
  int collapses_ = 0, questions_ = 0, triangles_ = 0;
  bool tolerance_refused_ = false, asked_again_ = false;
};

Decimator::Decimator(const TriMesh& mesh, const DecimateOptions& options)
    : mesh_(mesh),
      options_(options),
      centre_(Bounds(mesh).center()),
      edges_(mesh, "decimate"),
      given_(mesh),
      costs_(edges_.End()),
      triangles_(static_cast<int>(mesh.triangles.size())) {
  points_.reserve(mesh.points.size());
  for (const Vec3& p : mesh.points) {
    points_.push_back({p, {}});
  }
  for (int t = 0; t < triangles_; ++t) {
    AddQuadrics(t, 1);
    alive_.push_back(t);
  }
}

void Decimator::AddQuadrics(std::int32_t triangle, double times) {
  const Triangle corners = edges_.Corners(triangle);
  const Vec3 &a = points_[corners[0]].at, &b = points_[corners[1]].at, &c = points_[corners[2]].at;
  const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
  if (area_vector.squaredNorm() > 0) {
    const Quadric quadric = Quadric::OfTriangle(a - centre_, area_vector);
    for (const std::int32_t v : corners) {
      points_[v].quadric.Add(quadric, times);
    }
  }
  for (HalfEdgeIndex h = 4 * triangle; h < 4 * triangle + 3; ++h) {
    if (edges_.Twin(h) < 0) {
      DecimatePoint &from = points_[edges_.From(h)], &to = points_[edges_.To(h)];
      const Quadric quadric = Quadric::OfLine(from.at - centre_, to.at - centre_);
      from.quadric.Add(quadric, times);
      to.quadric.Add(quadric, times);
    }
  }
}

Placement Decimator::Place(HalfEdgeIndex h) const {
  const DecimatePoint &from = points_[edges_.From(h)], &to = points_[edges_.To(h)];
  const bool from_border = edges_.IsOnBorder(edges_.From(h)),
             to_border = edges_.IsOnBorder(edges_.To(h));
  if (from_border && to_border && edges_.Twin(h) >= 0) {
    return {};
  }
  Quadric sum = from.quadric;
  sum.Add(to.quadric);
  Vec3 at = from_border ? from.at : to.at;
  if (from_border == to_border) {
    at = centre_ + sum.LeastNear(0.5 * (from.at + to.at) - centre_, kHeldBack, kNewtonSteps);
  }
  const double flat = kShortFirst * sum.Trace() * (to.at - from.at).squaredNorm();
  return {std::max(0.0, sum.At(at - centre_)) + flat, at};
}

void Decimator::Evaluate(HalfEdgeIndex h) {
  const HalfEdgeIndex edge = edges_.EdgeOf(h);
  const double cost = Place(edge).cost;
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
  return std::max(points_[edges_.From(edge)].changed, points_[edges_.To(edge)].changed) >
         costs_[edge].evaluated;
}

DecimateResult Decimator::Run() {
  int gained_from = triangles_;
  EvaluateAll();
  while (triangles_ > options_.target_triangles) {
    const float most = MostOfSweep();
    if (most < kNever) {
      Sweep(most);
      continue;
    }
    if (gained_from - triangles_ < kLeastGain * gained_from) {
      break;
    }
    gained_from = triangles_;
    tolerance_refused_ = false;
    asked_again_ = true;
    EvaluateAll();
  }
  return {Rest(), Summary()};
}

DecimateSummary Decimator::Summary() const {
  DecimateSummary summary{.triangles = triangles_, .error_mm = given_.LargestDistance_mm()};
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

// What the cheapest edges cost that wait: a share of them, but no more than are needed. Infinite:
// none is to collapse.
float Decimator::MostOfSweep() {
  FindWaiting();
  if (waiting_.empty()) {
    return kNever;
  }
  const auto needed = static_cast<std::size_t>(triangles_ - options_.target_triangles) / 2;
  const auto share = static_cast<std::size_t>(kShareOfSweep * double(waiting_.size()));
  const auto nth = cheapest_.begin() + static_cast<std::ptrdiff_t>(std::min(needed, share));
  std::nth_element(cheapest_.begin(), nth, cheapest_.end());
  const bool few = double(waiting_.size()) < kLeastWaiting * 1.5 * triangles_;
  if (std::isfinite(options_.tolerance_mm) || (!asked_again_ && !few)) {
    dearest_ = std::max(dearest_, *nth);
  }
  const float cheapest = *std::min_element(cheapest_.begin(), nth + 1);
  return cheapest > dearest_ ? kNever : std::min(*nth, dearest_);
}

void Decimator::Sweep(float most) {
  for (const HalfEdgeIndex edge : waiting_) {
    if (costs_[edge].cost <= most && IsStale(edge)) {
      Evaluate(edge);
    }
    if (costs_[edge].cost <= most && triangles_ > options_.target_triangles) {
      Try(edge);
    }
  }
}

// Refused, an edge waits no more, until one of its ends changes.
void Decimator::Try(HalfEdgeIndex edge) {
  costs_[edge].cost = kNever;
  patch_.Gather(edges_, edge);
  if (!KeepsTopology()) {
    return;
  }
  SetPlaces(Place(edge).at);
  if (!KeepsShape(places_)) {
    return;
  }
  SetSamples();
  MeasureMove(places_, move_);
  if (IsWithinBounds()) {
    Collapse();
  }
}

// The ends have no neighbours in common but those that their triangles give (the link condition),
// and triangles are left.
bool Decimator::KeepsTopology() {
  ++questions_;
  for (const std::int32_t v : patch_.ring) {
    if (v < 0 || points_[v].met == questions_) {
      return false;
    }
    points_[v].met = questions_;
  }
  return patch_.spokes.size() >= (patch_.closed ? 3u : 1u);
}

void Decimator::SetPlaces(const Vec3& place) {
  places_.keep = points_[patch_.keep].at;
  places_.gone = points_[patch_.gone].at;
  places_.place = place;
  places_.closed = patch_.closed;
  places_.on_border = patch_.on_border;
  places_.opposite.clear();
  for (const HalfEdgeIndex h : {patch_.edge, edges_.Twin(patch_.edge)}) {
    if (h >= 0) {
      places_.opposite.push_back(points_[edges_.From(HalfEdges::Previous(h))].at);
    }
  }
  places_.ring.clear();
  for (const std::int32_t v : patch_.ring) {
    places_.ring.push_back(points_[v].at);
  }
  places_.at_gone.clear();
  for (const HalfEdgeIndex spoke : patch_.spokes) {
    places_.at_gone.push_back(edges_.From(spoke) == patch_.gone);
  }
}

// The points of the mesh given that belong to triangles around.
void Decimator::SetSamples() {
  sampled_.clear();
  given_.Append(HalfEdges::TriangleOf(patch_.edge), sampled_);
  if (!patch_.on_border) {
    given_.Append(HalfEdges::TriangleOf(edges_.Twin(patch_.edge)), sampled_);
  }
  for (const HalfEdgeIndex spoke : patch_.spokes) {
    given_.Append(HalfEdges::TriangleOf(spoke), sampled_);
  }
  places_.samples.clear();
  for (const std::int32_t v : sampled_) {
    places_.samples.push_back(mesh_.points[v]);
  }
}

bool Decimator::IsWithinBounds() {
  double error_mm = move_.sheets_mm;
  for (const double distance_mm : move_.distance_mm) {
    error_mm = std::max(error_mm, distance_mm);
  }
  if (!(error_mm * error_mm <=
        kMostErrorOfSize * kMostErrorOfSize * AreaVectorAfter(places_).norm())) {
    return false;
  }
  if (std::isfinite(options_.tolerance_mm)) {
    error_mm = std::max(error_mm, given_.DistanceBound_mm(places_.place, sampled_));
  }
  tolerance_refused_ |= error_mm > options_.tolerance_mm;
  return error_mm <= options_.tolerance_mm;
}

void Decimator::MoveSamples() {
  for (const HalfEdgeIndex spoke : patch_.spokes) {
    given_.Clear(HalfEdges::TriangleOf(spoke));
  }
  for (std::size_t n = 0; n < sampled_.size(); ++n) {
    given_.Give(HalfEdges::TriangleOf(patch_.spokes[move_.under[n]]), sampled_[n],
                move_.distance_mm[n]);
  }
}

void Decimator::Collapse() {
  const HalfEdgeIndex back = edges_.Twin(patch_.edge);
  for (const HalfEdgeIndex h : {patch_.edge, back}) {
    if (h >= 0) {
      for (const HalfEdgeIndex side : {h, HalfEdges::Next(h), HalfEdges::Previous(h)}) {
        costs_[edges_.EdgeOf(side)].cost = kNever;
      }
      AddQuadrics(HalfEdges::TriangleOf(h), -1);
    }
  }
  for (const HalfEdgeIndex spoke : patch_.spokes) {
    AddQuadrics(HalfEdges::TriangleOf(spoke), -1);
  }
  edges_.Collapse(patch_.edge, patch_.of_gone);
  triangles_ -= back < 0 ? 1 : 2;
  ++collapses_;
  points_[patch_.keep].at = places_.place;
  for (const HalfEdgeIndex spoke : patch_.spokes) {
    AddQuadrics(HalfEdges::TriangleOf(spoke), 1);
  }
  MoveSamples();
  points_[patch_.keep].changed = collapses_;
  for (const std::int32_t v : patch_.ring) {
    points_[v].changed = collapses_;
  }
  for (const HalfEdgeIndex spoke : patch_.spokes) {
    Evaluate(spoke);
  }
  if (!patch_.closed) {
    Evaluate(HalfEdges::Previous(patch_.spokes.back()));
  }
}

// In their old order.
TriMesh Decimator::Rest() const {
  TriMesh all;
  for (const DecimatePoint& point : points_) {
    all.points.push_back(point.at);
  }
  for (HalfEdgeIndex h = 0; h < edges_.End(); h += 4) {
    if (edges_.IsAlive(h)) {
      all.triangles.push_back(edges_.Corners(HalfEdges::TriangleOf(h)));
    }
  }
  return Submesh(all, std::vector<bool>(all.triangles.size(), true));
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
  return Decimator(mesh, options).Run();
}

}  // namespace semblance
