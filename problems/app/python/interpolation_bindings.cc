// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/dowels/dowel_network.h"
#include "interp/interpolate_depth.h"
#include "problems/app/python/bindings.h"
#include "problems/app/python/values.h"
#include "problems/config/config.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;

struct SchemeChoice {
  DepthScheme scheme = Kriging{};
};
template <class Visitor>
void Fields(Visitor& visit, SchemeChoice& o) {
  visit(FieldInfo{.name = "scheme", .doc = "interpolation of depth between the depth markers"},
        o.scheme);
}

// Dowels at the given bases, along the given directions.
std::vector<Dowel> MakeDowels(const std::vector<Vec3>& bases, const std::vector<Vec3>& directions,
                              std::span<const double> depths) {
  if (directions.size() != bases.size() || depths.size() != bases.size()) {
    throw InputError("bases, directions and depths_mm must have the same number of rows");
  }
  std::vector<Dowel> dowels;
  for (std::size_t k = 0; k < bases.size(); ++k) {
    dowels.push_back({.site = std::to_string(k),
                      .base = bases[k],
                      .direction = directions[k].normalized(),
                      .depth_mm = depths[k]});
  }
  return dowels;
}

py::tuple Interpolate(const Doubles& vertices, const Indices& triangles, const Doubles& bases,
                      const Doubles& directions, const Doubles& depths_mm, const py::object& scheme,
                      int threads) {
  const TriMesh skull = MakeMesh(vertices, triangles);
  const std::vector<Dowel> dowels = MakeDowels(
      Points3(bases, "bases"), Points3(directions, "directions"), Numbers(depths_mm, "depths_mm"));
  const auto choice =
      ReadConfigText<SchemeChoice>("{scheme: " + OptionText(scheme) + "}", "interpolate(...)");
  RunContext context;
  context.threads = threads;
  DepthField field;
  {
    const py::gil_scoped_release release;
    const std::vector<Vec3> normals = VertexNormals(skull);
    const DowelNetwork network;
    field = InterpolateDepth(choice.scheme, {skull, normals, dowels, network}, context);
  }
  return py::make_tuple(MakeArray(field.depth_mm), MakeArray(field.sd_mm));
}

}  // namespace

void BindInterpolation(py::module_& module) {
  module.def(
      "interpolate", &Interpolate, py::arg("vertices"), py::arg("triangles"), py::arg("bases"),
      py::arg("directions"), py::arg("depths_mm"), py::arg("scheme") = "kriging",
      py::arg("threads") = 1,
      "Returns (depth_mm, sd_mm) per vertex of a skull from a few depth markers; NaN where the "
      "scheme gives none.\n\n"
      "vertices n x 3, triangles m x 3 (from 0), bases and directions k x 3, depths_mm k. "
      "scheme: name of a scheme without a network, or a dictionary with `type` and its options, "
      "like `interp` in a configuration.");
}

}  // namespace semblance::problems
