// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "problems/app/python/bindings.h"
#include "problems/app/python/values.h"
#include "problems/config/config.h"
#include "problems/points/fit_report.h"
#include "problems/points/point_fit.h"
#include "problems/points/prediction.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;

// The columns of a table of points; see semblance.fit.
struct PointArrays {
  Doubles points;
  std::optional<Doubles> uv, weights, sigma;
  std::optional<Indices> triangles, exact;
  std::optional<Doubles> exact_normals;
  std::map<std::string, Doubles> attributes;
};

std::vector<double> CopiedNumbers(const Doubles& array, std::string_view name) {
  const std::span<const double> numbers = Numbers(array, name);
  return {numbers.begin(), numbers.end()};
}

// Throws InputError unless every number is above 0.
void CheckPositive(const std::vector<double>& numbers, std::string_view name) {
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    if (!(numbers[k] > 0)) {
      throw InputError(fmt::format("{}: row {} is {}; it must be above 0", name, k, numbers[k]));
    }
  }
}

void ReadWeights(const PointArrays& arrays, PointTable& table) {
  if (arrays.weights && arrays.sigma) {
    throw InputError(
        "weights and sigma are both given; give one of them (a weight is 1 / sigma^2)");
  }
  if (arrays.weights) {
    table.weights = CopiedNumbers(*arrays.weights, "weights");
    CheckPositive(table.weights, "weights");
  } else if (arrays.sigma) {
    table.weights = CopiedNumbers(*arrays.sigma, "sigma");
    CheckPositive(table.weights, "sigma");
    std::ranges::transform(table.weights, table.weights.begin(),
                           [](double sigma) { return 1 / (sigma * sigma); });
    table.weights_of_sigma = true;
  }
}

// exact: indices of points; normals: one per index, or none.
void ReadExact(const PointArrays& arrays, PointTable& table) {
  if (!arrays.exact) {
    return;
  }
  const auto count = static_cast<std::int64_t>(table.positions.size());
  const std::vector<Vec3> normals = arrays.exact_normals
                                        ? Points3(*arrays.exact_normals, "exact_normals")
                                        : std::vector<Vec3>(arrays.exact->size(), Vec3::Zero());
  if (std::ssize(normals) != arrays.exact->size()) {
    throw InputError("exact_normals must have one row per exact point");
  }
  std::map<std::int64_t, Vec3> by_index;
  for (py::ssize_t k = 0; k < arrays.exact->size(); ++k) {
    const std::int64_t index = arrays.exact->data()[k];
    if (index < 0 || index >= count) {
      throw InputError(
          fmt::format("exact: entry {} is point {}; there are {}, from 0", k, index, count));
    }
    by_index[index] = normals[k];
  }
  for (const auto& [index, normal] : by_index) {
    AddExact(table, static_cast<std::size_t>(index), normal);
  }
}

PointTable MakePointTable(const PointArrays& arrays) {
  PointTable table;
  table.positions = Points3(arrays.points, "points");
  const std::size_t count = table.positions.size();
  if (arrays.uv) {
    table.uv = Points2(*arrays.uv, "uv");
  }
  ReadWeights(arrays, table);
  for (const auto& [name, values] : arrays.attributes) {
    table.attributes.push_back({name, CopiedNumbers(values, name)});
  }
  if (arrays.triangles) {
    table.triangles = ReadTriangles(*arrays.triangles, "triangles", count);
  }
  std::vector<std::size_t> counts = {table.uv.size(), table.weights.size()};
  for (const PointAttribute& attribute : table.attributes) {
    counts.push_back(attribute.values.size());
  }
  if (std::ranges::any_of(counts, [&](std::size_t n) { return n != 0 && n != count; })) {
    throw InputError("points, uv, weights, sigma and attributes must have the same number of rows");
  }
  ReadExact(arrays, table);
  return table;
}

py::object MakeEvidence(const PointFit& fit) {
  if (!std::isfinite(fit.energy_weight) || !fit.is_graph || !fit.fit.automatic) {
    return py::none();
  }
  const HeightEvidence evidence = CollectEvidence(fit);
  py::dict parts;
  parts["uv"] = MakeArray(evidence.uv);
  parts["residual_mm"] = MakeArray(evidence.residual_mm);
  parts["weights"] = MakeArray(evidence.weights);
  parts["figures"] =
      std::vector<double>{evidence.noise_mm, evidence.energy_weight, evidence.stretch,
                          evidence.direction_deg, evidence.effective_share};
  return parts;
}

HeightEvidence ReadEvidence(const py::dict& parts) {
  const auto figures = parts["figures"].cast<std::vector<double>>();
  return {.uv = Points2(parts["uv"].cast<Doubles>(), "uv"),
          .residual_mm = CopiedNumbers(parts["residual_mm"].cast<Doubles>(), "residual_mm"),
          .weights = CopiedNumbers(parts["weights"].cast<Doubles>(), "weights"),
          .noise_mm = figures.at(0),
          .energy_weight = figures.at(1),
          .stretch = figures.at(2),
          .direction_deg = figures.at(3),
          .effective_share = figures.at(4)};
}

// The points that the fit left out as outliers, ascending.
std::vector<std::uint32_t> FindOutliers(const PointFit& fit) {
  std::vector<std::uint32_t> outliers = fit.strays;
  if (fit.fit.automatic) {
    const auto& found = fit.fit.automatic->outliers;
    outliers.insert(outliers.end(), found.begin(), found.end());
  }
  std::ranges::sort(outliers);
  outliers.erase(std::unique(outliers.begin(), outliers.end()), outliers.end());
  return outliers;
}

// The parts of the result that semblance.PointFit holds.
py::dict FitParts(const PointFit& fit) {
  const auto& automatic = fit.fit.automatic;
  py::dict parts;
  parts["surface"] = fit.fit.surface;
  parts["uv"] = MakeArray(fit.fit.uv);
  parts["residuals_mm"] = MakeArray(fit.fit.residual_mm);
  parts["rms_mm"] = fit.fit.point_rms_mm;
  parts["rms_of_all_mm"] = fit.rms_of_all_mm;
  parts["noise_mm"] = automatic ? automatic->noise_mm : kNaN;
  parts["held_out_mm"] = automatic ? automatic->held_out_rms_mm : kNaN;
  parts["outliers"] = FindOutliers(fit);
  parts["parameters"] = fit.parameters;
  parts["faults"] = fit.Faults();
  parts["notes"] = fit.notes;
  parts["report"] = automatic ? AutoText(*automatic, fit.unit) : std::string();
  parts["evidence"] = MakeEvidence(fit);
  parts["sigma_mm"] =
      fit.sigma_mm.empty() ? py::object(py::none()) : py::object(MakeArray(fit.sigma_mm));
  std::vector<std::string> names;
  for (const PointAttribute& attribute : fit.attributes) {
    names.push_back(attribute.name);
  }
  py::list fitted;
  for (const std::vector<double>& values : fit.attribute_at) {
    fitted.append(MakeArray(values));
  }
  parts["attribute_names"] = names;
  parts["attribute_values"] = std::move(fitted);
  parts["attribute_surfaces"] = fit.attribute_fit.surfaces;
  return parts;
}

py::dict FitArrays(const py::dict& given, const std::string& options, int threads) {
  const PointArrays arrays{
      .points = given["points"].cast<Doubles>(),
      .uv = given["uv"].cast<std::optional<Doubles>>(),
      .weights = given["weights"].cast<std::optional<Doubles>>(),
      .sigma = given["sigma"].cast<std::optional<Doubles>>(),
      .triangles = given["triangles"].cast<std::optional<Indices>>(),
      .exact = given["exact"].cast<std::optional<Indices>>(),
      .exact_normals = given["exact_normals"].cast<std::optional<Doubles>>(),
      .attributes = given["attributes"].cast<std::map<std::string, Doubles>>()};
  PointTable table = MakePointTable(arrays);
  auto chosen = ReadConfigText<PointFitOptions>(options, "fit(...)");
  for (const PointAttribute& attribute : table.attributes) {
    chosen.attributes.push_back(attribute.name);
  }
  const PointFit fit = Interruptible([&](const std::stop_token& stop) {
    RunContext context;
    context.threads = RequireAtLeastOne(threads, "threads");
    context.stop_token = stop;
    return FitPoints(std::move(table), chosen, context);
  });
  return FitParts(fit);
}

py::dict PredictHeights(const HSplineSurface& surface, const py::dict& evidence, const Doubles& xy,
                        double level, int threads) {
  const std::vector<Vec2> places = Points2(xy, "xy");
  const HeightPredictor predictor(surface, ReadEvidence(evidence));
  PredictedHeights heights;
  {
    const py::gil_scoped_release release;
    heights = predictor.At(places, level, RequireAtLeastOne(threads, "threads"));
  }
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

}  // namespace

void BindFit(py::module_& module) {
  module.def("fit", &FitArrays, py::arg("given"), py::arg("options"), py::arg("threads"));
  module.def("predict", &PredictHeights, py::arg("surface"), py::arg("evidence"), py::arg("xy"),
             py::arg("level"), py::arg("threads"));
  module.def("fit_options", &OptionsReference<PointFitOptions>);
}

}  // namespace semblance::problems
