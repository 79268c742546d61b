// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/subject_depths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>

#include "problems/experiment/case.h"
#include "problems/face/skin_distance.h"
#include "problems/face/template_placement.h"
#include "problems/subject/average_skull.h"
#include "problems/subject/landmark_mistakes.h"
#include "problems/subject/phantom_ct.h"
#include "problems/subject/propose/propose_landmarks.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;  // writes NaN as null

constexpr int kFormulaLevels = 3;  // levels of the generic head; 3 has all its detail

// Computes the mean of a mesh's normals around a point, by area, over the normals that face alike.
class MeanNormals {
 public:
  MeanNormals(const TriMesh& mesh, double radius_mm)
      : points_(mesh.points),
        normals_(VertexNormals(mesh)),
        areas_(VertexAreas(mesh)),
        order_(mesh.points.size()),
        radius_mm_(radius_mm) {
    std::iota(order_.begin(), order_.end(), 0);
    std::ranges::stable_sort(order_, {}, [this](std::size_t v) { return points_[v].x(); });
  }

  // The mean of the normals within 90 degrees of the unit vector `facing`; zero if there is none.
  Vec3 At(const Vec3& p, const Vec3& facing) const {
    const auto x_of = [this](std::size_t v) { return points_[v].x(); };
    const auto first = std::ranges::lower_bound(order_, p.x() - radius_mm_, {}, x_of);
    Vec3 sum = Vec3::Zero();
    for (auto v = first; v != order_.end() && x_of(*v) <= p.x() + radius_mm_; ++v) {
      const bool near = (points_[*v] - p).squaredNorm() <= radius_mm_ * radius_mm_;
      if (near && normals_[*v].dot(facing) > 0) {
        sum += areas_[*v] * normals_[*v];
      }
    }
    return sum.norm() > 0 ? Vec3(sum.normalized()) : Vec3(Vec3::Zero());
  }

 private:
  std::vector<Vec3> points_, normals_;
  std::vector<double> areas_;
  std::vector<std::size_t> order_;  // the vertices sorted by x
  double radius_mm_;
};

std::vector<SkinLandmark> StandardPoints(const LandmarkFile& file) {
  std::vector<SkinLandmark> points;
  for (const Landmark& landmark : file.landmarks) {
    if (IsStandardSite(landmark.site)) {
      points.push_back({landmark.site, landmark.Position()});
    }
  }
  return points;
}

SkullSites FindSkullSites(const std::vector<SkinLandmark>& landmarks) {
  std::vector<SitePoint> sites;
  for (const SkinLandmark& landmark : landmarks) {
    sites.push_back({landmark.code, landmark.point});
  }
  return CompleteSites(sites);
}

// One parametrisation for all skulls: the generic face's (u,v), laid on the bone. Values per cell
// i + columns j.
struct SkullGrid {
  std::vector<Vec2> uv;
  std::vector<Vec3> bone;        // on the skull, mm; NaN if no bone belongs to the cell
  std::vector<Vec3> normals;     // unit, out of the bone; zero if there is none
  std::vector<Vec3> in_average;  // `bone` in the frame of the average skull (average_skull.h)
};

// Lays the grid on a skull of which only the part visible from outside is given. A thin plate warps
// the generic head so that its sites lie on the skull's landmarks (template_placement.h). Each
// cell's centre then goes to the bone that belongs to it (skin_matcher.h), within reach_mm. Cells
// of the same (u,v) therefore correspond exactly at the sites and approximately between them. The
// normal is the mean of the skull's normals, by area, within normal_radius_mm. Throws InputError if
// there are fewer than four landmarks at standard sites, or if all lie in a plane.
SkullGrid LayGrid(const TriMesh& skull, const LandmarkFile& landmarks, const DenseOptions& options,
                  const RunContext& context) {
  constexpr std::size_t kMinLandmarks = 4;
  const OuterHead head{.skin = skull, .points = StandardPoints(landmarks), .notes = {}};
  if (head.points.size() < kMinLandmarks) {
    throw InputError(
        fmt::format("{}: {} landmarks at standard sites; the grid over the skull needs "
                    "at least {}",
                    landmarks.subject, head.points.size(), kMinLandmarks));
  }
  const TemplateFace generic = WarpedGenericHead(head, kFormulaLevels);
  const MatchGrid match = MatchToSkin(generic.surface, SkinMatcher(skull), options.columns,
                                      options.rows, options.reach_mm, context.threads);
  const SkullSites sites = FindSkullSites(head.points);
  const MeanNormals normals(skull, options.normal_radius_mm);
  SkullGrid grid{.uv = match.uv,
                 .bone = std::vector<Vec3>(match.uv.size(), Vec3::Constant(kNaN)),
                 .normals = std::vector<Vec3>(match.uv.size(), Vec3::Zero()),
                 .in_average = std::vector<Vec3>(match.uv.size(), Vec3::Constant(kNaN))};
  ParallelFor(match.uv.size(), context.threads, 64, [&](std::size_t k) {
    if (match.skin[k]) {
      grid.bone[k] = match.skin[k]->point;
      grid.normals[k] = normals.At(grid.bone[k], match.normals[k]);
      grid.in_average[k] = sites.InAverage(grid.bone[k]);
    }
  });
  return grid;
}

// The confidence of a landmark in a proposed file, which only has a word for it. The values lie
// within the ranges of the words (GradeCertainty in propose_landmarks.cc: from 0.6 and 0.3).
double ConfidenceFromWord(Certainty certainty) {
  constexpr std::array kByWord = {0.7, 0.45, 0.2};
  return kByWord.at(static_cast<std::size_t>(certainty));
}

struct MarkedDepths {
  LandmarkFile file;
  std::map<std::string, double> confidence;
  std::vector<SiteDepth> dropped;  // sites that get no depth
};

Proposal ProposeFrom(const LandmarkReferences& references, const TriMesh& skull, SkullLies lies,
                     const RunContext& context) {
  const std::string name = "the skull";
  if (!references.heads.empty()) {
    return ProposeLandmarks(skull, name, references.heads, context, {}, lies);
  }
  if (!references.mean) {
    throw InputError(
        "it has no landmarks, and there is no reference from which they could be proposed; name "
        "one under measure.references");
  }
  return ProposeLandmarks(skull, name, *references.mean, context, {}, lies);
}

MarkedDepths Propose(const SubjectData& data, const PopulationSubject& subject,
                     const LandmarkReferences& references, const RunContext& context) {
  const bool is_ct = std::holds_alternative<CtSubject>(subject.subject);
  const Proposal proposal = ProposeFrom(references, data.skull,
                                        is_ct ? SkullLies::kUpright : SkullLies::kAnyhow, context);
  if (proposal.axes != "LPS") {
    throw InputError(
        fmt::format("its skull seems to be in {0}; write `axes: {0}` there", proposal.axes));
  }
  MarkedDepths marked{ProposalFile(proposal, subject.name), {}, {}};
  for (const ProposedSite& site : proposal.sites) {
    marked.confidence[site.site] = site.confidence;
  }
  for (const AbsentLandmark& absent : proposal.absent) {
    marked.dropped.push_back({.site = absent.site, .confidence = kNaN, .why_not = absent.reason});
  }
  return marked;
}

MarkedDepths AsRead(LandmarkFile file) {
  MarkedDepths marked{std::move(file), {}, {}};
  for (const Landmark& landmark : marked.file.landmarks) {
    marked.confidence[landmark.site] =
        marked.file.proposed ? ConfidenceFromWord(landmark.certainty) : 1;
  }
  return marked;
}

Box3 Extent(const std::vector<Landmark>& landmarks) {
  Box3 box;
  for (const Landmark& landmark : landmarks) {
    box.extend(landmark.Position());
  }
  return box;
}

// Keeps, of several proposed landmarks with the same point, the one with the highest confidence.
// For landmarks of a person this would be an error; a proposal contains no person's mistake, and
// its other sites remain valid.
void DropSamePoints(MarkedDepths& marked) {
  const double same_mm = SamePoint_mm(Extent(marked.file.landmarks));
  std::vector<Landmark> by_confidence = marked.file.landmarks, kept;
  std::ranges::stable_sort(by_confidence, std::ranges::greater{},
                           [&](const Landmark& l) { return marked.confidence.at(l.site); });
  for (const Landmark& landmark : by_confidence) {
    const auto surer = std::ranges::find_if(kept, [&](const Landmark& other) {
      return (other.Position() - landmark.Position()).norm() <= same_mm;
    });
    if (surer == kept.end()) {
      kept.push_back(landmark);
      continue;
    }
    marked.dropped.push_back(
        {.site = landmark.site,
         .confidence = marked.confidence.at(landmark.site),
         .why_not =
             fmt::format("proposed at the point of {}; a person has to place it", surer->site)});
    std::erase_if(marked.file.landmarks,
                  [&](const Landmark& other) { return other.site == landmark.site; });
  }
}

bool IsExcluded(const PopulationSubject& subject, const std::string& site) {
  return std::ranges::any_of(subject.exclude, [&](const std::string& code) {
    return code == site || code == WithoutSide(site);
  });
}

// Gives each depth marker of a standard site the direction that the bone has there on average.
void TurnToAverage(const LandmarkFile& landmarks, std::vector<Dowel>& dowels) {
  const Mat3 rotation = FitAverageSkull(landmarks.Points()).skull_from_average.rotation;
  for (Dowel& dowel : dowels) {
    if (IsStandardSite(dowel.site)) {
      dowel.direction = rotation * AverageDirection(dowel.site);
    }
  }
}

bool UsesAverage(DepthDirection direction, bool proposed, double voxel_mm) {
  constexpr double kReliable_mm = 2.5;  // normals of bone are within some degrees below
  return direction == DepthDirection::kAverage ||
         (direction == DepthDirection::kAuto && proposed && voxel_mm > kReliable_mm);
}

const TruthMap& ChooseMap(DepthConvention convention, const DepthTruth& truth) {
  return convention == DepthConvention::kClosestPoint ? truth.closest : truth.along_direction;
}

// Measures depths at points of the bone, along unit directions.
TruthMap MeasureDepths(const std::vector<Vec3>& points, const std::vector<Vec3>& directions,
                       const TriMesh& skin, const MeasureOptions& options,
                       const RunContext& context) {
  const TriMesh bases{.points = points, .triangles = {}};
  return ChooseMap(options.convention,
                   MeasureDepthTruth(bases, directions, skin, options.depth_truth, context));
}

std::vector<SiteDepth> DepthsAtSites(const PopulationSubject& subject, const MarkedDepths& marked,
                                     const std::vector<Dowel>& dowels, const TriMesh& skin,
                                     const MeasureOptions& options, const RunContext& context) {
  std::vector<Vec3> points, directions;
  for (const Dowel& dowel : dowels) {
    points.push_back(dowel.base);
    directions.push_back(dowel.direction);
  }
  const TruthMap truth = MeasureDepths(points, directions, skin, options, context);
  std::vector<SiteDepth> sites;
  for (std::size_t k = 0; k < dowels.size(); ++k) {
    const bool excluded = IsExcluded(subject, dowels[k].site);
    sites.push_back(
        {.site = dowels[k].site,
         .depth_mm = excluded ? kNaN : truth.depth_mm[k],
         .confidence = marked.confidence.at(dowels[k].site),
         .why_not = std::string(excluded ? "excluded" : interp::DescribeStatus(truth.status[k]))});
  }
  return sites;
}

DenseDepths DepthsOverSkull(const LandmarkFile& landmarks, const TriMesh& skull,
                            const TriMesh& skin, const MeasureOptions& options,
                            const RunContext& context) {
  const SkullGrid grid = LayGrid(skull, landmarks, options.dense, context);
  const TruthMap truth = MeasureDepths(grid.bone, grid.normals, skin, options, context);
  return {.columns = options.dense.columns,
          .rows = options.dense.rows,
          .bone = grid.in_average,
          .depth_mm = truth.depth_mm};
}

// Reads a number; null is NaN.
double ReadNumber(const Json& json) {
  constexpr double kLargest = 1e5;  // mm; the limit of coordinates of a mesh (mesh_check.h)
  const double number = json.is_null() ? kNaN : json.get<double>();
  if (std::abs(number) > kLargest) {
    throw IoError(fmt::format(
        "a subject's depths: {} is too large for a head; at most 1e5 is allowed", number));
  }
  return number;
}

std::string ReadSite(const Json& json) {
  const auto site = json.get<std::string>();
  if (!IsSite(site)) {
    throw IoError(fmt::format("a subject's depths: '{}' is not a known site", site));
  }
  return site;
}

// Replaces a phantom's skull and skin by those imported from a scan of it.
void ImportScan(const PhantomOptions& phantom, const PhantomScan& scan, SubjectData& data,
                const RunContext& context) {
  const CtVolume volume = VoxelisePhantom(
      MakePhantom(phantom),
      {.pixel_mm = scan.pixel_mm, .slice_mm = scan.slice_mm, .threads = context.threads});
  CtImport import = ImportCt(volume, scan.import, context);
  data.skull = std::move(import.skull);
  data.skin = std::move(import.skin);
}

}  // namespace

SubjectDepths MeasureSubject(const PopulationSubject& subject, const MeasureOptions& options,
                             const LandmarkReferences& references, const RunContext& context) {
  if (!subject.fault.empty()) {
    throw InputError(subject.fault);
  }
  SubjectData data = LoadSubject(subject.subject, context, Landmarking::kOpen);
  if (!data.skin) {
    throw InputError("it has no skin; a depth needs one");
  }
  const bool open = data.landmarks.landmarks.empty();
  MarkedDepths marked =
      open ? Propose(data, subject, references, context) : AsRead(std::move(data.landmarks));
  if (marked.file.proposed) {
    DropSamePoints(marked);
  }
  data.landmarks = marked.file;
  SubjectDepths depths{.name = subject.name,
                       .proposed = marked.file.proposed,
                       .sites = {},
                       .dense = {},
                       .thickness = kNaN,
                       .notes = data.notes};
  if (const auto* phantom = std::get_if<PhantomOptions>(&subject.subject)) {
    depths.thickness = MakePhantom(*phantom).thickness;
    if (subject.scan) {
      ImportScan(*phantom, *subject.scan, data, context);
    }
  } else {
    std::ranges::copy(CheckSubject(data, options.landmarks), std::back_inserter(depths.notes));
  }
  const TriMesh skin = Submesh(*data.skin, SeenFromOutside(*data.skin, context.threads));
  const TriMesh skull = Submesh(data.skull, SeenFromOutside(data.skull, context.threads));
  context.ThrowIfStopped();
  std::vector<Dowel> dowels = PlaceDowels(marked.file, data.skull, options.landmarks);
  if (UsesAverage(options.direction, marked.file.proposed, data.voxel_mm)) {
    TurnToAverage(marked.file, dowels);
  }
  depths.sites = DepthsAtSites(subject, marked, dowels, skin, options, context);
  for (const SiteDepth& dropped : marked.dropped) {
    depths.notes.push_back(fmt::format("{}: {}", dropped.site, dropped.why_not));
    depths.sites.push_back(dropped);
  }
  depths.dense = DepthsOverSkull(marked.file, skull, skin, options, context);
  return depths;
}

Json ToJson(const SubjectDepths& depths) {
  Json json = {{"name", depths.name},
               {"proposed", depths.proposed},
               {"thickness", depths.thickness},
               {"notes", depths.notes},
               {"sites", Json::array()}};
  for (const SiteDepth& site : depths.sites) {
    json["sites"].push_back({{"site", site.site},
                             {"depth_mm", site.depth_mm},
                             {"confidence", site.confidence},
                             {"why_not", site.why_not}});
  }
  std::vector<double> bone;
  for (const Vec3& p : depths.dense.bone) {
    bone.insert(bone.end(), p.begin(), p.end());
  }
  json["dense"] = {{"columns", depths.dense.columns},
                   {"rows", depths.dense.rows},
                   {"bone", bone},
                   {"depth_mm", depths.dense.depth_mm}};
  return json;
}

SubjectDepths ParseSubjectDepths(const Json& json) try {
  SubjectDepths depths;
  depths.name = json.at("name").get<std::string>();
  depths.proposed = json.at("proposed").get<bool>();
  depths.thickness = ReadNumber(json.at("thickness"));
  depths.notes = json.at("notes").get<std::vector<std::string>>();
  for (const Json& site : json.at("sites")) {
    depths.sites.push_back({.site = ReadSite(site.at("site")),
                            .depth_mm = ReadNumber(site.at("depth_mm")),
                            .confidence = ReadNumber(site.at("confidence")),
                            .why_not = site.at("why_not").get<std::string>()});
  }
  const Json& dense = json.at("dense");
  depths.dense.columns = dense.at("columns").get<int>();
  depths.dense.rows = dense.at("rows").get<int>();
  for (const Json& depth : dense.at("depth_mm")) {
    depths.dense.depth_mm.push_back(ReadNumber(depth));
  }
  const Json& bone = dense.at("bone");
  for (std::size_t k = 0; k + 2 < bone.size(); k += 3) {
    depths.dense.bone.emplace_back(ReadNumber(bone[k]), ReadNumber(bone[k + 1]),
                                   ReadNumber(bone[k + 2]));
  }
  const std::size_t cells = static_cast<std::size_t>(depths.dense.columns) * depths.dense.rows;
  if (depths.dense.columns < 1 || depths.dense.rows < 1 || depths.dense.bone.size() != cells ||
      depths.dense.depth_mm.size() != cells) {
    throw IoError("a subject's depths: the numbers of values and of cells of the grid differ");
  }
  return depths;
} catch (const nlohmann::json::exception& error) {
  throw IoError(fmt::format("a subject's depths: {}", JsonFault(error)));
}

}  // namespace semblance::problems
