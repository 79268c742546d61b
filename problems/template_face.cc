// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/template_face.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "problems/head_formula.h"
#include "problems/template_sites.h"
#include "surfaces/error.h"

namespace semblance {
namespace {

// ---------------------------------------------------------------------------------------------
// Least squares of one level
// ---------------------------------------------------------------------------------------------

constexpr int kSamplesPerPatch = 6;

using Matrix = Eigen::MatrixXd;

// The four uniform cubic B-splines over a patch, t in [0,1] along it.
std::array<double, 4> CubicWeights(double t) {
  const double s = 1 - t;
  return {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6,
          t * t * t / 6};
}

double SampleAt(int sample, int patches) {
  return static_cast<double>(sample) / (kSamplesPerPatch * patches);
}

// Row s: the weights of the patches + 3 vertices of a line at its sample s.
Matrix Collocation(int patches) {
  const int samples = kSamplesPerPatch * patches + 1;
  Matrix rows = Matrix::Zero(samples, patches + 3);
  for (int s = 0; s < samples; ++s) {
    const int patch = std::min(s / kSamplesPerPatch, patches - 1);
    const auto weights =
        CubicWeights(static_cast<double>(s - patch * kSamplesPerPatch) / kSamplesPerPatch);
    for (int k = 0; k < 4; ++k) {
      rows(s, patch + k) = weights[k];
    }
  }
  return rows;
}

// (A^T A)^-1 A^T: from the samples of a line to its vertices.
Matrix LeastSquares(int patches) {
  const Matrix a = Collocation(patches);
  return (a.transpose() * a).ldlt().solve(a.transpose());
}

// The plain B-spline of patches_u x patches_v patches that is closest to the formula over a grid of
// samples. On such a grid the least squares of the surface is that of its columns, then its rows.
ControlNet FitFormula(int patches_u, int patches_v) {
  const Matrix along_u = LeastSquares(patches_u), along_v = LeastSquares(patches_v);
  ControlNet net;
  net.columns = patches_u + 3;
  net.rows = patches_v + 3;
  net.vertices.assign(static_cast<std::size_t>(net.columns) * net.rows, Vec3::Zero());
  std::array<Matrix, 3> samples;
  samples.fill(Matrix(along_u.cols(), along_v.cols()));
  for (int j = 0; j < along_v.cols(); ++j) {
    for (int i = 0; i < along_u.cols(); ++i) {
      const Vec3 p = HeadPoint(SampleAt(i, patches_u), SampleAt(j, patches_v));
      for (int axis = 0; axis < 3; ++axis) {
        samples[axis](i, j) = p[axis];
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    const Matrix vertices = along_u * samples[axis] * along_v.transpose();
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        net.At(i, j)[axis] = vertices(i, j);
      }
    }
  }
  return net;
}

// Makes the net its own mirror image, so that rounding does not tell the sides apart.
void MakeSymmetric(ControlNet& net) {
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; 2 * i < net.columns; ++i) {
      Vec3& right = net.At(i, j);
      Vec3& left = net.At(net.columns - 1 - i, j);
      const Vec3 mirrored(-right.x(), right.y(), right.z());
      left = (left + mirrored) / 2;
      right = Vec3(-left.x(), left.y(), left.z());
    }
  }
}

// ---------------------------------------------------------------------------------------------
// The surface and its features
// ---------------------------------------------------------------------------------------------

// Moves to the level's own least-squares fit each vertex that this moves by more than the
// tolerance.
void AddDetail(HSplineSurface& surface, int level, double tolerance_mm) {
  const HSplineShape& shape = surface.Shape();
  ControlNet target = FitFormula(shape.patches_u << level, shape.patches_v << level);
  MakeSymmetric(target);
  ControlNet net = surface.Net(level);
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    if ((target.vertices[k] - net.vertices[k]).norm() > tolerance_mm) {
      net.vertices[k] = target.vertices[k];
    }
  }
  surface.SetNet(level, net);
}

struct FeatureRegion {
  const char* name;
  Sphere region;
};

const FeatureRegion kRegions[] = {
    {"nose", {{0, -6, -36}, 26}},
    {"mouth", {{0, -4, -74}, 27}},
    {"eye_l", {{31.5, 14, -3}, 19}},
    {"eye_r", {{-31.5, 14, -3}, 19}},
};

// The vertices of levels >= 1 whose own (u,v) lies on the surface inside the region.
std::vector<VertexId> VerticesInside(const HSplineSurface& surface, const Sphere& region) {
  const HSplineShape& shape = surface.Shape();
  std::vector<VertexId> inside;
  for (int level = 1; level <= shape.max_level; ++level) {
    const int patches_u = shape.patches_u << level, patches_v = shape.patches_v << level;
    for (int j = 1; j <= patches_v + 1; ++j) {
      for (int i = 1; i <= patches_u + 1; ++i) {
        const Vec2 uv((i - 1.0) / patches_u, (j - 1.0) / patches_v);
        if (region.Contains(surface.Point(uv))) {
          inside.push_back({level, i, j});
        }
      }
    }
  }
  std::sort(inside.begin(), inside.end());
  return inside;
}

void CheckOptions(const TemplateOptions& o) {
  const auto check = [](const char* name, double value, double least, double most) {
    if (!(value >= least && value <= most)) {
      throw InputError(fmt::format("template: {} is {}; it must lie in [{}, {}]", name, value,
                                   least, most));
    }
  };
  check("patches_u", o.patches_u, 4, 32);
  check("patches_v", o.patches_v, 4, 32);
  check("max_level", o.max_level, 0, 5);
  check("detail_tolerance_mm", o.detail_tolerance_mm, 0, 10);
}

}  // namespace

TemplateFace MakeTemplateFace(const TemplateOptions& options) {
  CheckOptions(options);
  ControlNet coarse = FitFormula(options.patches_u, options.patches_v);
  MakeSymmetric(coarse);
  HSplineSurface surface(
      {.patches_u = options.patches_u, .patches_v = options.patches_v, .max_level = options.max_level},
      coarse);
  for (int level = 1; level <= options.max_level; ++level) {
    AddDetail(surface, level, options.detail_tolerance_mm);
  }
  TemplateFace face{.surface = std::move(surface), .site_uv = TemplateSites(), .features = {}};
  for (const FeatureRegion& f : kRegions) {
    face.features.push_back({f.name, VerticesInside(face.surface, f.region), f.region});
  }
  return face;
}

std::vector<Sphere> TemplateMasks(const TemplateFace& face) {
  std::vector<Sphere> masks;
  for (const Feature& feature : face.features) {
    if (feature.region) {
      masks.push_back(*feature.region);
    }
  }
  return masks;
}

Sphere Placed(const Similarity& face_from_template, const Sphere& sphere) {
  return {face_from_template * sphere.center, face_from_template.scale * sphere.radius_mm};
}

TemplateResidual ResidualToFormula(const HSplineSurface& surface, int samples_u, int samples_v) {
  TemplateResidual residual{.rms_mm = 0, .max_mm = -1};
  for (int j = 0; j < samples_v; ++j) {
    for (int i = 0; i < samples_u; ++i) {
      const Vec2 uv(i / (samples_u - 1.0), j / (samples_v - 1.0));
      const double d = (surface.Point(uv) - HeadPoint(uv.x(), uv.y())).norm();
      residual.rms_mm += d * d;
      if (d > residual.max_mm) {
        residual.max_mm = d;
        residual.worst_uv = uv;
      }
    }
  }
  residual.rms_mm = std::sqrt(residual.rms_mm / (static_cast<double>(samples_u) * samples_v));
  return residual;
}

}  // namespace semblance
