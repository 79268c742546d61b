// SPDX-License-Identifier: GPL-3.0-or-later
// The deviation of a face from a statistical model that neither its modes nor its smooth field
// express: a random field over the control vertices of a level, as sparse rows of a least-squares
// problem.
#pragma once

#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/hspline/bspline.h"

namespace semblance::problems {

struct ResidualFieldOptions {
  double sd_mm = 1;
  double range_mm = 20;
};
template <class Visitor>
void Fields(Visitor& visit, ResidualFieldOptions& o) {
  visit(FieldInfo{.name = "sd_mm",
                  .unit = "mm",
                  .min = 1e-3,
                  .max = 100,
                  .doc = "standard deviation of the face from the model; more follows dowels and "
                         "seeds, less follows the model"},
        o.sd_mm);
  visit(FieldInfo{.name = "range_mm",
                  .unit = "mm",
                  .min = 1,
                  .max = 500,
                  .doc = "distance at which such deviations hardly correlate any more (0.14); a "
                         "dowel moves the face about as far as this"},
        o.range_mm);
}

// sum_k weight[k] r[index[k]] over the deviations r of vertices has the distribution N(0, 1), along
// each axis, independently of all other rows. Between three and five vertices.
struct FieldRow {
  std::vector<int> index;
  std::vector<double> weight;
};

// One row per vertex of the net: those of tau C^-1/2 (kappa^2 C + G), where C holds the areas of
// the vertices and G is the Laplacian of finite volumes with the net's own lengths. This is a
// Matern field with nu = 1, by its stochastic differential equation (Lindgren, Rue & Lindstroem
// 2011), with
//   kappa = sqrt(8) / range,  tau = 1 / (sqrt(4 pi) kappa sd).
// So the field has the same distribution at every level. At the border, where nothing lies beyond,
// its deviation grows by up to the root of 2, in corners by 2. The net has at least two columns and
// two rows; edges shorter than a hundredth of the mean count as that.
std::vector<FieldRow> MakeFieldRows(const ControlNet& net, const ResidualFieldOptions& options);

}  // namespace semblance::problems
