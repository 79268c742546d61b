# SPDX-License-Identifier: GPL-3.0-or-later
"""The laws that every depth scheme should obey, for one of your own."""
import numpy as np

from .errors import InputError
from .experiments import interpolate
from .plugins import Scheme


def check_scheme(scheme: Scheme, exact: bool = True, linear: bool = True, tolerance_mm: float = 1e-6) -> None:
    """Check the laws of depth schemes on a small dome of bone with nine depth markers.

    Every scheme must give the same depths twice, follow a rotation and a shift of the skull, ignore the order of the
    markers, and give equal depths for equal markers.

    Parameters
    ----------
    scheme : Scheme
        Made by `semblance.scheme`.
    exact : bool
        Whether the depth at a marker's base is the marker's, as of an interpolation, not of a smoothing.
    linear : bool
        Whether depths are linear in the markers' depths.
    tolerance_mm : float
        Largest deviation.

    Raises
    ------
    AssertionError
        Names the law and the largest deviation.
    """
    if not isinstance(scheme, Scheme):
        raise InputError(f"{scheme!r} is no scheme; decorate the function with @semblance.scheme(\"name\")")
    scene = _Scene()
    depths_mm = scene.depths(scheme)
    _require(np.isfinite(depths_mm).any(), "a scheme gives some vertex a depth")
    _compare("the same input gives the same depths", scene.depths(scheme), depths_mm, 0)
    rotation = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    _compare("depths follow a rotation and a shift of the skull", scene.moved(rotation, [30, -20, 50]).depths(scheme), depths_mm, tolerance_mm)
    _compare("the order of the markers has no effect", scene.reordered([4, 1, 8, 0, 7, 3, 2, 6, 5]).depths(scheme), depths_mm, tolerance_mm)
    equal = scene.depths(scheme, np.full(9, 7.5))
    _compare("equal depths give that depth everywhere", equal[np.isfinite(equal)], 7.5, tolerance_mm)
    if exact:
        _compare("the depth at a marker is the marker's", depths_mm[scene.markers], scene.given_mm, tolerance_mm)
    if linear:
        other = np.linspace(3, 12, 9)
        _compare("depths are linear in the markers' depths", scene.depths(scheme, 0.5 * scene.given_mm + 2 * other),
                 0.5 * depths_mm + 2 * scene.depths(scheme, other), tolerance_mm)


class _Scene:
    """A dome of bone, markers on nine of its vertices, and a network of eight areas.

    The dome is skewed, so that no vertex is equally far from two markers: a scheme that jumps there, such as the mean of the nearest
    three markers, would follow a rotation only up to rounding.
    """

    def __init__(self):
        side = np.linspace(-1, 1, 21)
        x, y = np.meshgrid(side, side)
        x, y = x + 0.11 * y + 0.04 * x**2, y + 0.05 * x * y + 0.03 * y**2
        self.vertices = np.column_stack([60 * x.ravel(), 60 * y.ravel(), 30 * (1 - 0.5 * (x**2 + y**2)).ravel()])
        corner = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
        self.triangles = np.vstack([np.column_stack([corner, corner + 1, corner + 22]), np.column_stack([corner, corner + 22, corner + 21])])
        self.markers = np.array([21 * row + column for row in (2, 10, 18) for column in (2, 10, 18)])
        self.directions = np.tile([0.0, 0.0, 1.0], (9, 1))
        self.given_mm = np.array([5.0, 7, 9, 4, 12, 8, 6, 5, 10])
        self.areas = np.array([[a, b, c] for k in (0, 1, 3, 4) for a, b, c in ((k, k + 1, k + 4), (k, k + 4, k + 3))])

    def depths(self, scheme, given_mm=None):
        return interpolate(self.vertices, self.triangles, self.vertices[self.markers], self.directions,
                           self.given_mm if given_mm is None else given_mm, scheme, areas=self.areas)[0]

    def moved(self, rotation, shift):
        scene = _Scene()
        scene.vertices = self.vertices @ rotation.T + shift
        scene.directions = self.directions @ rotation.T
        return scene

    def reordered(self, order):
        scene = _Scene()
        scene.markers, scene.given_mm = self.markers[order], self.given_mm[order]
        scene.areas = np.argsort(order)[self.areas]
        return scene


def _compare(law, found, expected, tolerance_mm):
    expected = np.broadcast_to(expected, np.shape(found))
    _require((np.isnan(found) == np.isnan(expected)).all(), f"{law}: other vertices have a depth")
    off_mm = np.nanmax(np.abs(found - expected), initial=0)
    _require(off_mm <= tolerance_mm, f"{law}: off by {off_mm:.3g} mm")


def _require(holds, law):
    if not holds:
        raise AssertionError(law)
