# SPDX-License-Identifier: GPL-3.0-or-later
"""Options as text of a configuration, so that one reader checks all of them."""
import json
import os
import re

import numpy as np

from .errors import InputError

# YAML reads these plain words as other values than texts.
NOT_TEXT = {"null", "true", "false", "yes", "no", "on", "off", "nan", "inf"}


def option_text(value):
    """Write numbers, texts, booleans, None, lists and dictionaries as YAML on one line."""
    if value is None:
        return "null"
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if hasattr(value, "__index__"):
        return str(int(value))
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_quoted(str(key))}: {option_text(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(option_text(entry) for entry in value) + "]"
    if isinstance(value, str) or hasattr(value, "__fspath__"):
        return _quoted(os.fspath(value))
    raise InputError(f"an option is a {type(value).__name__}; expected a number, a text, True or False, None, a list or a dictionary")


def _quoted(text):
    # Plain words stay unquoted, because the readers of configurations refuse quotes around names.
    is_word = re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", text) is not None and text not in NOT_TEXT
    return text if is_word else json.dumps(text)
