# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of a run, or of one trial of a study."""
import difflib
import html
import json

import numpy as np

from .surface import HSpline

# The parts of the face that `Result.parts` numbers.
FACE_PARTS = ("forehead", "orbits", "nose", "cheeks", "mouth", "chin", "jaw", "temples")


class Result:
    """Numbers and shapes of a result. A missing shape is None. Lengths are in mm, the frame is the subject's (LPS).

    Attributes
    ----------
    numbers : dict
        Contents of result.json.
    faults : list of str
        Reasons why the result cannot be used; empty if it can.
    notes : list of str
        What the program changed, left out or found odd; read them.
    surface : HSpline or None
        The recovered face. None for a study of depth.
    face, first_face, skull, truth : (vertices, triangles) or None
        The recovered face, the first face, the outer shell of the skull, the true skin.
    depth_mm, sd_mm, sigma_mm : array or None
        Depth per vertex of the skull and its standard deviation; standard deviation per vertex of the face.
    region, parts : array or None
        Per vertex of the true skin (study of depth: of the skull): whether it is scored, and its part of the face as
        an index of `FACE_PARTS`, -1 for none.
    """

    def __init__(self, numbers, arrays, faults=(), page=None):
        self.numbers = numbers
        self.faults = list(faults)
        self.notes = list(numbers.get("notes", ()))
        surface = arrays["surface"]
        self.surface = None if surface is None else HSpline._of(surface)
        for name in ("face", "first_face", "skull", "truth", "depth_mm", "sd_mm", "sigma_mm", "region", "parts"):
            setattr(self, name, arrays[name])
        self._page = page  # makes the page with the 3-D view; not pickled

    @property
    def usable(self) -> bool:
        """Whether the result can be used: it has no faults."""
        return not self.faults

    def __getitem__(self, path: str):
        """Return a number of result.json by its dotted path, e.g. ``result["face.rms_mm"]``. KeyError if it is missing."""
        value, known = self.numbers, []
        for part in path.split("."):
            known = list(value) if isinstance(value, dict) else []
            if part not in known:
                near = difflib.get_close_matches(part, known, 1)
                hint = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}" if known else "there is nothing below it"
                raise KeyError(f"{path}: no '{part}'; {hint}")
            value = value[part]
        return value

    def number(self, path: str):
        """Return the same as ``result[path]``, but None if the result lacks it, such as ``face`` without a true skin."""
        value = self.numbers
        for part in path.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        return value

    def __getstate__(self):
        return {**self.__dict__, "_page": None}

    def __eq__(self, other):
        if not isinstance(other, Result):
            return NotImplemented
        mine, theirs = ({**r.__dict__, "_page": None} for r in (self, other))
        return all(_equal(mine[name], theirs[name]) for name in mine)

    __hash__ = None

    def __repr__(self):
        error = self.number("face.rms_mm")
        against = "" if error is None else f", RMS error {error:.2f} mm"
        return f"<Result of {self.numbers.get('subject', 'a subject')}: {'not usable' if self.faults else 'usable'}{against}>"

    def _repr_html_(self):
        """The 3-D view, for notebooks. A result that was unpickled shows its text alone."""
        text = f"<p>{html.escape(repr(self))}</p>"
        if self._page is None:
            return text
        return f'{text}<iframe srcdoc="{html.escape(self._page())}" width="100%" height="700" style="border:0"></iframe>'


def _equal(a, b):
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(_equal(x, y) for x, y in zip(a, b))
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, dict) and isinstance(b, dict):
        return json.dumps(a, sort_keys=True) == json.dumps(b, sort_keys=True)
    return type(a) is type(b) and a == b
