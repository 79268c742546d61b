// SPDX-License-Identifier: GPL-3.0-or-later
// The uncertainty of a run's face, from the uncertainty of its dowels and of the depths between
// them.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "interp/evaluation/scores.h"
#include "problems/experiment/experiment.h"
#include "problems/experiment/metrics/face_region.h"
#include "problems/experiment/skull_stage.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance::problems {

// Shares, 0..1, of the scored true skin whose distance from the face lies within the central
// interval of a normal distribution of the stated sigma (interp/evaluation/calibration.h).
struct SigmaCoverage {
  std::vector<double> curve;                   // at 5 %, 10 %, .. 95 %
  double at_90 = kNaN;                         // 0.9 for a true sigma
  double area_cm2 = kNaN;                      // of the counted skin
  std::map<std::string, double> of_part = {};  // at_90 of each counted part of the face
  DepthScores scores = {};                     // by area; proper scores, as for depths
};

struct FaceUncertainty {
  std::vector<double> sigma_mm;  // one per vertex of the tessellated face; NaN if unknown
  double median_mm = kNaN;       // of sigma by area, over the vertices that dowels or seeds hold
  double p95_mm = kNaN;
  double prior_sd = kNaN;             // ErrorPropagation::prior_sd
  double depth_length_mm = kNaN;      // correlation length of the depths (Kriging)
  double depth_signal_mm = kNaN;      // their standard deviation over the skull
  std::vector<std::string> left_out;  // terms of the fit that the propagation cannot include
  std::vector<HSplineSurface> samples;
};

// The result of a fit.
struct FittedFace {
  const HSplineSurface& rest;  // the placed template
  const FitTarget& target;     // of the last round; (u,v) as given to the fit
  const FitResult& fit;
  const Tessellation& face;
};

// The depths' errors are a Gaussian process over the skull. Kriging states its own covariance
// between points. The error of any other scheme has three parts:
//   1. the error between exact dowels, which kriging without a nugget states for these dowels;
//   2. the difference of the scheme from that kriging, taken as one deviation;
//   3. the error of the dowels. Its deviation is the one that the scheme states, else the dowels'
//   own
//      by inverse squared distance. It is correlated over kriging's length.
// A dowel's tip errs along the dowel, a seed along the face's normal. A seed also errs by
// implicit_sd_mm, over the same length. The part `shared` of a table's deviations is one error of
// all points, and the part `own` is correlated over that length. ErrorPropagation carries these
// errors through the fit. Sigma finally includes the template's own misfit. Throws InputError as
// ErrorPropagation does.
FaceUncertainty MakeUncertainty(const Experiment& experiment, const DepthStage& stage,
                                const FittedFace& fitted, const RunContext& context);

// The true skin with which sigma is compared.
struct TrueSkin {
  const TriMesh& mesh;
  std::span<const double> signed_mm;  // FaceMetrics::signed_mm
  std::span<const int> part = {};     // FaceRegion::part; empty: no figures of parts
};

// masks: parts of the face that are the template's, without dowels or seeds. Their skin does not
// count.
SigmaCoverage MeasureCoverage(const TrueSkin& skin, const TriMesh& face,
                              std::span<const double> sigma_mm, std::span<const Sphere> masks,
                              const RunContext& context);

}  // namespace semblance::problems
