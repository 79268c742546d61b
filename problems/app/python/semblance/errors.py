# SPDX-License-Identifier: GPL-3.0-or-later
"""The exceptions of the package. Their messages state the place, the fault, what is allowed and the remedy."""


class InputError(ValueError):
    """Data that cannot be used: a bad mesh, a NaN, a missing landmark."""


class ConfigError(InputError):
    """Options that cannot be used. The message may have several lines, one per fault."""


class UnknownOptionError(ConfigError, TypeError):
    """An option that does not exist."""


class IoError(OSError):
    """A file that cannot be read or written."""


class PluginError(RuntimeError):
    """A function of yours raised an exception. The message holds its traceback."""
