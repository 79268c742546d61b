// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of fit_bench; each prints its lines.
#pragma once

#include <string>

#include "fitting/problem/fit_schedule.h"
#include "tests/bench/fit_measure.h"

namespace semblance::bench {
using namespace problems;

// The adaptive fit of the head-like surface (scattered_data.h) at 1e4, 1e5 and 1e6 points, against
// figures of peers that are not in Debian.
void RunHead();

// The whole command at 1e6 and 1e7 points of the head: processor seconds and memory.
void RunCommand();

// Ten sets that are hard in different ways (point_sets.h), with nothing chosen, against MBA and
// FITPACK at their best on the truth.
void RunUntuned();

// The head at 1e5 points against FITPACK and ITK, where their Debian packages are there.
void RunPeers();

// (u,v) that are off, or found, moved to the points' feet before the fit that is told nothing.
void RunFeet();

// Points held out of a terrain and of a deep-drawn part with gaps, with `weight: auto`, and of real
// faces with nothing chosen, against MBA and FITPACK at their best.
void RunHeldOut();

// The share of a surface within the intervals of an adaptive fit that should hold 90 % of it.
void RunCoverage();

// Files of heights over x and y, with nothing chosen, against MBA at its best at places that were
// kept back. A set is NAME.csv.gz with the points and NAME.truth.npz, whose array xyz has the
// places and heights that were kept back. A set whose points lie at kept places too is also scored
// without these points.
void RunFiles(const std::string& folder);

// Points whose (u,v) are off, until the surface is where it should be.
void RunRelaxation();

// 1e6 points on one level against a direct solve of the same normal equations.
void RunLinear();

// `count` points of the head with noise 1e-4; finer vertices where a point is farther off than the
// tolerance. Errors on a grid of 400 x 400 that was not fitted.
Measured MeasureHead(int count, double tolerance, Solver solver = Solver::kFastest);

}  // namespace semblance::bench
