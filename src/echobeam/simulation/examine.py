"""Examination of what a scheme answers: one clear message for what breaks the contract."""

from __future__ import annotations

import numpy as np

from echobeam.physics.coordinates import cover_shape
from echobeam.physics.transmission import radiated_power
from echobeam.schemes.answers import check_array, check_mode
from echobeam.schemes.base import Decision, SchemeError, View
from echobeam.values import NOBODY, Array, Mode, Tracks, Transmission

POWER_TOLERANCE = 1e-6
"""Excess of the radiated power over P_T that passes, relative: rounding of a solver."""


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
    if not isinstance(decision.sent, Transmission):
        raise SchemeError(
            f"scheme {name!r} returned a decision with sent of type "
            f"{type(decision.sent).__name__} in slot {view.slot}; expected echobeam.Transmission"
        )
    _check_shapes(name, decision, view)
    _check_addressees(name, decision, tracks, view)
    _check_carriers(name, decision, view)
    sent = decision.sent
    if (_widths(decision.covered) < 0.0).any() or np.isinf(decision.covered).any():
        raise SchemeError(
            f"scheme {name!r} covers a negative or infinite half-width in slot {view.slot}; "
            "expected rad, or NaN without a design"
        )
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


def _widths(covered: Array) -> Array:
    """Return the half-widths ``(T, C)``, or the diagonals of the covers' matrices."""
    return covered if covered.ndim == 2 else np.diagonal(covered, axis1=-2, axis2=-1)


def _check_shapes(name: str, decision: Decision, view: View) -> None:
    trials, n_tx = view.n_trials, view.system.transmitter.n
    sent, cover = decision.sent, cover_shape(view.system.geometry.axes)
    streams = np.shape(sent.beams)[1:2] or (view.n_objects,)
    per_stream = (trials, *streams)
    expected: dict[str, tuple[object, tuple[int, ...], str]] = {
        "beams": (sent.beams, (*per_stream, n_tx), "complex numbers"),
        "antenna_power": (sent.antenna_power, (*per_stream, n_tx), "real numbers"),
        "probing": (sent.probing, (trials, n_tx), "real numbers"),
        "addressee": (decision.addressee, per_stream, "whole numbers"),
        "sensed": (decision.sensed, per_stream, "true or false"),
        "covered": (decision.covered, (*per_stream, *cover), "real numbers"),
        "fallback": (decision.fallback, (trials,), "true or false"),
    }
    if decision.carrier is not None:
        expected["carrier"] = (decision.carrier, per_stream, "whole numbers")
    where = f"scheme {name!r}, decision of slot {view.slot}:"
    for key, (value, shape, kind) in expected.items():
        check_array(f"{where} {key}", value, shape, kind)
    check_mode(f"{where} mode", decision.mode, trials, tuple(Mode))


def _check_addressees(name: str, decision: Decision, tracks: Tracks, view: View) -> None:
    """Refuse streams for tracks that are not there, and two for one track."""
    addressee = decision.addressee
    count = addressee.shape[-1]
    if count > tracks.id.shape[-1]:
        raise SchemeError(
            f"scheme {name!r} sends {count} streams in slot {view.slot} where there are "
            f"{tracks.id.shape[-1]} tracks"
        )
    own = addressee.shape == tracks.id.shape and np.array_equal(addressee, tracks.id)
    known = addressee == NOBODY if not own else np.ones(addressee.shape, dtype=bool)
    if not own:
        known |= (addressee[..., None] == tracks.id[:, None, :]).any(axis=-1)
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


def _check_carriers(name: str, decision: Decision, view: View) -> None:
    """Refuse streams that are not there as carriers of data."""
    if decision.carrier is None:
        return
    carrier, count = np.asarray(decision.carrier), decision.addressee.shape[-1]
    outside = (carrier < 0) | (carrier >= count)
    if outside.any():
        raise SchemeError(
            f"scheme {name!r} carries data by stream {int(carrier[outside][0])} in slot "
            f"{view.slot}; expected one of its {count} streams, 0 to {count - 1}"
        )
