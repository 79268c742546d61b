// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/scene_blobs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/output/manifest.h"
#include "problems/report/report.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

// Little-endian, as browsers' typed arrays are.
template <class T>
void Append(std::string& bytes, T value) {
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    bytes += static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * k)) & 0xFF);
  }
}

Json PointsJson(std::span<const Vec3> points) {
  constexpr double kMost = 65535;
  Box3 box;
  for (const Vec3& point : points) {
    box.extend(point);
  }
  const Vec3 low = points.empty() ? Vec3::Zero() : box.min();
  const double extent = points.empty() ? 0 : box.sizes().maxCoeff();
  const double step = extent > 0 ? extent / kMost : 1;
  std::string bytes;
  for (const Vec3& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      Append(bytes, static_cast<std::uint16_t>(std::lround((point[axis] - low[axis]) / step)));
    }
  }
  return {{"low", {low.x(), low.y(), low.z()}}, {"step", step}, {"points", Base64(bytes)}};
}

template <class Tuple>
std::string Indices(std::span<const Tuple> tuples, std::size_t points) {
  std::string bytes;
  for (const Tuple& tuple : tuples) {
    for (const std::int32_t index : tuple) {
      if (points <= 65536) {
        Append(bytes, static_cast<std::uint16_t>(index));
      } else {
        Append(bytes, static_cast<std::uint32_t>(index));
      }
    }
  }
  return Base64(bytes);
}

}  // namespace

std::string SceneBlobs::Add(const Json& blob) {
  std::string name = Sha256OfText(blob.dump()).substr(0, 16);
  blobs_[name] = blob;
  return name;
}

std::string SceneBlobs::AddMesh(const TriMesh& mesh) {
  Json blob = PointsJson(mesh.points);
  blob["triangles"] = Indices(std::span<const Triangle>(mesh.triangles), mesh.points.size());
  return Add(blob);
}

std::string SceneBlobs::AddLines(std::span<const Vec3> points, std::span<const Segment> segments) {
  Json blob = PointsJson(points);
  blob["segments"] = Indices(segments, points.size());
  return Add(blob);
}

std::string SceneBlobs::AddValues(std::span<const double> values_mm) {
  constexpr int kNone = std::numeric_limits<std::int16_t>::min(), kMost = 32000;
  std::string bytes;
  for (const double value : values_mm) {
    const double hundredths = std::clamp(100 * value, -1.0 * kMost, 1.0 * kMost);
    Append(bytes, static_cast<std::int16_t>(std::isfinite(value) ? std::lround(hundredths)
                                                                 : static_cast<long>(kNone)));
  }
  return Add({{"values", Base64(bytes)}});
}

}  // namespace semblance
