// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/template_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "problems/report/pictures/pictures.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_primitives.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

using Json = nlohmann::ordered_json;  // writes NaN as null

Json ToJson(const SkinDistance& d) {
  return {{"rms_mm", d.rms_mm},
          {"p95_mm", d.p95_mm},
          {"max_mm", d.max_mm},
          {"covered", d.covered},
          {"area_mm2", d.area_mm2}};
}

Json ToJson(const TemplateLevel& level) {
  return {{"level", level.level},
          {"rounds", level.rounds},
          {"matched", level.matched},
          {"vertices", level.vertices},
          {"face_to_skin", ToJson(level.face_to_skin)}};
}

Json ToJson(const TemplateSite& site) {
  return {{"u", site.uv.x()},
          {"v", site.uv.y()},
          {"from_landmark", site.from_landmark},
          {"drift_mm", site.drift_mm},
          {"error_mm", site.error_mm}};
}

std::string DescribeDistance(const SkinDistance& d) {
  return fmt::format(
      "RMS {:.3f} mm, p95 {:.3f} mm, largest {:.2f} mm; measured on {:.1f} % of "
      "{:.0f} cm²",
      d.rms_mm, d.p95_mm, d.max_mm, 100 * d.covered, d.area_mm2 / 100);
}

std::string DescribeSites(const TemplateFit& fit) {
  double worst = 0, drift = 0;
  std::string worst_code = "none", drift_code = "none";
  int landmarks = 0;
  for (const auto& [code, site] : fit.sites) {
    landmarks += site.from_landmark;
    if (site.error_mm > worst) {
      worst = site.error_mm;
      worst_code = code;
    }
    if (site.drift_mm > drift) {
      drift = site.drift_mm;
      drift_code = code;
    }
  }
  return fmt::format(
      "sites: {} of {} from landmarks, at most {:.2f} mm off the face ({}); the "
      "formula's places are up to {:.1f} mm from theirs ({})\n",
      landmarks, fit.sites.size(), worst, worst_code, drift, drift_code);
}

// ---------------------------------------------------------------------------------------------
// The picture
// ---------------------------------------------------------------------------------------------

constexpr double kDot_mm = 1.4;     // radius of the dots at the sites
constexpr double kColoured_mm = 1;  // larger distances have the colour of this one

SceneObject SiteDots(const TemplateFit& fit) {
  SceneObject dots{.mesh = {}, .material = PlasticMaterial(HexColour(0xc8321f))};
  for (const auto& [code, uv] : fit.face.site_uv) {
    Append(dots.mesh, MakeSphere(fit.face.surface.Point(uv), kDot_mm));
  }
  return dots;
}

std::vector<double> SignedDistances(const Tessellation& face, const TriMesh& skin) {
  const MeshQuery query(skin);
  std::vector<double> signed_mm;
  for (std::size_t k = 0; k < face.mesh.points.size(); ++k) {
    const MeshPoint nearest = query.Closest(face.mesh.points[k]);
    const double side = (face.mesh.points[k] - nearest.position).dot(face.normals[k]);
    signed_mm.push_back(std::copysign(nearest.distance_mm, side));
  }
  return signed_mm;
}

}  // namespace

std::string TemplateJson(const TemplateFit& fit, const OuterHead& head,
                         const TemplateFitOptions& options) {
  Json json{{"tolerance_mm", options.tolerance_mm},
            {"met", fit.met},
            {"folds", fit.folds},
            {"face_to_skin", ToJson(fit.face_to_skin)},
            {"skin_to_face", ToJson(fit.skin_to_face)},
            {"levels", Json::array()},
            {"sites", Json::object()},
            {"notes", head.notes}};
  for (const TemplateLevel& level : fit.levels) {
    json["levels"].push_back(ToJson(level));
  }
  for (const auto& [code, site] : fit.sites) {
    json["sites"][code] = ToJson(site);
  }
  return json.dump(1) + "\n";
}

std::string TemplateText(const TemplateFit& fit, const TemplateFitOptions& options) {
  std::string text;
  for (const TemplateLevel& level : fit.levels) {
    text += fmt::format("level {}: {} vertices; {}\n", level.level, level.vertices,
                        DescribeDistance(level.face_to_skin));
  }
  text += fmt::format("face to skin: {}\nskin to face: {}\n", DescribeDistance(fit.face_to_skin),
                      DescribeDistance(fit.skin_to_face));
  text += DescribeSites(fit);
  text += fmt::format("folds: {}\ntolerance of {} mm: {}\n", fit.folds, options.tolerance_mm,
                      fit.met ? "met" : "not met; finer levels, or a finer mesh, come closer");
  return text + fmt::format(
                    "template.png, from left to right: skin and face from the front, skin and face "
                    "from the side, and the distance of the face from the skin, from blue ({0} mm "
                    "inside) to red ({0} mm outside)\n",
                    kColoured_mm);
}

Image TemplatePicture(const TemplateFit& fit, const OuterHead& head, int threads) {
  const Tessellation face =
      Tessellate(fit.face.surface, std::max(1, 16 >> fit.face.surface.shape().max_level));
  const Box3 region = Bounds(face.mesh);
  const Scene skin{{SkinObject(head.skin)}}, shown{{SkinObject(face.mesh), SiteDots(fit)}};
  const ColourMap colours = DivergingMap(kColoured_mm);
  const Scene distance{{MappedObject(face.mesh, SignedDistances(face, head.skin), colours)}};
  const auto picture = [&](const Scene& scene, View view, Lighting lighting) {
    const RenderOptions options{.width = 480, .height = 620, .lighting = lighting};
    return Render(scene, CameraFor(view, region, 480.0 / 620), options, threads);
  };
  const std::vector<Image> pictures = {picture(skin, View::kFront, Lighting::kStudio),
                                       picture(shown, View::kFront, Lighting::kStudio),
                                       picture(skin, View::kSide, Lighting::kStudio),
                                       picture(shown, View::kSide, Lighting::kStudio),
                                       picture(distance, View::kFront, Lighting::kEven)};
  return ContactSheet(pictures);
}

}  // namespace semblance::problems
