// SPDX-License-Identifier: GPL-3.0-or-later
// How far depths are off for one person: those that a table gives for a population, and those
// between the dowels, on which the implicit face rests.
#pragma once

#include <span>
#include <vector>

#include "interp/dowels/dowel.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Parts of the standard deviation of a table's depth. A person's depths err together, for a fat
// face is fat everywhere (De Greef et al. 2009: body mass index dominates them all), and each by
// itself. On three heads with measured depths the mean of (depth - table) / deviation over their
// sites was 1.4, -0.8 and 0.2 against the T-Table and 1.6, -0.5 and 0.6 against Rhine's table, and
// the deviation about that mean 0.7 to 1.2.
struct TableDepthOptions {
  double own = 0.9;     // of a table's sd, by which one depth errs alone
  double shared = 0.9;  // and all of a person together
};
template <class Visitor>
void Fields(Visitor& visit, TableDepthOptions& o) {
  visit(FieldInfo{.name = "own",
                  .min = 0,
                  .max = 5,
                  .doc = "part of the standard deviation of a table's depth by which that depth "
                         "errs alone; where the table states none, of the one published"},
        o.own);
  visit(FieldInfo{.name = "shared",
                  .min = 0,
                  .max = 5,
                  .doc = "part of it in which all depths of a person err together, as those of a "
                         "fat person do: it widens sigma and moves no face"},
        o.shared);
}

// On two whole heads and a part of one, with measured depths, the implicit face is off by 1.4 mm
// (RMS) where tissue is 4 to 7 mm thick, by 2.4 at 12 and by 4.3 at 19 mm; where no dowel is within
// 30 mm by 5 to 7. So sd^2 = 0.7^2 + (0.22 thickness)^2 near dowels. Yet a rate makes the two whole
// heads worse (configs/studies/implicit_worth.yaml): there the prior alone is off by more.
struct ImplicitSpreadOptions {
  double sd_mm = 0.7;       // over thin tissue, near dowels
  double share = 0.22;      // of the tissue's thickness
  double reach_mm = 15;     // from every dowel
  double rate = 0;          // mm per mm beyond that
  double sigma_rate = 0.1;  // the same, for sigma
};
template <class Visitor>
void Fields(Visitor& visit, ImplicitSpreadOptions& o) {
  visit(FieldInfo{.name = "sd_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 100,
                  .doc = "standard deviation of the implicit face over thin tissue, near dowels"},
        o.sd_mm);
  visit(FieldInfo{.name = "share",
                  .min = 0,
                  .max = 5,
                  .doc = "added to its square: this part of the tissue's thickness"},
        o.share);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 1000,
                  .doc = "farther than this from every dowel's base"},
        o.reach_mm);
  visit(FieldInfo{.name = "rate",
                  .min = 0,
                  .max = 10,
                  .doc = "it also grows by so many mm with each mm farther"},
        o.rate);
  visit(FieldInfo{.name = "sigma_rate",
                  .min = 0,
                  .max = 10,
                  .doc = "the same, for sigma: the estimate would rather follow a face that may be "
                         "off than none, and sigma says that it may"},
        o.sigma_rate);
}

// One per point of the implicit face, mm.
struct ImplicitSpread {
  std::vector<double> sd;     // by which an estimate weighs it
  std::vector<double> error;  // how far it may be off, for sigma
};

// By the point's distance from the shell, which is the tissue's thickness, and that of its foot
// there from the nearest dowel. table: what the depths of a table err besides, each by itself; null
// for measured ones. dowels: with depths, not empty.
ImplicitSpread ImplicitSpread_mm(const ImplicitSpreadOptions& options, const TriMesh& implicit,
                                 const TriMesh& shell, std::span<const Dowel> dowels,
                                 const TableDepthOptions* table, int threads);

// The standard deviation of the dowel's depth among people: what its table states, else that of
// the T-Table 2023 at its site (Hona & Stephan 2024, adults pooled), else, where that lacks the
// site, 0.29 of the depth, which is the mean of that table's deviations in terms of its depths.
double PublishedSd_mm(const Dowel& dowel);

// Of the part in which the depth errs alone.
double DepthSd_mm(const TableDepthOptions& options, const Dowel& dowel);

}  // namespace semblance
