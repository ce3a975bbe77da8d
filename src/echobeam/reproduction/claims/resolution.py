"""Claims on the angular resolution (the paper's aa_acr)."""

from __future__ import annotations

import numpy as np

from echobeam.reproduction.estimates import bootstrap, gain_percent
from echobeam.reproduction.figures.resolutions import frame_rate
from echobeam.reproduction.records import Claim, Estimate, Measured
from echobeam.reproduction.results import Results
from echobeam.reproduction.rules import all_above, all_below, within
from echobeam.reproduction.setups import CALIBRATED, RESOLUTION_LINES, RESOLUTIONS
from echobeam.values import Array

SUBSTANTIAL = 5.0
"""Per cent of the rate at the finest resolution: a loss above this counts as one."""

FINEST, COARSEST = RESOLUTIONS[0], RESOLUTIONS[-1]


def coarse_loss(results: Results) -> Measured:
    """Measure how much of the rate is lost at the coarsest resolution."""
    return Measured(
        {f"N {n}, {h} m": _loss(results, n, h, COARSEST) for n, h in RESOLUTION_LINES}, "%"
    )


def fine_loss(results: Results) -> Measured:
    """Measure how much of the rate is lost at 1 degree with 30 antennas."""
    return Measured({f"{h} m": _loss(results, 30, h, 1.0) for h in (85, 90, 95)}, "%")


def onsets(results: Results) -> Measured:
    """Measure the first resolution with a substantial loss for the largest and smallest array."""
    return Measured({"N_t 35": _onset(results, 35), "N_t 25": _onset(results, 25)}, "deg")


def _loss(results: Results, n: int, metres: int, degrees: float) -> Estimate:
    rates = (frame_rate(results, n, metres, one) for one in (degrees, FINEST))
    return gain_percent(*rates).negated()


def _onset(results: Results, n: int) -> Estimate:
    grid = np.array([*RESOLUTIONS, np.inf])

    def first(*rates: Array) -> Array:
        means = np.stack([rate.mean(axis=-1) for rate in rates], axis=-1)
        lost = means < (1 - SUBSTANTIAL / 100) * means[..., :1]
        never = np.ones((*lost.shape[:-1], 1), dtype=bool)
        return np.asarray(grid[np.argmax(np.concatenate([lost, never], axis=-1), axis=-1)])

    return bootstrap(first, *(frame_rate(results, n, 90, one) for one in RESOLUTIONS))


CLAIMS = (
    Claim(
        "coarse-resolution-worsens",
        "aa_acr",
        "higher values of angular resolution worsen the average communication rate",
        "worse",
        f"loss of the frame's mean rate at {COARSEST:g} degrees against {FINEST:g}; the covered "
        "grid is rounded outward",
        coarse_loss,
        all_above(0.0),
    ),
    Claim(
        "no-loss-to-one-degree",
        "aa_acr",
        "with 30 antennas and the UAV's altitude increasing from 85 m to 95 m, there is no "
        "substantial decline in communication performance from 0.1 to 1 degree",
        "no substantial decline",
        f"loss of the frame's mean rate at 1 degree against {FINEST:g}; substantial: more than "
        f"{SUBSTANTIAL:g} %; {CALIBRATED}",
        fine_loss,
        all_below(SUBSTANTIAL),
    ),
    Claim(
        "resolution-onset",
        "aa_acr",
        "at 90 m, the decrease in communication rate becomes pronounced earlier, starting at 1 "
        "degree for 35 antennas and at 2 degrees for 25",
        "1 deg (35 antennas), 2 deg (25 antennas)",
        f"first resolution of {', '.join(f'{one:g}' for one in RESOLUTIONS)} degrees whose mean "
        f"rate is more than {SUBSTANTIAL:g} % below that of {FINEST:g}, within one step of the "
        f"paper's; {CALIBRATED}",
        onsets,
        within({"N_t 35": (0.5, 1.5), "N_t 25": (1.5, 3.0)}, ("N_t 35", "N_t 25")),
    ),
)
