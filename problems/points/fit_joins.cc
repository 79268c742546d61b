// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_joins.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "fitting/fit.h"
#include "fitting/terms/term_cost.h"
#include "problems/points/join_places.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

double ExtentOf(std::span<const FitPoint> points) {
  Box3 box;
  for (const FitPoint& p : points) {
    box.extend(p.position);
  }
  return box.diagonal().norm();
}

// One way to lay a new edge along an edge of the given surface.
struct EdgeWay {
  SurfaceEdge its_edge;
  bool reversed;
  double mean_mm;  // from the points beside the new edge to where it would be
};

// A point near the new edge, t along it.
struct Beside {
  Vec3 position;
  double t;
};

std::vector<Beside> PointsBeside(SurfaceEdge edge, std::span<const FitPoint> points) {
  constexpr double kNear = 0.05;
  const int along = RunsAlongV(edge) ? 1 : 0, across = 1 - along;
  std::vector<Beside> beside;
  for (const FitPoint& p : points) {
    const double t = p.uv[along];
    if (std::abs(p.uv[across] - OnEdge(edge, t)[across]) <= kNear) {
      beside.push_back({p.position, t});
    }
  }
  return beside;
}

// Of all borders that the new edge could follow; none where too few points lie beside it.
std::vector<EdgeWay> WaysOf(const OpenedJoin& opened, std::span<const FitPoint> points) {
  constexpr std::size_t kEnough = 8;
  const std::vector<Beside> beside = PointsBeside(opened.join.edge, points);
  const HSplineShape& its = opened.surface.shape();
  std::vector<EdgeWay> ways;
  for (const SurfaceEdge e :
       {SurfaceEdge::kU0, SurfaceEdge::kU1, SurfaceEdge::kV0, SurfaceEdge::kV1}) {
    if (beside.size() < kEnough || !HasEdge(its, e) ||
        IsClosedAlong(its, e) != IsClosedAlong(its, opened.join.its_edge)) {
      continue;
    }
    for (const bool reversed : {false, true}) {
      double sum_mm = 0;
      for (const Beside& p : beside) {
        const Vec2 place = OnEdge(e, reversed ? 1 - p.t : p.t);
        sum_mm += (p.position - opened.surface.Point(place)).norm();
      }
      ways.push_back({e, reversed, sum_mm / static_cast<double>(beside.size())});
    }
  }
  return ways;
}

// A twisted surface, or one that is drawn right across the given surface, is what nobody wants:
// points near an edge say which edge it follows, and which way it runs.
void CheckPlace(const OpenedJoin& opened, std::size_t index, std::span<const FitPoint> points) {
  constexpr double kPlainly = 4;
  const SurfaceJoin& join = opened.join;
  const std::vector<EdgeWay> ways = WaysOf(opened, points);
  const auto given = std::ranges::find_if(ways, [&](const EdgeWay& w) {
    return w.its_edge == join.its_edge && w.reversed == join.reversed;
  });
  const auto best = std::ranges::min_element(ways, {}, &EdgeWay::mean_mm);
  if (given == ways.end() || given->mean_mm <= kPlainly * best->mean_mm) {
    return;
  }
  const std::string beside = fmt::format("the points beside {} are {:.3g} times nearer to",
                                         NameOf(join.edge), given->mean_mm / best->mean_mm);
  const std::string file = join.surface.filename().string();
  if (best->its_edge == join.its_edge) {
    throw InputError(
        fmt::format("joins[{}].reversed: {} {} of {} if it runs the other way; write reversed: {}",
                    index, beside, NameOf(join.its_edge), file, best->reversed));
  }
  throw InputError(fmt::format(
      "joins[{}].its_edge: {} {} of {} than to its {}; write its_edge: {}, reversed: {}", index,
      beside, NameOf(best->its_edge), file, NameOf(join.its_edge), NameOf(best->its_edge),
      best->reversed));
}

class JoinFitter {
 public:
  JoinFitter(const HSplineSurface& start, FitTarget target, std::span<const OpenedJoin> joins,
             const FitOptions& options, const RunContext& context)
      : start_(start),
        target_(std::move(target)),
        given_exact_(target_.exact),
        joins_(joins),
        options_(options),
        context_(context),
        extent_mm_(ExtentOf(target_.points)),
        finest_(FinestAllowed(options.plan, start.shape())) {}

  JoinedFit Run() {
    constexpr int kMostRounds = 6;
    Check();
    std::vector<HeldEdge> edges = EdgesOf(FitTo("before it is joined").surface);
    for (int round = 1;; ++round) {
      JoinedFit joined = FitHeld(edges);
      std::vector<HeldEdge> finer = FinerWhereNeeded(edges, joined.fit.surface);
      if (round == kMostRounds || finer == edges || AreTooMany(finer)) {
        NoteLimits(edges, joined);
        return joined;
      }
      edges = std::move(finer);
    }
  }

 private:
  void Check() const {
    CheckCorners(joins_, extent_mm_);
    for (std::size_t k = 0; k < joins_.size(); ++k) {
      CheckPlace(joins_[k], k, target_.points);
    }
  }

  FitResult FitTo(const std::string& what) const {
    context_.Report("fit", what);
    return Fit(start_, target_, {}, options_, context_);
  }

  int PatchesOf(std::size_t join) const {
    return PatchesAlong(start_.shape(), joins_[join].join.edge);
  }

  // unjoined: as the points alone have it.
  std::vector<HeldEdge> EdgesOf(const HSplineSurface& unjoined) const {
    std::vector<HeldEdge> edges;
    for (std::size_t k = 0; k < joins_.size(); ++k) {
      const SurfaceEdge edge = joins_[k].join.edge;
      const EdgeSpans asked =
          AsFineAsItsEdge(SpansAlong(start_, edge), joins_[k], fmt::format("joins[{}]", k),
                          {start_.shape(), finest_});
      edges.push_back(Evened(k, {asked, FinerOf(Reached(asked, PatchesOf(k)),
                                                SpansAlong(unjoined, edge), PatchesOf(k))}));
    }
    return edges;
  }

  // A curve of other patches is followed best by one of equal spans: as many places as vertices.
  HeldEdge Evened(std::size_t k, HeldEdge edge) const {
    if (!joins_[k].FitsInto(PatchesOf(k))) {
      edge.spans = Levelled(edge.spans);
      edge.asked = edge.spans;
    }
    return edge;
  }

  int PlacesOf(const HeldEdge& edge, std::size_t join) const {
    return PlacesAlong(edge.spans, IsClosedAlong(start_.shape(), joins_[join].join.edge));
  }

  std::size_t PlacesOf(const std::vector<HeldEdge>& edges) const {
    std::size_t places = 0;
    for (std::size_t k = 0; k < joins_.size(); ++k) {
      places += static_cast<std::size_t>(PlacesOf(edges[k], k));
    }
    return places - CornersOf(joins_).size();
  }

  bool AreTooMany(const std::vector<HeldEdge>& edges) const {
    return PlacesOf(edges) + given_exact_.size() > kMostExactPoints;
  }

  JoinedFit FitHeld(const std::vector<HeldEdge>& edges) {
    if (AreTooMany(edges)) {
      throw InputError(fmt::format(
          "joins: the edges would be held at {} places beside {} exact points, more than {}; take "
          "a lower fit.plan.finest, fewer patches along the edges of both surfaces, or fewer joins",
          PlacesOf(edges), given_exact_.size(), kMostExactPoints));
    }
    const std::vector<ExactPoint> exact = ExactPointsOf(joins_, edges, start_.shape());
    target_.exact = given_exact_;
    target_.exact.insert(target_.exact.end(), exact.begin(), exact.end());
    JoinedFit joined{.fit = FitTo(fmt::format("joined at {} places", PlacesOf(edges))),
                     .joins = {}};
    for (std::size_t k = 0; k < joins_.size(); ++k) {
      joined.joins.push_back(ReportOf(k, edges[k], MeetingsOf(k, joined.fit.surface)));
    }
    return joined;
  }

  std::vector<EdgeMeeting> MeetingsOf(std::size_t k, const HSplineSurface& surface) const {
    const SurfaceJoin& join = joins_[k].join;
    return MeetingsAlong({surface, join.edge}, {joins_[k].surface, join.its_edge},
                         {.reversed = join.reversed});
  }

  JoinReport ReportOf(std::size_t k, const HeldEdge& edge,
                      std::span<const EdgeMeeting> meetings) const {
    JoinReport report{.join = joins_[k].join,
                      .sha256 = joins_[k].sha256,
                      .places = PlacesOf(edge, k),
                      .allowed_gap_mm = kMostJoinGap * extent_mm_};
    for (const EdgeMeeting& meeting : meetings) {
      report.largest_gap_mm = std::fmax(report.largest_gap_mm, meeting.gap_mm);
      report.largest_angle_deg = std::fmax(report.largest_angle_deg, meeting.angle_deg);
    }
    return report;
  }

  // The same edges where each is as it should be.
  std::vector<HeldEdge> FinerWhereNeeded(const std::vector<HeldEdge>& edges,
                                         const HSplineSurface& surface) const {
    std::vector<HeldEdge> finer = edges;
    for (std::size_t k = 0; k < joins_.size(); ++k) {
      finer[k].spans =
          FinerOf(edges[k].spans, SpansAlong(surface, joins_[k].join.edge), PatchesOf(k));
      finer[k] = Evened(k, finer[k]);
    }
    if (finer != edges) {
      return finer;  // what is finer than thought is not held between the places
    }
    for (std::size_t k = 0; k < joins_.size(); ++k) {
      HalveWhereNeeded(k, ShortfallOf(k, surface), finer);
    }
    return finer;
  }

  // How many would be needed: each makes an eighth of a gap, and of an angle.
  double Halvings(const SurfaceJoin& join, const EdgeMeeting& meeting) const {
    const double gap = std::log(meeting.gap_mm / (kMostJoinGap * extent_mm_)) / std::log(8),
                 angle = std::log(meeting.angle_deg / kMostJoinAngle_deg) / std::log(8);
    return join.continuity == JoinContinuity::kTangentPlane ? std::fmax(gap, angle) : gap;
  }

  // Where the surfaces meet worse than they should, and how many halvings would help.
  struct Shortfall {
    std::vector<double> at;
    double halvings = 0;
  };
  Shortfall ShortfallOf(std::size_t k, const HSplineSurface& surface) const {
    Shortfall shortfall;
    for (const EdgeMeeting& meeting : MeetingsOf(k, surface)) {
      if (const double halvings = Halvings(joins_[k].join, meeting); halvings > 0) {
        shortfall.at.push_back(meeting.t);
        shortfall.halvings = std::max(shortfall.halvings, halvings);
      }
    }
    return shortfall;
  }

  // As often as is likely to be needed and there are places for.
  void HalveWhereNeeded(std::size_t k, const Shortfall& shortfall,
                        std::vector<HeldEdge>& edges) const {
    const HeldEdge before = edges[k];
    for (int levels = static_cast<int>(std::ceil(shortfall.halvings)); levels > 0; --levels) {
      edges[k] = Evened(k, Halved(before, shortfall.at, levels, PatchesOf(k), finest_));
      if (!AreTooMany(edges)) {
        return;
      }
    }
    edges[k] = before;
  }

  void NoteLimits(const std::vector<HeldEdge>& edges, JoinedFit& joined) const {
    for (std::size_t k = 0; k < joins_.size(); ++k) {
      std::vector<HeldEdge> finer = edges;
      finer[k] = Evened(k, Halved(edges[k], ShortfallOf(k, joined.fit.surface).at, /*levels=*/1,
                                  PatchesOf(k), finest_));
      joined.joins[k].is_at_limit = AreTooMany(finer);
    }
  }

  const HSplineSurface& start_;
  FitTarget target_;
  const std::vector<ExactPoint> given_exact_;  // the joins' come and go
  std::span<const OpenedJoin> joins_;
  const FitOptions& options_;
  const RunContext& context_;
  double extent_mm_;
  int finest_;
};

}  // namespace

std::string JoinPlanFault(const FitOptions& options) {
  const bool at_once = std::holds_alternative<AdaptivePlan>(options.plan) ||
                       std::holds_alternative<AutoPlan>(options.plan);
  return at_once && options.solver == Solver::kFastest && SeparableButForLoss(options.terms) &&
                 std::holds_alternative<NoRelaxation>(options.relaxation)
             ? ""
             : "edges are held with fit.plan: auto or adaptive, fit.solver: fastest, terms that "
               "treat x, y and z alike, and fit.relaxation: none; take those, or leave joins out";
}

JoinedFit FitJoined(const HSplineSurface& start, FitTarget target,
                    std::span<const OpenedJoin> joins, const FitOptions& options,
                    const RunContext& context) {
  return JoinFitter(start, std::move(target), joins, options, context).Run();
}

}  // namespace semblance
