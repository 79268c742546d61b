# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolations, runs and studies."""
import csv
import json
import os
import pathlib
import warnings

from . import _semblance
from .arrays import refuse_masked
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
        own, which `semblance.scheme` made, also as the `type` of a dictionary.
    areas : array of shape (a, 3), optional
        The dowel network: indices of three depth markers each, for schemes that need one.

    Returns
    -------
    depth_mm, sd_mm : arrays of n numbers
        NaN where the scheme gives none.
    """
    scheme = {"type": scheme} if isinstance(scheme, Scheme) else scheme
    own = [scheme["type"]] if isinstance(scheme, dict) and isinstance(scheme.get("type"), Scheme) else []
    text = option_text({**scheme, "type": own[0].name} if own else scheme)
    for name, values in (("vertices", vertices), ("bases", bases), ("directions", directions), ("depths_mm", depths_mm)):
        refuse_masked(values, name)
    return _semblance.interpolate(vertices, triangles, bases, directions, depths_mm, text, own, areas, threads)


class Cache:
    """Keeps stages of `run` for later runs of this process: subject, depths, implicit face, template and face model.

    A run that differs only in options of the fit then repeats only the fit and what follows. If the content of an input
    file changes, or another scheme of the same name is given, all stages are made anew. A scheme of your own must
    depend only on its arguments, because its result is kept.

    Parameters
    ----------
    stages : int
        How many stages are kept, the latest ones. A run has about eight, and takes up to a few hundred MB for a head.
    """

    def __init__(self, stages: int = 10):
        if stages < 1:
            raise InputError(f"stages is {stages}; it must be at least 1")
        self._stages = _semblance.Stages(stages)
        self._schemes = {}

    def __repr__(self):
        return f"<cache, {self._stages.made} stages made>"

    def _for(self, schemes):
        if any(self._schemes.get(scheme.name, scheme) is not scheme for scheme in schemes):
            self._stages.clear()
            self._schemes = {}
        self._schemes.update((scheme.name, scheme) for scheme in schemes)
        return self._stages


def run(config, set=None, out=None, force: bool = False, threads: int = 1, schemes=(), cache=None) -> Result:
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
    cache : Cache, optional
        Keeps what later runs can use again.

    Returns
    -------
    Result
        Numbers, surface and meshes.
    """
    overrides = [f"{path}={option_text(value)}" for path, value in (set or {}).items()]
    out = None if out is None else os.fspath(out)
    if cache is not None and not isinstance(cache, Cache):
        raise TypeError(f"cache is a {type(cache).__name__}; give a semblance.Cache()")
    own = _own(schemes, Scheme)
    try:
        parts = _semblance.run(_file(config), overrides, out, force, threads, own, cache and cache._for(own))
    except IoError as error:
        raise IoError(str(error).replace("add --force", "pass force=True")) from None
    return Result(json.loads(parts["numbers"]), parts["arrays"], parts["faults"], parts["page"])


def study(path, out=None, jobs: int = 1, schemes=(), metrics=(), only: str = "", wide: bool = False, cache="", rerun: str = ""):
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
    cache : str or path
        Folder of implicit faces, which is shared with other calls and processes.
    rerun : str
        Finished trials that run again: "failed", "unusable", "other-versions" or "all".

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
        if cache or rerun:
            raise InputError(f"{path}: this is the folder of a study, which is only read; 'cache' and 'rerun' need its YAML file")
        _semblance.check_study_folder(os.fspath(path))
        return _table(pathlib.Path(path) / table)
    out = pathlib.Path("out", pathlib.Path(path).stem) if out is None else pathlib.Path(out)
    counts = run_study(path, out, jobs, (0, 1), only, schemes, metrics, os.fspath(cache), rerun)
    if counts["failed"]:
        warnings.warn(f"{counts['failed']} of {counts['trials']} trials failed; the table's column 'reason' states why", stacklevel=2)
    return _table(out / table)


def run_study(path, out, jobs, shard, only, schemes, metrics, cache="", rerun=""):
    """Run a shard (index, count) of a study with its plugins; return the counts of its trials and the ranking."""
    schemes, metrics = _own(schemes, Scheme), _own(metrics, Metric)
    for file in _semblance.list_plugins(os.fspath(path)):
        more_schemes, more_metrics = load_plugins(file)
        schemes += more_schemes
        metrics += more_metrics
    return _semblance.study(os.fspath(path), os.fspath(out), jobs, shard, only, schemes, metrics, cache, rerun)


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
