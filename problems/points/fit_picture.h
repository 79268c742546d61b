// SPDX-License-Identifier: GPL-3.0-or-later
// The pictures of a fit's page.
#pragma once

#include <string>
#include <vector>

#include "problems/points/fit_maps.h"
#include "problems/report/pictures/colour_map.h"

namespace semblance::problems {

// From 0 to what 98 % of the grid's distances are below.
ColourMap DistanceColours(const FitGrid& grid);
// The legend of these colours, for the page that shows SurfacePng or DomainPng.
Legend DistanceLegend(const FitGrid& grid, const std::string& unit);

// PNG: the surface from obliquely above, or from between front and side where it goes round: as it
// is, and by the points' distances.
std::string SurfacePng(const FitGrid& grid, int threads);

// PNG of the domain, u to the right and v upwards: the points' distances, and the level of each
// cell, the finest bright.
std::string DomainPng(const FitGrid& grid, const std::vector<FitCell>& cells);

// The scene of the page's 3-D view (scene_json.h): the surface, plain and by distance.
std::string FitScene(const FitGrid& grid, const std::string& unit);

}  // namespace semblance::problems
