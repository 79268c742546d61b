# SPDX-License-Identifier: GPL-3.0-or-later
"""FITPACK, through Debian's python3-scipy, with the number of patches that is best on the truth.

fitpack_untuned_peer.py POINTS GRID PATCHES...
  POINTS: doubles u v x y z, point by point; GRID: the same of the true surface. A bicubic
  least-squares spline of PATCHES x PATCHES patches for each coordinate that is not u or v itself.
  Goes through the numbers until there are fewer than eight points a patch or the error has plainly
  turned. Prints processor seconds of the best, its root mean square error and its largest.
"""
import sys
import time
import warnings

import numpy
from scipy.interpolate import LSQBivariateSpline


def main() -> None:
    warnings.simplefilter("ignore")  # of the rank, where patches have no points
    points = numpy.fromfile(sys.argv[1]).reshape(-1, 5)
    grid = numpy.fromfile(sys.argv[2]).reshape(-1, 5)
    heights = numpy.array_equal(grid[:, :2], grid[:, 2:4])
    best = (numpy.inf, numpy.inf, numpy.inf)  # RMS, largest, seconds
    for patches in map(int, sys.argv[3:]):
        if patches * patches > len(points) / 8 or best[2] > 30 and best[2] < numpy.inf:
            break
        knots = numpy.arange(1, patches) / patches
        begin = time.process_time()
        splines = {
            c: LSQBivariateSpline(points[:, 0], points[:, 1], points[:, 2 + c], knots, knots,
                                  bbox=[0, 1, 0, 1])
            for c in ([2] if heights else [0, 1, 2])
        }
        seconds = time.process_time() - begin
        squares = sum((spline.ev(grid[:, 0], grid[:, 1]) - grid[:, 2 + c])**2
                      for c, spline in splines.items())
        found = (numpy.sqrt(squares.mean()), numpy.sqrt(squares.max()), seconds)
        if found[0] > 1.5 * best[0]:
            break
        best = min(best, found)
    print(best[2], best[0], best[1])


main()
