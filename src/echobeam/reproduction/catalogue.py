"""All figures and claims, in the paper's order."""

from __future__ import annotations

from collections.abc import Sequence

from echobeam.faults import InputError
from echobeam.reproduction.claims import rates as rate_claims
from echobeam.reproduction.figures import rates
from echobeam.reproduction.records import Claim, Figure

FIGURES: dict[str, Figure] = {module.FIGURE.id: module.FIGURE for module in (rates,)}
"""By id."""

CLAIMS: tuple[Claim, ...] = (*rate_claims.CLAIMS,)


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
