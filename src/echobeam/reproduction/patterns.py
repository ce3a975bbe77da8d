"""Beam patterns of many trials: gains over the angle, widths, radiated powers."""

from __future__ import annotations

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.planar import linear
from echobeam.plots.patterns import beam_gain
from echobeam.plots.record import Axis
from echobeam.reproduction.results import Outcome
from echobeam.schemes.configure import system_for
from echobeam.values import Array, ComplexArray

GRID = np.radians(np.arange(0.0, 180.01, 0.25))
"""Angles at which patterns are evaluated, rad."""

FLOOR = 1e-4
"""Smallest gain drawn, linear: -40 dB."""

ANGLE = Axis("Angle θ", "deg", limits=(0.0, 180.0), ticks=tuple(map(float, range(0, 181, 30))))


def beams(outcome: Outcome, slot: int, scheme: str = "temporal") -> ComplexArray:
    """Return ``(trial, object, antenna)``: the beams of a slot counted from 1."""
    kept = outcome.of("beam", scheme)[:, slot - 1]
    sent: ComplexArray = kept[..., 0] + 1j * kept[..., 1]
    return sent


def _sender(outcome: Outcome) -> LinearArray:
    return linear(system_for(outcome.scenario, "temporal").transmitter)


def gains(outcome: Outcome, slot: int, scheme: str = "temporal") -> Array:
    """Return ``(trial, object, angle)``: power that each beam of a slot radiates towards `GRID`."""
    return beam_gain(beams(outcome, slot, scheme), GRID, _sender(outcome))


def powers(outcome: Outcome, slot: int, scheme: str = "temporal") -> Array:
    """Return ``(trial, object)``: power of each beam of a slot."""
    return np.asarray(np.sum(np.abs(beams(outcome, slot, scheme)) ** 2, axis=-1))


def gain_at_truth(outcome: Outcome, slot: int, scheme: str = "temporal") -> Array:
    """Return ``(trial, object)``: power sent to each object by its own beam, per beam power."""
    sent = beams(outcome, slot, scheme)
    a = _sender(outcome).steering(outcome.kept["truth"][:, slot - 1, :, 0])
    hit = np.abs(np.einsum("tkn,tkn->tk", a.conj(), sent)) ** 2
    power = np.sum(np.abs(sent) ** 2, axis=-1)
    return np.asarray(hit / np.where(power > 0, power, 1.0))


def half_power_angles(gain: Array) -> Array:
    """Return the total width, deg, over which a pattern on `GRID` is above half of its maximum.

    A vertical array repeats every lobe at its mirror angle, and both are illuminated: all lobes
    count. ``(..., angle)`` to ``(...)`` deg.
    """
    above = gain >= 0.5 * gain.max(axis=-1, keepdims=True)
    return np.asarray(180.0 * above.mean(axis=-1))


def matched_angles(outcome: Outcome, slot: int) -> Array:
    """Return ``(trial, object)`` deg: `half_power_angles` of beams matched to the true angle."""
    array = _sender(outcome)
    a = array.steering(outcome.kept["truth"][:, slot - 1, :, 0])
    return half_power_angles(beam_gain(a, GRID, array))
