// SPDX-License-Identifier: GPL-3.0-or-later
// The ways to a subject's face, once depth and implicit face are there.
#pragma once

#include <filesystem>
#include <string_view>
#include <variant>

#include "problems/prior/prior_target.h"
#include "problems/prior/seed_trust.h"
#include "surfaces/base/fields.h"

namespace semblance {

// prior_then_fit where there is a prior of the template, else fit.
struct AutoFace {
  static constexpr std::string_view kName = "auto";
};
template <class Visitor>
void Fields(Visitor&, AutoFace&) {}

// The template, brought to the dowels and no more.
struct PlacedFace {
  static constexpr std::string_view kName = "placed";
};
template <class Visitor>
void Fields(Visitor&, PlacedFace&) {}

// The placed template under the thin plate that brings its sites to the dowels' tips (Bookstein
// 1989).
struct ThinPlateFace {
  static constexpr std::string_view kName = "thin_plate";
  double stiffness_mm = 10;  // 0 meets all tips
};
template <class Visitor>
void Fields(Visitor& visit, ThinPlateFace& o) {
  visit(FieldInfo{.name = "stiffness_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1e6,
                  .doc = "weight of bending against the tips' misfit; 0 meets all tips"},
        o.stiffness_mm);
}

// The template, a reference head's skin, under the thin plate that brings the landmarks of that
// head's skull to the subject's (thesis 5.3, its volumetric deformation). No depth has a say.
struct ReferenceFace {
  static constexpr std::string_view kName = "reference";
  std::filesystem::path landmarks;  // of the reference's skull, in the template's frame
  double stiffness_mm = 1;          // 0 meets all landmarks
};
template <class Visitor>
void Fields(Visitor& visit, ReferenceFace& o) {
  visit(FieldInfo{.name = "landmarks",
                  .doc = "landmarks on the skull of the head that `template: {type: file, ...}` "
                         "was made from, in the frame of that head; those are taken that the "
                         "subject has too"},
        o.landmarks);
  visit(FieldInfo{.name = "stiffness_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1e6,
                  .doc = "weight of bending against the landmarks' misfit; 0 meets all of them"},
        o.stiffness_mm);
}

// The H-spline fit of the placed template to dowels and implicit face (thesis ch. 4).
struct FittedTemplate {
  static constexpr std::string_view kName = "fit";
};
template <class Visitor>
void Fields(Visitor&, FittedTemplate&) {}

// What every face that asks the prior has.
struct PriorUse {
  ShapeFitOptions estimate;               // how the most likely face is found
  TableDepthOptions table_depths;         // how sure depths of a table are
  ImplicitSpreadOptions implicit_spread;  // how sure the implicit face is
  int draw = 0;                           // 0: the most likely face; else one that is drawn
};
template <class Visitor>
void PriorUseFields(Visitor& visit, PriorUse& o) {
  visit(FieldInfo{.name = "estimate", .doc = "how the most likely face of the prior is found"},
        o.estimate);
  visit(FieldInfo{.name = "table_depths",
                  .doc = "how sure depths are that come from a table; measured ones are taken as "
                         "exact along the dowel"},
        o.table_depths);
  visit(FieldInfo{.name = "implicit_spread", .doc = "how sure the implicit face is"},
        o.implicit_spread);
  visit(FieldInfo{.name = "draw",
                  .min = 0,
                  .max = 1000000,
                  .doc = "0: the most likely face; 1, 2 ...: instead a face drawn from those that "
                         "bone and depths leave possible, the same one for the same number; for "
                         "`alternatives`"},
        o.draw);
}

// The most likely face of the prior.
struct PriorFace {
  static constexpr std::string_view kName = "prior";
  PriorUse use;  // how sure depths and implicit face are
};
template <class Visitor>
void Fields(Visitor& visit, PriorFace& o) {
  PriorUseFields(visit, o.use);
}

// The same as the template of the H-spline fit, which starts from it without a first fit; each
// dowel is fitted where its tip is nearest to that face. PriorShapeTerm holds the fit to the
// posterior. The implicit face has had its say in the prior's face, so its seeds weigh less here.
struct PriorThenFit {
  static constexpr std::string_view kName = "prior_then_fit";
  double shape_weight = 1;      // of the term prior_shape
  double seed_weight = 0.001;   // in place of seeds.weight
  SeedTrustOptions seed_trust;  // where that weight falls
  PriorUse use;                 // how sure depths and implicit face are
};
template <class Visitor>
void Fields(Visitor& visit, PriorThenFit& o) {
  visit(
      FieldInfo{.name = "shape_weight",
                .min = 0,
                .max = 1e6,
                .doc = "of the term `prior_shape`, where fit.terms does not name it, for measured "
                       "depths; with depths of a table it is larger, as their variance is"},
      o.shape_weight);
  visit(
      FieldInfo{.name = "seed_weight",
                .min = 1e-6,
                .max = 1e6,
                .doc = "of a seed in the fit, in place of seeds.weight; more follows the implicit "
                       "face, away from what the prior holds for likely"},
      o.seed_weight);
  visit(FieldInfo{.name = "seed_trust",
                  .doc = "where that weight falls: away from dowels; none is left at the features"},
        o.seed_trust);
  PriorUseFields(visit, o.use);
}

using FaceSource = std::variant<AutoFace, FittedTemplate, PlacedFace, ThinPlateFace, ReferenceFace,
                                PriorFace, PriorThenFit>;

// Null for a face that does not ask the prior.
inline const PriorUse* PriorUseOf(const FaceSource& face) {
  const auto* const prior = std::get_if<PriorFace>(&face);
  const auto* const fitted = std::get_if<PriorThenFit>(&face);
  return prior != nullptr ? &prior->use : fitted != nullptr ? &fitted->use : nullptr;
}

inline bool AsksPrior(const FaceSource& face) { return PriorUseOf(face) != nullptr; }

}  // namespace semblance
