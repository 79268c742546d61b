// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/pull.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// In patches. A smaller reach may move no vertex; a larger one moves most of a face.
constexpr double kLeastReach = 1, kMostReach = 8;

// Throws InputError for a place that the face lacks. what: "pull" or "brush".
template <class Edit>
void CheckEditPlace(const Edit& edit, const HSplineSurface& face, const char* what) {
  if (edit.level < 0 || edit.level > face.shape().max_level) {
    throw InputError(fmt::format("{}: the face has no level {}; its levels are 0 to {}", what,
                                 edit.level, face.shape().max_level));
  }
  if (!(edit.reach >= kLeastReach && edit.reach <= kMostReach)) {
    throw InputError(fmt::format("{}: a reach of {} patches; give {} to {}", what, edit.reach,
                                 kLeastReach, kMostReach));
  }
}

void Check(const Pull& pull, const HSplineSurface& face) {
  CheckEditPlace(pull, face, "pull");
  if (!pull.uv.allFinite() || !pull.by_mm.allFinite() || pull.by_mm.norm() > 1000) {
    throw InputError("pull: (u,v) and the way must be finite, and the way at most 1000 mm long");
  }
}

void Check(const Brush& brush, const HSplineSurface& face) {
  CheckEditPlace(brush, face, "brush");
  constexpr double kMostInflation_mm = 20;
  const bool inflates = brush.kind == BrushKind::kInflate;
  const double low = inflates ? -kMostInflation_mm : 0, high = inflates ? kMostInflation_mm : 1;
  if (!brush.uv.allFinite() || !(brush.strength >= low && brush.strength <= high)) {
    throw InputError(fmt::format("brush: a strength of {} at ({}, {}); give {} to {}",
                                 brush.strength, brush.uv.x(), brush.uv.y(), low, high));
  }
}

// The distance of two places in 0..1, the shorter way round if the domain is closed.
double Apart(double a, double b, bool closed) {
  const double straight = std::abs(a - b);
  return closed ? std::min(straight, 1 - straight) : straight;
}

// The share of each vertex of the level in the move of the point at uv, before scaling.
std::vector<double> SharesAround(const HSplineShape& shape, int level, const Vec2& uv,
                                 double reach) {
  std::vector<double> shares(static_cast<std::size_t>(shape.Columns(level)) * shape.Rows(level));
  for (int j = 0; j < shape.Rows(level); ++j) {
    for (int i = 0; i < shape.Columns(level); ++i) {
      const Vec2 at = GrevillePoint(shape, {level, i, j});
      const double du = Apart(at.x(), uv.x(), shape.ClosedU()), dv = at.y() - uv.y();
      const double squared =
          std::pow(du * shape.PatchesU(level), 2) + std::pow(dv * shape.PatchesV(level), 2);
      shares[i + static_cast<std::size_t>(shape.Columns(level)) * j] =
          std::pow(std::max(0.0, 1 - squared / (reach * reach)), 2);
    }
  }
  return shares;
}

double MoveAt(const Stencil& stencil, const std::vector<double>& shares) {
  double sum = 0;
  for (int k = 0; k < 16; ++k) {
    sum += stencil.weight[k] * shares[stencil.index[k]];
  }
  return sum;
}

void MoveBy(const std::vector<double>& shares, const Vec3& by, ControlNet& net) {
  for (std::size_t k = 0; k < shares.size(); ++k) {
    if (shares[k] > 0) {
      net.vertices[k] += shares[k] * by;
    }
  }
}

// Moves both sides by mirrored displacements d. Let m be the movement of a point by the vertices
// around it and o that by the vertices around its mirror image. In the mirror plane both add up: (m
// + o) d = by. Across the plane they oppose each other: (m - o) d = by.
void MoveBothSides(const Pull& pull, const HSplineSurface& face, ControlNet& net) {
  // Near the midline m - o is small, and d would grow without bound. Below this part of m the point
  // does not move sideways at all.
  constexpr double kMidline = 0.5;
  const Vec3 left = FindLeft(face);
  const Vec2 other_uv(1 - pull.uv.x(), pull.uv.y());
  const auto own = SharesAround(face.shape(), pull.level, pull.uv, pull.reach);
  const auto other = SharesAround(face.shape(), pull.level, other_uv, pull.reach);
  const Stencil here = face.StencilAt(pull.level, pull.uv);
  const double m = MoveAt(here, own), o = MoveAt(here, other);
  const Vec3 across = left.dot(pull.by_mm) * left;
  const Vec3 along = (pull.by_mm - across) / (m + o);
  const Vec3 sideways = m - o > kMidline * m ? Vec3(across / (m - o)) : Vec3(Vec3::Zero());
  MoveBy(own, along + sideways, net);
  MoveBy(other, along - sideways, net);
}

// The total moves, by the script and now, of the level-0 vertices that moved now.
std::map<VertexId, std::optional<Vec3>> SumMoves(const ControlNet& before, const ControlNet& after,
                                                 const EditScript& script) {
  std::map<VertexId, std::optional<Vec3>> moves;
  for (int j = 0; j < before.rows; ++j) {
    for (int i = 0; i < before.columns; ++i) {
      if (const Vec3 move = after.At(i, j) - before.At(i, j); move != Vec3::Zero()) {
        moves[{0, i, j}] = move;
      }
    }
  }
  for (const VertexEdit& edit : script.edits) {
    const auto found = moves.find({edit.level, edit.i, edit.j});
    if (found != moves.end() && edit.offset) {
      const auto& had = *edit.offset;
      found->second = Vec3(Vec3(had[0], had[1], had[2]) + *found->second);
    }
  }
  return moves;
}

// The mean of a vertex's neighbours in its net, two or more.
Vec3 MeanOfNeighbours(const ControlNet& net, int i, int j, bool closed_u) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  const auto add = [&](int column, int row) {
    const int wrapped = closed_u ? (column + net.columns) % net.columns : column;
    if (wrapped >= 0 && wrapped < net.columns && row >= 0 && row < net.rows) {
      sum += net.At(wrapped, row);
      ++count;
    }
  };
  add(i - 1, j);
  add(i + 1, j);
  add(i, j - 1);
  add(i, j + 1);
  return sum / count;
}

// The move of a vertex at the centre of the brush by strength 1 (inflate: 1 mm). uv: the centre.
Vec3 BrushMove(const Brush& brush, const HSplineSurface& face, const ControlNet& net, int i, int j,
               const Vec2& uv) {
  const Vec3& vertex = net.At(i, j);
  switch (brush.kind) {
    case BrushKind::kSmooth:
      return MeanOfNeighbours(net, i, j, face.shape().ClosedU()) - vertex;
    case BrushKind::kInflate:
      return face.Normal(GrevillePoint(face.shape(), {brush.level, i, j}));
    case BrushKind::kFlatten: {
      const Vec3 normal = face.Normal(uv);
      const Vec3 under = face.Point(GrevillePoint(face.shape(), {brush.level, i, j}));
      return -(under - face.Point(uv)).dot(normal) * normal;
    }
  }
  return Vec3::Zero();
}

// `script` with the edits that change the net of a level of `face` from `before` to `after`.
EditScript WithNet(const HSplineSurface& face, int level, const ControlNet& before,
                   const ControlNet& after, const EditScript& script) {
  if (level == 0) {
    return WithOffsets(script, SumMoves(before, after, script));
  }
  HSplineSurface changed = face;
  changed.SetNet(level, after);
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (const auto& [vertex, offset] : changed.Offsets(level)) {
    if (face.Offset(vertex) != offset) {
      offsets[vertex] = offset;
    }
  }
  return WithOffsets(script, offsets);
}

}  // namespace

Vec3 FindLeft(const HSplineSurface& face) {
  Vec3 sum = Vec3::Zero();
  for (const double v : {0.2, 0.35, 0.5, 0.65, 0.8}) {
    for (const double u : {0.55, 0.6, 0.65, 0.7, 0.75}) {
      sum += face.Point({u, v}) - face.Point({1 - u, v});
    }
  }
  if (!(sum.norm() > 1e-6)) {
    throw InputError("pull: the face does not distinguish left and right; pull without mirror");
  }
  return sum.normalized();
}

EditScript WithOffsets(EditScript script, const std::map<VertexId, std::optional<Vec3>>& offsets) {
  std::erase_if(script.edits, [&offsets](const VertexEdit& edit) {
    return offsets.contains({edit.level, edit.i, edit.j});
  });
  for (const auto& [vertex, offset] : offsets) {
    script.edits.push_back(MakeEdit(vertex, offset));
  }
  return script;
}

EditScript Pulled(const Pull& pull, const HSplineSurface& face, const EditScript& script) {
  Check(pull, face);
  const ControlNet before = face.Net(pull.level);
  ControlNet after = before;
  if (pull.mirror) {
    MoveBothSides(pull, face, after);
  } else {
    const auto shares = SharesAround(face.shape(), pull.level, pull.uv, pull.reach);
    const double moved = MoveAt(face.StencilAt(pull.level, pull.uv), shares);
    MoveBy(shares, pull.by_mm / moved, after);
  }
  return WithNet(face, pull.level, before, after, script);
}

EditScript Brushed(const Brush& brush, const HSplineSurface& face, const EditScript& script) {
  Check(brush, face);
  const ControlNet before = face.Net(brush.level);
  ControlNet after = before;
  const Vec2 other_uv(1 - brush.uv.x(), brush.uv.y());
  const auto own = SharesAround(face.shape(), brush.level, brush.uv, brush.reach);
  const auto other = SharesAround(face.shape(), brush.level, other_uv, brush.reach);
  for (int j = 0; j < before.rows; ++j) {
    for (int i = 0; i < before.columns; ++i) {
      const std::size_t k = i + static_cast<std::size_t>(before.columns) * j;
      const bool is_other = brush.mirror && other[k] > own[k];
      const double share = is_other ? other[k] : own[k];
      if (share > 0) {
        after.vertices[k] += share * brush.strength *
                             BrushMove(brush, face, before, i, j, is_other ? other_uv : brush.uv);
      }
    }
  }
  return WithNet(face, brush.level, before, after, script);
}

}  // namespace semblance::problems
