# SPDX-License-Identifier: GPL-3.0-or-later
"""Schemes and metrics of your own, for `run`, `study` and `interpolate`."""
import dataclasses
import hashlib
import importlib.util
import inspect
import json
import os

import numpy as np

from .errors import InputError
from .results import Result


@dataclasses.dataclass(frozen=True)
class DepthInput:
    """What a depth scheme may use. Lengths are in mm.

    Attributes
    ----------
    vertices, normals : arrays of shape (n, 3)
        Points of bone where a depth is wanted, and their unit normals, out of the bone.
    triangles : array of shape (m, 3)
        Triangles of the skull. Empty in cross-validation, unless the scheme has ``needs_surface=True``.
    sites : list of k texts
        Site codes of the depth markers.
    bases, directions : arrays of shape (k, 3)
        Where each depth marker stands on the bone, and its unit direction.
    depths_mm, sds_mm : arrays of k numbers
        Depths, and their standard deviations (NaN if not stated).
    areas : array of shape (a, 3)
        The dowel network: three indices of depth markers per area. May be empty.
    """

    vertices: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    sites: list
    bases: np.ndarray
    directions: np.ndarray
    depths_mm: np.ndarray
    sds_mm: np.ndarray
    areas: np.ndarray


class Scheme:
    """A depth scheme of your own; `scheme` makes it. Calling it calls your function."""

    def __init__(self, name, function, options, needs_surface, needs_network):
        self.name = name
        self.function = function
        self.options = options
        self.needs_surface = needs_surface
        self.needs_network = needs_network
        self.source_hash = _source_hash(function)
        self.__doc__ = function.__doc__
        self.__wrapped__ = function  # for inspect.signature
        self.__module__ = function.__module__

    def __reduce__(self):
        return _pickled_name(self)

    def __call__(self, given: DepthInput, **options):
        return self.function(given, **{**self.options, **options})

    def __repr__(self):
        return f"<scheme {self.name} {self.options}>"

    def _options(self):
        return [(name, _kind(self.name, name, value), _text(value)) for name, value in self.options.items()]

    def _call(self, arrays, options):
        values = {name: _value(self.options[name], text) for name, text in options.items()}
        found = self.function(DepthInput(**arrays), **values)
        depth_mm, sd_mm = found if isinstance(found, tuple) else (found, None)
        return _numbers("depths", depth_mm), None if sd_mm is None else _numbers("standard deviations", sd_mm)


class Metric:
    """A metric of your own; `metric` makes it. Calling it calls your function."""

    def __init__(self, name, function):
        self.name = name
        self.function = function
        self.source_hash = _source_hash(function)
        self.__doc__ = function.__doc__
        self.__wrapped__ = function
        self.__module__ = function.__module__

    def __reduce__(self):
        return _pickled_name(self)

    def __call__(self, result: Result):
        return self.function(result)

    def __repr__(self):
        return f"<metric {self.name}>"

    def _call(self, numbers, arrays):
        value = self.function(Result(json.loads(numbers), arrays))
        return float("nan") if value is None else float(value)


def scheme(name: str, *, needs_surface: bool = False, needs_network: bool = False, **options):
    """Make a depth scheme of a function; a decorator.

    The function takes a `DepthInput` and the options by name. It returns one depth in mm per vertex, above 0, or NaN
    where it gives none; or a tuple of these depths and their standard deviations. `outside` of the experiment then
    fills vertices without a depth, as for built-in schemes.

    Parameters
    ----------
    name : str
        Name in configurations: ``interp: NAME``, or ``interp: {type: NAME, power: 3}``.
    needs_surface : bool
        Whether the function needs the triangles of the skull, also in cross-validation.
    needs_network : bool
        Whether it needs a dowel network with an area.
    **options
        Defaults of the options: numbers, booleans or texts.

    Notes
    -----
    The id of a trial has the hashes of the source files of its scheme and of all metrics, so a changed file makes
    its trials anew. Keep each scheme in a file of its own, and metrics in another. Several threads of a study take
    turns at calling Python.

    Examples
    --------
    >>> @scheme("shepard4", power=4.0)
    ... def shepard4(given, power):
    ...     distance = np.linalg.norm(given.vertices[:, None] - given.bases, axis=2)
    ...     weight = np.maximum(distance, 1e-9) ** -power
    ...     return weight @ given.depths_mm / weight.sum(axis=1)
    """
    def decorate(function):
        try:
            inspect.signature(function).bind(None, **options)
        except TypeError as error:
            raise InputError(f"scheme '{name}': its function cannot be called with its options {list(options)}: {error}") from None
        return Scheme(name, function, options, needs_surface, needs_network)

    return decorate


def metric(name: str):
    """Make a metric of a function; a decorator.

    The function takes a `Result` and returns a number, or None if the trial has none. A study measures it in each
    trial, lists it as `name` in its tables, and ranks by it with ``metric: NAME``; lower is better.

    Parameters
    ----------
    name : str
        Letters, digits and `_`. It must differ from the members of result.json.
    """
    return lambda function: Metric(name, function)


def load_plugins(path):
    """Run a Python file and return the schemes and the metrics that it defines, as two lists.

    Parameters
    ----------
    path : str or path
        File of Python. It runs with all rights of this process, so load only files that you trust.
    """
    name = "semblance_plugin_" + hashlib.sha256(os.fsencode(os.path.abspath(path))).hexdigest()[:12]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or not os.path.isfile(path):
        raise InputError(f"plugins: {path}: no such file of Python")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    values = vars(module).values()
    return ([value for value in values if isinstance(value, Scheme)], [value for value in values if isinstance(value, Metric)])


def _pickled_name(part):
    """The name under which pickle finds a scheme or metric of a module."""
    return part.function.__qualname__


def _source_hash(function):
    """Hash of the file that defines a function, or of its own source or code in a notebook."""
    file = inspect.getsourcefile(function)
    if file is not None and os.path.isfile(file):
        with open(file, "rb") as source:
            text = source.read()
    else:
        try:
            text = inspect.getsource(function).encode()
        except OSError:
            text = _code_text(function.__code__).encode()
    return hashlib.sha256(text).hexdigest()[:16]


def _code_text(code):
    inner = [_code_text(value) if inspect.iscode(value) else repr(value) for value in code.co_consts]
    return repr((code.co_code, code.co_names, code.co_varnames, inner))


def _kind(scheme_name, name, value):
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            return kind.__name__
    raise InputError(f"scheme '{scheme_name}': option '{name}' is a {type(value).__name__}; its default must be a number, a boolean or a text")


def _text(value):
    return ("true" if value else "false") if isinstance(value, bool) else str(value)


def _value(default, text):
    return text == "true" if isinstance(default, bool) else type(default)(text)


def _numbers(what, values):
    array = np.ascontiguousarray(values, dtype=float)
    if array.ndim != 1:
        raise InputError(f"the {what} have the shape {array.shape}; return one number per vertex")
    return array
