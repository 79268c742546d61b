// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/scene_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "problems/config/terminal_text.h"
#include "problems/report/plain_names.h"
#include "problems/report/result_json.h"
#include "problems/report/run_pictures.h"
#include "problems/report/view/view_mesh.h"
#include "surfaces/base/json_text.h"
#include "surfaces/base/parallel.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kHeadTriangles = 38000;  // more than kViewTriangles, for ears and lids
// More triangles show thin bone better and enlarge the report, which should stay below 6 MB.
constexpr int kSkullTriangles = 40000;

// Bounds the distance of the view's face from the surface; a smaller chord makes a larger page. On
// configs/demo.yaml the 29,794 triangles are 0.03 mm (RMS) and at most 0.16 mm from the surface. A
// decimated mesh of 24,000 was 0.01 and 0.09 mm from it, but decimation takes far longer.
constexpr double kFaceChord_mm = 0.25;

Json MapJson(const ColourMap& map, const char* title) {
  return {{"title", title},
          {"low_mm", map.low_mm},
          {"high_mm", map.high_mm},
          {"no_data", HexText(kNoDataColour)},
          {"colours", ColourSteps(map)}};
}

Json RoundedPointJson(const Vec3& p) {
  const auto rounded = [](double x) { return std::round(1000 * x) / 1000; };
  return {rounded(p.x()), rounded(p.y()), rounded(p.z())};
}

// The simplified meshes of a run.
struct ViewMeshes {
  TriMesh skull, shell, implicit, face, skin, bust;
};

ViewMeshes MakeViewMeshes(const RunResult& result, int threads) {
  ViewMeshes view;
  view.face = SimplifyForView(TessellateToChord(result.fit.surface, kFaceChord_mm, threads).mesh,
                              kHeadTriangles);
  const std::array<std::pair<const TriMesh*, TriMesh*>, 5> jobs = {
      {{&result.subject.skull, &view.skull},
       {result.subject.skin ? &*result.subject.skin : nullptr, &view.skin},
       {&result.shell, &view.shell},
       {&result.implicit.mesh, &view.implicit},
       {result.bust ? &result.bust->skin : nullptr, &view.bust}}};
  ParallelFor(jobs.size(), threads, 1, [&jobs, &view](std::size_t k) {
    if (jobs[k].first != nullptr) {
      const int most = jobs[k].second == &view.skull  ? kSkullTriangles
                       : jobs[k].second == &view.bust ? kHeadTriangles
                                                      : kViewTriangles;
      *jobs[k].second = SimplifyForView(*jobs[k].first, most);
    }
  });
  return view;
}

class SceneWriter {
 public:
  SceneWriter(const RunResult& result, const RunContext& context)
      : result_(result), context_(context), view_(MakeViewMeshes(result, context.threads)) {}

  std::string Write() {
    Mesh("skull", "Skull", view_.skull, "#e8dcc4");
    Origin();
    Dowels();
    Depth();
    Face("implicit", "First face (implicit)", view_.implicit, "#d9b38c");
    Face("face", "Recovered face", view_.face, "#d8a58a");
    Head();
    if (result_.uncertainty && !result_.uncertainty->sigma_mm.empty()) {
      Mesh("sigma", "Uncertainty of face", view_.face, "#8f8f8f");
      Map("sigma", NearestValues(view_.face, result_.face.mesh, result_.uncertainty->sigma_mm));
    }
    if (result_.subject.skin) {
      Mesh("skin", "True skin", view_.skin, "#b9c7d6");
    }
    for (int level = 0; level <= result_.fit.surface.shape().max_level; ++level) {
      Net(level);
    }
    const Json scene = {{"label", PlainText(result_.subject.name)},
                        {"facts", Facts()},
                        {"faults", FaultMarks(PlausibilityToJson(result_.plausibility))},
                        {"maps", Maps()},
                        {"layers", layers_},
                        {"blobs", blobs_.All()}};
    return scene.dump() + "\n";
  }

 private:
  void Mesh(const char* id, const char* label, const TriMesh& mesh, const char* colour) {
    layers_.push_back(
        {{"id", id}, {"label", label}, {"colour", colour}, {"mesh", blobs_.AddMesh(mesh)}});
  }

  // Adds the bone by its origin: mirrored blue, inferred yellow. Skipped if all bone was observed.
  void Origin() {
    const auto part = [&](BoneOrigin origin) {
      std::vector<bool> keep;
      for (const BoneOrigin of_triangle : result_.origin) {
        keep.push_back(of_triangle == origin);
      }
      return SimplifyForView(Submesh(result_.shell, keep));
    };
    const auto [observed, mirrored, inferred] = AreaByOrigin_cm2(result_.shell, result_.origin);
    if (mirrored + inferred == 0) {
      return;
    }
    Mesh("origin", "Bone by origin", part(BoneOrigin::kObserved),
         HexText(OriginColour(BoneOrigin::kObserved)).c_str());
    for (const BoneOrigin origin : {BoneOrigin::kMirrored, BoneOrigin::kInferred}) {
      if (TriMesh mesh = part(origin); !mesh.triangles.empty()) {
        layers_.back()["parts"].push_back(
            {{"colour", HexText(OriginColour(origin))}, {"mesh", blobs_.AddMesh(mesh)}});
      }
    }
  }

  void Face(const char* id, const char* label, const TriMesh& mesh, const char* colour) {
    Mesh(id, label, mesh, colour);
    if (result_.truth) {
      layers_.back()["map"] = "error";
      layers_.back()["values"] = blobs_.AddValues(SignedErrors(mesh, result_, context_));
    }
  }

  void Head() {
    if (!result_.bust) {
      return;
    }
    Mesh("bust", "Head", view_.bust, "#d8a58a");
    for (const EyePart& part : result_.bust->eyes) {
      const auto& c = part.colour;
      layers_.back()["parts"].push_back(
          {{"colour", HexText({c[0], c[1], c[2]})}, {"mesh", blobs_.AddMesh(part.mesh)}});
    }
  }

  // For each vertex of the simplified mesh, the value at the nearest vertex of the full mesh.
  std::vector<double> NearestValues(const TriMesh& thin, const TriMesh& full,
                                    const std::vector<double>& full_values) const {
    const MeshQuery query(full);
    std::vector<double> values(thin.points.size());
    ParallelFor(values.size(), context_.threads, 256, [&](std::size_t v) {
      const MeshPoint at = query.Closest(thin.points[v]);
      double nearest = std::numeric_limits<double>::infinity();
      for (const std::int32_t corner : full.triangles[at.triangle]) {
        const double distance = (full.points[corner] - thin.points[v]).norm();
        if (distance < nearest) {
          nearest = distance;
          values[v] = full_values[corner];
        }
      }
    });
    return values;
  }

  // Colours the layer added last.
  void Map(const char* map, const std::vector<double>& values) {
    layers_.back()["map"] = map;
    layers_.back()["always_mapped"] = true;
    layers_.back()["values"] = blobs_.AddValues(values);
  }

  void Depth() {
    Mesh("depth", "Tissue depth on skull", view_.shell, "#8f8f8f");
    Map("depth", NearestValues(view_.shell, result_.shell, result_.depth.depth_mm));
  }

  void Dowels() {
    Json dowels = Json::array();
    for (const Dowel& dowel : result_.subject.dowels_on_bone) {
      if (!dowel.Tip().allFinite()) {
        continue;
      }
      Json json = {{"site", dowel.site},
                   {"name", WordsOfSite(dowel.site)},
                   {"base", RoundedPointJson(dowel.base)},
                   {"tip", RoundedPointJson(dowel.Tip())},
                   {"depth_mm", dowel.depth_mm}};
      for (std::size_t k = 0; k < result_.target.points.size(); ++k) {
        if (result_.target.points[k].label == dowel.site) {
          json["on_face"] = RoundedPointJson(result_.fit.surface.Point(result_.fit.uv[k]));
          json["residual_mm"] = result_.fit.residual_mm[k];
        }
      }
      dowels.push_back(json);
    }
    layers_.push_back(
        {{"id", "dowels"}, {"label", "Depth markers"}, {"colour", "#b3261e"}, {"dowels", dowels}});
  }

  void Net(int level) {
    const HSplineSurface& surface = result_.fit.surface;
    const ControlNet& net = surface.Net(level);
    std::vector<SceneBlobs::Segment> segments;
    const HSplineShape& shape = surface.shape();
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        if (i + 1 < net.columns || shape.ClosedU()) {
          segments.push_back({net.Index(i, j), net.Index((i + 1) % net.columns, j)});
        }
        if (j + 1 < net.rows) {
          segments.push_back({net.Index(i, j), net.Index(i, j + 1)});
        }
      }
    }
    static constexpr std::array kNetColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7"};
    layers_.push_back({{"id", fmt::format("net{}", level)},
                       {"label", fmt::format("Control net, level {}", level)},
                       {"colour", kNetColours[level % kNetColours.size()]},
                       {"lines", blobs_.AddLines(net.vertices, segments)}});
  }

  Json Maps() const {
    return {{"error", MapJson(ErrorColours(), "outside (+) or inside (\u2212) the true skin")},
            {"depth", MapJson(DepthColours(), "tissue depth")},
            {"sigma", MapJson(SigmaColours(), "standard deviation of the face")}};
  }

  Json Facts() const {
    Json facts = Json::array();
    if (!result_.usable()) {
      facts.push_back("not usable");
    }
    if (result_.truth) {
      const DistanceSummary& s = result_.truth->face.truth_to_face;
      facts.push_back(fmt::format("mean error {:.2f} mm", s.mean_abs_mm));
      facts.push_back(fmt::format("RMS {:.2f} mm", s.rms_mm));
      facts.push_back(fmt::format("within 2.5 mm {:.0f} %", 100 * s.within_2_5mm));
    }
    facts.push_back(fmt::format("depth markers: RMS {:.2f} mm", MarkerRms_mm(result_)));
    return facts;
  }

  const RunResult& result_;
  const RunContext& context_;
  const ViewMeshes view_;
  SceneBlobs blobs_;
  Json layers_ = Json::array();
};

}  // namespace

std::string SceneJson(const RunResult& result, const RunContext& context) {
  return SceneWriter(result, context).Write();
}

namespace {

// Adds a scene. Blobs with equal names are stored once.
void AddScene(const std::string& label, Json scene, Json& all) {
  for (auto& [name, blob] : scene["blobs"].items()) {
    all["blobs"][name] = std::move(blob);
  }
  scene.erase("blobs");
  scene["label"] = label;
  all["scenes"].push_back(std::move(scene));
}

Json ParseScene(const SceneText& text) {
  CheckJsonDepth(text.json);
  Json scene = Json::parse(text.json, nullptr, false);
  if (!scene.is_object() || !scene.contains("blobs") || !scene.contains("layers")) {
    throw IoError(fmt::format("scene '{}': not the scene of a run; run it again", text.label));
  }
  return scene;
}

// The size of the blobs that `all` does not hold yet.
std::size_t NewBytes(const Json& scene, const Json& all) {
  std::size_t bytes = 0;
  for (const auto& [name, blob] : scene["blobs"].items()) {
    bytes += all["blobs"].contains(name) ? 0 : blob.dump().size();
  }
  return bytes;
}

Json EmptyCollection() { return {{"scenes", Json::array()}, {"blobs", Json::object()}}; }

}  // namespace

std::string CollectScene(const std::string& label, Json scene) {
  Json all = EmptyCollection();
  AddScene(label, std::move(scene), all);
  return all.dump();
}

SceneCollection CollectScenes(const std::vector<SceneText>& scenes, std::size_t limit_bytes) {
  Json all = EmptyCollection();
  std::size_t size = 0;
  for (const SceneText& text : scenes) {
    Json scene = ParseScene(text);
    size += scenes.size() > 1 ? NewBytes(scene, all) : 0;
    if (!all["scenes"].empty() && size > limit_bytes) {
      break;
    }
    AddScene(text.label, std::move(scene), all);
  }
  return {all.dump(), static_cast<int>(all["scenes"].size())};
}

}  // namespace semblance::problems
