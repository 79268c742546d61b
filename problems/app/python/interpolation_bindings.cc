// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <optional>

#include "interp/dowels/dowel_network.h"
#include "interp/interpolate_depth.h"
#include "problems/app/python/bindings.h"
#include "problems/app/python/plugins.h"
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

DowelNetwork MakeNetwork(const std::optional<Indices>& areas, std::size_t dowels) {
  DowelNetwork network;
  if (areas) {
    for (const Triangle& area : ReadTriangles(*areas, "areas", dowels)) {
      network.areas.push_back({area[0], area[1], area[2]});
    }
  }
  return network;
}

// One of `schemes`, or a built-in scheme.
DepthScheme ReadScheme(const std::string& text, const std::vector<NamedScheme>& schemes) {
  constexpr const char* kCall = "interpolate(...)";
  ConfigErrors errors;
  const ConfigNode tree = LoadConfigTextTree("{scheme: " + text + "}", kCall, {},
                                             MakeConfigTree(SchemeChoice{}), errors);
  errors.ThrowIfAny();
  const ConfigNode* const node = tree.Find("scheme");
  const auto external = node == nullptr ? std::nullopt : ReadExternalScheme(*node, schemes, errors);
  DepthScheme scheme =
      external ? DepthScheme(*external) : ReadConfigTree<SchemeChoice>(tree, errors).scheme;
  errors.ThrowIfAny();
  return scheme;
}

py::tuple Interpolate(const Doubles& vertices, const Indices& triangles, const Doubles& bases,
                      const Doubles& directions, const Doubles& depths_mm,
                      const std::string& scheme_text, const py::iterable& schemes,
                      const std::optional<Indices>& areas, int threads) {
  const TriMesh skull = MakeMesh(vertices, triangles);
  const std::vector<Dowel> dowels = MakeDowels(
      Points3(bases, "bases"), Points3(directions, "directions"), Numbers(depths_mm, "depths_mm"));
  const DowelNetwork network = MakeNetwork(areas, dowels.size());
  const DepthScheme scheme = ReadScheme(scheme_text, ReadSchemes(schemes));
  RunContext context;
  context.threads = RequireAtLeastOne(threads, "threads");
  DepthField field;
  {
    const py::gil_scoped_release release;
    const std::vector<Vec3> normals = VertexNormals(skull);
    field = InterpolateDepth(scheme, {skull, normals, dowels, network}, context);
  }
  return py::make_tuple(MakeArray(field.depth_mm), MakeArray(field.sd_mm));
}

}  // namespace

void BindInterpolation(py::module_& module) {
  module.def("interpolate", &Interpolate, py::arg("vertices"), py::arg("triangles"),
             py::arg("bases"), py::arg("directions"), py::arg("depths_mm"), py::arg("scheme"),
             py::arg("schemes"), py::arg("areas"), py::arg("threads"));
}

}  // namespace semblance::problems
