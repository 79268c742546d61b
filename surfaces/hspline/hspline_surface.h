// SPDX-License-Identifier: GPL-3.0-or-later
// The hierarchical B-spline surface (Forsey & Bartels 1988; thesis ch. 4). It is bicubic and
// uniform, and each level halves the patches of the level before. A vertex x of level L >= 1 is
// stored as an offset o from the surface of level L - 1 (thesis 4.1):
//   x = r + F o,
// where r is that surface's point at the vertex's Greville point (u,v), and the columns of F are
// its unit u-tangent, normal x u-tangent, and normal there. Hence detail moves and turns with the
// coarser surface. Only edited vertices have an offset. All others follow from the coarser level by
// knot insertion.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "surfaces/hspline/hspline_shape.h"
#include "surfaces/hspline/sparse_net.h"

namespace semblance::surfaces {

struct SurfaceFrame {
  Vec3 point = Vec3::Constant(kNaN);
  Vec3 du = Vec3::Constant(kNaN);  // dS/du, mm, u in [0,1]
  Vec3 dv = Vec3::Constant(kNaN);
  Mat3 axes = Mat3::Zero();  // unit u-tangent, normal x u-tangent, unit normal (du x dv); zero if
                             // not regular
  bool regular = false;      // the tangents span a plane

  Vec3 Normal() const { return axes.col(2); }
  double Jacobian() const { return du.cross(dv).norm(); }  // mm^2 of surface per unit of (u,v)
};

struct SecondDerivatives {  // mm, for u and v in [0,1]
  Vec3 duu = Vec3::Constant(kNaN);
  Vec3 duv = Vec3::Constant(kNaN);
  Vec3 dvv = Vec3::Constant(kNaN);
};

// Stores the vertices of level 0 and the offsets of edited vertices. After each change it computes
// the vertices of the patches that the offsets influence, and no others, so that memory grows with
// the edits and not with 4^level. Const calls may run concurrently.
class HSplineSurface {
 public:
  // level0: Columns(0) x Rows(0) finite vertices; throws InputError for anything else.
  HSplineSurface(const HSplineShape& shape, const ControlNet& level0);

  const HSplineShape& shape() const { return shape_; }
  int Columns(int level) const { return shape_.Columns(level); }
  int Rows(int level) const { return shape_.Rows(level); }
  Vec2 GrevillePoint(const VertexId& vertex) const {
    return surfaces::GrevillePoint(shape_, vertex);
  }
  Stencil StencilAt(int level, const Vec2& uv, DerivativeOrder order = {}) const {
    return surfaces::StencilAt(shape_, level, uv, order);
  }

  // The finest surface, with the detail of all levels. Evaluates the finest patch at uv that an
  // offset influences, on that patch's own level. uv as in PatchPointAt; throws InputError if uv is
  // not finite.
  Vec3 Point(const Vec2& uv) const { return Derivative(uv, {}); }
  Vec3 Derivative(const Vec2& uv, DerivativeOrder order) const {
    return LevelDerivative(shape_.max_level, uv, order);
  }
  SecondDerivatives Second(const Vec2& uv) const;
  SurfaceFrame Frame(const Vec2& uv) const { return LevelFrame(shape_.max_level, uv); }
  Vec3 Normal(const Vec2& uv) const { return Frame(uv).Normal(); }  // unit; zero if not regular

  // The surface with the detail of levels 0..level only.
  Vec3 LevelDerivative(int level, const Vec2& uv, DerivativeOrder order = {}) const;
  SurfaceFrame LevelFrame(int level, const Vec2& uv) const;

  // Computes all control vertices of one level: the plain B-spline that has the detail of levels
  // 0..level. Time and memory grow with 4^level.
  ControlNet Net(int level) const;

  // The sixteen vertices of one existing patch, in the order [a + 4 b] with a along u. They have
  // the same bytes as in Net.
  std::array<Vec3, 16> PatchVertices(const PatchId& patch) const;

  // Makes Net(level) equal to `net`. Vertices with unchanged bits keep their state. The others
  // become edits, stored as positions (level 0) or offsets. Finer levels keep their offsets, so
  // that detail moves along. Coarser levels do not change. Throws InputError, and leaves the
  // surface unchanged, for a net of the wrong size, a vertex that is not finite, or a frame that is
  // not regular where an offset is needed.
  void SetNet(int level, const ControlNet& net);

  // The offsets o of x = r + F o by edited vertex (level >= 1), in mm. With OffsetReference::kWorld
  // F is the identity.
  const std::map<VertexId, Vec3>& Offsets() const { return offsets_; }
  std::map<VertexId, Vec3> Offsets(int level) const;  // of one level
  std::optional<Vec3> Offset(const VertexId& vertex) const;
  // Sets offsets, or removes them (nullopt); a vertex without an offset follows the coarser level.
  // Throws InputError, and changes nothing, if one of them cannot be set (no such vertex, offset
  // not finite, frame not regular). One call for many vertices is much faster than many calls,
  // because each call recomputes the stored vertices from the coarsest level that changes.
  void SetOffsets(const std::map<VertexId, std::optional<Vec3>>& offsets);

  std::size_t Bytes() const;  // memory in use

 private:
  struct Level {
    RowTable influenced;  // patches that an offset of this level changes
    SparseNet net;        // vertices of the needed patches (LevelLayout)
  };

  // The four columns of a patch's vertices, four contiguous vertices each; null if not stored.
  using Columns4 = std::array<const Vec3*, 4>;

  PatchPoint FinestPatch(int level, const Vec2& uv) const;
  Columns4 StoredColumns(const PatchId& patch) const;
  std::map<VertexId, Vec3> OffsetsForNet(int level, const ControlNet& net) const;
  void RebuildFrom(int level);

  HSplineShape shape_;
  std::map<VertexId, Vec3> offsets_;  // with level 0, all that defines the surface
  std::vector<Level> levels_;         // levels above 0 follow from offsets_
};

// The principal curvatures at a point, in 1/mm. A curvature is positive where the surface bends
// towards its normal (du x dv); a ball with outward normals has principal curvatures -1 / radius.
struct SurfaceCurvature {
  double largest_per_mm = kNaN;
  double smallest_per_mm = kNaN;
  Vec3 largest_direction = Vec3::Constant(kNaN);   // unit tangents, perpendicular; together with
  Vec3 smallest_direction = Vec3::Constant(kNaN);  // the normal they are right-handed

  double MeanPerMm() const { return (largest_per_mm + smallest_per_mm) / 2; }
  double GaussianPerMm2() const { return largest_per_mm * smallest_per_mm; }
};

// Computes the curvatures at uv (as in PatchPointAt) from the first and second fundamental forms.
// Empty if the frame is not regular. Throws InputError for a (u,v) that is not finite.
std::optional<SurfaceCurvature> CurvatureAt(const HSplineSurface& surface, const Vec2& uv);

}  // namespace semblance::surfaces
