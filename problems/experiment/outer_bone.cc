// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/outer_bone.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "surfaces/base/parallel.h"

namespace semblance::problems {
namespace {

// Samples of the observed bone. Each stands for the same area.
std::vector<BoneSample> SampleBone(const TriMesh& skull, std::span<const BoneOrigin> origin,
                                   double area_mm2) {
  std::vector<BoneSample> samples;
  double due = area_mm2 / 2;  // area until the next sample
  for (std::size_t t = 0; t < skull.triangles.size(); ++t) {
    if (!origin.empty() && origin[t] != BoneOrigin::kObserved) {
      continue;
    }
    const Vec3 vector = TriangleAreaVector(skull, skull.triangles[t]);
    const double area = vector.norm();
    due -= std::isfinite(area) ? area : 0;
    while (due < 0) {
      samples.push_back({TriangleCentroid(skull, skull.triangles[t]), vector / area});
      due += area_mm2;
    }
  }
  return samples;
}

std::vector<bool> BorderVertices(const TriMesh& mesh) {
  std::vector<bool> border(mesh.points.size(), false);
  for (const MeshEdge& edge : BorderEdges(mesh)) {
    border[edge[0]] = border[edge[1]] = true;
  }
  return border;
}

// Measures one sample. It stays NaN beyond the border of the face.
void Measure(const MeshQuery& query, const Tessellation& face, const std::vector<bool>& border,
             BoneSample& sample) {
  constexpr double kOnEdge = 1e-9;  // weight of a corner
  const MeshPoint at = query.Closest(sample.position);
  const Triangle& triangle = face.mesh.triangles[at.triangle];
  bool beyond = true;
  Vec3 normal = Vec3::Zero();
  sample.face_uv.setZero();
  for (int k = 0; k < 3; ++k) {
    beyond = beyond && (at.weights[k] < kOnEdge || border[triangle[k]]);
    normal += at.weights[k] * face.normals[triangle[k]];
    sample.face_uv += at.weights[k] * face.uv[triangle[k]];
  }
  sample.outside_mm =
      beyond ? kNaN : std::copysign(at.distance_mm, normal.dot(sample.position - at.position));
}

}  // namespace

std::vector<BoneSample> SampleOuterBone(const TriMesh& skull, std::span<const BoneOrigin> origin,
                                        const TriMesh& shell, const MeshQuery& query,
                                        double area_mm2, const RunContext& context) {
  constexpr double kShell_mm = 3, kLeastCosine = 0.3;
  const std::vector<BoneSample> samples = SampleBone(skull, origin, area_mm2);
  std::vector<std::uint8_t> is_outer(samples.size());  // bytes: threads may write neighbours
  ParallelFor(samples.size(), context.threads, 256, [&](std::size_t n) {
    const MeshPoint at = query.Closest(samples[n].position);
    const Vec3 out = TriangleAreaVector(shell, shell.triangles[at.triangle]);
    const bool faces_alike = out.dot(samples[n].normal) > kLeastCosine * out.norm();
    is_outer[n] = at.distance_mm <= kShell_mm && faces_alike ? 1 : 0;
  });
  std::vector<BoneSample> outer;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    if (is_outer[n] != 0) {
      outer.push_back(samples[n]);
    }
  }
  return outer;
}

void MeasureOutside(const Tessellation& face, std::vector<BoneSample>& samples,
                    const RunContext& context) {
  const MeshQuery query(face.mesh);
  const std::vector<bool> border = BorderVertices(face.mesh);
  ParallelFor(samples.size(), context.threads, 256,
              [&](std::size_t n) { Measure(query, face, border, samples[n]); });
}

}  // namespace semblance::problems
