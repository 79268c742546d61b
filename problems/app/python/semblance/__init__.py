# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces from skulls: H-splines, fits of scattered points, depths between depth markers, experiments and studies.

Lengths are in mm. Arrays are NumPy arrays of doubles.
"""
from ._semblance import __version__
from .errors import ConfigError, InputError, IoError, PluginError, UnknownOptionError
from .experiments import Cache, interpolate, run, study
from .plugins import DepthInput, Metric, Scheme, load_plugins, metric, scheme
from .points import PointFit, fit, fit_options, rows_term
from .regressor import SurfaceRegressor
from .results import FACE_PARTS, Result
from .surface import HSpline

__all__ = ["Cache", "ConfigError", "DepthInput", "FACE_PARTS", "HSpline", "InputError", "IoError", "Metric", "PluginError", "PointFit", "Result", "Scheme",
           "SurfaceRegressor", "UnknownOptionError", "fit", "fit_options", "interpolate", "load_plugins", "metric", "rows_term", "run", "scheme", "study"]
