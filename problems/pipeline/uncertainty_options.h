// SPDX-License-Identifier: GPL-3.0-or-later
// What a run says of how far its face may be off.
#pragma once

#include <cstdint>

#include "surfaces/base/fields.h"

namespace semblance {

struct UncertaintyOptions {
  bool sigma = true;              // sigma_mm per vertex of face.ply
  int samples = 0;                // faces to draw
  std::uint64_t random_seed = 1;  // which faces
  double dowel_sd_mm = 0;         // where the depth's source states none; 0: exact
  double implicit_sd_mm = 0.5;    // of the implicit face even where all depths are right
  double own = 0.9;               // part of a table's sd in which a depth errs alone
  double shared = 0.9;            // part of it in which a person's depths err together
  double template_sd_mm = 1;      // of the generic face, between points of the fit
  double unseen_sd_mm = 4;        // of it, far from any point
  double unseen_reach_mm = 25;    // how far that is
};
template <class Visitor>
void Fields(Visitor& visit, UncertaintyOptions& o) {
  visit(
      FieldInfo{.name = "sigma",
                .doc = "give each vertex of face.ply the standard deviation of its position along "
                       "the normal, sigma_mm"},
      o.sigma);
  visit(FieldInfo{.name = "samples",
                  .min = 0,
                  .max = 1000,
                  .doc = "faces drawn from the same distribution, sample_0.ply and on; of a fit or "
                         "a prior's face, not of one that is only placed or bent"},
        o.samples);
  visit(FieldInfo{.name = "random_seed", .doc = "which faces are drawn"}, o.random_seed);
  visit(
      FieldInfo{.name = "dowel_sd_mm",
                .unit = "mm",
                .min = 0,
                .max = 50,
                .doc = "of a fit without a prior: standard deviation of the depth of dowels whose "
                       "source states none; 0: measured ones are exact, and those of a table "
                       "have the published deviation of their site (Hona & Stephan 2024)"},
      o.dowel_sd_mm);
  visit(
      FieldInfo{.name = "implicit_sd_mm",
                .unit = "mm",
                .min = 0,
                .max = 50,
                .doc = "of a fit without a prior: how far the implicit face, and so a seed, is off "
                       "even where all depths are right; for a prior's face there is "
                       "face.implicit_spread"},
      o.implicit_sd_mm);
  visit(FieldInfo{.name = "own",
                  .min = 0,
                  .max = 5,
                  .doc = "of a fit without a prior: part of the standard deviation of a table's "
                         "depths by which a person's depths err each by itself; for a prior's face "
                         "there is face.table_depths"},
        o.own);
  visit(FieldInfo{.name = "shared",
                  .min = 0,
                  .max = 5,
                  .doc = "of a fit without a prior: part of it in which they all err together: a "
                         "fat face is fat everywhere"},
        o.shared);
  visit(FieldInfo{.name = "template_sd_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "of a fit without a prior: how far the generic face's own shape is from "
                         "the person's between dowels and seeds; 0 for a phantom, whose template "
                         "is its own"},
        o.template_sd_mm);
  visit(FieldInfo{.name = "unseen_sd_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "of a fit without a prior: added to that far from every dowel and seed, "
                         "where there is no bone or none was scanned"},
        o.unseen_sd_mm);
  visit(FieldInfo{.name = "unseen_reach_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 500,
                  .doc = "at the distance d from the nearest dowel or seed it is unseen_sd_mm "
                         "sqrt(1 - exp(-(d / unseen_reach_mm)^2))"},
        o.unseen_reach_mm);
}

}  // namespace semblance
