// SPDX-License-Identifier: GPL-3.0-or-later
// A subject's dowels and implicit face as observations of a face prior, and how far each may be off
// for one person.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "interp/dowels/dowel.h"
#include "problems/face/face_prior.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// ---------------------------------------------------------------------------------------------
// Depths of a table
// ---------------------------------------------------------------------------------------------

// A table's depth differs from a person's in two parts. All depths of a person err together,
// because a fat face is fat everywhere (De Greef et al. 2009: body mass index dominates all
// depths). And each depth errs alone. On three heads with measured depths the mean of (depth -
// table) / deviation over the sites was 1.4, -0.8 and 0.2 against the T-Table, and 1.6, -0.5 and
// 0.6 against Rhine's table. The deviation about that mean was 0.7 to 1.2.
struct TableDepthOptions {
  double own = 0.9;
  double shared = 0.9;
};
template <class Visitor>
void Fields(Visitor& visit, TableDepthOptions& o) {
  visit(FieldInfo{.name = "own",
                  .min = 0,
                  .max = 5,
                  .doc = "part of the standard deviation of a table's depth by which that depth "
                         "errs alone; if the table states no deviation, the published one is "
                         "taken"},
        o.own);
  visit(FieldInfo{.name = "shared",
                  .min = 0,
                  .max = 5,
                  .doc = "part of it by which all depths of a person err together, as those of a "
                         "fat person do; it widens sigma and moves no face"},
        o.shared);
}

// The standard deviation of the dowel's depth among people. If its table states none, it is that of
// the T-Table 2023 at its site (Hona & Stephan 2024, adults pooled). If the T-Table lacks the site,
// it is 0.29 of the depth, which is the mean ratio of that table's deviations to its depths.
double PublishedSd_mm(const Dowel& dowel);

// The deviation of the part in which the depth errs alone.
double DepthSd_mm(const TableDepthOptions& options, const Dowel& dowel);

// ---------------------------------------------------------------------------------------------
// The implicit face between the dowels
// ---------------------------------------------------------------------------------------------

// Measured on two whole heads and a part of one, with measured depths, the implicit face is off by
// 1.4 mm (RMS) where tissue is 4 to 7 mm thick, by 2.4 mm at 12 mm and by 4.3 mm at 19 mm. It is
// off by 5 to 7 mm where no dowel lies within 30 mm. So sd^2 = 0.7^2 + (0.22 thickness)^2 near
// dowels. A rate > 0 makes the two whole heads worse (configs/studies/implicit_worth.yaml), because
// far from dowels the prior alone is off by more.
struct ImplicitSpreadOptions {
  double sd_mm = 0.7;
  double share = 0.22;
  double reach_mm = 15;
  double rate = 0;
  double sigma_rate = 0.1;
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
                  .doc = "this part of the tissue's thickness is added to it (as squares)"},
        o.share);
  visit(
      FieldInfo{.name = "reach_mm",
                .unit = "mm",
                .min = 0,
                .max = 1000,
                .doc = "farther than this from every dowel's base, `rate` and `sigma_rate` count"},
      o.reach_mm);
  visit(FieldInfo{.name = "rate",
                  .min = 0,
                  .max = 10,
                  .doc = "growth of the deviation beyond reach_mm, in mm per mm"},
        o.rate);
  visit(FieldInfo{.name = "sigma_rate",
                  .min = 0,
                  .max = 10,
                  .doc = "the same growth for sigma alone: the estimate should follow an uncertain "
                         "face rather than none, and sigma should state that it is uncertain"},
        o.sigma_rate);
}

// Two deviations per point of the implicit face, mm.
struct ImplicitSpread {
  std::vector<double> sd;     // the estimate weighs the point by this
  std::vector<double> error;  // sigma takes this as the error of the point
};

// The deviations follow from the thickness of the tissue (the distance of the point from the shell)
// and from the distance of its foot on the shell from the nearest dowel. table: adds the error of a
// table's depths, each by itself; null for measured depths. dowels: with depths, not empty.
ImplicitSpread ImplicitSpread_mm(const ImplicitSpreadOptions& options, const TriMesh& implicit,
                                 const TriMesh& shell, std::span<const Dowel> dowels,
                                 const TableDepthOptions* table, int threads);

// ---------------------------------------------------------------------------------------------
// Seeds of a fit that starts from a prior's face
// ---------------------------------------------------------------------------------------------

// Such a fit should follow the implicit face near dowels, where it is known. It should not follow
// it at nose, mouth and eyes, where the implicit face has no face's shape.
struct SeedTrustOptions {
  double reach_mm = 25;
};
template <class Visitor>
void Fields(Visitor& visit, SeedTrustOptions& o) {
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 0.1,
                  .max = 1e6,
                  .doc = "a seed at the distance d from the nearest dowel's tip has exp(-(d / "
                         "reach_mm)^2) of its weight"},
        o.reach_mm);
}

// exp(-(d / reach)^2), where d is the distance to the nearest tip, times a factor for each feature:
// 0 within its radius, 1 from twice its radius on, linear between. 1 without tips and features.
double SeedTrust(const Vec3& p, std::span<const Vec3> tips, std::span<const Sphere> features,
                 const SeedTrustOptions& options);

// Multiplies the weights of the seeds by their trust. Drops seeds whose trust is below 0.01.
void WeighSeeds(std::span<const Vec3> tips, std::span<const Sphere> features,
                const SeedTrustOptions& options, std::vector<FitPoint>& seeds);

// ---------------------------------------------------------------------------------------------
// The target of the estimate
// ---------------------------------------------------------------------------------------------

// dowels: with depths, in the subject's frame. A dowel takes part if the prior or `more` has its
// site. from_table: null for measured depths. implicit: outward, must outlive the result; may be
// null. The start is the similarity that brings the mean's own sites to the tips. Throws InputError
// if fewer than three dowels are at the prior's own sites.
ShapeTarget PriorTarget(const FacePrior& prior, std::span<const Dowel> dowels,
                        const TableDepthOptions* from_table, const TriMesh* implicit,
                        const std::map<std::string, ModelPoint>& more = {});

}  // namespace semblance::problems
