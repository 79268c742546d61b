// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pictures/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/pictures/lighting.h"
#include "problems/pictures/mesh_primitives.h"
#include "problems/pictures/stroke_font.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr Colour kPaper = {1, 1, 1};

// Wide sheets are shown smaller, so their lettering grows with them.
struct Layout {
  double scale = 1;
  int margin = 24, gap = 16, title = 0, caption = 0, legend = 0;  // pixels

  Layout(int pictures_width, const Sheet& sheet)
      : scale(std::clamp(pictures_width / 1300.0, 1.0, 4.0)) {
    title = sheet.title.empty() ? 0 : Pixels(46);
    caption = sheet.captions.empty() ? 0 : Pixels(36);
    legend = sheet.legend ? Pixels(84) : 0;
  }
  int Pixels(double at_scale_1) const { return static_cast<int>(std::lround(scale * at_scale_1)); }
};

void CheckSheet(std::span<const Image> pictures, const Sheet& sheet) {
  if (pictures.empty()) {
    throw InputError("contact sheet: it needs at least one picture");
  }
  if (!sheet.captions.empty() && sheet.captions.size() != pictures.size()) {
    throw InputError(
        fmt::format("contact sheet: {} captions for {} pictures; give one per picture or none",
                    sheet.captions.size(), pictures.size()));
  }
}

}  // namespace

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

Image ContactSheet(std::span<const Image> pictures, const Sheet& sheet) {
  CheckSheet(pictures, sheet);
  int pictures_width = 0, height = 0;
  for (const Image& picture : pictures) {
    pictures_width += picture.width;
    height = std::max(height, picture.height);
  }
  const Layout l(pictures_width, sheet);
  const int gaps = l.gap * (static_cast<int>(pictures.size()) - 1);
  const int top = l.margin + l.title, below = top + height + l.caption;
  Image page = MakeImage(2 * l.margin + pictures_width + gaps, below + l.legend + l.margin, kPaper);
  DrawText(page, l.margin, l.margin + l.Pixels(22), sheet.title,
           {.cap_height_px = l.scale * 17, .stroke = 0.135});
  int x = l.margin;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    Paste(page, pictures[i], x, top);
    if (!sheet.captions.empty()) {
      DrawText(page, x + pictures[i].width / 2.0, top + height + l.Pixels(26), sheet.captions[i],
               {.cap_height_px = l.scale * 12, .anchor = Anchor::kCentre});
    }
    x += pictures[i].width + l.gap;
  }
  if (sheet.legend) {
    DrawLegend(page, *sheet.legend, 0, below, page.width, l.legend);
  }
  return page;
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
                  const Sheet& sheet, const RenderOptions& options, int threads) {
  const double aspect = static_cast<double>(options.width) / std::max(options.height, 1);
  ShadowMaps shadows;
  return ContactSheet(
      RenderAll(scene, CamerasFor(views, region, aspect), options, shadows, threads), sheet);
}

}  // namespace semblance
