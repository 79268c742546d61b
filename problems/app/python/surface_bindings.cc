// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>

#include "problems/app/python/bindings.h"
#include "problems/app/python/values.h"
#include "problems/face/edit_script.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;
using Release = py::call_guard<py::gil_scoped_release>;

// Shape: rows x columns x 3.
Doubles NetArray(const HSplineSurface& surface, int level) {
  const ControlNet net = surface.Net(level);
  Doubles array({py::ssize_t{net.rows}, py::ssize_t{net.columns}, py::ssize_t{3}});
  std::copy_n(net.vertices.front().data(), 3 * net.vertices.size(), array.mutable_data());
  return array;
}

ControlNet ParseNet(const Doubles& array) {
  if (array.ndim() != 3 || array.shape(2) != 3) {
    throw InputError("a net must be an array of rows x columns x 3");
  }
  ControlNet net{.columns = static_cast<int>(array.shape(1)),
                 .rows = static_cast<int>(array.shape(0)),
                 .vertices = std::vector<Vec3>(array.shape(0) * array.shape(1))};
  std::copy_n(array.data(), array.size(), net.vertices.front().data());
  return net;
}

std::unique_ptr<HSplineSurface> MakeSurface(const Doubles& level0, int max_level, bool periodic_u) {
  const ControlNet net = ParseNet(level0);
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
  return MakeArray(points);
}

Doubles NormalsAt(const HSplineSurface& surface, const Doubles& uv, int threads) {
  const std::vector<Vec2> at = Points2(uv, "uv");
  SurfaceSamples samples;
  {
    const py::gil_scoped_release release;
    samples = HSplineBatch(surface).PointsAndNormals(at, threads);
  }
  return MakeArray(samples.normals);
}

Doubles DerivativesAt(const HSplineSurface& surface, const Doubles& uv, int du, int dv) {
  if (du < 0 || dv < 0 || du + dv > 2) {
    throw InputError(
        fmt::format("derivatives of order {} and {}; the sum must be at most 2", du, dv));
  }
  std::vector<Vec3> derivatives;
  for (const Vec2& at : Points2(uv, "uv")) {
    derivatives.push_back(surface.Derivative(at, {du, dv}));
  }
  return MakeArray(derivatives);
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
  return py::make_tuple(MakeArray(uv), MakeArray(distance_mm));
}

py::tuple MeshAt(const HSplineSurface& surface, int per_patch) {
  const Tessellation drawn = Tessellate(surface, per_patch);
  return py::make_tuple(MakeArray(drawn.mesh.points), MakeArray(drawn.mesh.triangles),
                        MakeArray(drawn.uv));
}

// Evaluation, projection and tessellation of a surface.
void BindEvaluation(py::class_<HSplineSurface>& surface) {
  surface
      .def("points", &PointsAt, py::arg("uv"), py::arg("threads") = 1,
           "n x 3 points at n x 2 (u, v).")
      .def("normals", &NormalsAt, py::arg("uv"), py::arg("threads") = 1,
           "n x 3 unit normals; zero where the tangents vanish.")
      .def("derivatives", &DerivativesAt, py::arg("uv"), py::arg("du"), py::arg("dv"),
           "n x 3 derivatives of order du in u and dv in v, with du + dv <= 2.")
      .def("project", &Project, py::arg("points"),
           "(uv, distance_mm) of the closest points of the surface.")
      .def("mesh", &MeshAt, py::arg("per_patch") = 4,
           "(vertices, triangles, uv), with per_patch quads along each side of a finest patch.");
}

// The control vertices of a surface, and edits of them.
void BindNets(py::class_<HSplineSurface>& surface) {
  surface
      .def("net", &NetArray, py::arg("level"),
           "The control vertices of a level, rows x columns x 3, as absolute positions that "
           "include coarser "
           "detail.")
      .def(
          "set_net",
          [](HSplineSurface& s, int level, const Doubles& net) { s.SetNet(level, ParseNet(net)); },
          py::arg("level"), py::arg("net"),
          "Sets the control vertices of a level. Finer detail moves with them.")
      .def(
          "edit",
          [](HSplineSurface& s, const std::string& script) {
            ApplyEdits(ReadEditScript(script), s);
          },
          py::arg("script"), "Applies the edits of a script, as `semblance edit` does.");
}

}  // namespace

void BindSurface(py::module_& module) {
  py::class_<HSplineSurface> surface(
      module, "HSpline",
      "A hierarchical B-spline surface: bicubic, with dyadic levels. Detail "
      "is stored as offsets from the next coarser level. (u, v) lie in "
      "[0,1] x [0,1].");
  surface
      .def(py::init(&MakeSurface), py::arg("level0"), py::arg("max_level") = 0,
           py::arg("periodic_u") = false,
           "Makes a surface from the control vertices of level 0, rows x columns x 3. An open side "
           "has "
           "three more vertices than patches.")
      .def_static(
          "read", [](const std::string& path) { return ReadHSpline(path); }, py::arg("path"),
          "Reads a .hspline.json without loss.")
      .def(
          "write", [](const HSplineSurface& s, const std::string& path) { WriteHSpline(path, s); },
          py::arg("path"), "Writes a .hspline.json; read() gives the identical surface.")
      .def_property_readonly("max_level",
                             [](const HSplineSurface& s) { return s.shape().max_level; })
      .def_property_readonly("patches",
                             [](const HSplineSurface& s) {
                               return py::make_tuple(s.shape().patches_u, s.shape().patches_v);
                             })
      .def_property_readonly("periodic_u",
                             [](const HSplineSurface& s) { return s.shape().ClosedU(); });
  BindEvaluation(surface);
  BindNets(surface);
}

}  // namespace semblance::problems
