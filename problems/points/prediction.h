// SPDX-License-Identifier: GPL-3.0-or-later
// Heights of a fitted surface at any place, with their uncertainty (`semblance predict`).
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/points/height_field.h"
#include "problems/points/point_fit.h"

namespace semblance::problems {

// The points of a fit by the auto plan and the figures that it found. Points that did not count
// are left out.
struct HeightEvidence {
  std::vector<Vec2> uv = {};
  std::vector<double> residual_mm = {};
  std::vector<double> weights = {};  // one per point, or none
  double noise_mm = kNaN;            // AutoReport
  double energy_weight = kNaN;       // PointFit
  double stretch = 1, direction_deg = 0;
  double effective_share = 1;  // AutoReport
};
HeightEvidence CollectEvidence(const PointFit& fit);

// One entry per place. NaN beyond the domain of the surface.
struct PredictedHeights {
  std::vector<double> z;
  std::vector<double> sd;         // of the surface; NaN without evidence
  std::vector<double> low, high;  // interval for a new observation; NaN without evidence
  std::vector<char> supported;    // 0 where the points do not support z, and beyond the domain
};

// Predicts z over x and y.
//   sd: the error of the surface (surface_sigma.h), times the ratio of the noise around the place
//   to the noise of all points, and over the square root of the effective share of the points.
//   interval: z -+ q sqrt(noise^2 + sd^2), where q is the quantile of the points' own distances
//   over the noise around them, so that it holds for long tails too. A new observation is assumed
//   to be as exact as the points around it. supported: the surface is
//   known at least as well as by one observation, or nearly as well as at the points. Without
//   evidence: within the domain.
class HeightPredictor {
 public:
  // Throws InputError for a surface that is no graph over x and y, and as SurfaceSigma does.
  HeightPredictor(HSplineSurface surface, std::optional<HeightEvidence> evidence);

  // level: share of new observations within the interval, above 0 and below 1.
  PredictedHeights At(std::span<const Vec2> xy, double level, int threads) const;
  const GraphMap& map() const { return map_; }

 private:
  // The noise by cells of a grid over the domain, row by row: of a point of mean weight, and of a
  // new observation, whose weight is like those of the points in the cell.
  struct NoiseGrid {
    int across = 1;
    std::vector<double> of_mean_weight, sd;
    double At(const Vec2& uv) const;
    double OfMeanWeightAt(const Vec2& uv) const;
  };
  NoiseGrid FindNoise() const;
  double FindLimit() const;

  HSplineSurface surface_;
  GraphMap map_;
  std::optional<HeightEvidence> evidence_;
  std::shared_ptr<const SurfaceSigma> sigma_;  // null without evidence
  NoiseGrid noise_;
  double limit_ = kNaN;  // of the sd of supported places, before the noise around them counts
};

// Reads the surface and the evidence of a fit.
//   path: surface.hspline.json or its folder.
struct FittedHeights {
  HSplineSurface surface;
  std::optional<HeightEvidence> evidence;
  std::string note;  // why there is no evidence; empty if there is some
};
// Throws IoError for files that cannot be read or hold something else.
FittedHeights ReadFittedHeights(const std::filesystem::path& path);

// The nodes of a square grid over the domain, from its lowest x and y, row by row from the lowest
// y.
struct PlaceGrid {
  double step = kNaN;
  int columns = 0, rows = 0;
  Vec2 origin = Vec2::Constant(kNaN);

  std::vector<Vec2> Places() const;
};
// Throws InputError for a step that is not positive or gives more than 1e8 nodes.
PlaceGrid MakePlaceGrid(const GraphMap& map, double step);

// A table with the columns x, y, z, sd, low, high, supported, and the same as .npy (doubles).
std::string PredictionCsv(std::span<const Vec2> xy, const PredictedHeights& heights);
std::string PredictionNpy(std::span<const Vec2> xy, const PredictedHeights& heights);
// An ASCII grid of ESRI: z, and -9999 where it is not supported.
std::string PredictionAsc(const PlaceGrid& grid, const PredictedHeights& heights);

}  // namespace semblance::problems
