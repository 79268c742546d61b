// SPDX-License-Identifier: GPL-3.0-or-later
// The ways to make a subject's face from depth and implicit face.
#pragma once

#include <filesystem>
#include <string_view>
#include <variant>

#include "fitting/problem/seeding.h"
#include "fitting/springs/spring_net.h"
#include "problems/face/prior_observations.h"
#include "problems/face/residual_field.h"
#include "surfaces/base/fields.h"

namespace semblance::problems {

// If there is a prior of the template, joint, or prior_then_fit for a plan that joint does not run;
// else fit.
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
  double stiffness_mm = 10;
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

// The template is the skin of a reference head. The thin plate that brings the landmarks of that
// head's skull to the subject's bends it (thesis 5.3, volumetric deformation). Depths do not
// matter. Without landmarks the reference is the mean person: the skull lies people's mean depth
// (interp::CarriedPeople) below the template.
struct ReferenceFace {
  static constexpr std::string_view kName = "reference";
  std::filesystem::path landmarks;
  double stiffness_mm = 1;
};
template <class Visitor>
void Fields(Visitor& visit, ReferenceFace& o) {
  visit(FieldInfo{.name = "landmarks",
                  .doc = "landmarks on the skull of the head that `template: {type: file, ...}` "
                         "was made from, in the frame of that head; those that the subject has "
                         "too are used. Without a file the template is the mean person's face, "
                         "and the sites of that skull lie below it by the mean depth of 54 people"},
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

// The template as a network of springs, held at the tissue depth over the skull (thesis 5.3;
// spring_face.h).
struct SpringFace {
  static constexpr std::string_view kName = "springs";
  int level = 1;
  SpringOptions springs;
};
template <class Visitor>
void Fields(Visitor& visit, SpringFace& o) {
  visit(FieldInfo{.name = "level",
                  .min = 0,
                  .max = 3,
                  .doc = "the net has two vertices along each side of a patch of this level"},
        o.level);
  Fields(visit, o.springs);
}

// The options of every face that uses the prior.
struct PriorUse {
  ShapeFitOptions estimate;
  TableDepthOptions table_depths;
  ImplicitSpreadOptions implicit_spread;
  int draw = 0;
};
template <class Visitor>
void PriorUseFields(Visitor& visit, PriorUse& o) {
  visit(FieldInfo{.name = "estimate", .doc = "how the most likely face of the prior is found"},
        o.estimate);
  visit(FieldInfo{.name = "table_depths",
                  .doc = "how uncertain the depths of a table are; measured depths are taken as "
                         "exact along the dowel"},
        o.table_depths);
  visit(FieldInfo{.name = "implicit_spread", .doc = "how uncertain the implicit face is"},
        o.implicit_spread);
  visit(FieldInfo{.name = "draw",
                  .min = 0,
                  .max = 1000000,
                  .doc = "0: the most likely face; 1, 2 ...: a random face among those that bone "
                         "and depths leave possible, the same face for the same number; for "
                         "`alternatives`"},
        o.draw);
}

// The most likely face of the prior.
struct PriorFace {
  static constexpr std::string_view kName = "prior";
  PriorUse use;
};
template <class Visitor>
void Fields(Visitor& visit, PriorFace& o) {
  PriorUseFields(visit, o.use);
}

// The most likely face of the prior becomes the template of the H-spline fit, which starts from it
// without a first fit. Each dowel is fitted to the point of that face nearest to its tip.
// PriorShapeTerm holds the fit to the posterior. The implicit face has already shaped the prior's
// face, so its seeds weigh less here.
struct PriorThenFit {
  static constexpr std::string_view kName = "prior_then_fit";
  double shape_weight = 1;
  double seed_weight = 0.001;
  SeedTrustOptions seed_trust;
  PriorUse use;
};
template <class Visitor>
void Fields(Visitor& visit, PriorThenFit& o) {
  visit(FieldInfo{.name = "shape_weight",
                  .min = 0,
                  .max = 1e6,
                  .doc = "weight of the term `prior_shape` for measured depths, if fit.terms does "
                         "not name the term; for depths of a table it grows with their variance"},
        o.shape_weight);
  visit(FieldInfo{.name = "seed_weight",
                  .min = 1e-6,
                  .max = 1e6,
                  .doc = "weight of a seed in the fit, in place of seeds.weight; a larger one "
                         "follows the implicit face more and the likely shape less"},
        o.seed_weight);
  visit(FieldInfo{.name = "seed_trust",
                  .doc = "how that weight falls away from the dowels; it is 0 at the features"},
        o.seed_trust);
  PriorUseFields(visit, o.use);
}

// One problem from dowels to face (joint_face.h): each step of the schedule solves for control
// vertices, coefficients of the prior and pose together.
struct JointFace {
  static constexpr std::string_view kName = "joint";
  SeedMethod seed_method = SeedMethod::kClosest;
  ResidualFieldOptions residual;
  PriorUse use;
};
template <class Visitor>
void Fields(Visitor& visit, JointFace& o) {
  visit(FieldInfo{.name = "seed_method",
                  .doc = "how seeds are found, in place of seeds.method; closest: nearest point; "
                         "ray: along a smoothed normal, which spreads seeds evenly, but the face "
                         "starts too near to the implicit face to need that"},
        o.seed_method);
  visit(FieldInfo{.name = "residual",
                  .doc = "how far, and over what distance, the face may deviate from the prior"},
        o.residual);
  PriorUseFields(visit, o.use);
}

using FaceSource = std::variant<AutoFace, FittedTemplate, PlacedFace, ThinPlateFace, ReferenceFace,
                                SpringFace, PriorFace, PriorThenFit, JointFace>;

// Null for a face that does not use the prior.
inline const PriorUse* FindPriorUse(const FaceSource& face) {
  return std::visit(
      [](const auto& way) -> const PriorUse* {
        if constexpr (requires { way.use; }) {
          return &way.use;
        } else {
          return nullptr;
        }
      },
      face);
}

inline bool UsesPrior(const FaceSource& face) { return FindPriorUse(face) != nullptr; }

}  // namespace semblance::problems
