# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays as the extension takes them."""
import numpy as np

from .errors import InputError


def refuse_masked(values, name):
    """Raise InputError for an array with masked rows or complex numbers, which NumPy would use as if they were plain."""
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        mask = np.atleast_1d(np.ma.getmaskarray(values))
        rows = np.flatnonzero(mask.reshape(len(mask), -1).any(axis=1))
        raise InputError(f"{name}: {len(rows)} rows are masked, the first is row {rows[0]}; leave them out of all arrays, e.g. points[~mask]")
    if isinstance(values, np.ndarray) and values.dtype.kind == "c":
        raise InputError(f"{name}: Complex data not supported; give real numbers")


def floats(values, name):
    """Return an array of floats, or None for None. Raises InputError as `refuse_masked`."""
    if values is None:
        return None
    refuse_masked(values, name)
    return np.asarray(values, float)
