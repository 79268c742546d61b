// SPDX-License-Identifier: GPL-3.0-or-later
// The terms that hold a level's surface to its start, to the template, to itself or to its mirror
// image (term.h).
#pragma once

#include <array>
#include <string_view>

#include "fitting/terms/term_weight.h"
#include "surfaces/hspline/hspline_shape.h"

namespace semblance {

enum class PriorTowards { kStart, kTemplate };
constexpr auto EnumNames(PriorTowards) {
  return std::to_array<std::string_view>({"start", "template"});
}

// Control vertices stay where they were: weight * mean over all vertices of the level of
// |c - c0|^2, mm^2; c0 is the vertex before this solve, or the template's.
struct PriorTerm {
  static constexpr std::string_view kName = "prior";
  double weight = 1e-3;                         // of the mean squared move
  PriorTowards towards = PriorTowards::kStart;  // what a vertex is held to
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
// proportioned. With a stretch bending along direction_deg counts stretch^2 times,
// bending across it 1 / stretch^2 times. Translations and all affine maps of the template are free
// of cost. Against dense points of weight 1 it damps a wave of length x by 1 / (1 + weight (2 pi
// length_mm / x)^4): the default keeps waves longer than about 20 mm.
struct SmoothnessTerm {
  static constexpr std::string_view kName = "smoothness";
  AutoOr<double> weight = 0.01;                   // auto: from the points
  SmoothnessOf of = SmoothnessOf::kDisplacement;  // what is smooth
  double length_mm = 10;                          // over which bending is measured
  double stretch = 1;                             // of lengths along a direction
  double direction_deg = 0;                       // of that, from s towards t
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
  visit(FieldInfo{.name = "stretch",
                  .min = 1,
                  .max = 100,
                  .doc = "bending along direction_deg counts this squared times, and across it as "
                         "much less: for surfaces that bend less along one direction, as a ridge "
                         "along its crest"},
        o.stretch);
  visit(FieldInfo{.name = "direction_deg",
                  .unit = "deg",
                  .min = -180,
                  .max = 180,
                  .doc = "direction of the stretch, from u towards v, u and v being in mm"},
        o.direction_deg);
}

// Membrane: weight * length_mm^2 * mean over the surface of |f_s|^2 + |f_t|^2, integrated exactly;
// f, s and t as for SmoothnessTerm. Resists stretching; only translations are free of cost: where
// there is no point, the surface moves along with its neighbourhood.
struct MembraneTerm {
  static constexpr std::string_view kName = "membrane";
  AutoOr<double> weight = 0.1;                    // auto: from the points
  SmoothnessOf of = SmoothnessOf::kDisplacement;  // what resists stretching
  double length_mm = 10;                          // over which stretching is measured
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
// template's mid-sagittal plane, the plane that best maps its control vertices to their mirrors. Of
// all levels at once: of the vertices of each patch's own level, weighted by the patch's share of
// the domain; where a vertex is edited its mirror is too.
struct SymmetryTerm {
  static constexpr std::string_view kName = "symmetry";
  double weight = 0.01;                           // of the mean square
  SmoothnessOf of = SmoothnessOf::kDisplacement;  // what is symmetric
};
template <class Visitor>
void Fields(Visitor& visit, SymmetryTerm& o) {
  WeightField(visit, o.weight);
  visit(FieldInfo{.name = "of",
                  .doc = "what is symmetric: displacement from the template, or surface"},
        o.of);
}

// The vertex at 1 - u.
VertexId MirrorOf(const HSplineShape& shape, const VertexId& vertex);

enum class DistortionOf { kMetric, kArea };
constexpr auto EnumNames(DistortionOf) {
  return std::to_array<std::string_view>({"metric", "area"});
}

// The first fundamental form stays the template's: weight * length_mm^2 * mean over the template's
// surface of |E|^2; E = (F^T F - 1) / 2 is Green's strain, F the linear map that takes the
// template's tangent plane to the surface's. of area: mean of (dA / dA of the template - 1)^2.
// Taken at 2 x 2 Gauss points per patch, of the level's plain B-splines. Bending is free.
struct DistortionTerm {
  static constexpr std::string_view kName = "distortion";
  double weight = 0.1;                      // of the mean square
  DistortionOf of = DistortionOf::kMetric;  // lengths and angles, or areas
  double length_mm = 10;                    // over which it is measured
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

}  // namespace semblance
