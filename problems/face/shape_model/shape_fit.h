// SPDX-License-Identifier: GPL-3.0-or-later
// The most likely shape of a statistical model for a few points and a rough surface: similarity,
// coefficients of the modes and a smooth field, in one robust least-squares problem.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "problems/face/shape_model/shape_model.h"
#include "problems/face/shape_model/smooth_field.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct ShapeFitOptions {
  double tip_normal_sd_mm = 0.5;
  double tip_tangent_sd_mm = 4;
  double tip_loss_width = 3;
  double scale_sd = 0.03;
  double mode_sd = 1;
  SmoothFieldOptions field;
  int surface_points = 300;
  double surface_worth = 40;
  double surface_sd_mm = 2.5;
  double surface_loss_width = 0.8;
  double surface_reach_mm = 15;
  double surface_max_angle_deg = 60;
  double surface_range_mm = 60;
  double surface_length_mm = 5;
  int rounds = 12;
  double population_sd = 1.3;
  double discrepancy_mm = 1.25;
  double unseen_reach_mm = 20;
  double unseen_rate = 0.2;
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
                  .doc = "standard deviation of a dowel's tip across the face's normal: the "
                         "uncertainty of the site's place in the model; a value as small as along "
                         "the normal harms the result"},
        o.tip_tangent_sd_mm);
  visit(
      FieldInfo{.name = "tip_loss_width",
                .min = 0.1,
                .max = 1e6,
                .doc = "distance in standard deviations beyond which Huber's loss reduces a tip's "
                       "pull"},
      o.tip_loss_width);
  visit(FieldInfo{.name = "scale_sd",
                  .min = 1e-4,
                  .max = 10,
                  .doc = "standard deviation of the logarithm of the model's scale; the modes "
                         "contain most differences in size"},
        o.scale_sd);
  visit(FieldInfo{.name = "mode_sd",
                  .min = 0.01,
                  .max = 100,
                  .doc = "standard deviation of the modes' coefficients; more allows less average "
                         "faces"},
        o.mode_sd);
  visit(FieldInfo{.name = "field", .doc = "smooth displacement that the modes cannot express"},
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
                  .doc = "number of independent points to which the surface points are equivalent; "
                         "it is small because errors of the implicit face extend over centimetres"},
        o.surface_worth);
  visit(
      FieldInfo{.name = "surface_sd_mm",
                .unit = "mm",
                .min = 1e-3,
                .max = 100,
                .doc = "standard deviation of the surface along its normal if it states none; the "
                       "implicit face states that of `implicit_spread`"},
      o.surface_sd_mm);
  visit(FieldInfo{.name = "surface_loss_width",
                  .min = 1e-3,
                  .max = 1e6,
                  .doc = "distance in standard deviations beyond which Huber's loss reduces the "
                         "pull of the surface on a point"},
        o.surface_loss_width);
  visit(FieldInfo{.name = "surface_reach_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 200,
                  .doc = "largest distance of a point that is drawn to the implicit face"},
        o.surface_reach_mm);
  visit(FieldInfo{.name = "surface_max_angle_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 180,
                  .doc = "largest angle between the normals of such a point and of the implicit "
                         "face"},
        o.surface_max_angle_deg);
  visit(FieldInfo{.name = "surface_range_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1e6,
                  .doc = "largest distance of such a point from the nearest dowel's point of the "
                         "model; beyond, the implicit face rests on no depth; weights that fall "
                         "with the distance perform worse"},
        o.surface_range_mm);
  visit(FieldInfo{.name = "surface_length_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 1000,
                  .doc = "correlation length of the errors of the implicit face, for sigma; the "
                         "estimate uses `surface_worth` instead"},
        o.surface_length_mm);
  visit(FieldInfo{.name = "rounds",
                  .min = 3,
                  .max = 1000,
                  .doc = "most rounds; each updates the points of the implicit face and the "
                         "normals; the first two move the pose alone, and the implicit face takes "
                         "part from the fourth on"},
        o.rounds);
  visit(FieldInfo{.name = "population_sd",
                  .min = 0.01,
                  .max = 100,
                  .doc = "standard deviation of the coefficients over people, for sigma; the "
                         "estimate uses mode_sd; people differ more than the model's sample"},
        o.population_sd);
  visit(FieldInfo{.name = "discrepancy_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "standard deviation that neither the modes nor the smooth field express; "
                         "part of sigma"},
        o.discrepancy_mm);
  visit(FieldInfo{.name = "unseen_reach_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1000,
                  .doc = "distance from all dowels and drawn points beyond which sigma grows, for "
                         "example where no bone was scanned"},
        o.unseen_reach_mm);
  visit(FieldInfo{.name = "unseen_rate",
                  .min = 0,
                  .max = 10,
                  .doc = "growth of sigma beyond unseen_reach_mm, in mm per mm"},
        o.unseen_rate);
}

// A dowel's tip and the model's point that is expected there.
struct ShapeTip {
  std::string label;
  ModelPoint at;
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec3 direction = Vec3::Zero();         // unit, direction of further errors
  double along_sd_mm = 0;                // standard deviation of an independent error along it
  double shared_sd_mm = 0;               // of an error along it that all tips of a person share
};

// A measurement of one coordinate of the mean of some points of the model.
struct ShapeMark {
  std::string label;
  std::vector<ModelPoint> at;             // at least one
  Vec3 position = Vec3::Constant(kNaN);   // mm; only its coordinate along `direction` counts
  Vec3 direction = Vec3::Constant(kNaN);  // unit
  double sd_mm = kNaN;                    // > 0
};

// A feature; points of the model nearer to it than clearance_mm are not drawn to the surface.
struct ShapeFeature {
  Vec3 position = Vec3::Constant(kNaN);  // of the mean, mm
  double clearance_mm = 15;
};

struct ShapeTarget {
  Similarity start;                  // subject_from_model
  std::vector<ShapeTip> tips;        // may be empty
  const TriMesh* surface = nullptr;  // outward, in the subject's frame; null: the tips alone
  // Points that are nearer to this bone than to the surface, and more than the surface's deviation
  // away from it, are not drawn to the surface: one of the two is then off by half the tissue or
  // more; null: none.
  const TriMesh* bone = nullptr;
  std::vector<ShapeFeature> features;
  std::vector<double> surface_sd_mm = {};     // one per point of the surface; empty: the option's
  std::vector<double> surface_error_mm = {};  // its errors, for sigma; empty: surface_sd_mm
  std::vector<ShapeMark> marks = {};
  std::vector<std::uint64_t> draws = {};  // random seeds of shapes to draw
  bool compute_spread = true;             // compute sigma and draws
};

struct ShapeEstimate {
  Similarity subject_from_model;
  Eigen::VectorXd coefficients;  // one per mode
  std::vector<Vec3> points;      // one per point of the model, in the subject's frame, mm
  // Standard deviation along the normal, one per point; empty if the target does not ask for it.
  std::vector<double> sigma_mm;
  std::vector<std::string> tip_labels;  // of the tips that took part, in their order
  // Distance from the shape to each tip along the shape's normal, > 0 outside.
  std::vector<double> tip_residual_mm;
  // The factor in (0, 1] by which the loss reduced the pull of each tip in the last round. A small
  // one marks a dowel that contradicts the model, the other dowels and the surface.
  std::vector<double> tip_weight;
  std::vector<double> mark_residual_mm;  // from the shape to each mark, along its direction
  std::vector<std::vector<Vec3>> drawn;  // points of each drawn shape
  // The solution itself: x of shape_model.h for each point of the model.
  ShapeFrame frame;
  ShapeParameters parameters;
  Eigen::MatrixXd field;       // of SmoothFieldFactor, one row per point of the model
  double field_rms_mm = kNaN;  // root mean square of the smooth field over the points
  int surface_points = -1;     // points drawn to the surface in the last round
  int rounds = -1;
  double last_move_mm = kNaN;  // largest move of a point in the last round
  bool usable = false;
};

// Minimises with Ceres, over s, R, t, w and a of shape_model.h,
//   sum_tips Huber_width(r' C^-1 r) + sum_marks Huber_width((d . (m - x))^2 / sd^2)
//     + worth / points sum_surface Huber_width((n . (c - x))^2 / sd(c)^2)
//     + |w / mode_sd|^2 + |a|^2 + (ln s / scale_sd)^2,
// where C is that of MakeWhitening with the shape's own normal, c is the surface's closest point to
// x and n its normal. A weak prior of 1 rad and 100 mm on the pose matters only without other
// information. Each round updates the closest points and normals.
//
// The posterior is the normal distribution of the last linearisation, widened by MakePosterior: the
// surface shares the error of the nearest tip, and its own errors are smooth. Draws have this
// distribution. Sigma adds two parts in squares: discrepancy_mm, and unseen_rate (d -
// unseen_reach_mm) where the distance d on the mean from the nearest observed point exceeds
// unseen_reach_mm. The modes alone would be too confident, for example of a jaw without scanned
// bone.
//
// One thread, except for sigma; the number of threads does not change any byte. Throws InputError
// like CheckShapeModel (name: "shape model"), for a tip that is not on the model or not finite, for
// deviations that are not one per point of the surface, and for a start without a positive scale;
// Cancelled.
ShapeEstimate EstimateShape(const ShapeModel& model, const ShapeTarget& target,
                            const ShapeFitOptions& options, const RunContext& context);

}  // namespace semblance::problems
