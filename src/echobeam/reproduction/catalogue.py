"""All figures and claims, in the paper's order."""

from __future__ import annotations

from collections.abc import Sequence

from echobeam.faults import InputError
from echobeam.reproduction.claims import ALL
from echobeam.reproduction.figures import (
    angles,
    approximation,
    distances,
    height_angles,
    height_rates,
    long_run,
    patterns_antennas,
    patterns_slots,
    rates,
    resolutions,
    sensitivity,
    trajectories,
)
from echobeam.reproduction.records import Claim, Figure

FIGURES: dict[str, Figure] = {
    figure.id: figure
    for figure in (
        approximation.FIGURE,
        rates.FIGURE,
        patterns_slots.FIGURE,
        patterns_antennas.FIGURE,
        angles.FIGURE,
        distances.FIGURE,
        trajectories.FIGURE,
        long_run.FIGURE,
        height_rates.FIGURE,
        height_angles.FIGURE,
        resolutions.FIGURE,
        sensitivity.FIGURE,
    )
}
"""By id."""

CLAIMS: tuple[Claim, ...] = ALL


def choose(ids: Sequence[str]) -> list[Figure]:
    """Return the figures of some ids, or all, in the paper's order.

    Raises
    ------
    InputError
        Names the unknown ids and those that there are.
    """
    unknown = [one for one in ids if one not in FIGURES]
    if unknown:
        raise InputError(f"no such figure: {', '.join(unknown)}; there are {', '.join(FIGURES)}")
    return [figure for name, figure in FIGURES.items() if not ids or name in ids]
