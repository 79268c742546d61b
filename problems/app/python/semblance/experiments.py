# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolations, runs and studies."""
import csv
import json
import os
import pathlib
import warnings

from . import _semblance
from .errors import InputError, IoError
from .options import option_text
from .plugins import Metric, Scheme, load_plugins
from .results import Result


def interpolate(vertices, triangles, bases, directions, depths_mm, scheme="kriging", threads: int = 1, areas=None):
    """Interpolate a depth per vertex of a skull from a few depth markers.

    Parameters
    ----------
    vertices, triangles : arrays of shape (n, 3) and (m, 3)
        The skull, in mm; indices count from 0.
    bases, directions : arrays of shape (k, 3)
        Where the depth markers stand, and their directions, of any length.
    depths_mm : array of k numbers
        Their depths.
    scheme : str, dict or Scheme
        Name of a scheme; a dictionary with `type` and its options, like `interp` in a configuration; or one of your
        own, which `semblance.scheme` made.
    areas : array of shape (a, 3), optional
        The dowel network: indices of three depth markers each, for schemes that need one.

    Returns
    -------
    depth_mm, sd_mm : arrays of n numbers
        NaN where the scheme gives none.
    """
    own = [scheme] if isinstance(scheme, Scheme) else []
    text = option_text(scheme.name if own else scheme)
    return _semblance.interpolate(vertices, triangles, bases, directions, depths_mm, text, own, areas, threads)


def run(config, set=None, out=None, force: bool = False, threads: int = 1, schemes=()) -> Result:
    """Run an experiment, as `semblance run` does.

    Parameters
    ----------
    config : str or path
        YAML file of the experiment.
    set : dict, optional
        Options by path, e.g. ``{"implicit.resolution": 60}``.
    out : str or path, optional
        Folder for the files of the run. Without it nothing is written.
    force : bool
        Whether files of the same name in a folder that is not empty are replaced.
    schemes : list of Scheme
        Your own schemes, which `interp` may then name.

    Returns
    -------
    Result
        Numbers, surface and meshes.
    """
    overrides = [f"{path}={option_text(value)}" for path, value in (set or {}).items()]
    out = None if out is None else os.fspath(out)
    try:
        parts = _semblance.run(_file(config), overrides, out, force, threads, _own(schemes, Scheme))
    except IoError as error:
        raise IoError(str(error).replace("add --force", "pass force=True")) from None
    return Result(json.loads(parts["numbers"]), parts["arrays"], parts["faults"], parts["page"])


def study(path, out=None, jobs: int = 1, schemes=(), metrics=(), only: str = "", wide: bool = False):
    """Run the unfinished trials of a study, or read the table of a finished one.

    Parameters
    ----------
    path : str or path
        YAML file of the study. If it is the folder of a study, its trials.csv is only read.
    out : str or path, optional
        Folder for the trials; default: out/NAME, like `semblance study NAME.yaml`.
    jobs : int
        Trials at a time, in threads. Functions of Python take turns; `python3 -m semblance study --shard I/N` runs
        parts of a study in several processes.
    schemes, metrics : lists of Scheme and Metric
        Your own, in addition to those of the files under `plugins` of the study.
    only : str
        Condition for the trials to run, as of `semblance study --only`.
    wide : bool
        Whether a row of the table is a trial with all its metrics. Otherwise it is one metric of one trial, in the
        columns `metric` and `value`, and there are hundreds of rows per trial.

    Returns
    -------
    pandas.DataFrame or list of dict
        trials_wide.csv or trials.csv; a DataFrame if pandas is installed. Numbers are floats. A warning counts the
        trials that failed in this call.
    """
    table = "trials_wide.csv" if wide else "trials.csv"
    path = _file(path)
    if os.path.isdir(path):
        if out is not None:
            raise InputError(f"{path}: this is the folder of a study, which is only read; omit 'out'")
        _semblance.check_study_folder(os.fspath(path))
        return _table(pathlib.Path(path) / table)
    out = pathlib.Path("out", pathlib.Path(path).stem) if out is None else pathlib.Path(out)
    counts = run_study(path, out, jobs, (0, 1), only, schemes, metrics)
    if counts["failed"]:
        warnings.warn(f"{counts['failed']} of {counts['trials']} trials failed; the table's column 'reason' states why", stacklevel=2)
    return _table(out / table)


def run_study(path, out, jobs, shard, only, schemes, metrics):
    """Run a shard (index, count) of a study with its plugins; return the counts of its trials and the ranking."""
    schemes, metrics = _own(schemes, Scheme), _own(metrics, Metric)
    for file in _semblance.list_plugins(os.fspath(path)):
        more_schemes, more_metrics = load_plugins(file)
        schemes += more_schemes
        metrics += more_metrics
    return _semblance.study(os.fspath(path), os.fspath(out), jobs, shard, only, schemes, metrics)


def _file(path):
    if isinstance(path, dict):
        raise TypeError("a dict is no configuration; give the path of a YAML file, and options by `set`")
    return os.fspath(path)


def _own(parts, kind):
    """The list of schemes or metrics; TypeError for a function that was not decorated."""
    parts = list(parts)
    for part in parts:
        if not isinstance(part, kind):
            word = kind.__name__.lower()
            raise TypeError(f"{part!r} is no {word}; decorate the function with @semblance.{word}(name)")
    return parts


def _table(file):
    if not file.exists():
        raise IoError(f"{file}: it is missing; `semblance report {file.parent}` makes it from the finished trials")
    try:
        import pandas
    except ImportError:
        with open(file, encoding="utf-8", newline="") as rows:
            return [{name: _float_or_text(name, text) for name, text in row.items()} for row in csv.DictReader(rows)]
    return pandas.read_csv(file)


def _float_or_text(name, text):
    if name in ("trial", "subject", "status", "reason"):  # a subject may be called 17
        return text
    try:
        return float(text or "nan")
    except ValueError:
        return text
