// SPDX-License-Identifier: GPL-3.0-or-later
// A subject's dowels and implicit face as observations of a face prior.
#pragma once

#include <span>

#include "interp/dowels/dowel.h"
#include "problems/prior/face_prior.h"

namespace semblance {

// How sure the depths of dowels are that stand in a table of a population and were not measured.
struct TableDepthOptions {
  double sd_mm = 1;
  double share = 0.2;
  double shared = 0.7;
};
template <class Visitor>
void Fields(Visitor& visit, TableDepthOptions& o) {
  visit(FieldInfo{.name = "sd_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "standard deviation along the dowel of a depth from a table"},
        o.sd_mm);
  visit(FieldInfo{.name = "share",
                  .min = 0,
                  .max = 5,
                  .doc = "added to its square: this part of the depth"},
        o.share);
  visit(FieldInfo{.name = "shared",
                  .min = 0,
                  .max = 1,
                  .doc = "part of the table's own standard deviation (where it states none, of "
                         "the one above) in which all depths of a person err together, as those "
                         "of a fat person do: it widens sigma and moves no face"},
        o.shared);
}

// Standard deviation along the dowel of its depth from a table.
double DepthSd_mm(const TableDepthOptions& options, const Dowel& dowel);

// dowels: with depths, in the subject's frame; those whose site the prior does not have are left
// out. from_table: null for measured depths. The start is the similarity that brings the mean's
// sites to the tips. implicit: outward, must outlive the result; may be null. Throws InputError if
// fewer than three dowels are left.
ShapeTarget PriorTarget(const FacePrior& prior, std::span<const Dowel> dowels,
                        const TableDepthOptions* from_table, const TriMesh* implicit);

}  // namespace semblance
