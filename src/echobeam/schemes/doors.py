"""The small door for users' schemes: a function ``(prior, view) -> beams``.

The frame, the omnidirectional slot, the filter and the two-step prediction come for free. A
frozen object with that call serves as well, when it has parameters; for everything else there is
the whole `Scheme`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from echobeam.schemes.base import Decision, Scheme, SchemeError, View
from echobeam.schemes.frame import TrackingFrame
from echobeam.values import ComplexArray, GaussianState

BeamFunction = Callable[[GaussianState, View], ComplexArray]
F = TypeVar("F", bound=Callable[..., object])

_MARK = "__echobeam_scheme__"


@dataclass(frozen=True, slots=True)
class BeamFunctionScheme(TrackingFrame):
    """A scheme made of a function from prior and view to beams."""

    name: str
    function: BeamFunction

    def beamform(self, prior: GaussianState, view: View) -> Decision:
        """Return the function's beams, zero for objects that are not known.

        Raises
        ------
        SchemeError
            If what the function returns is no array of shape ``(..., K, N)``.
        """
        shape = (*prior.known.shape, view.system.array.n_tx)
        try:
            given = self.function(prior, view)
        except (Exception, SystemExit) as error:  # a user's function may raise anything
            raise SchemeError(
                f"scheme {self.name!r} raised {type(error).__name__} in slot {view.slot}: {error}"
            ) from error
        if given is None:
            raise SchemeError(f"scheme {self.name!r} returned nothing in slot {view.slot}")
        try:
            beams = np.broadcast_to(np.asarray(given, dtype=complex), shape)
        except (TypeError, ValueError):
            raise SchemeError(
                f"scheme {self.name!r} returned beams of shape {np.shape(given)} in slot "
                f"{view.slot}; expected (..., K, n_tx), here {shape}"
            ) from None
        beams = np.where(prior.known[..., None], beams, 0.0)
        return Decision(beams, np.zeros(shape[:-2], dtype=bool))


def scheme(name: str) -> Callable[[F], F]:
    """Mark a function ``(prior, view) -> beams``, or a class of such objects, as a scheme.

    Parameters
    ----------
    name
        The scheme's name in results and on the command line.

    Examples
    --------
    >>> import echobeam as eb
    >>> @eb.scheme("mine")
    ... def mine(prior, view):
    ...     angle = prior.mean[..., 0]            # (trials, K) rad, NaN where not known
    ...     n_tx = view.system.array.n_tx
    ...     return ...                            # (trials, K, n_tx) complex, sqrt(power)
    """

    def mark(function: F) -> F:
        setattr(function, _MARK, name)
        return function

    return mark


def as_scheme(candidate: object, name: str | None = None) -> Scheme:
    """Return a whole scheme from any of the three sizes of door.

    Parameters
    ----------
    candidate
        A `Scheme`, a class that makes one without arguments, or a callable
        ``(prior, view) -> beams``.
    name
        Used if the candidate does not say its own.

    Raises
    ------
    SchemeError
        If it is none of these.
    """
    marked = getattr(candidate, _MARK, None)
    if isinstance(candidate, type):
        try:
            candidate = candidate()
        except (Exception, SystemExit) as error:
            raise SchemeError(
                f"{candidate!r} cannot be made without arguments: {type(error).__name__}: {error}"
            ) from error
    if isinstance(candidate, Scheme):
        return candidate
    if callable(candidate):
        own = getattr(candidate, "name", None) or marked or name
        return BeamFunctionScheme(
            name=str(own or getattr(candidate, "__name__", "")), function=candidate
        )
    raise SchemeError(
        f"{candidate!r} is not a scheme; expected a function (prior, view) -> beams, an object "
        "with that call, or an echobeam Scheme"
    )
