// SPDX-License-Identifier: GPL-3.0-or-later
// The terms whose sum a solve minimises. Each term costs `weight * mean squared residual`, in mm^2
// times the weight, so that a weight means the same at every level and for every number of points
// and every subject. f is a displacement field or a surface, S(u,v) the surface being fitted, and
// p_i, w_i a point and its weight.
//
// To add a term, write one struct with `kName` and `Fields` here, add it to the variant, and write
// its overloads of AddRows or AddResiduals and of TermCost (term_cost.h). The law tests then cover
// it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance::fitting {

// The option `weight` of a term, in 0 .. 1e6.
template <class Visitor>
void WeightField(Visitor& visit, double& weight) {
  visit(FieldInfo{.name = "weight",
                  .min = 0,
                  .max = 1e6,
                  .doc = "factor of the mean squared residual; 0 switches the term off"},
        weight);
}

// The same option, or `auto`: each solve then chooses the weight by generalised cross-validation
// (auto_weight.h).
template <class Visitor>
void AutoWeightField(Visitor& visit, AutoOr<double>& weight) {
  visit(FieldInfo{.name = "weight",
                  .min = 0,
                  .max = 1e6,
                  .doc = "factor of the mean squared residual; 0 switches the term off; auto: "
                         "chosen by generalised cross-validation, which needs many points with "
                         "independent errors"},
        weight);
}

enum class RobustLoss { kNone, kHuber, kCauchy, kTukey };
constexpr auto EnumNames(RobustLoss) {
  return std::to_array<std::string_view>({"none", "huber", "cauchy", "tukey"});
}

// Draws the surface to the points:
//
//   weight * sum_i w_i rho(|S(u_i,v_i) - p_i|^2) / sum_i w_i, mm^2.
//
// With a = loss_width_mm and s the squared distance, rho(s) is
//   none:    s
//   huber:   s for s <= a^2, else 2 a sqrt(s) - a^2
//   cauchy:  a^2 log(1 + s / a^2)
//   tukey:   a^2 / 3 (1 - (1 - s / a^2)^3) for s <= a^2, else a^2 / 3: points beyond a do not pull.
struct PointTerm {
  static constexpr std::string_view kName = "points";
  double weight = 1;
  RobustLoss loss = RobustLoss::kNone;
  double loss_width_mm = 5;
};
template <class Visitor>
void Fields(Visitor& visit, PointTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "loss",
                  .doc = "loss that reduces the pull of distant points: none, huber, cauchy or "
                         "tukey"},
        o.loss);
  visit(FieldInfo{.name = "loss_width_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "distance beyond which a robust loss reduces a point's pull"},
        o.loss_width_mm);
}

// Draws the surface to the standard landmarks, in addition to PointTerm and independently of the
// number of seeds: weight * sum_i w_i |S(u_i,v_i) - p_i|^2 / sum_i w_i over the landmarks alone,
// mm^2.
struct LandmarkTerm {
  static constexpr std::string_view kName = "landmarks";
  double weight = 1;
};
template <class Visitor>
void Fields(Visitor& visit, LandmarkTerm& o) {
  WeightField(visit, o.weight);
}

// Keeps the surface close to a prior's shape: weight * mean over that shape of |S(u,v) - x|^2 /
// sd^2, where the prior states the place x and its standard deviation sd. The weight, in mm^2, is
// the cost of being one standard deviation away everywhere.
struct PriorShapeTerm {
  static constexpr std::string_view kName = "prior_shape";
  double weight = 1;
};
template <class Visitor>
void Fields(Visitor& visit, PriorShapeTerm& o) {
  WeightField(visit, o.weight);
}

// Draws the surface to the points and lets it slide along itself (tangent-distance minimisation):
// weight * mean over the points, by their weights, of (n . d)^2 + tangential |d - n (n . d)|^2,
// mm^2. Here d = S(u,v) - p, and n is the unit normal at (u,v) of the level's surface before the
// solve. Use it for points with approximate (u,v). With tangential 1, or where the surface has no
// normal, it equals PointTerm without a loss.
struct TangentPointTerm {
  static constexpr std::string_view kName = "tangent_points";
  double weight = 1;
  double tangential = 0.1;
};
template <class Visitor>
void Fields(Visitor& visit, TangentPointTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "tangential",
                  .min = 0,
                  .max = 1,
                  .doc = "cost of a misfit along the surface relative to one along its normal; 0 "
                         "leaves sliding to the other terms"},
        o.tangential);
}

enum class PriorTowards { kStart, kTemplate };
constexpr auto EnumNames(PriorTowards) {
  return std::to_array<std::string_view>({"start", "template"});
}

// Keeps control vertices in place: weight * mean over all vertices c of the level of |c - c0|^2,
// mm^2; c0 is the vertex before this solve or in the template.
struct PriorTerm {
  static constexpr std::string_view kName = "prior";
  double weight = 1e-3;
  PriorTowards towards = PriorTowards::kStart;
  // Sums over LevelView::held alone, but still divides by the number of all vertices. This is not
  // an option: Fit() sets it to hold features.
  bool held_only = false;
};
template <class Visitor>
void Fields(Visitor& visit, PriorTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "towards",
                  .doc = "place to which a vertex is held: start, before the level's solve, or "
                         "template"},
        o.towards);
}

enum class SmoothnessOf { kDisplacement, kSurface };
constexpr auto EnumNames(SmoothnessOf) {
  return std::to_array<std::string_view>({"displacement", "surface"});
}

// Resists bending (thin plate):
//
//   weight * length_mm^4 * mean over the surface of |f_ss|^2 + 2 |f_st|^2 + |f_tt|^2, mm^2,
//
// integrated exactly. f is the displacement from the template, whose features then survive, or the
// surface itself. s and t are u and v in mm: scaled by the template's mean lengths (rms of |S_u|
// and of |S_v| of its level 0), so that the same f costs the same at every level and for any
// proportions of the patches. With a stretch, bending along direction_deg costs stretch^2 times as
// much and bending across it 1 / stretch^2 times. All affine maps of the template are free of cost.
// Against dense points of weight 1 the term damps a wave of length x by 1 / (1 + weight (2 pi
// length_mm / x)^4): the default keeps waves longer than about 20 mm.
struct SmoothnessTerm {
  static constexpr std::string_view kName = "smoothness";
  AutoOr<double> weight = 0.01;
  SmoothnessOf of = SmoothnessOf::kDisplacement;
  double length_mm = 10;
  double stretch = 1;
  double direction_deg = 0;
};
template <class Visitor>
void Fields(Visitor& visit, SmoothnessTerm& o) {
  AutoWeightField(visit, o.weight);
  visit(
      FieldInfo{.name = "of", .doc = "what is smooth: displacement from the template, or surface"},
      o.of);
  visit(FieldInfo{.name = "length_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "length over which bending is measured; the cost grows with its fourth "
                         "power"},
        o.length_mm);
  visit(FieldInfo{.name = "stretch",
                  .min = 1,
                  .max = 100,
                  .doc = "bending along direction_deg costs the square of this factor more, and "
                         "bending across it as much less; for surfaces that bend less along one "
                         "direction, such as a ridge along its crest"},
        o.stretch);
  visit(FieldInfo{.name = "direction_deg",
                  .unit = "deg",
                  .min = -180,
                  .max = 180,
                  .doc = "direction of the stretch, from u towards v, both measured in mm"},
        o.direction_deg);
}

// Resists stretching (membrane): weight * length_mm^2 * mean over the surface of |f_s|^2 + |f_t|^2,
// mm^2, integrated exactly; f, s and t as for SmoothnessTerm. Only translations are free of cost,
// so a part without points moves with its neighbourhood.
struct MembraneTerm {
  static constexpr std::string_view kName = "membrane";
  AutoOr<double> weight = 0.1;
  SmoothnessOf of = SmoothnessOf::kDisplacement;
  double length_mm = 10;
};
template <class Visitor>
void Fields(Visitor& visit, MembraneTerm& o) {
  AutoWeightField(visit, o.weight);
  visit(FieldInfo{.name = "of",
                  .doc = "what resists stretching: displacement from the template, or "
                         "surface"},
        o.of);
  visit(FieldInfo{.name = "length_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "length over which stretching is measured; the cost grows with its "
                         "square"},
        o.length_mm);
}

// Keeps left and right alike: weight * mean over the level's control vertices of |f(i,j) - R
// f(mirror of (i,j))|^2, mm^2. f is the displacement from the template, whose own asymmetry then
// survives, or the vertex itself. The mirror of a vertex has 1 - u. R reflects at the template's
// mid-sagittal plane: the plane that best maps its control vertices to their mirrors. In a solve of
// all levels the mean is over the vertices of each patch's own level, weighted by the patch's share
// of the domain, and the mirror of each edited vertex is edited too.
struct SymmetryTerm {
  static constexpr std::string_view kName = "symmetry";
  double weight = 0.01;
  SmoothnessOf of = SmoothnessOf::kDisplacement;
};
template <class Visitor>
void Fields(Visitor& visit, SymmetryTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "of",
                  .doc = "what is symmetric: displacement from the template, or surface"},
        o.of);
}

// The vertex of the same level at 1 - u.
VertexId MirrorVertex(const HSplineShape& shape, const VertexId& vertex);

enum class DistortionOf { kMetric, kArea };
constexpr auto EnumNames(DistortionOf) {
  return std::to_array<std::string_view>({"metric", "area"});
}

// Keeps the template's first fundamental form: weight * length_mm^2 * mean over the template's
// surface of |E|^2, mm^2. E = (F^T F - 1) / 2 is Green's strain, and F the linear map from the
// template's tangent plane to the surface's. With `of: area` the mean is of (dA / dA of the
// template - 1)^2. The mean uses 2 x 2 Gauss points per patch, of the level's plain B-splines.
// Bending costs nothing.
struct DistortionTerm {
  static constexpr std::string_view kName = "distortion";
  double weight = 0.1;
  DistortionOf of = DistortionOf::kMetric;
  double length_mm = 10;
};
template <class Visitor>
void Fields(Visitor& visit, DistortionTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "of",
                  .doc = "metric: lengths and angles on the surface stay the template's; area: "
                         "areas alone"},
        o.of);
  visit(FieldInfo{.name = "length_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "length over which distortion is measured; the cost grows with its "
                         "square"},
        o.length_mm);
}

// Keeps the skin outside the bone: weight * mean over the points with a foot on the bone, by their
// weights, of max(0, min_depth_mm - n . (S(u,v) - foot))^2, mm^2; n is the point's direction out of
// the bone.
struct NonPenetrationTerm {
  static constexpr std::string_view kName = "non_penetration";
  double weight = 1;
  double min_depth_mm = 2;
};
template <class Visitor>
void Fields(Visitor& visit, NonPenetrationTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "min_depth_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 100,
                  .doc = "smallest distance of the surface outside the bone, along the point's "
                         "direction"},
        o.min_depth_mm);
}

// Spans a spring from the foot on the bone to the surface (thesis 5.3): weight * mean over the
// points with a foot, by their weights, of (|S(u,v) - foot| - depth)^2, mm^2. Its length at rest,
// depth, is the point's distance from the foot. Unlike PointTerm it lets the surface swing round
// the foot.
struct SpringTerm {
  static constexpr std::string_view kName = "spring";
  double weight = 0.1;
};
template <class Visitor>
void Fields(Visitor& visit, SpringTerm& o) {
  WeightField(visit, o.weight);
}

// A linear equation of the surface: the sum of c_k D_k S(u_k, v_k) over the entries of `at` equals
// `equals`, mm. D_k is the derivative of order du in u and dv in v.
struct LinearRow {
  std::vector<std::array<double, 5>> at;  // u, v, du, dv, c of each entry
  std::array<double, 3> equals = {};
};
template <class Visitor>
void Fields(Visitor& visit, LinearRow& o) {
  visit(FieldInfo{.name = "at",
                  .min = 1,
                  .doc = "points of the surface, as lists [u, v, du, dv, c]: c times the "
                         "derivative of order du in u and dv in v; 0, 0 is the point itself"},
        o.at);
  visit(FieldInfo{.name = "equals", .unit = "mm", .doc = "the sum that they should have"},
        o.equals);
}

// Rows of the caller: weight * mean over the rows of |sum - equals|^2, mm^2.
struct RowsTerm {
  static constexpr std::string_view kName = "rows";
  double weight = 1;
  std::vector<LinearRow> rows;
};
template <class Visitor>
void Fields(Visitor& visit, RowsTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "rows",
                  .doc = "linear equations of the surface, e.g. [{at: [[0.5, 0.5, 1, 0, 1]], "
                         "equals: [40, 0, 0]}] for its derivative in u at its middle"},
        o.rows);
}
template <class Report>
void CheckValue(Report& report, const RowsTerm& o) {
  const auto is_order = [](double d) { return d == 0 || d == 1 || d == 2; };
  if (o.rows.empty()) {
    report("rows", "there is no row; give one or more");
  }
  for (std::size_t k = 0; k < o.rows.size(); ++k) {
    for (const auto& [u, v, du, dv, c] : o.rows[k].at) {
      if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) {
        report("rows", "row " + std::to_string(k) + ": (u,v) is not in 0..1");
      } else if (!is_order(du) || !is_order(dv) || du + dv > 2) {
        report("rows",
               "row " + std::to_string(k) + ": du and dv are 0, 1 or 2, and at most 2 in all");
      }
    }
  }
}

using Term = std::variant<PointTerm, PriorTerm, SmoothnessTerm, MembraneTerm, TangentPointTerm,
                          SymmetryTerm, NonPenetrationTerm, SpringTerm, DistortionTerm,
                          LandmarkTerm, PriorShapeTerm, RowsTerm>;

inline std::string_view TermName(const Term& term) {
  return std::visit([](const auto& t) { return t.kName; }, term);
}

inline double TermWeight(const Term& term) {
  return std::visit([](const auto& t) -> double { return t.weight; }, term);
}

}  // namespace semblance::fitting
