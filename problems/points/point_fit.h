// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance fit`: an H-spline fitted to any scattered points. Each point goes one way: read
// (point_files.h), parametrised once (fitting/parameters), fitted (fitting/fit.h), reported
// (fit_report.h).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fitting/plan/attribute_fit.h"
#include "fitting/plan/fit_result.h"
#include "fitting/relaxation/foot_moves.h"
#include "fitting/solve/surface_sigma.h"
#include "problems/experiment/step_clock.h"
#include "problems/points/fit_maps.h"
#include "problems/points/point_fit_options.h"
#include "problems/points/point_table.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

// The quantities of all points are in the order of the table, outliers included. Those of points
// that were left out before the fit are NaN.
struct PointFit {
  std::string parameters;  // a name of ParameterSource
  std::string how;         // the plane, axis or map in words; empty for given (u,v)
  std::string unit = {};   // of lengths, from the options; empty if it is not known
  bool is_graph = false;   // heights z over x and y (Parametrisation)
  // The fit was done with z times this factor, so that the unit of z has no effect (HeightFactor).
  // All figures are in the unit of the points. 1 for surfaces that are no heights over x and y.
  double height_factor = 1;
  double energy_weight = kNaN;       // of the thin-plate energy, as in AutoReport before terms
  std::vector<double> weights = {};  // of all given points, NaN where left out; none if equal
  MapFaults map_faults;              // of the map that was used
  std::optional<FootMoves> moves =
      {};  // moves of (u,v) before the fit, if relaxation was asked for
  // point_rms_mm counts all points alike, outliers apart. The weights of smoothness are those that
  // the written terms would need for the same surface.
  FitResult fit;
  double weighted_rms_mm = kNaN;  // RMS with the points' weights; NaN if all weights are equal
  double rms_of_all_mm = kNaN;    // RMS of all points alike, outliers included
  DistanceQuantiles distance;     // of the points from the surface, outliers apart
  std::vector<PointAttribute> attributes;         // as given
  std::vector<std::vector<double>> attribute_at;  // fitted, at the points
  AttributeFit attribute_fit;
  std::shared_ptr<const SurfaceSigma> sigma;  // of the surface; null without `sigma`
  std::vector<double> sigma_mm;               // at the points
  // Noise of the points over the given sigma, outliers apart; NaN without given sigma, and for
  // other plans than auto.
  double sigma_factor = kNaN;
  // The distance that the surface goes beyond the points' box, in diagonals of the box. Heights
  // over x and y count in heights of the box.
  double reach = kNaN;
  double off = kNaN;  // RMS distance of the points in diagonals of the box, outliers apart; NaN for
                      // given (u,v) if the points lie on a line
  std::vector<std::uint32_t> strays =
      {};                               // left out before the fit, ascending: far from all others
  std::size_t not_finite = 0;           // points without a place, left out before the fit
  std::vector<std::string> notes = {};  // what was left out or looks doubtful, a sentence each
  std::vector<StepTime> times;

  // The reasons why the result cannot be used; empty if it can. Besides the faults of the fit
  // itself there are two: the surface goes three diagonals (or heights) beyond the points, where
  // nothing holds it; or the points lie a tenth of the diagonal from it, as on no single sheet.
  std::vector<std::string> Faults() const;
};

// Compares the points with the tolerance of an adaptive plan (fit_maps.h); nothing for other plans
// and for results that cannot be used.
std::optional<ToleranceReport> CompareWithTolerance(const PointFitOptions& options,
                                                    const PointFit& result);

// Leaves out points that are not finite and, without given (u,v), strays: points far beyond all
// others along x, y or z, either up to a fiftieth of the points or several with one value, such as
// -9999. Strays count as outliers. Throws InputError as Parametrise, StartSurface, Fit and
// FitAttributes do, for a closure that does not suit the parameters, for attributes that the table
// lacks, for moves of (u,v) together with exact points, and for a chord so fine that surface.ply
// would be too large (CheckChord).
PointFit FitPoints(PointTable table, const PointFitOptions& options, const RunContext& context);

// The file of the points.
struct PointSource {
  std::string name, sha256;
};

}  // namespace semblance::problems
