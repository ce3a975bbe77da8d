"""Checks of what schemes and their parts answer: arrays of the right shape and type, modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echobeam.schemes.base import SchemeError
from echobeam.values import Mode, Status, Tracks

KINDS = {
    "complex numbers": "ciuf",
    "real numbers": "iuf",
    "whole numbers": "iu",
    "true or false": "b",
}
"""Contents of an array, and the kinds of NumPy's types that pass for them."""


def check_array(label: str, value: object, shape: tuple[int, ...], kind: str) -> None:
    """Refuse what is no array of a shape and a kind of `KINDS`; the label begins the message.

    Raises
    ------
    SchemeError
        Says what is expected.
    """
    if not isinstance(value, np.ndarray):
        raise SchemeError(
            f"{label} is a {type(value).__name__}; expected a NumPy array of shape {shape}"
        )
    if value.shape != shape:
        raise SchemeError(f"{label} is of shape {value.shape}; expected {shape}")
    if value.dtype.kind not in KINDS[kind]:
        raise SchemeError(f"{label} is of type {value.dtype}; expected {kind}")


def check_mode(label: str, mode: object, n_trials: int, allowed: Sequence[Mode]) -> None:
    """Refuse what is no mode of each trial; the label begins the message.

    Raises
    ------
    SchemeError
        Says what is expected.
    """
    check_array(label, mode, (n_trials,), "whole numbers")
    assert isinstance(mode, np.ndarray)
    unknown = sorted(set(np.unique(mode).tolist()) - set(allowed))
    if unknown:
        raise SchemeError(
            f"{label} is {unknown[0]}; expected "
            f"{', '.join(f'{int(one)} ({one.name.lower()})' for one in allowed)}"
        )


def check_tracks(label: str, tracks: Tracks, n_trials: int, size: int) -> None:
    """Refuse tracks of wrong shapes or types, and known ones without a mean or a covariance.

    ``size`` is the number of components of a state.

    Raises
    ------
    SchemeError
        Names the array, what it is and what is expected.
    """
    leading = np.shape(tracks.id)
    if len(leading) != 2 or leading[0] != n_trials:
        raise SchemeError(
            f"{label}: id is of shape {leading}; expected (trials, tracks) with {n_trials} trials"
        )
    check_array(f"{label}: id", tracks.id, leading, "whole numbers")
    check_array(f"{label}: mean", tracks.mean, (*leading, size), "real numbers")
    check_array(f"{label}: cov", tracks.cov, (*leading, size, size), "real numbers")
    check_array(f"{label}: status", tracks.status, leading, "whole numbers")
    if not np.isin(tracks.status, list(Status)).all():
        raise SchemeError(f"{label}: status is none of {', '.join(str(int(s)) for s in Status)}")
    known = tracks.known
    if not np.isfinite(tracks.mean[known]).all():
        raise SchemeError(f"{label}: the mean of a known track is not finite; its status is not 0")
    variances = np.diagonal(tracks.cov, axis1=-2, axis2=-1)[known]
    if not (variances >= 0.0).all():
        raise SchemeError(f"{label}: a variance of a known track is negative or not a number")


def check_identities(label: str, tracks: Tracks) -> None:
    """Refuse known tracks without an identity of their own: without labels nobody else gives one.

    Raises
    ------
    SchemeError
        Names the identity and what is expected.
    """
    known = tracks.known
    if (tracks.id[known] < 0).any():
        raise SchemeError(f"{label}: the id of a known track is negative; expected one from 0")
    ordered = np.sort(np.where(known, tracks.id, -1 - np.arange(known.shape[-1])), axis=-1)
    twice = ordered[..., 1:] == ordered[..., :-1]
    if twice.any():
        number = int(ordered[..., 1:][twice][0])
        raise SchemeError(
            f"{label}: two known tracks have the id {number}; expected one of its own"
        )
