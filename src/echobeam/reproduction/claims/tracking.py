"""Claims on angle, distance and trajectory (the paper's t3, t4 and t5)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from echobeam.estimation.intervals import rms
from echobeam.physics.geometry import offset
from echobeam.reproduction.estimates import bootstrap, proportion, rms_ratio
from echobeam.reproduction.figures.trajectories import errors
from echobeam.reproduction.records import Claim, Estimate, Measured
from echobeam.reproduction.results import Results
from echobeam.reproduction.rules import all_above, all_below
from echobeam.reproduction.setups import ANTENNAS, ANTENNAS_FOR_TWO, multi, single, trajectory
from echobeam.schemes.configure import system_for
from echobeam.simulation.forecast import forecasts
from echobeam.values import Array

FEW, MANY = ANTENNAS[0], ANTENNAS[-1]
COMPONENTS = ("distance", "angle")
DISRUPTED = 40
"""Slot after which measurements are missing, several frames after the start."""

AHEAD = (5, 10, 20)
"""Lengths of the disruption, slots."""


def same_start(results: Results) -> Measured:
    """Measure the largest difference of the two schemes' first estimates, deg."""
    differences = {}
    for n in ANTENNAS:
        first = [_estimate(results, n, scheme)[:, 0] for scheme in ("temporal", "pilot")]
        differences[_antennas(n)] = Estimate.exact(np.degrees(np.max(np.abs(np.subtract(*first)))))
    return Measured(differences, "deg")


def _of_arrays(measure: Callable[[Results, int], Estimate]) -> Callable[[Results], Measured]:
    """Apply a measure to each array size, %."""
    return lambda results: Measured({_antennas(n): measure(results, n) for n in ANTENNAS}, "%")


def pilot_degrades(results: Results, n: int) -> Estimate:
    """Measure the growth of the pilot scheme's angle error from slot 1 to slot 10."""
    return _percent(*(_angle(results, n, "pilot", slot) for slot in (10, 1)))


def proposed_better(results: Results, n: int) -> Estimate:
    """Measure the reduction of the angle error in slot 10 by the proposed scheme."""
    return _percent(*(_angle(results, n, name, 10) for name in ("temporal", "pilot"))).negated()


def gap_growth(results: Results) -> Measured:
    """Measure the growth of the advantage in slot 10 from the smallest to the largest array."""
    samples = [
        _angle(results, n, scheme, 10) for n in (FEW, MANY) for scheme in ("pilot", "temporal")
    ]

    def by_ratio(pilot: Array, ours: Array, pilot_many: Array, ours_many: Array) -> Array:
        return (rms(pilot_many) / rms(ours_many)) / (rms(pilot) / rms(ours))

    def by_difference(pilot: Array, ours: Array, pilot_many: Array, ours_many: Array) -> Array:
        return (rms(pilot_many) - rms(ours_many)) / (rms(pilot) - rms(ours))

    return Measured(
        {
            "as a ratio": bootstrap(by_ratio, *samples).scaled(100, -100),
            "in degrees": bootstrap(by_difference, *samples).scaled(100, -100),
        },
        "%",
    )


def distance_in_time(results: Results) -> Measured:
    """Measure the fall of the distance error from slot 1 to slot 10."""
    return Measured(
        {
            _antennas(n): _percent(_distance(results, n, 10), _distance(results, n, 1)).negated()
            for n in ANTENNAS_FOR_TWO
        },
        "%",
    )


def distance_in_antennas(results: Results) -> Measured:
    """Measure the fall of the distance error in slot 10 from one array to the next larger."""
    ends = (ANTENNAS_FOR_TWO[0], ANTENNAS_FOR_TWO[-1])
    return Measured(
        {
            f"{less} to {more} antennas": _percent(
                _distance(results, more, 10), _distance(results, less, 10)
            ).negated()
            for less, more in (ends, *pairwise(ANTENNAS_FOR_TWO))
        },
        "%",
    )


def fast_object(results: Results) -> Measured:
    """Measure the fall of the faster object's errors from slot 1 to slot 10."""
    outcome = results[multi().name]
    fast = int(np.argmax([abs(one.along_road[1]) for one in outcome.scenario.objects]))
    errors_of = {name: outcome.error("temporal", name)[..., fast] for name in COMPONENTS}
    return Measured(
        {name: _percent(off[:, 9], off[:, 0]).negated() for name, off in errors_of.items()}
        | {
            "tracks kept, above 90 %": proportion(np.isfinite(errors_of["distance"][:, 9])).scaled(
                100.0, -90.0
            ),
        },
        "%",
    )


def prediction_ahead(results: Results) -> Measured:
    """Measure the position error after some slots without measurements."""
    outcome = results[trajectory().name]
    mean, cov = (outcome.of(name, "temporal") for name in ("estimated", "estimated_cov"))
    truth, velocity = outcome.kept["truth"], outcome.kept["uav_velocity"]
    system = system_for(outcome.scenario, "temporal")
    made = np.array([DISRUPTED - 1])
    found = {}
    for one in forecasts(mean[:, made], cov[:, made], made, max(AHEAD), velocity, system):
        if one.horizon in AHEAD:
            there = truth[:, DISRUPTED - 1 + one.horizon]
            off = offset(one.mean[:, 0]) - offset(there)
            share = 100 * np.hypot(off[..., 0], off[..., 1]) / there[..., 1]
            per_trial = np.sqrt(np.mean(share**2, axis=-1))
            found[f"{one.horizon} slots"] = bootstrap(rms, per_trial)
    return Measured(found, "% of the distance")


def prediction_close(results: Results) -> Measured:
    """Measure the error of the predicted position after the first frame, % of the distance."""
    outcome = results[trajectory().name]
    share = 100 * errors(outcome) / outcome.kept["truth"][..., 1]
    settled = share[:, outcome.scenario.frame.slots_per_frame :]
    per_trial = np.sqrt(np.mean(settled**2, axis=1))
    return Measured(
        {f"object {k + 1}": bootstrap(rms, per_trial[:, k]) for k in range(per_trial.shape[1])},
        "% of the distance",
    )


def _antennas(n: int) -> str:
    return f"{n} antennas"


def _estimate(results: Results, n: int, scheme: str) -> Array:
    return results[single(n).name].of("estimated", scheme)[:, :, 0, 0]


def _angle(results: Results, n: int, scheme: str, slot: int) -> Array:
    return results[single(n).name].error(scheme, "angle")[:, slot - 1, 0]


def _distance(results: Results, n: int, slot: int) -> Array:
    """Return ``(trial,)`` m: root mean square over the objects."""
    return rms(results[multi(n).name].error("temporal", "distance")[:, slot - 1])


def _percent(above: Array, below: Array) -> Estimate:
    return rms_ratio(above, below).scaled(100, -100)


CLAIMS = (
    Claim(
        "same-start",
        "t3",
        "the pilot-based scheme initially produces the same estimates as the proposed scheme",
        "the same",
        "largest difference of the angle estimates of slot 1; both schemes measure with an "
        "omnidirectional transmission and have the same noise draws",
        same_start,
        all_below(1e-6),
        "by construction",
    ),
    Claim(
        "pilot-angle-degrades",
        "t3",
        "over time, the pilot-based scheme's accuracy diminishes",
        "diminishing",
        "growth of the angle RMSE from slot 1 to slot 10; the pilot's estimate is not updated",
        _of_arrays(pilot_degrades),
        all_above(0.0),
    ),
    Claim(
        "proposed-angle-better",
        "t3",
        "the proposed scheme maintains accuracy and outperforms the pilot-based scheme",
        "better",
        "reduction of the angle RMSE in slot 10",
        _of_arrays(proposed_better),
        all_above(0.0),
    ),
    Claim(
        "angle-gap-grows",
        "t3",
        "the improvement becomes more significant as the number of antennas increases",
        "growing",
        f"growth from {FEW} to {MANY} antennas of the advantage in slot 10: as the ratio of the "
        "two RMSE, and as their difference in degrees",
        gap_growth,
        all_above(0.0),
    ),
    Claim(
        "distance-error-falls-in-time",
        "t4",
        "the tracking accuracy improves over time",
        "falling",
        "fall of the distance RMSE, both objects, from slot 1 to slot 10",
        distance_in_time,
        all_above(0.0),
    ),
    Claim(
        "distance-error-falls-with-antennas",
        "t4",
        "a sufficient number of antennas ensures tracking accuracy",
        "falling",
        "fall of the distance RMSE in slot 10, both objects, with the number of antennas",
        distance_in_antennas,
        all_above(0.0),
    ),
    Claim(
        "stable-at-high-speed",
        "t4",
        "the addition of the EKF enables stable tracking even at high speeds",
        "stable",
        "faster object (30 m/s): fall of its distance and its angle RMSE from slot 1 to slot 10, "
        "and how far the share of trials in which it is still tracked lies above 90 %",
        fast_object,
        all_above(0.0),
    ),
    Claim(
        "accurate-amidst-disruptions",
        "t5",
        "maintaining high accuracy even amidst sporadic communication disruptions, courtesy of its "
        "multi-step predictive capability",
        "high accuracy",
        f"root mean square error of the position predicted in slot {DISRUPTED} for 5, 10 and 20 "
        "slots of 10 ms without a measurement; high accuracy: below 1 % of the distance",
        prediction_ahead,
        all_below(1.0),
    ),
    Claim(
        "prediction-close",
        "t5",
        "the position prediction exhibited remarkable proximity to actual values after a brief "
        "optimization period",
        "close",
        "root mean square error of the position predicted one slot ahead, after the first frame "
        "of 100 ms; close: below 1 % of the distance",
        prediction_close,
        all_below(1.0),
    ),
)
