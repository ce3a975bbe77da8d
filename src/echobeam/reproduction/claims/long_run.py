"""Claims on 500 ms of service (the paper's t6)."""

from __future__ import annotations

import numpy as np

from echobeam.reproduction.estimates import (
    gain_percent,
    mean,
    proportion,
    ratio,
    rms,
    rms_ratio,
)
from echobeam.reproduction.figures.long_run import throughput
from echobeam.reproduction.records import Claim, Measured
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.rules import all_above, first_above
from echobeam.reproduction.setups import BRAKING, CALIBRATED, long, manoeuvre
from echobeam.values import BoolArray

SETTLED = 2
"""Slots of a frame, omni slot included, before a scheme's first beams count as settled."""


def dips(results: Results) -> Measured:
    """Measure how far the rate falls in each omni slot below the slot before."""
    outcome = _long(results)
    rate = outcome.sum_rate("temporal")
    return Measured(
        {
            f"slot {n + 1}": gain_percent(rate[:, n], rate[:, n - 1]).negated()
            for n in _omni(outcome)
        },
        "%",
    )


def sensing_dips(results: Results) -> Measured:
    """Measure how far the angle error rises in each omni slot above the slot before."""
    outcome = _long(results)
    error = rms(outcome.error("temporal", "angle"))
    return Measured(
        {
            f"slot {n + 1}": rms_ratio(error[:, n], error[:, n - 1]).scaled(100, -100)
            for n in _omni(outcome)
        },
        "%",
    )


def recovery(results: Results) -> Measured:
    """Measure the rate right after each omni slot as a share of that right before."""
    outcome = _long(results)
    rate = outcome.sum_rate("temporal")
    return Measured(
        {
            f"slot {n + 2}": gain_percent(rate[:, n + 1], rate[:, n - 1]).scaled(1, 100)
            for n in _omni(outcome)
        },
        "%",
    )


def near_optimal(results: Results) -> Measured:
    """Measure the rate right after each omni slot as a share of the genie's."""
    outcome = _long(results)
    rate, best = outcome.sum_rate("temporal"), outcome.sum_rate("genie")
    return Measured(
        {f"slot {n + 2}": ratio(rate[:, n + 1], best[:, n + 1]).scaled(100) for n in
         _omni(outcome)},
        "% of the genie's rate",
    )  # fmt: skip


def stability(results: Results) -> Measured:
    """Measure in how many more trials the pilot's rate drops while objects brake hard."""
    outcome = results[manoeuvre().name]
    dropped = {scheme: _drops(outcome, scheme).astype(float) for scheme in ("temporal", "pilot")}
    more = mean(100 * (dropped["pilot"] - dropped["temporal"]))
    own = {scheme: proportion(one > 0).scaled(100) for scheme, one in dropped.items()}
    return Measured({"pilot minus proposed": more} | own, "% of trials")


def _drops(outcome: Outcome, scheme: str) -> BoolArray:
    """Return ``(trial,)``: whether the rate of a directional slot is below half of the frame's."""
    frame = outcome.scenario.frame.slots_per_frame
    rate = outcome.sum_rate(scheme)
    frames = rate.reshape(len(rate), -1, frame)[:, :, SETTLED:]
    best = np.maximum.accumulate(frames, axis=-1)
    return np.asarray((frames < 0.5 * best).any(axis=(-2, -1)))


def pilot_trend(results: Results) -> Measured:
    """Measure how the pilot scheme's throughput rises from the first frame to the last."""
    pilot = throughput(_long(results), "pilot")
    return Measured({"frame 1 to 5": gain_percent(pilot[:, -1], pilot[:, 0])}, "%")


def gap_trend(results: Results) -> Measured:
    """Measure how the gap between the schemes' throughputs shrinks up to the last frame."""
    outcome = _long(results)
    gap = throughput(outcome, "temporal") - throughput(outcome, "pilot")
    return Measured(
        {
            "frame 1 to 5": gain_percent(gap[:, -1], gap[:, 0]).negated(),
            "frame 2 to 5": gain_percent(gap[:, -1], gap[:, 1]).negated(),
        },
        "%",
    )


def _long(results: Results) -> Outcome:
    return results[long().name]


def _omni(outcome: Outcome) -> range:
    """Return the omni slots after the first, counted from 0."""
    per_frame = outcome.scenario.frame.slots_per_frame
    return range(per_frame, outcome.scenario.n_slots, per_frame)


CLAIMS = (
    Claim(
        "dips-at-omni-slots",
        "t6",
        "the UAV periodically transmits the omnidirectional beam, at the cost of intermittently "
        "losing the communication efficiency of one time slot",
        "dips",
        "fall of the mean rate in every omni slot below the slot before it",
        dips,
        all_above(0.0),
    ),
    Claim(
        "sensing-dips-at-omni-slots",
        "t6",
        "the UAV periodically transmits the omnidirectional beam, at the cost of intermittently "
        "losing the sensing accuracy of one time slot",
        "dips",
        "rise of the angle RMSE, both objects, in every omni slot above the slot before it; known "
        "objects are predicted there, not measured",
        sensing_dips,
        all_above(0.0),
    ),
    Claim(
        "fast-recovery",
        "t6",
        "the communication rate quickly returns to a high level after the update",
        "quickly",
        "mean rate in the slot after each omni slot as a share of the slot before it; quickly: at "
        "least 90 % at once",
        recovery,
        all_above(90.0),
    ),
    Claim(
        "near-optimal-after-update",
        "t6",
        "for previously known objects a two-step prediction is executed, thereby swiftly restoring "
        "communication rates to near-optimal levels",
        "near-optimal",
        "mean sum rate in the slot after each omni slot as a share of the genie's, which knows the "
        "angles and serves the nearer object alone; near-optimal: at least 90 %",
        near_optimal,
        all_above(90.0),
    ),
    Claim(
        "stable-under-manoeuvres",
        "t6",
        "in scenarios with high object maneuverability, the proposed beam prediction exhibits "
        "superior stability",
        "more stable",
        f"objects of t6 that brake and accelerate at {BRAKING:g} m/s^2: share of trials in which "
        "the sum rate falls below half of what it was earlier in the same frame (from its slot "
        f"{SETTLED + 1} on), the pilot scheme's minus the proposed one's",
        stability,
        first_above(0.0),
    ),
    Claim(
        "pilot-upward-trend",
        "t6",
        "as the UAV gets closer to the objects, the communication rate of the pilot-based scheme "
        "shows a slight upward trend",
        "rising slightly",
        f"rise of the mean throughput per frame from frame 1 to frame 5; {CALIBRATED}",
        pilot_trend,
        all_above(0.0),
    ),
    Claim(
        "gap-shrinks",
        "t6",
        "the gap between the throughput of each frame of the pilot scheme and that of the proposed "
        "scheme is also decreasing",
        "decreasing",
        "fall of the mean gap from frame 1 and from frame 2 (the first without a start from "
        f"nothing) to frame 5; {CALIBRATED}",
        gap_trend,
        all_above(0.0),
    ),
)
