// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/report/view/view_mesh.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "problems/io/manifest.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
TriMesh SimplifyForView(const TriMesh& mesh, int most_triangles) {
  const auto most = static_cast<std::size_t>(most_triangles);
  if (mesh.triangles.size() <= most) {
    return mesh;
  }
  // meshoptimizer takes floats, so the coordinates count from the mesh, not from a map's origin.
  const Vec3 origin = Bounds(mesh).min();
  std::vector<Eigen::Vector3f> points;
  points.reserve(mesh.points.size());
  for (const Vec3& point : mesh.points) {
    points.emplace_back((point - origin).cast<float>());
  }
  std::vector<unsigned> from;
  from.reserve(3 * mesh.triangles.size());
  for (const Triangle& triangle : mesh.triangles) {
    from.insert(from.end(), triangle.begin(), triangle.end());
  }
  constexpr float kAnyError = 1;  // of the extent: the number of triangles is the only limit
  constexpr std::size_t kFewTimes = 2;
  const float* const coordinates = points.front().data();
  std::vector<unsigned> corners(from.size());
  std::size_t kept = meshopt_simplify(corners.data(), from.data(), from.size(), coordinates,
                                      points.size(), sizeof(points.front()), 3 * most, kAnyError);
  if (kept > kFewTimes * 3 * most) {  // a mesh of many small pieces, none of which it gives up
    kept = meshopt_simplifySloppy(corners.data(), from.data(), from.size(), coordinates,
                                  points.size(), sizeof(points.front()), 3 * most, kAnyError);
  }
  TriMesh simple = {.points = mesh.points, .triangles = {}};
  for (std::size_t k = 0; k < kept; k += 3) {
    const auto corner = [&](std::size_t i) { return static_cast<std::int32_t>(corners[k + i]); };
    simple.triangles.push_back({corner(0), corner(1), corner(2)});
  }
  DropUnusedPoints(simple);
  return simple;
}

// ---------------------------------------------------------------------------------------------
// Geometry as text
// ---------------------------------------------------------------------------------------------

namespace {

using Json = nlohmann::ordered_json;

// Appends a number in little-endian order, the order of typed arrays in browsers.
template <class T>
void Append(std::string& bytes, T value) {
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    bytes += static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * k)) & 0xFF);
  }
}

Json PointsJson(std::span<const Vec3> points) {
  constexpr double kLargest = 65535;  // uint16
  Box3 box;
  for (const Vec3& point : points) {
    box.extend(point);
  }
  const Vec3 low = points.empty() ? Vec3::Zero() : box.min();
  const double extent = points.empty() ? 0 : box.sizes().maxCoeff();
  const double step = extent > 0 ? extent / kLargest : 1;
  std::string bytes;
  for (const Vec3& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      Append(bytes, static_cast<std::uint16_t>(std::lround((point[axis] - low[axis]) / step)));
    }
  }
  return {{"low", {low.x(), low.y(), low.z()}}, {"step", step}, {"points", Base64(bytes)}};
}

// 16-bit indices where they suffice, else 32-bit ones.
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

// Decodes unsigned numbers of `width` bytes each.
std::vector<std::uint32_t> ReadBlobNumbers(const std::string& base64, std::size_t width) {
  const std::string bytes = FromBase64(base64);
  std::vector<std::uint32_t> numbers(bytes.size() / width, 0);
  for (std::size_t k = 0; k < numbers.size() * width; ++k) {
    numbers[k / width] |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[k]))
                          << (8 * (k % width));
  }
  return numbers;
}

}  // namespace

std::string SceneBlobs::Add(Json blob) {
  std::string name = Sha256OfText(blob.dump()).substr(0, 16);
  blobs_[name] = std::move(blob);
  return name;
}

std::string SceneBlobs::AddMesh(const TriMesh& mesh) { return Add(EncodeMeshBlob(mesh)); }

std::string SceneBlobs::AddLines(std::span<const Vec3> points, std::span<const Segment> segments) {
  Json blob = PointsJson(points);
  blob["segments"] = Indices(segments, points.size());
  return Add(std::move(blob));
}

std::string SceneBlobs::AddValues(std::span<const double> values_mm) {
  constexpr int kNoValue = std::numeric_limits<std::int16_t>::min(), kLargest = 32000;
  std::string bytes;
  for (const double value : values_mm) {
    const double hundredths = std::clamp(100 * value, -1.0 * kLargest, 1.0 * kLargest);
    Append(bytes, static_cast<std::int16_t>(std::isfinite(value) ? std::lround(hundredths)
                                                                 : static_cast<long>(kNoValue)));
  }
  return Add({{"values", Base64(bytes)}});
}

Json EncodeMeshBlob(const TriMesh& mesh) {
  Json blob = PointsJson(mesh.points);
  blob["triangles"] = Indices(std::span<const Triangle>(mesh.triangles), mesh.points.size());
  return blob;
}

TriMesh DecodeMeshBlob(const Json& blob) {
  const auto numbers = ReadBlobNumbers(blob.at("points").get<std::string>(), 2);
  const double step = blob.at("step").get<double>();
  TriMesh mesh;
  mesh.points.assign(numbers.size() / 3, Vec3::Zero());
  for (std::size_t k = 0; k < 3 * mesh.points.size(); ++k) {
    const auto axis = static_cast<int>(k % 3);
    mesh.points[k / 3][axis] = blob.at("low").at(k % 3).get<double>() + step * numbers[k];
  }
  const bool narrow = mesh.points.size() <= 65536;
  const auto corners = ReadBlobNumbers(blob.at("triangles").get<std::string>(), narrow ? 2 : 4);
  mesh.triangles.resize(corners.size() / 3);
  for (std::size_t k = 0; k < 3 * mesh.triangles.size(); ++k) {
    if (corners[k] >= mesh.points.size()) {
      throw InputError(
          fmt::format("a triangle names point {} of {}", corners[k], mesh.points.size()));
    }
    mesh.triangles[k / 3][k % 3] = static_cast<std::int32_t>(corners[k]);
  }
  return mesh;
}

}  // namespace semblance::problems
