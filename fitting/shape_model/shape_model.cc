// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/shape_model/shape_model.h"

#include <fmt/format.h>

#include <algorithm>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

[[noreturn]] void Fail(std::string_view name, const std::string& what) {
  throw InputError(fmt::format("{}: {}", name, what));
}

bool AreCorners(const Triangle& t, std::size_t points) {
  return std::ranges::all_of(
      t, [&](std::int32_t v) { return v >= 0 && static_cast<std::size_t>(v) < points; });
}

}  // namespace

void CheckShapeModel(const ShapeModel& model, std::string_view name) {
  const std::size_t points = model.mean.points.size();
  if (model.mean.triangles.empty() || model.Modes() == 0) {
    Fail(name, fmt::format("a shape model needs triangles and modes; this one has {} and {}",
                           model.mean.triangles.size(), model.Modes()));
  }
  if (static_cast<std::size_t>(model.modes.rows()) != 3 * points) {
    Fail(name, fmt::format("the modes move {} coordinates, and the mean mesh has {} (3 x {} "
                           "points); both must be of one mesh, in one order of points",
                           model.modes.rows(), 3 * points, points));
  }
  for (const Triangle& t : model.mean.triangles) {
    if (!AreCorners(t, points)) {
      Fail(name, fmt::format("a triangle has the corners {}, and there are {} points",
                             fmt::join(t, ", "), points));
    }
  }
  if (!std::ranges::all_of(model.mean.points, [](const Vec3& p) { return p.allFinite(); }) ||
      !model.modes.allFinite()) {
    Fail(name, "a coordinate of the mean or of a mode is not finite");
  }
}

std::vector<Vec3> ShapeAt(const ShapeModel& model, const Eigen::VectorXd& coefficients) {
  if (coefficients.size() != model.Modes()) {
    throw InputError(fmt::format("shape model: {} coefficients for {} modes; give one per mode",
                                 coefficients.size(), model.Modes()));
  }
  const Eigen::VectorXd moves = model.modes * coefficients;
  std::vector<Vec3> points = model.mean.points;
  for (std::size_t v = 0; v < points.size(); ++v) {
    points[v] += moves.segment<3>(3 * static_cast<Eigen::Index>(v));
  }
  return points;
}

Vec3 PositionOf(const ModelPoint& at, const TriMesh& mean, const std::vector<Vec3>& points) {
  const Triangle& t = mean.triangles.at(at.triangle);
  return at.weights[0] * points[t[0]] + at.weights[1] * points[t[1]] + at.weights[2] * points[t[2]];
}

}  // namespace semblance
