// SPDX-License-Identifier: GPL-3.0-or-later
// How far a run's face may be off, from how far its dowels and what lies between them may be.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "fitting/fit.h"
#include "interp/evaluation/scores.h"
#include "problems/metrics/face_region.h"
#include "problems/pipeline/experiment.h"
#include "problems/pipeline/skull_stage.h"
#include "surfaces/hspline_query/tessellate.h"

namespace semblance {

// Shares, 0..1, of the scored true skin whose distance from the face lies within the central
// interval of a normal distribution of the stated sigma (interp/evaluation/calibration.h).
struct SigmaCoverage {
  std::vector<double> curve;                   // at 5 %, 10 %, .. 95 %
  double at_90 = kNaN;                         // 0.9 where sigma is true
  double area_cm2 = kNaN;                      // of the skin that counts
  std::map<std::string, double> of_part = {};  // at_90 of each part of the face that counts
  DepthScores scores = {};                     // by area; proper ones, as for depths
};

struct FaceUncertainty {
  std::vector<double>
      sigma_mm;             // one per vertex of the tessellated face; NaN where nothing is known
  double median_mm = kNaN;  // of sigma by area, over the vertices that dowels or seeds hold
  double p95_mm = kNaN;
  double prior_sd = kNaN;             // ErrorPropagation::prior_sd
  double depth_length_mm = kNaN;      // over which depths resemble each other (Kriging)
  double depth_signal_mm = kNaN;      // their standard deviation over the skull
  std::vector<std::string> left_out;  // terms of the fit that could not be taken into account
  std::vector<HSplineSurface> samples;
};

// What the fit left behind.
struct FittedFace {
  const HSplineSurface& rest;  // the placed template
  const FitTarget& target;     // of the last round; (u,v) as given to the fit
  const FitResult& fit;
  const Tessellation& face;
};

// The depths' errors are a Gaussian process over the skull. Kriging states its own, with its
// covariance between points. The error of any other has three parts: that between exact dowels,
// which kriging without a nugget states for the subject's dowels; what the scheme differs from that
// kriging, taken as one deviation; and that of the dowels themselves, of the deviation that the
// scheme states there (where it states none, the dowels' by inverse squared distance) and
// resembling itself over kriging's length. A dowel's tip
// is off along the dowel, a seed along the face's normal; a seed also by implicit_sd_mm, over the
// same length. Of a table's deviations the part `shared` is one error of all points, and the part
// `own` resembles itself over that length.
// ErrorPropagation carries this through the fit; sigma then has the template's own misfit too.
// Throws InputError as ErrorPropagation.
FaceUncertainty MakeUncertainty(const Experiment& experiment, const DepthStage& stage,
                                const FittedFace& fitted, const RunContext& context);

// What sigma is measured against.
struct TrueSkin {
  const TriMesh& mesh;
  std::span<const double> signed_mm;  // FaceMetrics::signed_mm
  std::span<const int> part = {};     // FaceRegion::part; none: no figures of parts
};

// masks: where the face is the template's and no dowel or seed was to be; the skin there does not
// count.
SigmaCoverage MeasureCoverage(const TrueSkin& skin, const TriMesh& face,
                              std::span<const double> sigma_mm, std::span<const Sphere> masks,
                              const RunContext& context);

}  // namespace semblance
