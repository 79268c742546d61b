# SPDX-License-Identifier: GPL-3.0-or-later
"""An estimator in the style of scikit-learn, which need not be installed."""
import warnings

import numpy as np

from .arrays import refuse_masked
from .points import fit

try:
    from sklearn.base import BaseEstimator, RegressorMixin
    from sklearn.utils.validation import check_array, check_is_fitted, check_X_y
except ImportError:
    BaseEstimator = RegressorMixin = None

# A fit needs 16 distinct points; copies of a smaller table stand beside each other.
LEAST_POINTS = 16
# Heights over x and y, whatever plane the points would choose.
HEIGHTS = {"parameters": {"type": "plane", "normal": [0, 0, 1], "folds": "accept"}}


def _plain_base():
    """The part of BaseEstimator and RegressorMixin that users of the estimator call."""
    import inspect

    class Base:
        def get_params(self, deep=True):
            return {name: getattr(self, name) for name in inspect.signature(type(self)).parameters}

        def set_params(self, **parameters):
            for name, value in parameters.items():
                if name not in self.get_params():
                    raise ValueError(f"there is no parameter '{name}'; there are {sorted(self.get_params())}")
                setattr(self, name, value)
            return self

        def score(self, X, y, sample_weight=None):
            y, weight = np.asarray(y, float), np.ones(len(y)) if sample_weight is None else np.asarray(sample_weight, float)
            mean = np.average(y, weights=weight)
            return 1 - np.sum(weight * (y - self.predict(X)) ** 2) / np.sum(weight * (y - mean) ** 2)

    return (Base,)


class SurfaceRegressor(*(_plain_base() if BaseEstimator is None else (RegressorMixin, BaseEstimator))):
    """Heights over x and y as a smooth surface with an uncertainty.

    Parameters
    ----------
    options : dict, optional
        Options of `semblance.fit`.
    level : float
        Share of new observations that `predict_interval` holds.
    threads : int

    Attributes
    ----------
    fit_ : PointFit
        The fit of the points.

    Notes
    -----
    The surface is over the two features. More than two features are replaced by their first two principal components,
    and a single one by itself. Outside the rectangle of the points the heights are those of the nearest place in it;
    standard deviations and intervals are infinite there. Where points are few inside it, ask `fit_.predict(X)["supported"]`.
    """

    def __init__(self, options=None, level=0.9, threads=1):
        self.options = options
        self.level = level
        self.threads = threads

    def fit(self, X, y, sample_weight=None):
        """Fit the surface to heights y at places X, an array of shape (n, 2). Returns the estimator.

        Faults and notes of the fit become warnings.
        """
        for values, name in ((X, "X"), (y, "y"), (sample_weight, "sample_weight")):
            refuse_masked(values, name)
        X, y = self._check_table(X, y)
        weights = None if sample_weight is None else np.asarray(sample_weight, float)
        if weights is not None and weights.shape != y.shape:
            raise ValueError(f"sample_weight has the shape {weights.shape}; it must be {y.shape}, one number per row")
        if weights is not None:
            X, y, weights = X[weights > 0], y[weights > 0], weights[weights > 0]
        self.n_features_in_ = X.shape[1]
        self.mean_ = X.mean(axis=0)
        axes = np.linalg.svd(X - self.mean_, full_matrices=False)[2] if X.shape[1] > 2 else np.eye(X.shape[1])
        self.axes_ = np.sign(axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)])[:2, None] * axes[:2]
        points = np.column_stack([self._places(X), y])
        points, weights = _spread(points, weights)
        self.fit_ = fit(points, weights=weights, threads=self.threads, **{**HEIGHTS, **(self.options or {})})
        self.low_, self.high_ = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        for words in (*self.fit_.faults, *self.fit_.notes):
            warnings.warn(words, stacklevel=2)
        return self

    def predict(self, X, return_std=False):
        """Return the heights at n x 2 places, or with `return_std` a tuple of heights and their standard deviations.

        These are deviations of the surface; for a new observation use `predict_interval`.
        """
        found = self._predict(X)
        return (found["z"], found["sd"]) if return_std else found["z"]

    def predict_interval(self, X):
        """Return the ends (low, high) of the interval that holds the share `level` of new observations."""
        found = self._predict(X)
        return found["low"], found["high"]

    def _more_tags(self):
        return {"poor_score": True}  # scikit-learn's test data have ten features, of which a surface sees two axes

    def _predict(self, X):
        if BaseEstimator is not None:
            check_is_fitted(self, "fit_")
        elif not hasattr(self, "fit_"):
            raise ValueError("this SurfaceRegressor is not fitted yet; call fit")
        X = self._check_places(X)
        if X.shape[1] != self.n_features_in_:
            raise ValueError(f"X has {X.shape[1]} features, but SurfaceRegressor is expecting {self.n_features_in_} features as input")
        places = self._places(X)
        inside = np.clip(places, self.low_, self.high_)
        found = self.fit_.predict(inside, self.level, self.threads)
        outside = np.any(np.abs(places - inside) > 1e-9 * (self.high_ - self.low_), axis=1)
        for name, unknown in (("sd", np.inf), ("low", -np.inf), ("high", np.inf)):
            found[name] = np.where(outside, unknown, found[name])
        return found

    def _places(self, X):
        places = (X - self.mean_) @ self.axes_.T + (self.mean_ if X.shape[1] <= 2 else 0)
        return np.column_stack([places, np.zeros(len(X))]) if X.shape[1] == 1 else places

    def _check_table(self, X, y):
        if BaseEstimator is not None:
            return check_X_y(X, y, dtype=float, y_numeric=True, ensure_min_samples=2)
        return self._check_places(X), np.asarray(y, float)

    def _check_places(self, X):
        if BaseEstimator is not None:
            return check_array(X, dtype=float)
        X = np.asarray(X, float)
        if X.ndim != 2:
            raise ValueError(f"X has the shape {X.shape}; it must be n x 2")
        return X


def _spread(points, weights):
    """Add copies of the points beside themselves where they lie on one line or are too few for a fit."""
    extent = np.ptp(points[:, :2], axis=0)
    for axis in (0, 1):
        if extent[axis] <= 1e-12 * max(extent.max(), 1e-300):
            width = extent[1 - axis] or 1.0
            points = np.concatenate([points + width * step * np.eye(3)[axis] for step in np.linspace(-0.5, 0.5, 5)])
            weights = None if weights is None else np.tile(weights, 5)
    distinct = len(np.unique(points, axis=0))
    if distinct < LEAST_POINTS:
        order = np.lexsort(points.T)  # so that the order of the rows has no effect
        points, weights = points[order], None if weights is None else weights[order]
        copies = -(-LEAST_POINTS // distinct)
        step = 1e-3 * (np.ptp(points, axis=0) * [1, 1, 0] + [1e-9, 1e-9, 0])
        points = np.concatenate([points + step * k * [1, (-1) ** k, 1] for k in range(copies)])
        weights = None if weights is None else np.tile(weights, copies)
    return points, weights
