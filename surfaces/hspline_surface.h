// SPDX-License-Identifier: GPL-3.0-or-later
// The hierarchical B-spline surface (Forsey & Bartels 1988; thesis ch. 4): bicubic, uniform, dyadic
// levels, detail kept as offsets from the next coarser surface.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "surfaces/control_net.h"

namespace semblance {

enum class Closure { kOpen, kPeriodicU };
constexpr auto EnumNames(Closure) {
  return std::to_array<std::string_view>({"open", "periodic_u"});
}

// In what axes an offset is kept: the frame of the next coarser surface, so that detail turns with
// it, or the world's.
enum class OffsetReference { kFrame, kWorld };
constexpr auto EnumNames(OffsetReference) {
  return std::to_array<std::string_view>({"frame", "world"});
}

// The domain is [0,1] x [0,1]; level L has patches_u 2^L x patches_v 2^L patches.
struct HSplineShape {
  int patches_u = 8;  // of level 0; >= 1 (open), >= 4 (periodic); at most 8192 on the finest level
  int patches_v = 8;  // of level 0; >= 1; likewise
  int max_level = 3;  // finest level that may hold detail; 0..8
  Closure closure = Closure::kOpen;
  OffsetReference reference = OffsetReference::kFrame;

  int PatchesU(int level) const { return patches_u << level; }
  int PatchesV(int level) const { return patches_v << level; }
  int Columns(int level) const { return PatchesU(level) + (closure == Closure::kOpen ? 3 : 0); }
  int Rows(int level) const { return PatchesV(level) + 3; }
  bool operator==(const HSplineShape&) const = default;
};

// A control vertex of one level; (i, j) along u and v.
struct VertexId {
  int level = -1;
  int i = -1;
  int j = -1;
  auto operator<=>(const VertexId&) const = default;
};

struct SurfaceFrame {
  Vec3 point = Vec3::Constant(kNaN);
  Vec3 du = Vec3::Constant(kNaN);  // first derivatives with respect to u and v in [0,1], mm
  Vec3 dv = Vec3::Constant(kNaN);
  Mat3 axes = Mat3::Zero();  // columns: unit u-tangent, normal x u-tangent, unit normal (of du x
                             // dv); zero where not regular
  bool regular = false;      // the tangents do not vanish and are not parallel

  Vec3 Normal() const { return axes.col(2); }
  double Jacobian() const { return du.cross(dv).norm(); }  // mm^2 of surface per unit of u x v
};

struct SecondDerivatives {  // with respect to u and v in [0,1], mm
  Vec3 duu = Vec3::Constant(kNaN);
  Vec3 duv = Vec3::Constant(kNaN);
  Vec3 dvv = Vec3::Constant(kNaN);
};

// Orders of derivation along u and v.
struct DerivativeOrder {
  int u = 0;  // 0, 1 or 2
  int v = 0;
};

// The sixteen vertices of `level` that make the point of the plain B-spline at uv, or its
// derivative with respect to u, v in [0,1]. uv: u is clamped (open) or wrapped (periodic), v is
// clamped to [0,1]. level: 0..shape.max_level. Throws InputError for a level that is not there or a
// (u,v) that is not finite.
Stencil StencilAt(const HSplineShape& shape, int level, const Vec2& uv, DerivativeOrder order = {});

// Where a control vertex has the greatest influence, clamped (open) or wrapped (periodic) into the
// domain.
Vec2 ParameterOf(const HSplineShape& shape, const VertexId& vertex);

// The net of the same surface one level finer (knot insertion at every midpoint).
ControlNet Refine(const HSplineShape& shape, const ControlNet& net, int level);

// Stored are the vertices of level 0 and the offsets of edited ones; the nets of all levels are
// derived at each change, so that const calls may run at the same time.
class HSplineSurface {
 public:
  // level0: Columns(0) x Rows(0) finite vertices, else InputError.
  HSplineSurface(const HSplineShape& shape, ControlNet level0);

  const HSplineShape& shape() const { return shape_; }
  int Columns(int level) const { return shape_.Columns(level); }
  int Rows(int level) const { return shape_.Rows(level); }
  Vec2 ParameterOf(const VertexId& vertex) const { return semblance::ParameterOf(shape_, vertex); }
  Stencil StencilAt(int level, const Vec2& uv, DerivativeOrder order = {}) const {
    return semblance::StencilAt(shape_, level, uv, order);
  }

  // The finest surface; all levels' detail included.
  Vec3 Point(const Vec2& uv) const;
  Vec3 Derivative(const Vec2& uv, DerivativeOrder order) const;
  SecondDerivatives Second(const Vec2& uv) const;
  SurfaceFrame Frame(const Vec2& uv) const;
  Vec3 Normal(const Vec2& uv) const { return Frame(uv).Normal(); }  // unit; zero where degenerate

  // The absolute control vertices of one level; a plain B-spline that holds the detail of levels
  // 0..level.
  const ControlNet& Net(int level) const { return nets_.at(level); }

  // Makes Net(level) equal to `net`. Vertices that do not differ, to the bit, keep their state; the
  // others become edits, kept as absolute positions (level 0) or offsets. Finer levels keep their
  // offsets, so detail rides along; coarser ones do not change. Throws InputError for a net of the
  // wrong size, a vertex that is not finite, or a frame without tangents where an offset must live;
  // the surface is then as before.
  void SetNet(int level, const ControlNet& net);

  // Offsets o of edited vertices, x = r + F o (thesis 4.1), by vertex; level >= 1. r: the next
  // coarser surface at the vertex's (u,v); F: its frame's axes, or the identity with
  // OffsetReference::kWorld. mm.
  const std::map<VertexId, Vec3>& Offsets() const { return offsets_; }
  std::map<VertexId, Vec3> Offsets(int level) const;  // those of one level
  std::optional<Vec3> Offset(const VertexId& vertex) const;
  // Sets the offsets of some vertices, or removes them (nullopt: the vertex follows the coarser
  // level again). All or, where one cannot be set (no such vertex, not finite, no frame:
  // InputError), none. One call for many vertices is much faster than many calls: each rebuilds the
  // nets from the coarsest level that it changes.
  void SetOffsets(const std::map<VertexId, std::optional<Vec3>>& offsets);
  void SetOffset(const VertexId& vertex, const Vec3& offset) { SetOffsets({{vertex, offset}}); }
  void RemoveOffset(const VertexId& vertex) { SetOffsets({{vertex, std::nullopt}}); }

 private:
  std::map<VertexId, Vec3> OffsetsThatGive(int level, const ControlNet& net) const;
  void RebuildFrom(int level);

  HSplineShape shape_;
  std::map<VertexId, Vec3> offsets_;  // the truth, with nets_[0]
  std::vector<ControlNet> nets_;      // one a level; those above 0 follow from offsets_
};

}  // namespace semblance
