// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "problems/app/python/bindings.h"
#include "problems/app/python/values.h"
#include "problems/face/edit_script.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/face_export.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/hspline_query/hspline_project.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;

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
    points = HSplineBatch(surface).Points(at, RequireAtLeastOne(threads, "threads"));
  }
  return MakeArray(points);
}

Doubles NormalsAt(const HSplineSurface& surface, const Doubles& uv, int threads) {
  const std::vector<Vec2> at = Points2(uv, "uv");
  SurfaceSamples samples;
  {
    const py::gil_scoped_release release;
    samples = HSplineBatch(surface).PointsAndNormals(at, RequireAtLeastOne(threads, "threads"));
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

// Writes the surface in the format of the path's ending: .hspline.json without loss, or a format of
// other programs.
void WriteAnyFormat(const HSplineSurface& surface, const std::string& path,
                    std::optional<double> chord_mm, int threads) {
  const std::filesystem::path file = path;
  const py::gil_scoped_release release;
  if (file.extension() == ".json") {
    WriteHSpline(file, surface);
  } else {
    WriteFileAtomically(file, EncodeFace(surface, file.extension().string(), chord_mm, threads));
  }
}

}  // namespace

void BindSurface(py::module_& module) {
  const auto set_net = [](HSplineSurface& s, int level, const Doubles& net) {
    s.SetNet(level, ParseNet(net));
  };
  const auto edit = [](HSplineSurface& s, const std::string& script) {
    ApplyEdits(ReadEditScript(script), s);
  };
  const auto patches = [](const HSplineSurface& s) {
    return py::make_tuple(s.shape().patches_u, s.shape().patches_v);
  };
  py::class_<HSplineSurface>(module, "Surface")
      .def(py::init(&MakeSurface), py::arg("level0"), py::arg("max_level"), py::arg("periodic_u"))
      .def_static("read", [](const std::string& path) { return ReadHSpline(path); })
      .def_static("from_json",
                  [](const std::string& text) { return HSplineFromJson(text, "pickle"); })
      .def("to_json", [](const HSplineSurface& s) { return HSplineToJson(s); })
      .def("copy", [](const HSplineSurface& s) { return HSplineSurface(s); })
      .def("write", &WriteAnyFormat, py::arg("path"), py::arg("chord_mm"), py::arg("threads"))
      .def("points", &PointsAt, py::arg("uv"), py::arg("threads"))
      .def("normals", &NormalsAt, py::arg("uv"), py::arg("threads"))
      .def("derivatives", &DerivativesAt, py::arg("uv"), py::arg("du"), py::arg("dv"))
      .def("project", &Project, py::arg("points"))
      .def("mesh", &MeshAt, py::arg("per_patch"))
      .def("net", &NetArray, py::arg("level"))
      .def("set_net", set_net, py::arg("level"), py::arg("net"))
      .def("edit", edit, py::arg("script"))
      .def_property_readonly("max_level",
                             [](const HSplineSurface& s) { return s.shape().max_level; })
      .def_property_readonly("patches", patches)
      .def_property_readonly("periodic_u",
                             [](const HSplineSurface& s) { return s.shape().ClosedU(); });
}

}  // namespace semblance::problems
