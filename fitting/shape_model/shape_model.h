// SPDX-License-Identifier: GPL-3.0-or-later
// A statistical model of a shape: a mean mesh, and the modes in which the shapes of a population
// differ from it (Cootes et al. 1995; Blanz & Vetter 1999).
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct ShapeModel {
  TriMesh mean;           // n points, mm, outward
  Eigen::MatrixXd modes;  // 3n x k, mm at coefficient 1: rows 3v, 3v+1, 3v+2 are x, y, z of point v

  Eigen::Index Modes() const { return modes.cols(); }
};

// A point on the model's mesh: the weighted sum of the corners of a triangle.
struct ModelPoint {
  int triangle = -1;
  Vec3 weights = Vec3::Constant(kNaN);  // sum 1
};

// name: of the model, for messages. Throws InputError in one line that starts with `name`: no
// triangle or no mode, a number of rows that is not three times that of the points, a corner that
// is no point, or a value that is not finite.
void CheckShapeModel(const ShapeModel& model, std::string_view name);

// The points of the shape with these coefficients, which are independent N(0,1) over the
// population: mean + modes * coefficients. Throws InputError if they are not one per mode.
std::vector<Vec3> ShapeAt(const ShapeModel& model, const Eigen::VectorXd& coefficients);

// The place of a model point on a shape. points: one per point of the mean.
Vec3 PositionOf(const ModelPoint& at, const TriMesh& mean, const std::vector<Vec3>& points);

}  // namespace semblance
