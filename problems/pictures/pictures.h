// SPDX-License-Identifier: GPL-3.0-or-later
// What the pictures of a run are composed of: skulls, skins, dowels and coloured surfaces, seen
// from the usual sides, on one sheet with captions and a legend.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/pictures/colour_map.h"
#include "problems/pictures/render.h"

namespace semblance {

SceneObject SkullObject(TriMesh mesh);
SceneObject SkinObject(TriMesh mesh, double opacity = 1);

// Wet and glossy.
SceneObject EyeObject(TriMesh mesh, const Colour& colour);

// One red cylinder per dowel from base to tip, with a sphere at the tip. radius_mm > 0. A dowel
// with no finite tip, or no depth, is left out.
SceneObject DowelObject(std::span<const Dowel> dowels, double radius_mm = 1.1);

// Matte, coloured by one value per vertex; NaN is grey. For Lighting::kEven. Throws InputError if
// the numbers of values and points differ.
SceneObject MappedObject(TriMesh mesh, std::span<const double> values_mm, const ColourMap& map);

struct Sheet {
  std::string title;                  // above all; may be empty
  std::vector<std::string> captions;  // one per picture, or none
  std::optional<Legend> legend;       // below all
};

// Pictures side by side on white, in order. Throws InputError without a picture, or with captions
// that are not one per picture.
Image ContactSheet(std::span<const Image> pictures, const Sheet& sheet);

// One per view, framed to `region` and all at one scale, for pictures of width / height `aspect`.
std::vector<Camera> CamerasFor(std::span<const View> views, const Box3& region, double aspect);

// One picture per view from these cameras, on one sheet.
Image RenderViews(const Scene& scene, const Box3& region, std::span<const View> views,
                  const Sheet& sheet, const RenderOptions& options, int threads);

}  // namespace semblance
