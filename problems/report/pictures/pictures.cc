// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/pictures/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "problems/report/pictures/lighting.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_primitives.h"

namespace semblance::problems {
SceneObject SkullObject(TriMesh mesh) {
  return {.mesh = std::move(mesh), .material = BoneMaterial()};
}

SceneObject SkinObject(TriMesh mesh, double opacity) {
  return {.mesh = std::move(mesh), .material = SkinMaterial(), .opacity = opacity};
}

SceneObject EyeObject(TriMesh mesh, const Colour& colour) {
  return {.mesh = std::move(mesh),
          .material = {.colour = colour, .wrap = 0.1, .gloss = 0.9, .gloss_log2 = 7}};
}

SceneObject DowelObject(std::span<const Dowel> dowels, double radius_mm) {
  SceneObject object{.mesh = {}, .material = PlasticMaterial(HexColour(0xc8321f))};
  for (const Dowel& dowel : dowels) {
    const Vec3 tip = dowel.Tip();
    if (tip.allFinite() && (tip - dowel.base).norm() > 0) {
      Append(object.mesh, MakeCylinder(dowel.base, tip, radius_mm));
      Append(object.mesh, MakeSphere(tip, 1.6 * radius_mm));
    }
  }
  return object;
}

SceneObject MappedObject(TriMesh mesh, std::span<const double> values_mm, const ColourMap& map) {
  if (values_mm.size() != mesh.points.size()) {
    throw InputError(fmt::format("coloured surface: {} values for {} points; give one per point",
                                 values_mm.size(), mesh.points.size()));
  }
  return {.mesh = std::move(mesh),
          .material = MatteMaterial(),
          .vertex_colours = ColoursAt(map, values_mm)};
}

Image ContactSheet(std::span<const Image> pictures) {
  constexpr int kMargin = 24, kGap = 16;  // pixels
  if (pictures.empty()) {
    throw InputError("contact sheet: it needs at least one picture");
  }
  int width = kGap * (static_cast<int>(pictures.size()) - 1), height = 0;
  for (const Image& picture : pictures) {
    width += picture.width;
    height = std::max(height, picture.height);
  }
  Image sheet = MakeImage(2 * kMargin + width, 2 * kMargin + height, {1, 1, 1});
  int x = kMargin;
  for (const Image& picture : pictures) {
    Paste(sheet, picture, x, kMargin);
    x += picture.width + kGap;
  }
  return sheet;
}

std::vector<Camera> CamerasFor(std::span<const View> views, const Box3& region, double aspect) {
  std::vector<Camera> cameras;
  double height_mm = 0;
  for (const View view : views) {
    height_mm =
        std::max(height_mm, cameras.emplace_back(CameraFor(view, region, aspect)).height_mm);
  }
  for (Camera& camera : cameras) {
    camera.height_mm = height_mm;
  }
  return cameras;
}

Image RenderViews(const Scene& scene, const Box3& region, std::span<const View> views,
                  const RenderOptions& options, int threads) {
  const double aspect = static_cast<double>(options.width) / std::max(options.height, 1);
  ShadowMaps shadows;
  return ContactSheet(
      RenderAll(scene, CamerasFor(views, region, aspect), options, shadows, threads));
}

}  // namespace semblance::problems
