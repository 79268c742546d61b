// SPDX-License-Identifier: GPL-3.0-or-later
// The hierarchical B-spline surface (Forsey & Bartels 1988; thesis ch. 4): bicubic, uniform, with
// dyadic levels; detail is kept as offsets from the next coarser surface.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "surfaces/hspline/hspline_shape.h"
#include "surfaces/hspline/sparse_net.h"

namespace semblance {

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

// Stores the vertices of level 0 and the offsets of edited ones. From them it computes, at each
// change, the vertices of the patches that the offsets reach, and no others: memory grows with the
// edits, not with 4^level. Const calls may run at the same time.
class HSplineSurface {
 public:
  // level0: Columns(0) x Rows(0) finite vertices, else InputError.
  HSplineSurface(const HSplineShape& shape, const ControlNet& level0);

  const HSplineShape& shape() const { return shape_; }
  int Columns(int level) const { return shape_.Columns(level); }
  int Rows(int level) const { return shape_.Rows(level); }
  Vec2 ParameterOf(const VertexId& vertex) const { return semblance::ParameterOf(shape_, vertex); }
  Stencil StencilAt(int level, const Vec2& uv, DerivativeOrder order = {}) const {
    return semblance::StencilAt(shape_, level, uv, order);
  }

  // The finest surface; all levels' detail included. (u,v) lies in the finest patch that an offset
  // reaches; the patch's own level is evaluated. uv: as in PatchPointAt; InputError if not finite.
  Vec3 Point(const Vec2& uv) const { return Derivative(uv, {}); }
  Vec3 Derivative(const Vec2& uv, DerivativeOrder order) const {
    return LevelDerivative(shape_.max_level, uv, order);
  }
  SecondDerivatives Second(const Vec2& uv) const;
  SurfaceFrame Frame(const Vec2& uv) const { return LevelFrame(shape_.max_level, uv); }
  Vec3 Normal(const Vec2& uv) const { return Frame(uv).Normal(); }  // unit; zero where degenerate

  // The surface with the detail of levels 0..level alone.
  Vec3 LevelDerivative(int level, const Vec2& uv, DerivativeOrder order = {}) const;
  SurfaceFrame LevelFrame(int level, const Vec2& uv) const;

  // The absolute control vertices of one level; a plain B-spline that holds the detail of levels
  // 0..level. All of them, made anew: time and memory grow with 4^level.
  ControlNet Net(int level) const;

  // Those of one patch alone, [a + 4 b] with a along u; the same bytes. The patch must be there.
  std::array<Vec3, 16> PatchVertices(const PatchId& patch) const;

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
  // level again). Sets all or, if one cannot be set (no such vertex, not finite, no frame:
  // InputError), none. One call for many vertices is much faster than many calls: each makes the
  // stored vertices anew, from the coarsest level that it changes.
  void SetOffsets(const std::map<VertexId, std::optional<Vec3>>& offsets);

  std::size_t Bytes() const;  // of memory held; a node of the offsets counts 96

 private:
  struct Level {
    RowTable reached;  // patches
    SparseNet net;     // vertices of the needed patches (patch_layout.h)
  };

  // The four columns of a patch's vertices, each four in a row; null where they are not stored.
  using Columns4 = std::array<const Vec3*, 4>;

  PatchPoint FinestPatch(int level, const Vec2& uv) const;
  Columns4 StoredColumns(const PatchId& patch) const;
  std::map<VertexId, Vec3> OffsetsThatGive(int level, const ControlNet& net) const;
  void RebuildFrom(int level);

  HSplineShape shape_;
  std::map<VertexId, Vec3> offsets_;  // the truth, with level 0
  std::vector<Level> levels_;         // those above 0 follow from offsets_
};

}  // namespace semblance
