// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/placement.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance::fitting {
namespace {

// Weighted means of both point sets, and second moments about the means.
struct Moments {
  Vec3 mean_template = Vec3::Zero();
  Vec3 mean_subject = Vec3::Zero();
  double spread_template = 0;  // mean squared distance from the mean, mm^2
  double spread_subject = 0;
  Mat3 cross = Mat3::Zero();  // mean of subject * template^T, mm^2
};

[[noreturn]] void FailPlacement(const std::string& what) { throw InputError("placement: " + what); }

void CheckSizes(std::size_t on_template, std::size_t on_subject, std::size_t weights) {
  if (on_template != on_subject || (weights != 0 && weights != on_template)) {
    FailPlacement(
        fmt::format("{} points on the template, {} on the subject and {} weights; give as many of "
                    "each",
                    on_template, on_subject, weights));
  }
  if (on_template == 0) {
    FailPlacement("no point; give at least one that the template and the subject share");
  }
}

void CheckValues(std::span<const Vec3> on_template, std::span<const Vec3> on_subject,
                 std::span<const double> weights) {
  for (std::size_t i = 0; i < on_template.size(); ++i) {
    if (!on_template[i].allFinite() || !on_subject[i].allFinite()) {
      FailPlacement(
          fmt::format("point {} is not finite on the template or the subject; leave it out", i));
    }
    if (!weights.empty() && !(std::isfinite(weights[i]) && weights[i] > 0)) {
      FailPlacement(fmt::format("weight {} of point {} is not a positive number", weights[i], i));
    }
  }
}

Moments MakeMoments(std::span<const Vec3> on_template, std::span<const Vec3> on_subject,
                    std::span<const double> weights) {
  std::vector<double> w(on_template.size(), 1);
  if (!weights.empty()) {
    w.assign(weights.begin(), weights.end());
  }
  double sum = 0;
  Moments m;
  for (std::size_t i = 0; i < w.size(); ++i) {
    sum += w[i];
    m.mean_template += w[i] * on_template[i];
    m.mean_subject += w[i] * on_subject[i];
  }
  m.mean_template /= sum;
  m.mean_subject /= sum;
  for (std::size_t i = 0; i < w.size(); ++i) {
    const Vec3 a = on_template[i] - m.mean_template, b = on_subject[i] - m.mean_subject;
    m.spread_template += w[i] / sum * a.squaredNorm();
    m.spread_subject += w[i] / sum * b.squaredNorm();
    m.cross += w[i] / sum * b * a.transpose();
  }
  return m;
}

// The best rotation. It is determined if both sets span at least a plane; then the cross moments
// have rank >= 2.
Mat3 BestRotation(const Moments& m) {
  const Eigen::JacobiSVD<Mat3> svd(m.cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double size = std::sqrt(m.spread_template * m.spread_subject);
  if (!(svd.singularValues()[1] > 1e-9 * size)) {
    FailPlacement(
        "the shared points lie on a line (or are fewer than 3), which leaves the rotation open; "
        "add a point beside it or set rotate: false");
  }
  Vec3 sign = Vec3::Ones();
  sign[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

// Umeyama's scale for a given rotation: trace(R^T cross) / spread of the template.
double BestScale(const Moments& m, const Mat3& rotation) {
  const double numerator = (rotation.transpose() * m.cross).trace();
  const double scale = m.spread_template > 0 ? numerator / m.spread_template : kNaN;
  if (!(std::isfinite(scale) && scale > 0)) {
    FailPlacement(
        "the shared points give no positive scale (all at one place, or swapped on the subject); "
        "check their labels or set scale: false");
  }
  return scale;
}

}  // namespace

Similarity PlaceTemplate(std::span<const Vec3> on_template, std::span<const Vec3> on_subject,
                         std::span<const double> weights, const PlacementOptions& options) {
  CheckSizes(on_template.size(), on_subject.size(), weights.size());
  CheckValues(on_template, on_subject, weights);
  const Moments m = MakeMoments(on_template, on_subject, weights);
  Similarity subject_from_template;
  if (options.rotate) {
    subject_from_template.rotation = BestRotation(m);
  }
  if (options.scale) {
    subject_from_template.scale = BestScale(m, subject_from_template.rotation);
  }
  subject_from_template.translation =
      m.mean_subject -
      subject_from_template.scale * (subject_from_template.rotation * m.mean_template);
  return subject_from_template;
}

HSplineSurface Transformed(const HSplineSurface& surface, const Similarity& to_from) {
  ControlNet net = surface.Net(0);
  for (Vec3& vertex : net.vertices) {
    vertex = to_from * vertex;
  }
  const bool world = surface.shape().reference == OffsetReference::kWorld;
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const auto& [vertex, offset] : surface.Offsets()) {
    offsets[vertex] = to_from.scale * (world ? Vec3(to_from.rotation * offset) : offset);
  }
  HSplineSurface result(surface.shape(), std::move(net));
  result.SetOffsets(offsets);
  return result;
}

}  // namespace semblance::fitting
