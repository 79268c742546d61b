// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "problems/app/python/bindings.h"
#include "problems/app/python/values.h"
#include "problems/config/config.h"
#include "problems/points/point_fit.h"
#include "problems/points/prediction.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;

PointTable MakePointTable(const Doubles& points, const std::optional<Doubles>& uv,
                          const std::optional<Doubles>& weights) {
  PointTable table;
  table.positions = Points3(points, "points");
  if (uv) {
    table.uv = Points2(*uv, "uv");
  }
  if (weights) {
    const auto numbers = Numbers(*weights, "weights");
    table.weights.assign(numbers.begin(), numbers.end());
  }
  for (const std::size_t count : {table.uv.size(), table.weights.size()}) {
    if (count != 0 && count != table.positions.size()) {
      throw InputError("points, uv and weights must have the same number of rows");
    }
  }
  return table;
}

PointFit FitArrays(const Doubles& points, const std::optional<Doubles>& uv,
                   const std::optional<Doubles>& weights, int threads, const py::kwargs& options) {
  PointTable table = MakePointTable(points, uv, weights);
  const auto chosen = ReadConfigText<PointFitOptions>(OptionText(options), "fit(...)");
  return Interruptible([&](const std::stop_token& stop) {
    RunContext context;
    context.threads = threads;
    context.stop_token = stop;
    return FitPoints(std::move(table), chosen, context);
  });
}

py::dict PredictHeights(const PointFit& fit, const Doubles& xy, double level, int threads) {
  if (!std::isfinite(fit.energy_weight)) {
    throw InputError("predict needs a fit by plan: auto with solver: fastest");
  }
  const std::vector<Vec2> places = Points2(xy, "xy");
  const PredictedHeights heights =
      HeightPredictor(fit.fit.surface, CollectEvidence(fit)).At(places, level, threads);
  py::array_t<bool> supported(static_cast<py::ssize_t>(heights.supported.size()));
  std::ranges::transform(heights.supported, supported.mutable_data(),
                         [](char flag) { return flag != 0; });
  py::dict result;
  result["z"] = MakeArray(heights.z);
  result["sd"] = MakeArray(heights.sd);
  result["low"] = MakeArray(heights.low);
  result["high"] = MakeArray(heights.high);
  result["supported"] = std::move(supported);
  return result;
}

std::string FitDocumentation() {
  return "Fits an H-spline to scattered points, refined where they need it.\n\npoints: n x 3, mm. "
         "uv: n "
         "x 2, or None: computed by the option `parameters`. weights: n, positive. The options are "
         "those of a configuration of `semblance fit`, as nested dictionaries:\n\n" +
         OptionsReference<PointFitOptions>();
}

}  // namespace

void BindFit(py::module_& module) {
  py::class_<PointFit>(module, "PointFit", "Result of fit().")
      .def_property_readonly("surface", [](const PointFit& f) { return f.fit.surface; })
      .def_property_readonly(
          "uv", [](const PointFit& f) { return MakeArray(f.fit.uv); },
          "n x 2: (u, v) of each point")
      .def_property_readonly(
          "residuals_mm", [](const PointFit& f) { return MakeArray(f.fit.residual_mm); },
          "n: distance of each point from the surface at its (u, v)")
      .def_property_readonly("rms_mm", [](const PointFit& f) { return f.fit.point_rms_mm; })
      .def_property_readonly("parameters", [](const PointFit& f) { return f.parameters; })
      .def_property_readonly("usable", [](const PointFit& f) { return f.Faults().empty(); })
      .def(
          "predict", &PredictHeights, py::arg("xy"), py::arg("level") = 0.9, py::arg("threads") = 1,
          "Heights at n x 2 places, for a fit of heights over x and y: a dictionary of n numbers "
          "each: z, sd (of the surface), low and high (interval for a new observation, which holds "
          "the share `level`) and supported (False where the points do not support z).")
      .def_property_readonly("faults", &PointFit::Faults,
                             "reasons why the result cannot be used, or empty");
  module.def("fit", &FitArrays, py::arg("points"), py::arg("uv") = py::none(),
             py::arg("weights") = py::none(), py::arg("threads") = 1, FitDocumentation().c_str());
}

}  // namespace semblance::problems
