# SPDX-License-Identifier: GPL-3.0-or-later
"""FITPACK, through Debian's python3-scipy, on points of which some were held out.

fitpack_heldout_peer.py POINTS HELD PATCHES...
  POINTS and HELD: doubles u v z, point by point, u and v in [0,1]. Bicubic least-squares splines of
  PATCHES x PATCHES patches (surfit with fixed knots), one a number given. Prints processor seconds
  of all, and of the one with the least root mean square distance from the points held out that
  distance and the largest.
"""
import sys
import time
import warnings

import numpy
from scipy.interpolate import LSQBivariateSpline


def main() -> None:
    warnings.simplefilter("ignore")  # of the rank, where patches have no points
    points = numpy.fromfile(sys.argv[1]).reshape(-1, 3)
    held = numpy.fromfile(sys.argv[2]).reshape(-1, 3)
    begin = time.process_time()
    found = []
    for patches in map(int, sys.argv[3:]):
        knots = numpy.arange(1, patches) / patches
        spline = LSQBivariateSpline(*points.T, knots, knots, bbox=[0, 1, 0, 1])
        off = spline.ev(held[:, 0], held[:, 1]) - held[:, 2]
        found.append((numpy.sqrt((off**2).mean()), abs(off).max()))
    print(time.process_time() - begin, *min(found))


main()
