// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/plane_section.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace semblance::surfaces {
namespace {

// An edge by its lower and its higher vertex.
using EdgeKey = std::uint64_t;

EdgeKey KeyOf(std::int32_t a, std::int32_t b) {
  return static_cast<EdgeKey>(static_cast<std::uint32_t>(std::min(a, b))) << 32 |
         static_cast<std::uint32_t>(std::max(a, b));
}

// The section of one triangle: from the edge where the plane enters it to the edge where it leaves.
struct Segment {
  EdgeKey from = 0, to = 0;
  bool used = false;
};

// Seen from above the plane, with the solid on the left, a section enters a triangle through the
// edge that goes down.
std::vector<Segment> CutTriangles(const TriMesh& mesh, const std::vector<double>& heights_mm) {
  std::vector<Segment> segments;
  for (const Triangle& t : mesh.triangles) {
    Segment segment;
    int crossed = 0;
    for (const int k : {0, 1, 2}) {
      const std::int32_t a = t[k], b = t[(k + 1) % 3];
      const bool a_above = heights_mm[a] >= 0, b_above = heights_mm[b] >= 0;
      if (a_above != b_above) {
        (b_above ? segment.to : segment.from) = KeyOf(a, b);
        ++crossed;
      }
    }
    if (crossed == 2) {
      segments.push_back(segment);
    }
  }
  return segments;
}

class LineJoiner {
 public:
  explicit LineJoiner(std::vector<Segment> segments) : segments_(std::move(segments)) {
    for (std::size_t k = segments_.size(); k-- > 0;) {  // so that the first triangle comes last
      starting_[segments_[k].from].push_back(k);
      ++balance_[segments_[k].from];
      --balance_[segments_[k].to];
    }
  }

  // The edges along each line: open lines from their ends first, then the closed ones.
  std::vector<std::pair<std::vector<EdgeKey>, bool>> Join() {
    std::vector<std::pair<std::vector<EdgeKey>, bool>> lines;
    for (const bool from_ends : {true, false}) {
      for (const Segment& segment : segments_) {
        if (!segment.used && (!from_ends || balance_[segment.from] > 0)) {
          balance_[segment.from] -= from_ends ? 1 : 0;
          lines.push_back(Follow(segment.from));
        }
      }
    }
    return lines;
  }

 private:
  std::pair<std::vector<EdgeKey>, bool> Follow(EdgeKey first) {
    std::vector<EdgeKey> edges = {first};
    while (Segment* const next = Next(edges.back())) {
      next->used = true;
      if (next->to == first) {
        return {std::move(edges), true};
      }
      edges.push_back(next->to);
    }
    return {std::move(edges), false};
  }

  Segment* Next(EdgeKey edge) {
    const auto found = starting_.find(edge);
    if (found == starting_.end()) {
      return nullptr;
    }
    std::vector<std::size_t>& here = found->second;
    while (!here.empty()) {
      Segment& segment = segments_[here.back()];
      here.pop_back();
      if (!segment.used) {
        return &segment;
      }
    }
    return nullptr;
  }

  std::vector<Segment> segments_;
  std::unordered_map<EdgeKey, std::vector<std::size_t>> starting_;
  std::unordered_map<EdgeKey, int> balance_;  // segments that start there minus those that end
};

}  // namespace

std::vector<SectionLine> CutByPlane(const TriMesh& mesh, const PicturePlane& plane) {
  std::vector<double> heights_mm;
  heights_mm.reserve(mesh.points.size());
  for (const Vec3& p : mesh.points) {
    heights_mm.push_back(plane.Height_mm(p));
  }
  const auto point_on = [&](EdgeKey edge) {
    const auto a = static_cast<std::size_t>(edge >> 32), b = static_cast<std::size_t>(edge & ~0u);
    const double share = heights_mm[a] / (heights_mm[a] - heights_mm[b]);
    return plane.InPicture(mesh.points[a] + share * (mesh.points[b] - mesh.points[a]));
  };
  std::vector<SectionLine> lines;
  for (const auto& [edges, closed] : LineJoiner(CutTriangles(mesh, heights_mm)).Join()) {
    SectionLine line{.points = {}, .closed = closed};
    for (const EdgeKey edge : edges) {
      line.points.push_back(point_on(edge));
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

double EnclosedArea(std::span<const SectionLine> lines) {
  double twice_mm2 = 0;
  for (const SectionLine& line : lines) {
    for (std::size_t k = 0; line.closed && k < line.points.size(); ++k) {
      const Vec2& a = line.points[k];
      const Vec2& b = line.points[(k + 1) % line.points.size()];
      twice_mm2 += a.x() * b.y() - a.y() * b.x();
    }
  }
  return twice_mm2 / 2;
}

}  // namespace semblance::surfaces
