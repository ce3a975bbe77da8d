"""Doors for users' schemes: a function ``(prior, view) -> beams``, a choice of parts, or a whole.

With a function the frame, the omnidirectional slot, the filter and the two-step prediction come
for free. A frozen object with that call serves as well, when it has parameters; for everything
else there is the whole `Scheme`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from echobeam.physics.coordinates import cover_shape
from echobeam.schemes.base import Scheme, SchemeError, View
from echobeam.schemes.beamers import Aim, Beams
from echobeam.schemes.failures import failure, users_traceback, written_at
from echobeam.schemes.frames import ClockedFrame
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.trackers import ExtendedKalman
from echobeam.values import ComplexArray, Tracks

BeamFunction = Callable[[Tracks, View], ComplexArray]
F = TypeVar("F", bound=Callable[..., object])

NO_SCHEME = (
    "is not a scheme; expected a function (prior, view) -> beams, an object with that call, or an "
    "echobeam Scheme"
)

MARK = "__echobeam_scheme__"
"""Attribute under which `scheme` notes the name."""


@dataclass(frozen=True, slots=True)
class FunctionBeamer:
    """Beams from a user's function of prior and view."""

    name: str
    function: Any

    def beams(self, aim: Aim, view: View) -> Beams:
        """Return the function's beams, zero for objects that are not known.

        Raises
        ------
        SchemeError
            If the function returns no array of shape ``(..., K, N)``.
        """
        prior = aim.prior
        shape = (*prior.status.shape, view.system.transmitter.n)
        given = self.function(prior, view)
        if given is None:
            raise SchemeError(f"scheme {self.name!r} returned nothing in slot {view.slot}")
        try:
            beams = np.broadcast_to(np.asarray(given, dtype=complex), shape)
        except (TypeError, ValueError):
            raise SchemeError(
                f"scheme {self.name!r} returned beams of shape {np.shape(given)} in slot "
                f"{view.slot}; expected (..., K, N), here {shape}"
            ) from None
        served = (prior.known & aim.active[:, None])[..., None]
        cover = cover_shape(view.system.geometry.axes)
        return Beams(
            np.where(served, beams, 0.0),
            np.full((*prior.status.shape, *cover), np.nan),
            np.zeros(shape[:-2], dtype=bool),
        )


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
    ...     N = view.system.transmitter.n         # weights of a beam
    ...     return ...                            # (trials, K, N) complex, sqrt(power)
    """

    def mark(function: F) -> F:
        setattr(function, MARK, name)
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
    label = getattr(candidate, "__name__", None) or type(candidate).__name__
    try:
        return _made(candidate, name)
    except (KeyboardInterrupt, SchemeError):
        raise
    except BaseException as error:  # a user's class may raise anything
        raise SchemeError(
            f"{failure(error)} (while making a scheme of {label})", users_traceback(error)
        ) from error


def _made(candidate: object, name: str | None) -> Scheme:
    """Return a whole scheme, see `as_scheme`; what its own code raises goes on as it is."""
    marked = getattr(candidate, MARK, None)
    if isinstance(candidate, type):
        candidate = candidate()
    if isinstance(candidate, Scheme):
        if not isinstance(candidate.name, str) or not candidate.name:
            raise SchemeError(f"{candidate!r}: its name is {candidate.name!r}; expected a text")
        return candidate
    if callable(candidate):
        own = getattr(candidate, "name", None) or marked or name
        label = str(own or getattr(candidate, "__name__", type(candidate).__name__))
        _check_call(candidate, label)
        return SchemeOfParts(
            label, ClockedFrame(), ExtendedKalman(), FunctionBeamer(label, candidate)
        )
    raise SchemeError(f"{candidate!r} {NO_SCHEME}")


def _check_call(candidate: Callable[..., object], label: str) -> None:
    """Refuse what cannot be called as beams are asked for, before anything is run."""
    try:
        call = inspect.signature(candidate)
    except (TypeError, ValueError):  # of compiled code, which may not say
        return
    try:
        call.bind(None, None)
    except TypeError as error:
        raise SchemeError(
            f"{written_at(candidate)}scheme {label!r} is called with (prior, view): {error}"
        ) from None
