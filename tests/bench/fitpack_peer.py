# SPDX-License-Identifier: GPL-3.0-or-later
"""FITPACK, through Debian's python3-scipy, as a peer of fit_bench.

fitpack_peer.py POINTS GRID PATCHES
  POINTS: doubles u v x y z, point by point; GRID: doubles x y z of the clean surface at the middles
  of a square grid of [0,1] x [0,1], u fastest. A bicubic least-squares spline of PATCHES x PATCHES
  patches for each coordinate (surfit with fixed knots). Prints processor seconds of the fit, and
  the root mean square and the largest distance from the clean surface.
"""
import math
import sys
import time

import numpy
from scipy.interpolate import LSQBivariateSpline


def main() -> None:
    points = numpy.fromfile(sys.argv[1]).reshape(-1, 5)
    clean = numpy.fromfile(sys.argv[2]).reshape(-1, 3)
    patches = int(sys.argv[3])
    knots = numpy.arange(1, patches) / patches
    begin = time.process_time()
    splines = [
        LSQBivariateSpline(points[:, 0], points[:, 1], points[:, 2 + c], knots, knots,
                           bbox=[0, 1, 0, 1]) for c in range(3)
    ]
    seconds = time.process_time() - begin
    side = math.isqrt(len(clean))
    middles = (numpy.arange(side) + 0.5) / side
    squares = numpy.zeros(len(clean))
    for c, spline in enumerate(splines):
        values = spline(middles, middles).T.reshape(-1)  # u fastest
        squares += (values - clean[:, c])**2
    print(seconds, math.sqrt(squares.mean()), math.sqrt(squares.max()))


main()
