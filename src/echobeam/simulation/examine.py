"""Examination of what a scheme answers: one clear message for what breaks the contract."""

from __future__ import annotations

from typing import Any

import numpy as np

from echobeam.physics.transmission import radiated_power
from echobeam.schemes.base import Decision, SchemeError, View
from echobeam.values import NOBODY, Mode, Tracks

POWER_TOLERANCE = 1e-6
"""Excess of the radiated power over P_T that passes, relative: rounding of a solver."""

STATE_SIZE = 3


def examine_tracks(name: str, tracks: Tracks, call: str, view: View) -> None:
    """Refuse tracks of wrong shapes.

    Raises
    ------
    SchemeError
        Names the array, its shape and the shape expected.
    """
    leading = np.shape(tracks.id)
    expected = {
        "mean": (*leading, STATE_SIZE),
        "cov": (*leading, STATE_SIZE, STATE_SIZE),
        "status": leading,
    }
    if len(leading) != 2 or leading[0] != view.n_trials:
        raise SchemeError(
            f"scheme {name!r} reports tracks with id of shape {leading} from {call} of slot "
            f"{view.slot}; expected (trials, tracks) with {view.n_trials} trials"
        )
    for key, shape in expected.items():
        if np.shape(getattr(tracks, key)) != shape:
            raise SchemeError(
                f"scheme {name!r} reports tracks with {key} of shape "
                f"{np.shape(getattr(tracks, key))} from {call} of slot {view.slot}; "
                f"expected {shape}"
            )


def examine_decision(name: str, decision: Decision, tracks: Tracks, view: View) -> None:
    """Refuse a decision of wrong shapes, for unknown tracks, not finite or too strong.

    Raises
    ------
    SchemeError
        Names what is wrong and what is expected.
    """
    if not isinstance(decision, Decision):
        raise SchemeError(
            f"scheme {name!r} returned {type(decision).__name__} from transmit of slot "
            f"{view.slot}; expected an echobeam.Decision"
        )
    _check_shapes(name, decision, view)
    _check_addressees(name, decision, tracks, view)
    modes = set(np.unique(decision.mode).tolist())
    if not modes <= set(Mode):
        raise SchemeError(
            f"scheme {name!r} gives mode {sorted(modes - set(Mode))[0]} in slot {view.slot}; "
            f"expected {', '.join(f'{int(mode)} ({mode.name.lower()})' for mode in Mode)}"
        )
    sent = decision.sent
    if not all(np.isfinite(part).all() for part in (sent.beams, sent.antenna_power, sent.probing)):
        raise SchemeError(f"scheme {name!r} sent beams in slot {view.slot} that are not finite")
    if min(sent.antenna_power.min(initial=0.0), sent.probing.min(initial=0.0)) < 0.0:
        raise SchemeError(f"scheme {name!r} sends negative power in slot {view.slot}")
    most = float(np.max(radiated_power(sent), initial=0.0))
    allowed = view.system.radio.power
    if most > allowed * (1.0 + POWER_TOLERANCE):
        raise SchemeError(
            f"scheme {name!r} radiates {most:.6g} in slot {view.slot}; "
            f"at most radio.power = {allowed:.6g} is allowed"
        )


def _check_shapes(name: str, decision: Decision, view: View) -> None:
    trials, n_tx = view.n_trials, view.system.array.n_tx
    streams = np.shape(decision.sent.beams)[1:2]
    per_stream = (trials, *streams)
    expected: dict[str, tuple[Any, tuple[int, ...]]] = {
        "beams": (decision.sent.beams, (*per_stream, n_tx)),
        "antenna_power": (decision.sent.antenna_power, (*per_stream, n_tx)),
        "probing": (decision.sent.probing, (trials, n_tx)),
        "addressee": (decision.addressee, per_stream),
        "sensed": (decision.sensed, per_stream),
        "covered": (decision.covered, per_stream),
        "mode": (decision.mode, (trials,)),
        "fallback": (decision.fallback, (trials,)),
    }
    for key, (values, shape) in expected.items():
        if np.shape(values) != shape or len(per_stream) != 2:
            raise SchemeError(
                f"scheme {name!r} sent {key} of shape {np.shape(values)} in slot {view.slot}; "
                f"expected {shape if len(per_stream) == 2 else f'({trials}, streams, {n_tx})'}"
            )


def _check_addressees(name: str, decision: Decision, tracks: Tracks, view: View) -> None:
    """Refuse streams for tracks that are not there, and two for one track."""
    addressee = decision.addressee
    if addressee.shape == tracks.id.shape and np.array_equal(addressee, tracks.id):
        return  # one stream for each track, the usual case
    count = addressee.shape[-1]
    if count > tracks.id.shape[-1]:
        raise SchemeError(
            f"scheme {name!r} sends {count} streams in slot {view.slot} where there are "
            f"{tracks.id.shape[-1]} tracks"
        )
    known = (addressee[..., None] == tracks.id[:, None, :]).any(axis=-1) | (addressee == NOBODY)
    if not known.all():
        stranger = int(addressee[~known][0])
        raise SchemeError(
            f"scheme {name!r} addresses a stream to {stranger} in slot {view.slot}; "
            "expected the id of one of its tracks, or -1 for nobody"
        )
    order = np.sort(np.where(addressee == NOBODY, -1 - np.arange(count), addressee), axis=-1)
    if (np.diff(order, axis=-1) == 0).any():
        raise SchemeError(
            f"scheme {name!r} sends two streams to one track in slot {view.slot}; expected one"
        )
