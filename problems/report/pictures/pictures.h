// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of a run's pictures: skulls, skins, dowels and coloured surfaces, seen from the usual
// sides, side by side on one sheet.
#pragma once

#include <span>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/report/pictures/colour_map.h"
#include "problems/report/pictures/render.h"

namespace semblance::problems {

SceneObject SkullObject(TriMesh mesh);
SceneObject SkinObject(TriMesh mesh, double opacity = 1);

// A wet, glossy eyeball.
SceneObject EyeObject(TriMesh mesh, const Colour& colour);

// One red cylinder per dowel from base to tip, with a sphere at the tip. radius_mm > 0. A dowel
// without a finite tip or without a depth is left out.
SceneObject DowelObject(std::span<const Dowel> dowels, double radius_mm = 1.1);

// A matte surface coloured by one value per vertex, for Lighting::kEven. NaN is grey. Throws
// InputError if the numbers of values and points differ.
SceneObject MappedObject(TriMesh mesh, std::span<const double> values_mm, const ColourMap& map);

// Pictures side by side on white, in order, with a margin. Titles, captions and legends belong to
// the page that shows the sheet. Throws InputError without a picture.
Image ContactSheet(std::span<const Image> pictures);

// One camera per view, framed to `region` and all at one scale, for pictures of width / height
// `aspect`.
std::vector<Camera> CamerasFor(std::span<const View> views, const Box3& region, double aspect);

// One picture per view from the cameras of CamerasFor, on one sheet.
Image RenderViews(const Scene& scene, const Box3& region, std::span<const View> views,
                  const RenderOptions& options, int threads);

}  // namespace semblance::problems
