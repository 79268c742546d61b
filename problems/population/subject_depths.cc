// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/subject_depths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "problems/phantom/phantom_ct.h"
#include "problems/pipeline/case.h"
#include "problems/population/skull_grid.h"
#include "problems/propose/propose_landmarks.h"
#include "problems/subject/landmark_mistakes.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

// Of a file that the program proposed and that gives its certainty in words alone.
double ConfidenceOf(Certainty certainty) {
  constexpr std::array kByWord = {0.7, 0.45, 0.2};
  return kByWord.at(static_cast<std::size_t>(certainty));
}

struct Marked {
  LandmarkFile file;
  std::map<std::string, double> confidence;
  std::vector<SiteDepth> dropped;  // without a depth
};

Marked Propose(const SubjectData& data, const std::string& name,
               std::span<const ReferenceHead> references, const RunContext& context) {
  if (references.empty()) {
    throw InputError(
        "it has no landmarks, and no skull has any by which they could be proposed; name one under "
        "measure.references");
  }
  const Proposal proposal = ProposeLandmarks(data.skull, "the skull", references, context);
  if (proposal.axes != "LPS") {
    throw InputError(fmt::format("its skull looks as if it were in {0}; write `axes: {0}` there",
                                 proposal.axes));
  }
  Marked marked{ProposalFile(proposal, name), {}, {}};
  for (const ProposedSite& site : proposal.sites) {
    marked.confidence[site.site] = site.confidence;
  }
  return marked;
}

Marked AsRead(LandmarkFile file) {
  Marked marked{std::move(file), {}, {}};
  for (const Landmark& landmark : marked.file.landmarks) {
    marked.confidence[landmark.site] = marked.file.proposed ? ConfidenceOf(landmark.certainty) : 1;
  }
  return marked;
}

Vec3 PointOf(const Landmark& landmark) {
  return {landmark.point[0], landmark.point[1], landmark.point[2]};
}

Box3 ExtentOf(const std::vector<Landmark>& landmarks) {
  Box3 box;
  for (const Landmark& landmark : landmarks) {
    box.extend(PointOf(landmark));
  }
  return box;
}

// Of proposed landmarks on one point the surest stays: no person has placed them, so that no person
// has mistaken anything, and the other sites are as good as they were.
void DropClashing(Marked& marked) {
  const double same_mm = SamePoint_mm(ExtentOf(marked.file.landmarks));
  std::vector<Landmark> by_confidence = marked.file.landmarks, kept;
  std::ranges::stable_sort(by_confidence, std::ranges::greater{},
                           [&](const Landmark& l) { return marked.confidence.at(l.site); });
  for (const Landmark& landmark : by_confidence) {
    const auto surer = std::ranges::find_if(kept, [&](const Landmark& other) {
      return (PointOf(other) - PointOf(landmark)).norm() <= same_mm;
    });
    if (surer == kept.end()) {
      kept.push_back(landmark);
      continue;
    }
    marked.dropped.push_back(
        {.site = landmark.site,
         .confidence = marked.confidence.at(landmark.site),
         .why_not =
             fmt::format("proposed on the point of {}; a person has to place it", surer->site)});
    std::erase_if(marked.file.landmarks,
                  [&](const Landmark& other) { return other.site == landmark.site; });
  }
}

bool IsExcluded(const PopulationSubject& subject, const std::string& site) {
  return std::ranges::any_of(subject.exclude, [&](const std::string& code) {
    return code == site || code == WithoutSide(site);
  });
}

std::string InWords(TruthStatus status) {
  switch (status) {
    case TruthStatus::kValid:
      return "";
    case TruthStatus::kNoDirection:
      return "the bone has no direction there";
    case TruthStatus::kNoHit:
      return "no skin along the normal";
    case TruthStatus::kTooFar:
      return "no skin near";
    case TruthStatus::kGrazing:
      return "the skin is met at a grazing angle";
    case TruthStatus::kBehind:
      return "the closest skin is behind the bone";
  }
  return "";
}

const TruthMap& By(DepthConvention convention, const DepthTruth& truth) {
  return convention == DepthConvention::kClosestPoint ? truth.closest : truth.along_direction;
}

// Depths at points of the bone, along unit directions.
TruthMap DepthsAt(const std::vector<Vec3>& points, const std::vector<Vec3>& directions,
                  const TriMesh& skin, const MeasureOptions& options, const RunContext& context) {
  const TriMesh bases{.points = points, .triangles = {}};
  return By(options.convention,
            MeasureDepthTruth(bases, directions, skin, options.depth_truth, context));
}

std::vector<SiteDepth> DepthsAtSites(const PopulationSubject& subject, const Marked& marked,
                                     const std::vector<Dowel>& dowels, const TriMesh& skin,
                                     const MeasureOptions& options, const RunContext& context) {
  std::vector<Vec3> points, directions;
  for (const Dowel& dowel : dowels) {
    points.push_back(dowel.base);
    directions.push_back(dowel.direction);
  }
  const TruthMap truth = DepthsAt(points, directions, skin, options, context);
  std::vector<SiteDepth> sites;
  for (std::size_t k = 0; k < dowels.size(); ++k) {
    const bool excluded = IsExcluded(subject, dowels[k].site);
    sites.push_back({.site = dowels[k].site,
                     .depth_mm = excluded ? kNaN : truth.depth_mm[k],
                     .confidence = marked.confidence.at(dowels[k].site),
                     .why_not = excluded ? "excluded" : InWords(truth.status[k])});
  }
  return sites;
}

DenseDepths DepthsOverSkull(const LandmarkFile& landmarks, const TriMesh& skull,
                            const TriMesh& skin, const MeasureOptions& options,
                            const RunContext& context) {
  const SkullGrid grid = LayGrid(skull, landmarks, options.dense, context);
  const TruthMap truth = DepthsAt(grid.bone, grid.normals, skin, options, context);
  return {.columns = options.dense.columns,
          .rows = options.dense.rows,
          .bone = grid.in_average,
          .depth_mm = truth.depth_mm};
}

Json Numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) {
    list.push_back(std::isfinite(value) ? Json(value) : Json(nullptr));
  }
  return list;
}

// NaN for null.
double NumberOf(const Json& json) {
  constexpr double kLargest = 1e5;  // farther no mesh may lie (mesh_check.h)
  const double number = json.is_null() ? kNaN : json.get<double>();
  if (std::abs(number) > kLargest) {
    throw IoError(fmt::format("a subject's depths: {} is beyond every head", number));
  }
  return number;
}

std::string SiteOf(const Json& json) {
  const auto site = json.get<std::string>();
  if (!IsStandardSite(site) && !IsFurtherSite(site)) {
    throw IoError(fmt::format("a subject's depths: '{}' is not a known site", site));
  }
  return site;
}

// A phantom's skull and skin as they come out of a scan of it.
void Scan(const PhantomOptions& phantom, const PhantomScan& scan, SubjectData& data,
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
                             std::span<const ReferenceHead> references, const RunContext& context) {
  SubjectData data = LoadSubject(subject.subject, context, Landmarking::kOpen);
  if (!data.skin) {
    throw InputError("it has no skin; a depth needs one");
  }
  const bool open = data.landmarks.landmarks.empty();
  Marked marked =
      open ? Propose(data, subject.name, references, context) : AsRead(std::move(data.landmarks));
  if (marked.file.proposed) {
    DropClashing(marked);
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
      Scan(*phantom, *subject.scan, data, context);
    }
  } else {
    std::ranges::copy(CheckSubject(data, options.landmarks), std::back_inserter(depths.notes));
  }
  const TriMesh skin = Submesh(*data.skin, SeenFromOutside(*data.skin, context.threads));
  const TriMesh skull = Submesh(data.skull, SeenFromOutside(data.skull, context.threads));
  context.ThrowIfStopped();
  const std::vector<Dowel> dowels = PlaceDowels(marked.file, data.skull, options.landmarks);
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
               {"thickness", std::isfinite(depths.thickness) ? Json(depths.thickness) : Json()},
               {"notes", depths.notes},
               {"sites", Json::array()}};
  for (const SiteDepth& site : depths.sites) {
    json["sites"].push_back(
        {{"site", site.site},
         {"depth_mm", std::isfinite(site.depth_mm) ? Json(site.depth_mm) : Json()},
         {"confidence", site.confidence},
         {"why_not", site.why_not}});
  }
  std::vector<double> bone;
  for (const Vec3& p : depths.dense.bone) {
    bone.insert(bone.end(), p.begin(), p.end());
  }
  json["dense"] = {{"columns", depths.dense.columns},
                   {"rows", depths.dense.rows},
                   {"bone", Numbers(bone)},
                   {"depth_mm", Numbers(depths.dense.depth_mm)}};
  return json;
}

SubjectDepths SubjectDepthsOf(const Json& json) try {
  SubjectDepths depths;
  depths.name = json.at("name").get<std::string>();
  depths.proposed = json.at("proposed").get<bool>();
  depths.thickness = NumberOf(json.at("thickness"));
  depths.notes = json.at("notes").get<std::vector<std::string>>();
  for (const Json& site : json.at("sites")) {
    depths.sites.push_back({.site = SiteOf(site.at("site")),
                            .depth_mm = NumberOf(site.at("depth_mm")),
                            .confidence = NumberOf(site.at("confidence")),
                            .why_not = site.at("why_not").get<std::string>()});
  }
  const Json& dense = json.at("dense");
  depths.dense.columns = dense.at("columns").get<int>();
  depths.dense.rows = dense.at("rows").get<int>();
  for (const Json& depth : dense.at("depth_mm")) {
    depths.dense.depth_mm.push_back(NumberOf(depth));
  }
  const Json& bone = dense.at("bone");
  for (std::size_t k = 0; k + 2 < bone.size(); k += 3) {
    depths.dense.bone.emplace_back(NumberOf(bone[k]), NumberOf(bone[k + 1]), NumberOf(bone[k + 2]));
  }
  const std::size_t cells = static_cast<std::size_t>(depths.dense.columns) * depths.dense.rows;
  if (depths.dense.columns < 1 || depths.dense.rows < 1 || depths.dense.bone.size() != cells ||
      depths.dense.depth_mm.size() != cells) {
    throw IoError("a subject's depths: the grid has not as many values as cells");
  }
  return depths;
} catch (const nlohmann::json::exception& error) {
  throw IoError(fmt::format("a subject's depths: {}", JsonFault(error)));
}

}  // namespace semblance
