# SPDX-License-Identifier: GPL-3.0-or-later
"""Hierarchical B-spline surfaces."""
import os

import numpy as np

from . import _semblance
from .arrays import floats
from .errors import InputError


class HSpline:
    """A hierarchical B-spline surface: bicubic, with dyadic levels.

    Detail is stored as offsets from the next coarser level, so it moves along when a coarser level moves.
    A surface compares equal to one of the same control vertices. It can be copied and pickled without loss.

    Parameters
    ----------
    level0 : array of shape (rows, columns, 3)
        Control vertices of level 0 in mm. An open side has three more vertices than patches.
    max_level : int
        Finest level that may hold detail.
    periodic_u : bool
        Whether the surface closes in u, as a tube does.
    """

    __hash__ = None

    def __init__(self, level0, max_level: int = 0, periodic_u: bool = False):
        self._surface = _semblance.Surface(floats(level0, "level0"), max_level, periodic_u)

    @classmethod
    def _of(cls, surface):
        self = cls.__new__(cls)
        self._surface = surface
        return self

    @classmethod
    def read(cls, path) -> "HSpline":
        """Read a .hspline.json without loss. Raises IoError for any other file."""
        return cls._of(_semblance.Surface.read(os.fspath(path)))

    def write(self, path, chord_mm: float | None = None, threads: int = 1) -> None:
        """Write the surface in the format of the path's ending.

        Parameters
        ----------
        path : str or path
            .hspline.json keeps everything. .step, .iges and .vtu are exact. .ply, .glb, .vtp, .obj, .off
            and .stl are triangles.
        chord_mm : float, optional
            Largest distance of the triangles from the surface; default 0.1 mm, or 1/5000 of the extent if that is more.
        """
        self._surface.write(os.fspath(path), chord_mm, threads)

    @property
    def max_level(self) -> int:
        """Finest level that may hold detail."""
        return self._surface.max_level

    @property
    def patches(self) -> tuple[int, int]:
        """Number of patches of level 0 along u and v."""
        return self._surface.patches

    @property
    def periodic_u(self) -> bool:
        """Whether the surface closes in u."""
        return self._surface.periodic_u

    def __call__(self, u, v, clamp: bool = False) -> np.ndarray:
        """Return the points at (u, v): an array of the broadcast shape of u and v, with a last axis of 3."""
        u, v = np.broadcast_arrays(floats(u, "u"), floats(v, "v"))
        return self.points(np.column_stack([u.ravel(), v.ravel()]), clamp=clamp).reshape(*u.shape, 3)

    def points(self, uv, threads: int = 1, clamp: bool = False) -> np.ndarray:
        """Return the n x 3 points in mm at n x 2 (u, v) in [0, 1].

        Raises InputError, with the row, for a (u, v) outside, unless `clamp` moves it to the border.
        """
        return self._surface.points(_domain(uv, clamp), threads)

    def normals(self, uv, threads: int = 1, clamp: bool = False) -> np.ndarray:
        """Return the n x 3 unit normals at n x 2 (u, v); zero where the tangents vanish. See `points`."""
        return self._surface.normals(_domain(uv, clamp), threads)

    def derivatives(self, uv, du: int, dv: int, clamp: bool = False) -> np.ndarray:
        """Return the n x 3 derivatives of order du in u and dv in v, with du + dv <= 2. See `points`."""
        return self._surface.derivatives(_domain(uv, clamp), du, dv)

    def project(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Return (uv, distance_mm) of the closest points of the surface to n x 3 points."""
        return self._surface.project(floats(points, "points"))

    def mesh(self, per_patch: int = 4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (vertices, triangles, uv), with per_patch quads along each side of a finest patch."""
        return self._surface.mesh(per_patch)

    def net(self, level: int) -> np.ndarray:
        """Return the control vertices of a level, rows x columns x 3: positions in mm that include coarser detail."""
        return self._surface.net(level)

    def set_net(self, level: int, net) -> None:
        """Set the control vertices of a level. Finer detail moves with them."""
        self._surface.set_net(level, floats(net, "net"))

    def edit(self, script) -> None:
        """Apply the edits of a script, as `semblance edit` does."""
        self._surface.edit(os.fspath(script))

    def copy(self) -> "HSpline":
        """Return an independent surface with the same control vertices."""
        return HSpline._of(self._surface.copy())

    def __copy__(self):
        return self.copy()

    def __deepcopy__(self, memo):
        return self.copy()

    def __getstate__(self):
        return self._surface.to_json()

    def __setstate__(self, text):
        self._surface = _semblance.Surface.from_json(text)

    def __eq__(self, other):
        if not isinstance(other, HSpline):
            return NotImplemented
        return self._surface.to_json() == other._surface.to_json()

    def __repr__(self):
        across, along = self.patches
        closed = ", periodic in u" if self.periodic_u else ""
        return f"<HSpline of {across} x {along} patches, levels 0 to {self.max_level}{closed}>"


def _domain(uv, clamp):
    uv = floats(uv, "uv")
    if clamp:
        return np.clip(uv, 0, 1)
    if uv.ndim == 2:
        outside = np.flatnonzero(((uv < 0) | (uv > 1)).any(axis=1))
        if outside.size:
            raise InputError(f"uv: row {outside[0]} is {uv[outside[0]].tolist()}, outside [0, 1]; clamp=True moves it to the border")
    return uv
