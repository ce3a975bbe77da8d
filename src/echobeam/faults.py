"""The two ways in which a call can go wrong that are nobody's bug."""

from __future__ import annotations


class InputError(ValueError):
    """What was given cannot be used; the message names it and says what is accepted."""


class RunError(RuntimeError):
    """The work could not be finished; the message says what is kept and how to go on."""


class InputWarning(UserWarning):
    """Input that is used in part only, or reinterpreted; the message says how."""
