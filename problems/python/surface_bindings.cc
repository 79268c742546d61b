// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>

#include "problems/edits/edit_script.h"
#include "problems/python/arrays.h"
#include "problems/python/bindings.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance {
namespace {

namespace py = pybind11;
using Release = py::call_guard<py::gil_scoped_release>;

// rows x columns x 3.
Doubles NetArray(const HSplineSurface& surface, int level) {
  const ControlNet net = surface.Net(level);
  Doubles array({py::ssize_t{net.rows}, py::ssize_t{net.columns}, py::ssize_t{3}});
  std::copy_n(net.vertices.front().data(), 3 * net.vertices.size(), array.mutable_data());
  return array;
}

ControlNet NetOf(const Doubles& array) {
  if (array.ndim() != 3 || array.shape(2) != 3) {
    throw InputError("a net is an array of rows x columns x 3");
  }
  ControlNet net{.columns = static_cast<int>(array.shape(1)),
                 .rows = static_cast<int>(array.shape(0)),
                 .vertices = std::vector<Vec3>(array.shape(0) * array.shape(1))};
  std::copy_n(array.data(), array.size(), net.vertices.front().data());
  return net;
}

std::unique_ptr<HSplineSurface> MakeSurface(const Doubles& level0, int max_level, bool periodic_u) {
  const ControlNet net = NetOf(level0);
  const HSplineShape shape{.patches_u = periodic_u ? net.columns : net.columns - 3,
                           .patches_v = net.rows - 3,
                           .max_level = max_level,
                           .closure = periodic_u ? Closure::kPeriodicU : Closure::kOpen};
  return std::make_unique<HSplineSurface>(shape, net);
}

Doubles PointsAt(const HSplineSurface& surface, const Doubles& uv, int threads) {
  const std::vector<Vec2> at = Points2(uv, "uv");
  std::vector<Vec3> points;
  {
    const py::gil_scoped_release release;
    points = HSplineBatch(surface).Points(at, threads);
  }
  return ArrayOf(points);
}

Doubles NormalsAt(const HSplineSurface& surface, const Doubles& uv, int threads) {
  const std::vector<Vec2> at = Points2(uv, "uv");
  SurfaceSamples samples;
  {
    const py::gil_scoped_release release;
    samples = HSplineBatch(surface).PointsAndNormals(at, threads);
  }
  return ArrayOf(samples.normals);
}

Doubles DerivativesAt(const HSplineSurface& surface, const Doubles& uv, int du, int dv) {
  if (du < 0 || dv < 0 || du + dv > 2) {
    throw InputError(
        fmt::format("derivatives of order {} and {}; expected two in all at most", du, dv));
  }
  std::vector<Vec3> derivatives;
  for (const Vec2& at : Points2(uv, "uv")) {
    derivatives.push_back(surface.Derivative(at, {du, dv}));
  }
  return ArrayOf(derivatives);
}

py::tuple Project(const HSplineSurface& surface, const Doubles& points) {
  const std::vector<Vec3> given = Points3(points, "points");
  std::vector<Vec2> uv;
  std::vector<double> distance_mm;
  {
    const py::gil_scoped_release release;
    const SurfaceProjector projector(surface);
    for (const Vec3& point : given) {
      const SurfaceProjection foot = projector.Project(point);
      uv.push_back(foot.uv);
      distance_mm.push_back(foot.distance_mm);
    }
  }
  return py::make_tuple(ArrayOf(uv), ArrayOf(distance_mm));
}

py::tuple MeshAt(const HSplineSurface& surface, int per_patch) {
  const Tessellation drawn = Tessellate(surface, per_patch);
  return py::make_tuple(ArrayOf(drawn.mesh.points), ArrayOf(drawn.mesh.triangles),
                        ArrayOf(drawn.uv));
}

// What can be asked of a surface.
void BindQuestions(py::class_<HSplineSurface>& surface) {
  surface.def("points", &PointsAt, py::arg("uv"), py::arg("threads") = 1, "n x 3, of n x 2 (u, v).")
      .def("normals", &NormalsAt, py::arg("uv"), py::arg("threads") = 1,
           "n x 3, unit; zero where the tangents vanish.")
      .def("derivatives", &DerivativesAt, py::arg("uv"), py::arg("du"), py::arg("dv"),
           "n x 3: so many times by u and by v, two in all at most.")
      .def("project", &Project, py::arg("points"),
           "(uv, distance_mm) of the closest points of the surface.")
      .def("mesh", &MeshAt, py::arg("per_patch") = 4,
           "(vertices, triangles, uv): so many quads along each side of a finest patch.");
}

// Its control vertices, and their edits.
void BindNets(py::class_<HSplineSurface>& surface) {
  surface
      .def("net", &NetArray, py::arg("level"),
           "The control vertices of a level, rows x columns x 3, absolute, with coarser detail.")
      .def(
          "set_net",
          [](HSplineSurface& s, int level, const Doubles& net) { s.SetNet(level, NetOf(net)); },
          py::arg("level"), py::arg("net"),
          "Makes net(level) equal to this. Finer detail rides along.")
      .def(
          "edit",
          [](HSplineSurface& s, const std::string& script) {
            ApplyEdits(ReadEditScript(script), s);
          },
          py::arg("script"), "Makes the edits of a script, as `semblance edit` does.");
}

}  // namespace

void BindSurface(py::module_& module) {
  py::class_<HSplineSurface> surface(module, "HSpline",
                                     "A hierarchical B-spline surface: bicubic, with dyadic "
                                     "levels; detail is kept as offsets from "
                                     "the next coarser level. (u, v) lie in [0,1] x [0,1].");
  surface
      .def(
          py::init(&MakeSurface), py::arg("level0"), py::arg("max_level") = 0,
          py::arg("periodic_u") = false,
          "From the control vertices of level 0, rows x columns x 3: three more than patches along "
          "each open side.")
      .def_static(
          "read", [](const std::string& path) { return ReadHSpline(path); }, py::arg("path"),
          "From a .hspline.json, to the bit.")
      .def(
          "write", [](const HSplineSurface& s, const std::string& path) { WriteHSpline(path, s); },
          py::arg("path"), "To a .hspline.json; read() gives the same surface to the bit.")
      .def_property_readonly("max_level",
                             [](const HSplineSurface& s) { return s.shape().max_level; })
      .def_property_readonly("patches",
                             [](const HSplineSurface& s) {
                               return py::make_tuple(s.shape().patches_u, s.shape().patches_v);
                             })
      .def_property_readonly("periodic_u",
                             [](const HSplineSurface& s) { return s.shape().ClosedU(); });
  BindQuestions(surface);
  BindNets(surface);
}

}  // namespace semblance
