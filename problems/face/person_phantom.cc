// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/person_phantom.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "fitting/problem/placement.h"
#include "interp/schemes/people.h"
#include "problems/face/bust/pose_bust.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/template_source.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/condition_depths.h"
#include "problems/subject/propose/mean_skull.h"
#include "problems/subject/propose/suggestion_check.h"
#include "problems/subject/sites.h"
#include "problems/subject/tissue_table.h"
#include "surfaces/base/random.h"
#include "surfaces/base/thin_plate.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/correspondences.h"
#include "surfaces/mesh/mesh_primitives.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// ---------------------------------------------------------------------------------------------
// The face
// ---------------------------------------------------------------------------------------------

struct DrawnFace {
  HSplineSurface surface;
  std::map<std::string, Vec2> site_uv;
  std::map<std::string, Vec3> tips;  // the points of the face over the sites
};

DrawnFace DrawFace(Random& random, const RunContext& context) {
  const TemplateFace mean = LoadTemplate(IctTemplate{});
  const FacePrior prior = LoadPrior(IctPrior{}, mean);
  Eigen::VectorXd coefficients(prior.model.Modes());
  for (double& c : coefficients) {
    c = random.BoundedNormal();
  }
  ShapeEstimate drawn;
  drawn.points = ShapeAt(prior.model, coefficients);
  DrawnFace face{
      MakeFaceSurface(drawn, prior, LayOnTemplate(prior, mean, context), mean.surface.shape()),
      mean.site_uv,
      {}};
  for (const auto& [site, at] : prior.sites) {
    face.tips[site] = FindPosition(at, prior.model.mean, drawn.points);
  }
  return face;
}

// Closes each border by a fan whose tip is the given point.
void CloseBorders(const Vec3& point, TriMesh& mesh) {
  for (const VertexLoop& loop : BorderLoops(mesh, "person")) {
    const auto tip = static_cast<std::int32_t>(mesh.points.size());
    mesh.points.push_back(point);
    for (std::size_t k = 0; k < loop.size(); ++k) {
      mesh.triangles.push_back({loop[(k + 1) % loop.size()], loop[k], tip});
    }
  }
}

Vec3 MeanPoint(const TriMesh& mesh, const VertexLoop& loop) {
  Vec3 sum = Vec3::Zero();
  for (const std::int32_t v : loop) {
    sum += mesh.points[v];
  }
  return sum / static_cast<double>(loop.size());
}

// The middle of the face, with closed lids and lips, which the head of PoseBust has open.
TriMesh MiddleOfFace(const HSplineSurface& surface) {
  constexpr int kQuadsPerPatch = 3;
  // The openings lie within this part of the domain; near its borders head and face differ.
  const Eigen::AlignedBox2d middle(Vec2(0.25, 0.3), Vec2(0.75, 0.75));
  const Tessellation face = Tessellate(surface, kQuadsPerPatch);
  std::vector<bool> keep;
  for (const Triangle& t : face.mesh.triangles) {
    keep.push_back(std::ranges::all_of(t, [&](int v) { return middle.contains(face.uv[v]); }));
  }
  return Submesh(face.mesh, keep);
}

// The triangles whose centre is further than tolerance_mm from the other mesh.
std::vector<bool> AwayFrom(const TriMesh& mesh, const MeshQuery& other, double tolerance_mm) {
  std::vector<bool> away;
  for (const Triangle& t : mesh.triangles) {
    away.push_back(other.Closest(TriangleCentroid(mesh, t)).distance_mm > tolerance_mm);
  }
  return away;
}

// The part of a mesh that does not lie below the middle of the face.
TriMesh PartNotBelow(const Correspondences& middle, const TriMesh& mesh, double tolerance_mm) {
  std::vector<bool> keep;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 p = TriangleCentroid(mesh, t);
    const MeshPoint at = middle.query().Closest(p);
    const double below_mm = (at.position - p).dot(middle.NormalAt(at));
    keep.push_back(below_mm < tolerance_mm || below_mm < 0.9 * at.distance_mm);
  }
  return Submesh(mesh, keep);
}

// Drops the walls of the openings, which lie below the middle of the face, and covers them with it
// and with what the eyes show.
TriMesh CoverOpenings(const TriMesh& skin, const TriMesh& middle,
                      const std::vector<TriMesh>& eyes) {
  constexpr double kTolerance_mm = 0.5;  // head and face differ by less beside the openings
  const Correspondences on_middle(middle);
  TriMesh covered = PartNotBelow(on_middle, skin, kTolerance_mm);
  for (const TriMesh& eye : eyes) {
    Append(covered, PartNotBelow(on_middle, eye, 0));
  }
  Append(covered, Submesh(middle, AwayFrom(middle, MeshQuery(covered), kTolerance_mm)));
  return covered;
}

void MakeHead(const DrawnFace& face, PersonPhantom& person, const RunContext& context) {
  constexpr int kEyeRings = 24;  // edges of 1.6 mm
  const std::optional<BustModel> model = LoadBust(IctBust{}, IctTemplate{}, context);
  Bust bust = PoseBust({*model, face.surface, face.site_uv, {}}, context);
  person.skin = std::move(bust.skin);
  CloseBorders(MeanPoint(person.skin, BorderLoops(person.skin, "person").at(0)), person.skin);
  for (const Sphere& eye : bust.eyeballs) {
    person.eyes.push_back(MakeSphere(eye.center, eye.radius_mm, kEyeRings));
  }
  person.closing = MiddleOfFace(face.surface);
  person.true_skin = CoverOpenings(person.skin, person.closing, person.eyes);
  CloseBorders(Bounds(person.skin).center(), person.closing);  // behind the whole face
}

// ---------------------------------------------------------------------------------------------
// Depths
// ---------------------------------------------------------------------------------------------

// The rest that is left when the build is known. Sites share it as SiteCorrelation's parts state,
// without the common part, which is the build's.
Eigen::VectorXd DrawRest(const std::vector<std::string>& sites, Random& random) {
  constexpr SiteCorrelation kAll;
  constexpr double kRest = 1 - kAll.common;
  const SiteCorrelation rest{.common = 0,
                             .twins = kAll.twins / kRest,
                             .own = kAll.own / kRest,
                             .length_mm = kAll.length_mm};
  const Eigen::MatrixXd correlation = ModelledCorrelation(rest, sites);
  Eigen::VectorXd independent(correlation.rows());
  for (double& x : independent) {
    x = random.BoundedNormal();
  }
  return correlation.llt().matrixL() * independent;
}

// The T-Table's mean and deviation, which come from many people and fine scans, where it has the
// site.
interp::LogDepth Published(const std::string& site, interp::LogDepth depth) {
  if (const std::optional<PublishedDepth> published = FindPublishedDepth(site)) {
    depth.mean = std::log(published->mean_mm);
    depth.sd = published->sd_mm / published->mean_mm;
  }
  return depth;
}

std::map<std::string, double> DrawDepths(double build, Random& random) {
  const interp::People& people = interp::CarriedPeople();
  std::vector<std::string> sites;
  for (const Site& site : StandardSites()) {
    if (people.sites.contains(site.code)) {
      sites.push_back(site.code);
    }
  }
  const Eigen::VectorXd rest = DrawRest(sites, random);
  std::map<std::string, double> depth_mm;
  for (std::size_t k = 0; k < sites.size(); ++k) {
    const interp::LogDepth d = Published(sites[k], people.sites.at(sites[k]).depth);
    const double own = std::sqrt(1 - d.loading * d.loading) * rest[static_cast<Eigen::Index>(k)];
    depth_mm[sites[k]] = std::exp(d.mean + d.sd * (d.loading * build + own));
  }
  return depth_mm;
}

// ---------------------------------------------------------------------------------------------
// The skull
// ---------------------------------------------------------------------------------------------

// A mean skull with drawn modes, and its sites as points of its triangles.
struct DrawnSkull {
  TriMesh mesh;
  std::map<std::string, MeshPoint> sites;

  Vec3 SiteOn(const std::vector<Vec3>& points, const MeshPoint& at) const {
    const Triangle& t = mesh.triangles[at.triangle];
    return at.weights[0] * points[t[0]] + at.weights[1] * points[t[1]] +
           at.weights[2] * points[t[2]];
  }
};

// Returns whether a point of the shell, and the bone around it, face within acos(least_cosine) of a
// direction. Thin bone has a second side within the radius, so the mean alone would not tell.
bool Faces(const SkullShell& shell, const Vec3& p, const Vec3& direction, double least_cosine) {
  constexpr double kRadius_mm = 5;  // wider than the bone at a rim is thick
  Vec3 sum = Vec3::Zero();
  for (std::size_t v = 0; v < shell.mesh.points.size(); ++v) {
    if ((shell.mesh.points[v] - p).norm() < kRadius_mm) {
      sum += shell.surface.vertex_normals()[v];
    }
  }
  const Vec3 own = shell.surface.NormalAt(shell.surface.query().Closest(p));
  return std::min(sum.normalized().dot(direction), own.dot(direction)) > least_cosine;
}

// The point of the shell that stands for a site: the nearest one where the bone faces as it does at
// that site on people. At rims of thin bone that is a few mm away; else it is the nearest of all.
Vec3 PlaceSite(const SitePoint& site, const SkullShell& shell) {
  constexpr double kReach_mm = 8;  // more moves the site off its place, less leaves it on a rim
  constexpr double kLeastCosine = 0.8;  // 37 degrees
  const Vec3 usual = AverageDirection(site.site);
  Vec3 best = shell.surface.query().Closest(site.point).position;
  double nearest_mm = Faces(shell, best, usual, kLeastCosine) ? 0 : kReach_mm;
  for (const Vec3& p : shell.mesh.points) {
    const double away_mm = (p - site.point).norm();
    if (away_mm < nearest_mm && Faces(shell, p, usual, kLeastCosine)) {
      nearest_mm = away_mm;
      best = p;
    }
  }
  return best;
}

DrawnSkull DrawSkull(Random& random) {
  const MeanSkull mean = ReadMeanSkull();
  DrawnSkull skull{mean.head.shell.mesh, {}};
  for (const SitePoint& site : mean.head.sites) {
    skull.sites[site.site] =
        mean.head.shell.surface.query().Closest(PlaceSite(site, mean.head.shell));
  }
  for (const std::vector<Vec3>& mode : mean.modes) {
    const double coefficient = random.BoundedNormal();
    for (std::size_t v = 0; v < mode.size(); ++v) {
      skull.mesh.points[v] += coefficient * mode[v];
    }
  }
  return skull;
}

// The points that the skull's sites are to have: at their depths below the tips.
struct SiteTargets {
  std::vector<Vec3> from, to;
};

SiteTargets TargetsUnder(const DrawnFace& face, const std::map<std::string, double>& depth_mm,
                         const DrawnSkull& skull) {
  SiteTargets targets;
  for (const auto& [site, depth] : depth_mm) {
    if (face.tips.contains(site) && skull.sites.contains(site)) {
      targets.from.push_back(skull.SiteOn(skull.mesh.points, skull.sites.at(site)));
      targets.to.emplace_back(face.tips.at(site) - depth * AverageDirection(site));
    }
  }
  return targets;
}

// Adds points of the brain case, whose targets lie under the scalp along rays from its middle.
void AddBrainCase(const TriMesh& placed, const MeshQuery& skin, SiteTargets& targets) {
  constexpr double kCell_mm = 30;  // about 40 points; more follow the scalp more closely
  constexpr double kAway_mm = 18;  // from all sites, so that these alone decide at the face
  constexpr double kReach_mm = 200;
  const Box3 box = Bounds(placed);
  const Vec3 middle(box.center().x(), box.min().y() + 0.65 * box.sizes().y(),
                    box.max().z() - 0.4 * box.sizes().z());
  const std::vector<Vec3> sites = targets.from;
  for (const ShellPoint& p : SpreadPoints(AsShell(placed), kCell_mm)) {
    const Vec3 out = (p.position - middle).normalized();
    const bool is_far = std::ranges::all_of(
        sites, [&](const Vec3& s) { return (s - p.position).norm() > kAway_mm; });
    const std::optional<MeshPoint> scalp = skin.FirstHit(middle, out, kReach_mm);
    if (is_far && p.position.z() > middle.z() && p.normal.dot(out) > 0.5 && scalp) {
      targets.from.push_back(p.position);
      targets.to.emplace_back(scalp->position - kPersonScalp_mm * out);
    }
  }
}

// Moves points that lie less than a little under the skin inwards, smoothly, so that prominences
// are rounded off and not cut.
void KeepUnderSkin(const Correspondences& skin, std::vector<Vec3>& points) {
  constexpr double kLeast_mm = 2, kRounding_mm = 1;
  for (Vec3& p : points) {
    const MeshPoint at = skin.query().Closest(p);
    const Vec3 out = skin.NormalAt(at);
    const double depth_mm = (at.position - p).dot(out) >= 0 ? at.distance_mm : -at.distance_mm;
    const double above = (depth_mm - kLeast_mm) / kRounding_mm;
    if (above < 30) {
      p -= (kLeast_mm + kRounding_mm * std::log1p(std::exp(above)) - depth_mm) * out;
    }
  }
}

void BendSkull(const DrawnFace& face, const std::map<std::string, double>& depth_mm,
               const DrawnSkull& drawn, PersonPhantom& person) {
  constexpr double kStiffness_mm = 2;  // less bends the bone between neighbours more
  SiteTargets targets = TargetsUnder(face, depth_mm, drawn);
  const Similarity placed = PlaceTemplate(targets.from, targets.to);
  person.skull = Transformed(drawn.mesh, placed);
  for (Vec3& p : targets.from) {
    p = placed * p;
  }
  const Correspondences skin(person.true_skin);
  AddBrainCase(person.skull, skin.query(), targets);
  const ThinPlate plate =
      FitThinPlate(targets.from, targets.to, {}, {.stiffness_mm = kStiffness_mm});
  std::ranges::transform(person.skull.points, person.skull.points.begin(), plate);
  KeepUnderSkin(skin, person.skull.points);
}

// A site is left out where no landmark would be suggested, and where the bone around it faces
// another way, as at the rims of the holes that the mean skull has where bone is thin.
void MeasureSites(const DrawnSkull& drawn, PersonPhantom& person) {
  constexpr double kReach_mm = 60;  // longer than any depth
  // A scan moves a rim by a mm or two, and then its bone faces elsewhere. Runs on the scans of
  // random seeds 1 to 10 refused none of the sites that this leaves.
  const double least_cosine = std::cos(std::numbers::pi / 4);
  const MeshQuery skin(person.true_skin);
  const SkullShell shell = AsShell(person.skull);
  const SurfaceEnds ends(person.skull);
  const SuggestedBone bone{person.skull, shell.surface.query(), ends};
  person.nasion = drawn.SiteOn(person.skull.points, drawn.sites.at("n"));
  for (const Site& site : StandardSites()) {
    const auto at = drawn.sites.find(site.code);
    if (at == drawn.sites.end()) {
      continue;
    }
    const Vec3 base = drawn.SiteOn(person.skull.points, at->second);
    const Vec3 outward = AverageDirection(site.code);
    const Vec3 normal = SuggestedDirection(base, outward, bone);
    const std::optional<MeshPoint> hit = skin.FirstHit(base, normal, kReach_mm);
    if (hit && Faces(shell, base, normal, least_cosine) &&
        SuggestionFault(base, outward, bone).empty()) {
      person.sites.push_back({site.code, base, normal, hit->distance_mm});
    }
  }
}

}  // namespace

PersonPhantom MakePersonPhantom(std::uint64_t random_seed, const RunContext& context) {
  Random random(random_seed);
  PersonPhantom person;
  const DrawnFace face = DrawFace(random, context);
  MakeHead(face, person, context);
  person.build = random.BoundedNormal();
  const std::map<std::string, double> depth_mm = DrawDepths(person.build, random);
  const DrawnSkull drawn = DrawSkull(random);
  BendSkull(face, depth_mm, drawn, person);
  MeasureSites(drawn, person);
  return person;
}

}  // namespace semblance::problems
