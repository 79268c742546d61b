// SPDX-License-Identifier: GPL-3.0-or-later
// The figures by which a fit of points is judged.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "problems/points/point_fit.h"
#include "problems/points/point_table.h"

namespace semblance::problems {

// Facts about the points that are needed after the fit, which frees their positions.
struct GivenPoints {
  std::vector<double> weights;
  std::vector<Vec2> exact_uv;
  Box3 box;
  bool has_uv = false;
  bool on_line = false;  // heights alone, without places
  bool has_sigma = false;
  double plane_rms = kNaN;  // of the distances from the best plane, in the fit's coordinates
};

GivenPoints KeepFacts(const PointTable& table, ParameterSource source,
                      std::span<const ExactPoint> exact);

// Sets `reach` and `off`, in the coordinates of the fit.
void CompareShapes(const GivenPoints& given, PointFit& result);
// Sets the figures of the points' distances, in the unit of the points.
void CompareDistances(const GivenPoints& given, PointFit& result);

// States that a part of the points lies much farther from the surface than most; empty if none
// does, or if those are outliers.
std::string TailText(const GivenPoints& given, const FitResult& fit, std::string_view unit);

// States that the surface is no nearer to the points than a plane, although they have relief; empty
// otherwise.
std::string ReliefText(const GivenPoints& given, const PointFit& result);

// States that points of great weight, or small sigma, are the noisier ones, as if weights were
// standard deviations or the other way round; empty if they are not.
std::string WeightText(const GivenPoints& given, const FitResult& fit, std::string_view unit);

// States that many points lie at the places of others and count as measured twice; empty otherwise.
std::string TwiceText(const FitResult& fit);

}  // namespace semblance::problems
