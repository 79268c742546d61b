// SPDX-License-Identifier: GPL-3.0-or-later
// The outer shell of a skull, whose triangles emit. It bridges the temples, the orbits and the gap
// to the mandible (thesis 3.3, fig. 3.5, where this is done by hand).
#pragma once

#include <string_view>
#include <variant>

#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

struct WrapFill {
  static constexpr std::string_view kName = "wrap";
  double alpha_mm = 24;
  double edge_mm = 3.5;
  double pull_mm = 4;
  double press_mm = 3;
};
template <class Visitor>
void Fields(Visitor& visit, WrapFill& o) {
  visit(FieldInfo{.name = "alpha_mm",
                  .unit = "mm",
                  .min = 2,
                  .max = 200,
                  .doc = "openings narrower than about this are bridged: smaller enters orbits and "
                         "temples, larger bridges cheeks too"},
        o.alpha_mm);
  visit(FieldInfo{.name = "edge_mm",
                  .unit = "mm",
                  .min = 0.5,
                  .max = 20,
                  .doc = "edge length of the shell's triangles, each of which emits"},
        o.edge_mm);
  visit(FieldInfo{.name = "pull_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 20,
                  .doc = "parts of the shell closer than this to bone are laid onto it, fading out "
                         "at twice this, so that the shell is bone where bone is exposed"},
        o.pull_mm);
  visit(
      FieldInfo{.name = "press_mm",
                .unit = "mm",
                .min = 0,
                .max = 20,
                .doc = "where a dowel would reach less than this out of the shell (the root of "
                       "the nose), the shell is pressed in around it, to bone at most; 0: nowhere"},
      o.press_mm);
}

struct NoFill {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoFill&) {}

using SkullFill = std::variant<WrapFill, NoFill>;

// The shell of a skull. With `wrap` it is a closed, outward manifold (alpha wrapping: Portaneri et
// al. 2022); with `none` it is the skull itself.
TriMesh FillSkull(const TriMesh& skull, const SkullFill& fill, const RunContext& context);

// The same surface with triangles whose edges are near edge_mm (Botsch & Kobbelt 2004); the result
// is a manifold. Throws InputError if edge_mm is not positive or the mesh is not a consistently
// oriented manifold.
TriMesh Remesh(const TriMesh& mesh, double edge_mm);

}  // namespace semblance::surfaces
