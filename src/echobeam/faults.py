"""Faults and notices that a call can end with and that are nobody's bug."""

from __future__ import annotations


class InputError(ValueError):
    """Fault of an input that cannot be used; the message names it and says what is accepted.

    Parameters
    ----------
    message
        For people.
    details
        Traceback of a user's own code, if that is at fault; empty otherwise.
    """

    def __init__(self, message: str = "", details: str = "") -> None:
        super().__init__(message)
        self.details = details


class RunError(RuntimeError):
    """Fault of work that could not be finished; the message says what is kept, how to go on."""


class InputWarning(UserWarning):
    """Notice that an input is used in part, or otherwise than it is written; it says how."""
