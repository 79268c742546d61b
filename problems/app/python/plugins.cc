// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/python/plugins.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "problems/app/python/values.h"
#include "problems/run.h"
#include "problems/study/depth_study.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;

using HeldObject = std::shared_ptr<const py::object>;

// Keeps an object alive for threads that do not hold the interpreter's lock. They may copy and drop
// the pointer, because only the deleter touches the object.
HeldObject Hold(py::object object) {
  return {new py::object(std::move(object)), [](const py::object* held) {
            const py::gil_scoped_acquire lock;
            delete held;
          }};
}

// Describes an exception of Python as one line and as its traceback.
ExternalFailure DescribeException(const std::string& name, const py::error_already_set& error) {
  const auto words = py::str(error.value()).cast<std::string>();
  const auto type = error.type().attr("__name__").cast<std::string>();
  const py::object lines =
      py::module_::import("traceback")
          .attr("format_exception")(error.type(), error.value(), error.trace());
  return {fmt::format("{}: {}: {}", name, type, words.substr(0, words.find('\n'))),
          py::str("").attr("join")(lines).cast<std::string>()};
}

// Calls a function with the interpreter's lock. Throws ExternalFailure if it raises an exception.
template <class Call>
auto CallPython(const std::string& name, const Call& call) {
  const py::gil_scoped_acquire lock;
  try {
    return call();
  } catch (const py::error_already_set& error) {
    throw DescribeException(name, error);
  }
}

std::vector<double> Copied(const py::handle& numbers) {
  const auto array = py::cast<Doubles>(numbers);
  const std::span<const double> values = Numbers(array, "the result", MissingNumbers::kAllow);
  return {values.begin(), values.end()};
}

py::dict InputArrays(const DepthInput& input) {
  std::vector<std::string> sites;
  std::vector<Vec3> bases, directions;
  std::vector<double> depths_mm, sds_mm;
  for (const Dowel& dowel : input.dowels) {
    sites.push_back(dowel.site);
    bases.push_back(dowel.base);
    directions.push_back(dowel.direction);
    depths_mm.push_back(dowel.depth_mm);
    sds_mm.push_back(dowel.sd_mm);
  }
  const std::vector<Triangle> areas(input.network.areas.begin(), input.network.areas.end());
  py::dict arrays;
  arrays["vertices"] = MakeArray(input.skull.points);
  arrays["triangles"] = MakeArray(input.skull.triangles);
  arrays["normals"] = MakeArray(input.normals);
  arrays["sites"] = sites;
  arrays["bases"] = MakeArray(bases);
  arrays["directions"] = MakeArray(directions);
  arrays["depths_mm"] = MakeArray(depths_mm);
  arrays["sds_mm"] = MakeArray(sds_mm);
  arrays["areas"] = MakeArray(areas);
  return arrays;
}

ExternalOption::Kind ReadKind(const std::string& kind) {
  return kind == "bool"  ? ExternalOption::Kind::kBool
         : kind == "int" ? ExternalOption::Kind::kInteger
         : kind == "str" ? ExternalOption::Kind::kText
                         : ExternalOption::Kind::kNumber;
}

ExternalFunction MakeFunction(const std::string& name, const py::handle& scheme) {
  const HeldObject call = Hold(scheme.attr("_call"));
  ExternalFunction function;
  function.needs_surface = scheme.attr("needs_surface").cast<bool>();
  function.needs_network = scheme.attr("needs_network").cast<bool>();
  function.interpolate = [name, call](const DepthInput& input,
                                      const std::map<std::string, std::string>& options) {
    return CallPython(name, [&] {
      const py::tuple found = (*call)(InputArrays(input), options);
      ExternalDepths depths{.depth_mm = Copied(found[0]), .sd_mm = {}};
      if (!found[1].is_none()) {
        depths.sd_mm = Copied(found[1]);
      }
      return depths;
    });
  };
  return function;
}

py::object MeshArrays(const TriMesh& mesh) {
  return py::make_tuple(MakeArray(mesh.points), MakeArray(mesh.triangles));
}

py::object Flags(const std::vector<bool>& flags) {
  py::array_t<bool> array(static_cast<py::ssize_t>(flags.size()));
  std::copy(flags.begin(), flags.end(), array.mutable_data());
  return array;
}

py::object PartNumbers(const FaceRegion& region) {
  const std::vector<double> numbers(region.part.begin(), region.part.end());
  return MakeArray(numbers).attr("astype")("int64");
}

}  // namespace

std::vector<NamedScheme> ReadSchemes(const py::iterable& schemes) {
  std::vector<NamedScheme> named;
  for (const py::handle& scheme : schemes) {
    NamedScheme& next = named.emplace_back();
    next.name = scheme.attr("name").cast<std::string>();
    next.source_hash = scheme.attr("source_hash").cast<std::string>();
    for (const py::handle& option : scheme.attr("_options")()) {
      const auto [name, kind, text] =
          option.cast<std::tuple<std::string, std::string, std::string>>();
      next.options.push_back({name, ReadKind(kind), text});
    }
    next.function = std::make_shared<const ExternalFunction>(MakeFunction(next.name, scheme));
  }
  return named;
}

std::vector<OwnMetric> ReadMetrics(const py::iterable& metrics) {
  std::vector<OwnMetric> own;
  for (const py::handle& metric : metrics) {
    const auto name = metric.attr("name").cast<std::string>();
    const HeldObject call = Hold(metric.attr("_call"));
    const auto measure = [name, call](const MeasuredTrial& trial) {
      const std::string numbers = trial.numbers.dump();
      return CallPython(name, [&] {
        const py::dict arrays =
            trial.run != nullptr ? ResultArrays(*trial.run) : ResultArrays(*trial.depth);
        return (*call)(numbers, arrays).cast<double>();
      });
    };
    own.push_back({name, metric.attr("source_hash").cast<std::string>(), measure});
  }
  return own;
}

py::dict ResultArrays(const RunResult& result) {
  py::dict arrays;
  arrays["surface"] = result.fit.surface;
  arrays["face"] = MeshArrays(result.face.mesh);
  arrays["first_face"] = MeshArrays(result.implicit.mesh);
  arrays["skull"] = MeshArrays(result.shell);
  arrays["depth_mm"] = MakeArray(result.depth.depth_mm);
  arrays["sd_mm"] = MakeArray(result.depth.sd_mm);
  arrays["sigma_mm"] = result.uncertainty ? py::object(MakeArray(result.uncertainty->sigma_mm))
                                          : py::object(py::none());
  arrays["truth"] = result.subject.skin ? MeshArrays(*result.subject.skin) : py::none();
  arrays["region"] = result.truth ? Flags(result.truth->skin.region.scored) : py::none();
  arrays["parts"] = result.truth ? PartNumbers(result.truth->skin.region) : py::none();
  return arrays;
}

py::dict ResultArrays(const DepthResult& result) {
  py::dict arrays;
  for (const char* const missing : {"surface", "face", "first_face", "sigma_mm"}) {
    arrays[missing] = py::none();
  }
  const Case& subject = result.stage->subject;
  arrays["skull"] = MeshArrays(result.stage->shell);
  arrays["depth_mm"] = MakeArray(result.depth.depth_mm);
  arrays["sd_mm"] = MakeArray(result.depth.sd_mm);
  arrays["truth"] = subject.skin ? MeshArrays(*subject.skin) : py::none();
  arrays["region"] = result.truth ? Flags(result.truth->region.scored) : py::none();
  arrays["parts"] = result.truth ? PartNumbers(result.truth->region) : py::none();
  return arrays;
}

}  // namespace semblance::problems
