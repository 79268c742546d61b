// SPDX-License-Identifier: GPL-3.0-or-later
// What a level's solve weighs against each other. Each term costs `weight * mean squared residual`,
// in mm^2 times the weight, so that a weight means the same over levels, point counts and subjects.
// A new term is one struct here, one entry of the variant, and its overloads of AddResiduals and
// TermCost (term_cost.h).
#pragma once

#include <array>
#include <string_view>
#include <variant>

#include "surfaces/auto_number.h"
#include "surfaces/fields.h"

namespace semblance {

// Every weight: 0 (the term is off) .. 1e6.
template <class Visitor>
void WeightField(Visitor& visit, double& weight) {
  visit(FieldInfo{.name = "weight",
                  .min = 0,
                  .max = 1e6,
                  .doc = "factor of the mean squared residual; 0 switches the term off"},
        weight);
}

// The same, or `auto`: then each solve chooses it by generalised cross-validation (auto_weight.h).
template <class Visitor>
void AutoWeightField(Visitor& visit, AutoNumber& weight) {
  visit(FieldInfo{.name = "weight",
                  .min = 0,
                  .max = 1e6,
                  .doc = "factor of the mean squared residual; 0 switches the term off; auto: "
                         "chosen by generalised cross-validation, for points that are many and "
                         "whose errors do not hang together"},
        weight);
}

enum class RobustLoss { kNone, kHuber, kCauchy, kTukey };
constexpr auto EnumNames(RobustLoss) {
  return std::to_array<std::string_view>({"none", "huber", "cauchy", "tukey"});
}

// The surface meets the points: weight * sum_i w_i rho(|S(u_i,v_i) - p_i|^2) / sum_i w_i, the mean
// over the points by their own weights w_i, mm^2. rho(s) = s without a loss; with a = loss_width_mm
// Huber's is s for s <= a^2, else 2 a sqrt(s) - a^2, Cauchy's a^2 log(1 + s / a^2), and Tukey's
// a^2 / 3 (1 - (1 - s / a^2)^3) for s <= a^2, else a^2 / 3: points beyond a have no pull at all.
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
                  .doc = "how points far off are tamed: none, huber, cauchy or tukey"},
        o.loss);
  visit(FieldInfo{.name = "loss_width_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 1e3,
                  .doc = "distance from which a robust loss counts a point less"},
        o.loss_width_mm);
}

// The surface may slide along itself (tangent-distance minimisation): weight * the mean over the
// points, by their weights, of (n . d)^2 + tangential |d - n (n . d)|^2, mm^2; d = S(u,v) - p and n
// the unit normal at (u,v) of the level's surface before the solve. For points whose (u,v) are only
// about right. With tangential 1, or where there is no normal, as the points without a loss.
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
                  .doc = "what a misfit along the surface counts against one along its normal; 0 "
                         "leaves sliding to the other terms"},
        o.tangential);
}

enum class PriorTowards { kStart, kTemplate };
constexpr auto EnumNames(PriorTowards) {
  return std::to_array<std::string_view>({"start", "template"});
}

// Control vertices stay where they were: weight * mean over all vertices of the level of
// |c - c0|^2, mm^2; c0 is the vertex before this solve, or the template's.
struct PriorTerm {
  static constexpr std::string_view kName = "prior";
  double weight = 1e-3;
  PriorTowards towards = PriorTowards::kStart;
  bool held_only = false;  // of LevelView::held alone, the mean still over all; no option: fit.h
                           // asks for it to hold features
};
template <class Visitor>
void Fields(Visitor& visit, PriorTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "towards",
                  .doc = "what a vertex is held to: its place at the start of the level's solve, "
                         "or in the template"},
        o.towards);
}

enum class SmoothnessOf { kDisplacement, kSurface };
constexpr auto EnumNames(SmoothnessOf) {
  return std::to_array<std::string_view>({"displacement", "surface"});
}

// Thin plate: weight * length_mm^4 * mean over the surface of |f_ss|^2 + 2 |f_st|^2 + |f_tt|^2,
// integrated exactly; f is the displacement from the template (its features survive) or the surface
// itself. s and t are u and v stretched to the template's mean lengths in mm (rms of |S_u| and of
// |S_v| of its level 0), so the same f costs the same at every level, however the patches are
// proportioned. Translations and all affine maps of the template are free of cost. Against
// dense points of weight 1 it damps a wave of length x by 1 / (1 + weight (2 pi length_mm / x)^4):
// the default keeps waves longer than about 20 mm.
struct SmoothnessTerm {
  static constexpr std::string_view kName = "smoothness";
  AutoNumber weight = 0.01;
  SmoothnessOf of = SmoothnessOf::kDisplacement;
  double length_mm = 10;
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
                  .doc = "length over which bending is measured; enters by its fourth power"},
        o.length_mm);
}

// Membrane: weight * length_mm^2 * mean over the surface of |f_s|^2 + |f_t|^2, integrated exactly;
// f, s and t as for SmoothnessTerm. Resists stretching; only translations are free of cost: where
// there is no point, the surface moves along with its neighbourhood.
struct MembraneTerm {
  static constexpr std::string_view kName = "membrane";
  AutoNumber weight = 0.1;
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
                  .doc = "length over which stretching is measured; enters by its square"},
        o.length_mm);
}

// Left and right alike: weight * mean over the level's control vertices of
// |f(i,j) - R f(mirror of (i,j))|^2, mm^2; f is the displacement from the template (its own
// asymmetry survives) or the vertex itself. The mirror of a vertex has 1 - u; R reflects at the
// template's mid-sagittal plane, the plane that best maps its control vertices to their mirrors.
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

// Skin outside bone, for points whose foot on the bone is known: weight * mean over them, by their
// weights, of max(0, min_depth_mm - n . (S(u,v) - foot))^2, mm^2; n is the point's direction out of
// the bone. Costs nothing where the surface is far enough out.
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
                  .doc = "how far outside the bone the surface is to be, at least, along the "
                         "point's direction"},
        o.min_depth_mm);
}

// A spring from the foot on the bone to the surface (thesis 5.3): weight * mean over the points
// with a foot, by their weights, of (|S(u,v) - foot| - depth)^2, mm^2. Its length at rest is the
// point's depth, its distance from the foot. Unlike the points it lets the surface swing round the
// foot.
struct SpringTerm {
  static constexpr std::string_view kName = "spring";
  double weight = 0.1;
};
template <class Visitor>
void Fields(Visitor& visit, SpringTerm& o) {
  WeightField(visit, o.weight);
}

enum class DistortionOf { kMetric, kArea };
constexpr auto EnumNames(DistortionOf) {
  return std::to_array<std::string_view>({"metric", "area"});
}

// The first fundamental form stays the template's: weight * length_mm^2 * mean over the template's
// surface of |E|^2; E = (F^T F - 1) / 2 is Green's strain, F the linear map that takes the
// template's tangent plane to the surface's. of area: mean of (dA / dA of the template - 1)^2.
// Taken at 2 x 2 Gauss points a patch, of the level's plain B-splines. Bending is free.
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
                  .doc = "length over which distortion is measured; enters by its square"},
        o.length_mm);
}

using Term = std::variant<PointTerm, PriorTerm, SmoothnessTerm, MembraneTerm, TangentPointTerm,
                          SymmetryTerm, NonPenetrationTerm, SpringTerm, DistortionTerm>;

inline std::string_view TermName(const Term& term) {
  return std::visit([](const auto& t) { return t.kName; }, term);
}

inline double WeightOf(const Term& term) {
  return std::visit([](const auto& t) -> double { return t.weight; }, term);
}

}  // namespace semblance
