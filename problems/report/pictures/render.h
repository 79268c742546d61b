// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of triangle meshes by a z-buffer in software. Rendering needs no window system and gives
// the same bytes for any number of threads.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "problems/report/pictures/image.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

struct ShadowMaps;

struct Material {
  Colour colour = {0.8, 0.8, 0.8};    // of the vertices, unless they have their own
  double wrap = 0;                    // 0..1: how far light reaches past the terminator
  Vec3 scatter_mm = {0.6, 0.6, 0.6};  // red, green, blue: thickness that half the light passes; > 0
  double gloss = 0;                   // 0..1: strength of the highlight
  int gloss_log2 = 5;                 // its sharpness: the cosine to the power 2^gloss_log2
};

Material SkinMaterial();
Material BoneMaterial();
Material PlasticMaterial(const Colour& colour);  // dowels, tools
Material MatteMaterial();                        // for colours that stand for numbers

struct SceneObject {
  TriMesh mesh;
  Material material;
  std::vector<Colour> vertex_colours = {};  // one per vertex, or none: material.colour
  // The opacity seen face on. At a slant it grows as in a thin sheet: 1 - (1 - opacity)^(1 / cos).
  // Only opaque surfaces are visible behind the nearest surface with opacity < 1.
  double opacity = 1;
};

struct Scene {
  std::vector<SceneObject> objects;
};

// An orthographic camera.
struct Camera {
  Mat3 view_from_world = Mat3::Identity();  // rows: right, up, towards the viewer
  Vec3 centre = Vec3::Zero();               // at the middle of the picture, mm
  double height_mm = kNaN;                  // from the picture's lower to its upper edge, > 0
};

enum class View { kFront, kThreeQuarter, kSide };
constexpr auto EnumNames(View) {
  return std::to_array<std::string_view>({"front", "three_quarter", "side"});
}

// The camera that frames `region` with a small margin in a picture of width / height `aspect`. From
// front and side it frames the box itself; from between it frames the ellipsoid in the box, which
// is closer to a head. kFront looks from -y (the subject's left is on the right of the picture),
// kThreeQuarter from 40 degrees round to the subject's left, kSide from +x (the face looks to the
// left). +z is up in all. Throws InputError for an empty region.
Camera CameraFor(View view, const Box3& region, double aspect);

// kStudio: key, fill and rim light with soft shadows. kEven: no highlights and little shadow, so
// that a surface that faces the viewer has exactly its own colour.
enum class Lighting { kStudio, kEven };
constexpr auto EnumNames(Lighting) { return std::to_array<std::string_view>({"studio", "even"}); }

struct RenderOptions {
  int width = 800;
  int height = 800;
  int supersampling = 2;
  Lighting lighting = Lighting::kStudio;
  Colour background_top = {0.98, 0.985, 0.99};
  Colour background_bottom = {0.89, 0.90, 0.915};
};

template <class Visitor>
void Fields(Visitor& visit, RenderOptions& o) {
  visit(FieldInfo{.name = "width", .min = 16, .max = 8192, .doc = "pixels"}, o.width);
  visit(FieldInfo{.name = "height", .min = 16, .max = 8192, .doc = "pixels"}, o.height);
  visit(FieldInfo{.name = "supersampling",
                  .min = 1,
                  .max = 8,
                  .doc = "samples along each side of a pixel; more is smoother and slower"},
        o.supersampling);
  visit(FieldInfo{.name = "lighting", .doc = "studio, or even for colours that stand for numbers"},
        o.lighting);
  visit(FieldInfo{.name = "background_top", .doc = "sRGB; blends into background_bottom"},
        o.background_top);
  visit(FieldInfo{.name = "background_bottom", .doc = "sRGB"}, o.background_bottom);
}

// Throws InputError for options out of range, a camera without height, a point that is not finite,
// a triangle with the index of a missing point, an opacity outside 0..1, or colours that are not
// one per vertex. An empty scene shows the background. threads >= 1; the picture does not depend on
// it.
Image Render(const Scene& scene, const Camera& camera, const RenderOptions& options, int threads);
// Renders the scene from several sides. The sky's shadow maps are computed once for all cameras.
// Later calls with the same opaque meshes reuse them through `shadows` (lighting.h).
std::vector<Image> RenderAll(const Scene& scene, std::span<const Camera> cameras,
                             const RenderOptions& options, ShadowMaps& shadows, int threads);
// One way to show a scene.
struct Look {
  std::optional<Lighting> lighting = {};  // none: that of the options
  // Take the place of the first object's. An empty list of colours: the material's colour.
  std::optional<Material> material = {};
  std::optional<std::vector<Colour>> vertex_colours = {};
  bool shows_sheer = true;  // false: objects with an opacity below 1 are left out
};

// Renders the scene once per look and camera: result[look][camera]. The visible surfaces and the
// shadows, which take most of the time, are found once for all looks.
std::vector<std::vector<Image>> RenderLooks(const Scene& scene, std::span<const Look> looks,
                                            std::span<const Camera> cameras,
                                            const RenderOptions& options, ShadowMaps& shadows,
                                            int threads);

}  // namespace semblance::problems
