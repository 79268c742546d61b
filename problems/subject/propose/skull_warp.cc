// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/propose/skull_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "problems/subject/propose/skull_pose.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {
namespace {

constexpr double kMinCosine = 0.5;  // normals within 60 degrees face alike

// Points of the reference with the points of the skull that they belong to.
struct Pairs {
  std::vector<Vec3> from, to;
  std::vector<double> weights;

  void Add(const Vec3& source, const Vec3& target, double distance_mm, double reach_mm) {
    const double share = distance_mm / reach_mm;
    if (share < 1) {
      from.push_back(source);
      to.push_back(target);
      // Tukey's weight, kept above 0.
      weights.push_back(std::max(1e-3, (1 - share * share) * (1 - share * share)));
    }
  }
};

// Points spread over the shell, denser where is_near(position) is true.
template <class IsNear>
std::vector<ShellPoint> SpreadDenser(const SkullShell& shell, IsNear&& is_near) {
  constexpr double kNearCell_mm = 15, kFarCell_mm = 40;
  std::vector<ShellPoint> points;
  for (const ShellPoint& p : SpreadPoints(shell, kNearCell_mm)) {
    if (is_near(p.position)) {
      points.push_back(p);
    }
  }
  for (const ShellPoint& p : SpreadPoints(shell, kFarCell_mm)) {
    if (!is_near(p.position)) {
      points.push_back(p);
    }
  }
  return points;
}

bool NearASite(const ReferenceHead& reference, const Vec3& p) {
  constexpr double kNear_mm = 30;
  return std::ranges::any_of(reference.sites,
                             [&](const SitePoint& s) { return (s.point - p).norm() <= kNear_mm; });
}

TriMesh Carried(const TriMesh& mesh, const ThinPlate& plate) {
  TriMesh carried = mesh;
  std::ranges::transform(mesh.points, carried.points.begin(), plate);
  return carried;
}

struct Round {
  double stiffness_mm, reach_mm;
};

class Warper {
 public:
  Warper(const ReferenceHead& reference, const SkullShell& skull, const Similarity& pose,
         std::span<const SitePoint> known)
      : reference_(reference), skull_(skull), pose_(pose) {
    for (const SitePoint& s : known) {
      const auto own = std::ranges::find(reference.sites, s.site, &SitePoint::site);
      if (own != reference.sites.end()) {
        known_.emplace_back(own->point, s.point);
      }
    }
    of_reference_ =
        SpreadDenser(reference.shell, [&](const Vec3& p) { return NearASite(reference, p); });
    const Similarity back = Inverse(pose);
    of_skull_ = SpreadDenser(skull, [&](const Vec3& q) { return NearASite(reference, back * q); });
    coarse_ = ClusterVertices(reference.shell.mesh, 4);
    plate_.affine << pose.scale * pose.rotation, pose.translation;
  }

  ThinPlate Run() {
    // From stiff and far to soft and near, so that no round has to correct large errors locally.
    constexpr std::array kRounds = {Round{20000, 25}, Round{5000, 20}, Round{1000, 16},
                                    Round{200, 12},   Round{60, 9},    Round{20, 7}};
    for (const Round& round : kRounds) {
      const Pairs pairs = Match(round.reach_mm);
      if (pairs.from.size() < 30) {
        break;  // too few matches; the last plate, at first the pose, stays
      }
      plate_ =
          FitThinPlate(pairs.from, pairs.to, pairs.weights, {.stiffness_mm = round.stiffness_mm});
    }
    return std::move(plate_);
  }

 private:
  Pairs Match(double reach_mm) const {
    const CorrespondenceOptions match{.reach_mm = reach_mm, .least_cosine = kMinCosine};
    Pairs pairs;
    for (const auto& [from, to] : known_) {
      // A click stands for all bone around it, so it weighs as much as several matches.
      constexpr double kClickWeight = 5;
      pairs.from.push_back(from);
      pairs.to.push_back(to);
      pairs.weights.push_back(kClickWeight);
    }
    for (const ShellPoint& p : of_reference_) {
      const Vec3 moved = plate_(p.position);
      if (const auto q = skull_.surface.Find(moved, pose_.rotation * p.normal, match)) {
        pairs.Add(p.position, q->point.position, q->point.distance_mm, reach_mm);
      }
    }
    const Correspondences carried(Carried(coarse_, plate_));
    for (const ShellPoint& q : of_skull_) {
      if (const auto p = carried.Find(q.position, q.normal, match)) {
        pairs.Add(Before(p->point), q.position, p->point.distance_mm, reach_mm);
      }
    }
    return pairs;
  }

  // The point of the reference from which a point of the carried shell came.
  Vec3 Before(const MeshPoint& p) const {
    const Triangle& t = coarse_.triangles[p.triangle];
    return p.weights[0] * coarse_.points[t[0]] + p.weights[1] * coarse_.points[t[1]] +
           p.weights[2] * coarse_.points[t[2]];
  }

  const ReferenceHead& reference_;
  const SkullShell& skull_;
  const Similarity& pose_;
  std::vector<ShellPoint> of_reference_, of_skull_;
  std::vector<std::pair<Vec3, Vec3>> known_;  // points of the reference and of the skull
  TriMesh coarse_;  // coarse shell of the reference, for matches from the skull
  ThinPlate plate_;
};

// Matches the points of a piece of bone, after its motion, with the skull.
std::vector<ShellMatch> MatchPiece(const std::vector<ShellPoint>& piece, const SkullShell& skull,
                                   const Similarity& motion) {
  constexpr CorrespondenceOptions kMatch = {.reach_mm = 6, .least_cosine = kMinCosine};
  std::vector<ShellMatch> matches;
  for (const ShellPoint& p : piece) {
    const Vec3 from = motion * p.position;
    if (const auto q = skull.surface.Find(from, motion.rotation * p.normal, kMatch)) {
      matches.push_back({.from = from,
                         .to = q->point.position,
                         .normal = q->normal,
                         .distance_mm = q->point.distance_mm});
    }
  }
  return matches;
}

struct PieceFit {
  Similarity motion;
  double misfit_mm = kNaN;
};

PieceFit LayPiece(const std::vector<ShellPoint>& piece, const SkullShell& skull) {
  constexpr int kRounds = 12;
  constexpr double kKeptOfPiece = 0.8;  // the rest may lack on the skull
  const std::size_t fewest = std::max<std::size_t>(12, piece.size() / 3);
  PieceFit fit;
  for (int round = 0; round <= kRounds; ++round) {
    const std::vector<ShellMatch> kept =
        KeepClosest(MatchPiece(piece, skull, fit.motion), kKeptOfPiece);
    if (kept.size() < fewest) {
      return {};
    }
    fit.misfit_mm = 0;
    for (const ShellMatch& m : kept) {
      fit.misfit_mm += m.distance_mm / static_cast<double>(kept.size());
    }
    if (round < kRounds) {
      fit.motion = StepTowards(kept, /*scale_too=*/false) * fit.motion;
    }
  }
  return fit;
}

std::vector<ShellPoint> PieceAround(const Vec3& site, const std::vector<ShellPoint>& points,
                                    const ThinPlate& plate, const Mat3& rotation) {
  constexpr double kRadius_mm = 18;
  std::vector<ShellPoint> piece;
  for (const ShellPoint& p : points) {
    if ((p.position - site).norm() <= kRadius_mm) {
      piece.push_back({plate(p.position), rotation * p.normal});
    }
  }
  return piece;
}

}  // namespace

Similarity FacePose(const ReferenceHead& reference, const SkullShell& skull,
                    const Similarity& skull_from_reference) {
  return RefinePose(reference.shell, skull, skull_from_reference,
                    [&](const Vec3& p) { return NearASite(reference, p); });
}

ThinPlate WarpOnto(const ReferenceHead& reference, const SkullShell& skull,
                   const Similarity& skull_from_reference, std::span<const SitePoint> known) {
  return Warper(reference, skull, skull_from_reference, known).Run();
}

std::vector<WarpedSite> CarrySites(const ReferenceHead& reference, const SkullShell& skull,
                                   const Similarity& skull_from_reference, const ThinPlate& plate) {
  constexpr double kCell_mm = 3, kMaxMove_mm = 8;
  const std::vector<ShellPoint> points = SpreadPoints(reference.shell, kCell_mm);
  std::vector<WarpedSite> sites;
  for (const SitePoint& s : reference.sites) {
    const Vec3 carried = plate(s.point);
    const PieceFit fit =
        LayPiece(PieceAround(s.point, points, plate, skull_from_reference.rotation), skull);
    const Vec3 laid = fit.motion * carried;
    const bool near = (laid - carried).norm() <= kMaxMove_mm;
    sites.push_back({s.site, near ? laid : carried, fit.misfit_mm});
  }
  return sites;
}

}  // namespace semblance::problems
