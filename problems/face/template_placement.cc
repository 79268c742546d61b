// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/template_placement.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "fitting/problem/placement.h"
#include "interp/dowels/dowel.h"
#include "problems/face/head_formula.h"
#include "problems/subject/input_mistakes.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "surfaces/base/thin_plate.h"
#include "surfaces/mesh/mesh_check.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr int kFewestMidline = 3, kFewestPairs = 2;            // as the header states
constexpr double kSmallestScale = 0.75, kLargestScale = 1.35;  // of heads against the generic one
constexpr double kMaxPlacement_mm = 10;                        // of a landmark from the skin
// A piece whose diagonal exceeds this part of the largest piece's may be a second head. Smaller
// ones (eyes, hair, ears) are not reported.
constexpr double kPieceOfHead = 0.5;
constexpr int kFormulaLevel = 3;     // finest level of the formula's detail
constexpr double kSiteWeight = 0.1;  // of a site of bone, against 1 of a facial landmark
// A stiffer plate follows the landmarks less; a softer one copies their errors into the start.
constexpr double kPlateStiffness_mm = 0.1;

// ---------------------------------------------------------------------------------------------
// The mesh
// ---------------------------------------------------------------------------------------------

std::vector<Box3> PieceBoxes(const TriMesh& mesh) {
  const Components pieces = ConnectedComponents(mesh);
  std::vector<Box3> boxes(pieces.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::int32_t vertex : mesh.triangles[t]) {
      boxes[pieces.of_triangle[t]].extend(mesh.points[vertex]);
    }
  }
  return boxes;
}

// Inner layers lie inside the largest piece's box; a second head does not.
void CheckOneHead(const TriMesh& mesh, const std::string& name) {
  if (mesh.triangles.empty()) {
    return;  // CheckHeadMesh reports this
  }
  const std::vector<Box3> boxes = PieceBoxes(mesh);
  const auto size = [](const Box3& box) { return box.diagonal().norm(); };
  const Box3& largest =
      *std::ranges::max_element(boxes, {}, [&](const Box3& box) { return size(box); });
  for (const Box3& box : boxes) {
    const double inside =
        box.intersection(largest).isEmpty() ? 0 : box.intersection(largest).volume() / box.volume();
    if (size(box) > kPieceOfHead * size(largest) && inside < 0.5) {
      throw InputError(
          fmt::format("{}: it holds two pieces of a head's size ({:.0f} and {:.0f} mm) side by "
                      "side; give one head alone",
                      name, size(largest), size(box)));
    }
  }
}

// ---------------------------------------------------------------------------------------------
// The landmarks
// ---------------------------------------------------------------------------------------------

std::vector<std::string> MissingSites(const std::set<std::string>& given) {
  std::vector<std::string> missing;
  for (const std::string& code : StandardSiteCodes()) {
    if (!given.contains(code)) {
      missing.push_back(code);
    }
  }
  return missing;
}

void CheckEnough(const std::vector<SkinLandmark>& points, const std::string& name) {
  std::set<std::string> given;
  for (const SkinLandmark& landmark : points) {
    given.insert(landmark.code);
  }
  int midline = 0, pairs = 0;
  for (const std::string& code : given) {
    midline += SideOfSite(code) == Side::kMidline;
    pairs += SideOfSite(code) == Side::kLeft && given.contains(WithoutSide(code) + "_r");
  }
  if (midline < kFewestMidline || pairs < kFewestPairs) {
    throw InputError(fmt::format(
        "{}: its landmarks are {} in the midline and {} pairs; a template needs at least {} and "
        "{}; missing sites: {}",
        name, midline, pairs, kFewestMidline, kFewestPairs, fmt::join(MissingSites(given), ", ")));
  }
}

// The same landmarks on the formula and on the head.
struct LandmarkPairs {
  std::vector<Vec3> generic, head;
  std::vector<double> weights;

  explicit LandmarkPairs(const std::vector<SkinLandmark>& points) {
    for (const SkinLandmark& landmark : points) {
      const Vec2 uv = UvOnGenericHead(landmark.code);
      generic.push_back(HeadPoint(uv.x(), uv.y()));
      head.push_back(landmark.point);
      weights.push_back(StandardSiteFault(landmark.code).empty() ? kSiteWeight : 1);
    }
  }
  Similarity HeadFromGeneric() const { return PlaceTemplate(generic, head, weights); }
};

double ComputeMisfit(const LandmarkPairs& pairs) {
  const Similarity head_from_generic = pairs.HeadFromGeneric();
  double sum = 0;
  for (std::size_t i = 0; i < pairs.generic.size(); ++i) {
    sum += pairs.weights[i] * (head_from_generic * pairs.generic[i] - pairs.head[i]).squaredNorm();
  }
  // Relative to the scale, because a small image has small misfits.
  return std::sqrt(sum) / head_from_generic.scale;
}

void CheckHandedness(const LandmarkPairs& pairs) {
  LandmarkPairs mirrored = pairs;
  for (Vec3& p : mirrored.generic) {
    p.x() = -p.x();
  }
  if (ComputeMisfit(mirrored) < ComputeMisfit(pairs)) {
    throw InputError(
        "a mirror image of the generic head meets the landmarks better than the head itself: left "
        "and right have changed places, or mesh and landmarks are not LPS; swap _l and _r, or "
        "mirror both");
  }
}

// A single exchanged pair does not change the handedness of all landmarks together.
void CheckEachPair(const std::vector<SkinLandmark>& points, const Vec3& leftward) {
  std::map<std::string, Vec3> at;
  for (const SkinLandmark& landmark : points) {
    at.emplace(landmark.code, landmark.point);
  }
  for (const auto& [code, point] : at) {
    const auto mirrored =
        SideOfSite(code) == Side::kLeft ? at.find(WithoutSide(code) + "_r") : at.end();
    if (mirrored != at.end() && !((point - mirrored->second).dot(leftward) > 0)) {
      throw InputError(
          fmt::format("'{}' lies {:.0f} mm to the right of '{}': the two have changed places; "
                      "exchange their points",
                      code, (mirrored->second - point).dot(leftward), mirrored->first));
    }
  }
}

void CheckScale(double scale, const std::string& name) {
  if (scale >= kSmallestScale && scale <= kLargestScale) {
    return;
  }
  std::string guess = "check their unit and names";
  for (const auto& [unit, factor] : {std::pair("metres", 1000.0), std::pair("centimetres", 10.0),
                                     std::pair("inches", 25.4), std::pair("micrometres", 0.001)}) {
    if (scale * factor >= kSmallestScale && scale * factor <= kLargestScale) {
      guess = fmt::format("they look like {}; multiply by {}", unit, factor);
    }
  }
  throw InputError(
      fmt::format("{}: by its landmarks the head is {:.4g} times as large as an adult's ({} to {} "
                  "is allowed); {}",
                  name, scale, kSmallestScale, kLargestScale, guess));
}

// Throws if a forgotten conversion lays the landmarks on the skin.
void CheckFrame(const std::vector<SkinLandmark>& points, const MeshQuery& skin, const Vec3& middle,
                const std::string& name) {
  std::vector<Vec3> at;
  for (const SkinLandmark& landmark : points) {
    at.push_back(landmark.point);
  }
  std::vector<double> mm;
  for (const Vec3& p : at) {
    mm.push_back(skin.Closest(p).distance_mm);
  }
  if (UpperMedian(mm) <= kMaxPlacement_mm) {
    return;  // a few landmarks are wrong, not their frame
  }
  const auto same_size = [](const FrameChange& change) { return change.factor == 1; };
  if (const auto found = FindForgottenChange(at, skin, middle, kMaxPlacement_mm / 2, same_size)) {
    throw InputError(fmt::format(
        "{}: its landmarks do not lie on it; {} they fit within {:.1f} mm (median): bring both "
        "into one frame (LPS)",
        name, found->change.what, found->median_mm));
  }
}

std::vector<SkinLandmark> MoveToSkin(const std::vector<SkinLandmark>& points, const TriMesh& skin,
                                     const std::string& name) {
  const MeshQuery query(skin);
  std::vector<SkinLandmark> on_skin;
  for (const SkinLandmark& landmark : points) {
    const MeshPoint nearest = query.Closest(landmark.point);
    if (!(nearest.distance_mm <= kMaxPlacement_mm)) {
      CheckFrame(points, query, Bounds(skin).center(), name);
      throw InputError(
          fmt::format("{}: landmark '{}' is {:.1f} mm from the outer skin, and at most {} mm are "
                      "allowed; correct its point, or check that landmarks and mesh share one "
                      "frame",
                      name, landmark.code, nearest.distance_mm, kMaxPlacement_mm));
    }
    on_skin.push_back({landmark.code, nearest.position});
  }
  return on_skin;
}

// ---------------------------------------------------------------------------------------------
// The generic head
// ---------------------------------------------------------------------------------------------

TemplateFace GenericHead(int max_level) {
  static const TemplateFace formula = MakeTemplateFace({.max_level = kFormulaLevel});
  TemplateFace face = formula;
  HSplineShape shape = face.surface.shape();
  shape.max_level = max_level;
  HSplineSurface finer(shape, face.surface.Net(0));
  finer.SetOffsets({face.surface.Offsets().begin(), face.surface.Offsets().end()});
  face.features = GenericHeadFeatures(finer);
  face.surface = std::move(finer);
  return face;
}

// Maps each stored vertex. This is close to mapping the surface itself.
template <class Map>
HSplineSurface Warped(const HSplineSurface& surface, const Map& map) {
  ControlNet coarse = surface.Net(0);
  std::ranges::transform(coarse.vertices, coarse.vertices.begin(), map);
  HSplineSurface warped(surface.shape(), coarse);
  for (int level = 1; level <= kFormulaLevel; ++level) {
    const ControlNet from = surface.Net(level);
    ControlNet to = warped.Net(level);
    for (const auto& [id, offset] : surface.Offsets(level)) {
      to.At(id.i, id.j) = map(from.At(id.i, id.j));
    }
    warped.SetNet(level, to);
  }
  return warped;
}

// Checks where the landmarks place the generic head. Its messages name the head, too.
void CheckPlace(const std::vector<SkinLandmark>& points, const std::string& name) try {
  CheckSides(points);
  CheckScale(LandmarkPairs(points).HeadFromGeneric().scale, name);
} catch (const InputError& error) {
  const std::string words = error.what();
  throw InputError(words.starts_with(name) ? words
                                           : fmt::format("{}: its landmarks: {}", name, words));
}

}  // namespace

void CheckSides(const std::vector<SkinLandmark>& points) {
  const LandmarkPairs pairs(points);
  CheckHandedness(pairs);
  CheckEachPair(points, pairs.HeadFromGeneric().rotation * Vec3::UnitX());
}

OuterHead PrepareHead(const TriMesh& head, const SkinLandmarks& landmarks, const std::string& name,
                      const RunContext& context) {
  CheckOneHead(head, name);  // before CheckHeadMesh, which would call two heads too large
  OuterHead outer{.skin = {}, .points = {}, .notes = CheckHeadMesh(head, name)};
  std::ranges::copy(landmarks.notes, std::back_inserter(outer.notes));
  CheckEnough(landmarks.points, name);
  CheckPlace(landmarks.points, name);
  context.Report("skin", "what is seen from outside");
  outer.skin = Submesh(head, SeenFromOutside(head, context.threads));
  outer.points = MoveToSkin(landmarks.points, outer.skin, name);
  return outer;
}

TemplateFace WarpedGenericHead(const OuterHead& head, int max_level) {
  TemplateFace face = GenericHead(max_level);
  const LandmarkPairs pairs(head.points);
  const Similarity head_from_generic = pairs.HeadFromGeneric();
  std::vector<Vec3> placed;
  for (const Vec3& p : pairs.generic) {
    placed.push_back(head_from_generic * p);
  }
  const ThinPlate plate =
      FitThinPlate(placed, pairs.head, pairs.weights, {.stiffness_mm = kPlateStiffness_mm});
  const auto map = [&](const Vec3& p) { return plate(head_from_generic * p); };
  face.surface = Warped(face.surface, map);
  for (TemplateFeature& feature : face.features) {
    feature.region =
        Sphere{map(feature.region->center), head_from_generic.scale * feature.region->radius_mm};
  }
  return face;
}

}  // namespace semblance::problems
