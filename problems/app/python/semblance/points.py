# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces through scattered points."""
import dataclasses

import numpy as np

from . import _semblance
from .arrays import floats
from .errors import InputError
from .options import option_text
from .surface import HSpline


@dataclasses.dataclass(eq=False, repr=False)
class PointFit:
    """Result of `fit`. Arrays have one entry per given point, in the given order. It can be pickled.

    Attributes
    ----------
    surface : HSpline
    uv : array of shape (n, 2)
        (u, v) of each point.
    residuals_mm : array
        Distance of each point from the surface at its (u, v).
    rms_mm, rms_of_all_mm : float
        RMS distance of the points that were used, and of all points, outliers included.
    noise_mm : float
        Standard deviation of a point along one axis, by the fit. NaN for other plans than auto.
    held_out_mm : float
        RMS error along one axis at the tenth of the points that was held out. NaN for other plans than auto.
    outliers : array of int
        Indices of the points that had no influence.
    sigma_mm : array or None
        Standard deviation of the surface at each point, with the option ``sigma=True``.
    attributes : dict of arrays
        The fitted value of each attribute at each point.
    parameters : str
        Source of (u, v).
    faults, notes : lists of str
        Reasons why the result cannot be used; what was left out or looks doubtful.
    report : str
        The statements of `semblance fit` about noise, outliers and detail.
    """

    surface: HSpline
    uv: np.ndarray
    residuals_mm: np.ndarray
    rms_mm: float
    rms_of_all_mm: float
    noise_mm: float
    held_out_mm: float
    outliers: np.ndarray
    sigma_mm: np.ndarray | None
    attributes: dict
    parameters: str
    faults: list
    notes: list
    report: str
    _attribute_surfaces: list
    _evidence: dict | None

    @property
    def usable(self) -> bool:
        """Whether the result can be used: it has no faults."""
        return not self.faults

    def attribute(self, name: str, uv) -> np.ndarray:
        """Return the fitted values of an attribute at n x 2 (u, v)."""
        names = list(self.attributes)
        if name not in names:
            raise InputError(f"there is no attribute '{name}'; the fit has {names}")
        return self._attribute_surfaces[names.index(name)].points(uv)[:, 0]

    def predict(self, xy, level: float = 0.9, threads: int = 1) -> dict:
        """Predict heights at n x 2 places, for a fit of heights over x and y by plan: auto.

        Parameters
        ----------
        level : float
            Share of new observations that the interval holds, above 0 and below 1.

        Returns
        -------
        dict of arrays
            z; sd, of the surface; low and high, the interval; supported, False where the points do not support z.
        """
        if self._evidence is None:
            raise InputError("predict needs heights over x and y, and a fit by plan: auto with solver: fastest")
        return _semblance.predict(self.surface._surface, self._evidence, floats(xy, "xy"), level, threads)

    def __call__(self, x, y) -> np.ndarray:
        """Return the predicted heights at x and y, in their broadcast shape."""
        x, y = np.broadcast_arrays(floats(x, "x"), floats(y, "y"))
        return self.predict(np.column_stack([x.ravel(), y.ravel()]))["z"].reshape(x.shape)

    def __eq__(self, other):
        if not isinstance(other, PointFit):
            return NotImplemented
        return self.surface == other.surface and np.array_equal(self.uv, other.uv) and np.array_equal(self.residuals_mm, other.residuals_mm, equal_nan=True)

    __hash__ = None

    def __repr__(self):
        return f"<PointFit of {len(self.uv)} points: {'usable' if self.usable else 'not usable'}, RMS {self.rms_mm:.3g}, {len(self.outliers)} outliers>"


def fit(points, uv=None, weights=None, threads: int = 1, *, sigma_of_points=None, triangles=None, exact=None, exact_normals=None, attributes=None, **options) -> PointFit:
    """Fit an H-spline to scattered points, refined where they need it.

    Parameters
    ----------
    points : array of shape (n, 3)
        In mm. A row that is not finite, or masked, is an error.
    uv : array of shape (n, 2), optional
        Their (u, v); without it the option `parameters` decides.
    weights, sigma_of_points : arrays of n numbers above 0, optional
        Weights, or standard deviations of the points' coordinates; one of the two.
    triangles : array of shape (m, 3), optional
        Triangles between the points, for ``parameters="mesh"``.
    exact : array of indices or n booleans, optional
        Points that the surface must meet exactly.
    exact_normals : array of shape (k, 3), optional
        Normal of the surface at each exact point; a row of zeros leaves it free.
    attributes : dict of arrays, optional
        Further numbers of each point, by name, which are fitted over the surface.
    **options
        Those of a configuration of `semblance fit`, as nested dictionaries, e.g.
        ``fit={"plan": {"type": "adaptive", "tolerance_mm": 0.1}}``. `semblance.fit_options()` describes all of them:
        patches_u, patches_v, closure, parameters, fit, sigma, unit and others.

    Returns
    -------
    PointFit

    Raises
    ------
    UnknownOptionError
        A TypeError for an option that does not exist, with the nearest one.
    InputError
        A ValueError for data or values that cannot be used, with the row.
    """
    if exact is not None:
        exact = np.asarray(exact)
        exact = np.flatnonzero(exact) if exact.dtype == bool else exact.astype("int64")
    given = {"points": floats(points, "points"), "uv": floats(uv, "uv"), "weights": floats(weights, "weights"),
             "sigma": floats(sigma_of_points, "sigma_of_points"), "triangles": triangles, "exact": exact,
             "exact_normals": floats(exact_normals, "exact_normals"),
             "attributes": {name: floats(values, name) for name, values in (attributes or {}).items()}}
    parts = _semblance.fit(given, option_text(options), threads)
    values = dict(zip(parts.pop("attribute_names"), parts.pop("attribute_values")))
    return PointFit(surface=HSpline._of(parts.pop("surface")), outliers=np.array(parts.pop("outliers"), int), attributes=values,
                    _attribute_surfaces=[HSpline._of(surface) for surface in parts.pop("attribute_surfaces")],
                    _evidence=parts.pop("evidence"), **parts)


def fit_options() -> str:
    """Describe every option of `fit`: path, type, default, range, unit and meaning."""
    return _semblance.fit_options()


def rows_term(uv, equals, du=0, dv=0, coefficients=None, weight: float = 1.0) -> dict:
    """Make a term of the fit of linear equations, for ``fit={"terms": [...]}``.

    Row k states that ``sum_j coefficients[k, j] * D S(uv[k, j])`` equals ``equals[k]``, where D is the derivative of
    order du in u and dv in v. Its cost is `weight` times the mean over the rows of the squared difference. A function
    of yours that is called per residual would be far slower.

    Parameters
    ----------
    uv : array of shape (n, 2) or (n, m, 2)
        One or m places per row, in [0, 1].
    equals : array of shape (n, 3)
        Right-hand sides in mm.
    du, dv : int or arrays of shape (n, m)
        Orders, at most 2 in all; 0 and 0 is the point itself.
    coefficients : array of shape (n, m), optional
        Default: 1.

    Examples
    --------
    >>> flat = rows_term([[0.0, v] for v in (0.2, 0.5, 0.8)], np.zeros((3, 3)), du=2)
    >>> fit(points, uv, fit={"plan": "adaptive", "terms": ["points", flat]})
    """
    uv = floats(uv, "uv")
    uv = uv[:, None] if uv.ndim == 2 else uv
    equals = floats(equals, "equals")
    if uv.ndim != 3 or uv.shape[2] != 2 or equals.shape != (len(uv), 3):
        raise InputError(f"uv has the shape {uv.shape} and equals {equals.shape}; expected n x m x 2 and n x 3")
    columns = []
    for name, values in (("du", du), ("dv", dv), ("coefficients", 1 if coefficients is None else coefficients)):
        if np.shape(values) not in ((), uv.shape[:2]):
            raise InputError(f"{name} has the shape {np.shape(values)}; expected one number or {uv.shape[:2]}, one per place")
        columns.append(np.broadcast_to(floats(values, name), uv.shape[:2]))
    entries = np.concatenate([uv, np.stack(columns, -1)], axis=2)
    for name, array in (("uv or coefficients", entries), ("equals", equals)):
        if not np.isfinite(array).all():
            raise InputError(f"{name}: row {np.argwhere(~np.isfinite(array))[0][0]} is not finite")
    return {"type": "rows", "weight": float(weight), "rows": [{"at": at, "equals": right} for at, right in zip(entries.tolist(), equals.tolist())]}
