// SPDX-License-Identifier: GPL-3.0-or-later
// The most likely shape of a statistical model given a few points and a rough surface: similarity,
// coefficients of the modes and a smooth rest, in one robust least-squares problem.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fitting/shape_model/shape_model.h"
#include "fitting/shape_model/smooth_field.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct ShapeFitOptions {
  double tip_normal_sd_mm = 0.5;      // of a dowel's tip along the face's normal
  double tip_tangent_sd_mm = 4;       // and across it
  double tip_loss_width = 3;          // Huber, in standard deviations
  double scale_sd = 0.03;             // of the logarithm of the model's scale
  double mode_sd = 1;                 // of a coefficient
  SmoothFieldOptions field;           // what the modes cannot express
  int surface_points = 300;           // drawn to the implicit face; 0: the dowels alone
  double surface_worth = 40;          // how many independent points those count as
  double surface_sd_mm = 2.5;         // of the surface along its normal, where it states none
  double surface_loss_width = 0.8;    // Huber, in standard deviations
  double surface_reach_mm = 15;       // farther off a point is not drawn
  double surface_max_angle_deg = 60;  // nor where normals differ by more
  double surface_range_mm = 60;       // nor farther than this from every dowel
  double surface_length_mm = 5;       // over which the surface's errors resemble; for sigma
  int rounds = 12;                    // at most
  double population_sd = 1.3;         // of a coefficient among people; for sigma
  double discrepancy_mm = 1.25;       // what neither modes nor field can express; for sigma
  double unseen_reach_mm = 20;        // farther from all that is observed sigma grows
  double unseen_rate = 0.2;           // by this, mm per mm
};
template <class Visitor>
void Fields(Visitor& visit, ShapeFitOptions& o) {
  visit(FieldInfo{.name = "tip_normal_sd_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 100,
                  .doc = "standard deviation of a dowel's tip along the face's normal; between "
                         "0.25 and 1.5 the result hardly changes"},
        o.tip_normal_sd_mm);
  visit(FieldInfo{.name = "tip_tangent_sd_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 100,
                  .doc = "the same across the normal: how surely a site of the bone is a point of "
                         "the model's face; as tight as along the normal it does harm"},
        o.tip_tangent_sd_mm);
  visit(FieldInfo{.name = "tip_loss_width",
                  .min = 0.1,
                  .max = 1e6,
                  .doc = "in standard deviations; a tip farther off counts less (Huber's loss)"},
        o.tip_loss_width);
  visit(FieldInfo{.name = "scale_sd",
                  .min = 1e-4,
                  .max = 10,
                  .doc = "standard deviation of the logarithm of the model's scale; the modes hold "
                         "most of what differs in size"},
        o.scale_sd);
  visit(FieldInfo{.name = "mode_sd",
                  .min = 0.01,
                  .max = 100,
                  .doc = "standard deviation of the modes' coefficients; more lets a face be less "
                         "average"},
        o.mode_sd);
  visit(FieldInfo{.name = "field", .doc = "the smooth rest that the modes cannot express"},
        o.field);
  visit(FieldInfo{.name = "surface_points",
                  .min = 0,
                  .max = 100000,
                  .doc = "points of the model, away from nose, mouth and eyes, that are drawn to "
                         "the implicit face; 0: the dowels alone"},
        o.surface_points);
  visit(FieldInfo{.name = "surface_worth",
                  .min = 0,
                  .max = 100000,
                  .doc = "how many independent points they count as together, as what is wrong "
                         "with the implicit face is wrong over centimetres"},
        o.surface_worth);
  visit(FieldInfo{.name = "surface_sd_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 100,
                  .doc = "standard deviation of the surface along its normal, where nothing is "
                         "known of it; that of the implicit face is `implicit_spread`'s"},
        o.surface_sd_mm);
  visit(FieldInfo{.name = "surface_loss_width",
                  .min = 1e-3,
                  .max = 1e6,
                  .doc = "in standard deviations; a point farther from the surface counts less "
                         "(Huber's loss)"},
        o.surface_loss_width);
  visit(FieldInfo{.name = "surface_reach_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 200,
                  .doc = "a point farther from the implicit face is not drawn to it"},
        o.surface_reach_mm);
  visit(FieldInfo{.name = "surface_max_angle_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 180,
                  .doc = "nor is one whose normal differs by more than this"},
        o.surface_max_angle_deg);
  visit(FieldInfo{.name = "surface_range_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1e6,
                  .doc = "nor one farther than this from every dowel's point of the model, where "
                         "the implicit face rests on no depth; weights that fall with that "
                         "distance do worse"},
        o.surface_range_mm);
  visit(FieldInfo{.name = "surface_length_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 1000,
                  .doc = "length over which the errors of the implicit face resemble each other: "
                         "the estimate knows of it by `surface_worth` alone, sigma by this"},
        o.surface_length_mm);
  visit(FieldInfo{.name = "rounds",
                  .min = 3,
                  .max = 1000,
                  .doc = "how often at most the points of the implicit face and the normals are "
                         "taken anew; two rounds move the pose alone, and the implicit face comes "
                         "in with the fourth"},
        o.rounds);
  visit(FieldInfo{.name = "population_sd",
                  .min = 0.01,
                  .max = 100,
                  .doc = "standard deviation of the people's coefficients, where the estimate "
                         "takes mode_sd: people differ more than the model's, and sigma knows"},
        o.population_sd);
  visit(FieldInfo{.name = "discrepancy_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "standard deviation of what neither modes nor the smooth rest can "
                         "express; part of the stated sigma"},
        o.discrepancy_mm);
  visit(FieldInfo{.name = "unseen_reach_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1000,
                  .doc = "farther than this from every dowel and every point that is drawn to the "
                         "implicit face, as where no bone was scanned, sigma has a further part"},
        o.unseen_reach_mm);
  visit(FieldInfo{.name = "unseen_rate",
                  .min = 0,
                  .max = 10,
                  .doc = "which grows by so many mm with each mm farther"},
        o.unseen_rate);
}

// A dowel's tip and the point of the model that is expected there.
struct ShapeTip {
  std::string label;
  ModelPoint at;
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec3 direction = Vec3::Zero();         // unit, along which it may be off besides
  double along_sd_mm = 0;                // by this
  double shared_sd_mm = 0;               // and by this, in which all tips of a person err together
};

// What is known of one coordinate of the mean of some points of the model.
struct ShapeMark {
  std::string label;
  std::vector<ModelPoint> at;             // at least one
  Vec3 position = Vec3::Constant(kNaN);   // mm; only its coordinate along `direction` counts
  Vec3 direction = Vec3::Constant(kNaN);  // unit
  double sd_mm = kNaN;                    // > 0
};

// Points of the model nearer to it than this are not drawn to the surface.
struct ShapeFeature {
  Vec3 position = Vec3::Constant(kNaN);  // of the mean, mm
  double clearance_mm = 15;
};

struct ShapeTarget {
  Similarity start;                  // subject_from_model
  std::vector<ShapeTip> tips;        // may be empty
  const TriMesh* surface = nullptr;  // outward, in the subject's frame; none: the tips alone
  std::vector<ShapeFeature> features;
  std::vector<double> surface_sd_mm = {};     // one per point of the surface; none: of the options
  std::vector<double> surface_error_mm = {};  // how far it is off there, for sigma; none: the same
  std::vector<ShapeMark> marks = {};
  std::vector<std::uint64_t> draws = {};  // random seeds of shapes to draw
  bool tells_spread = true;               // sigma, and draws
};

struct ShapeEstimate {
  Similarity subject_from_model;
  Eigen::VectorXd coefficients;          // one per mode
  std::vector<Vec3> points;              // one per point of the model, in the subject's frame, mm
  std::vector<double> sigma_mm;          // one per point: along its normal, with all its parts;
                                         // none where the target leaves the spread out
  std::vector<double> tip_residual_mm;   // one per tip: from the point of the shape to the tip, > 0
                                         // outside, along the shape's normal
  std::vector<double> mark_residual_mm;  // one per mark: from the shape to the mark, along its
                                         // direction
  std::vector<std::vector<Vec3>> drawn;  // one per draw: its points
  double field_rms_mm = kNaN;            // of the smooth rest over the points
  int surface_points = -1;               // that were drawn to the surface in the last round
  int rounds = -1;
  double last_move_mm = kNaN;  // of an observed point, in the last round
  bool usable = false;
};

// Minimises, in Ceres, over s, R, t, w and a of shape_parameters.h
//   sum_tips Huber_width(r' C^-1 r) + sum_marks Huber_width((d . (m - x))^2 / sd^2)
//     + worth / points sum_surface Huber_width((n . (c - x))^2 / sd(c)^2)
//     + |w / mode_sd|^2 + |a|^2 + (ln s / scale_sd)^2,
// C of shape_observation.h with the shape's own normal, c the surface's closest point to x and n
// its normal; and a prior of 1 rad and 100 mm on the pose, so weak that it matters only where
// nothing else speaks. Points and normals are taken anew in each round. The posterior is the normal
// distribution of the last linearisation, widened as PosteriorOf says: the surface shares the
// error of the nearest tip, and its own errors are smooth. What is drawn has that distribution.
// Sigma has two parts besides, added in squares: discrepancy_mm, and
// unseen_rate (d - unseen_reach_mm) where d, the distance on the mean from the nearest point that
// was observed, is larger than that: modes alone are too sure of a jaw whose bone nobody saw.
// One thread apart from sigma; same bytes whatever their
// number. Throws InputError as CheckShapeModel (name: "shape model"), for a tip that is not on the
// model or not finite, for deviations that are not one per point of the surface, and for a start
// without a positive scale; Cancelled.
ShapeEstimate EstimateShape(const ShapeModel& model, const ShapeTarget& target,
                            const ShapeFitOptions& options, const RunContext& context);

}  // namespace semblance
