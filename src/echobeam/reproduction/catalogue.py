"""Figures and claims in the paper's order, collected from the modules of the two packages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from echobeam.faults import InputError
from echobeam.reproduction import figures
from echobeam.reproduction.discovery import find_claims, modules
from echobeam.reproduction.records import Claim, Figure


def _figures() -> Iterator[Figure]:
    for module in modules(figures):
        figure = getattr(module, "FIGURE", None)
        if isinstance(figure, Figure):
            yield figure


FIGURES: dict[str, Figure] = {
    figure.id: figure for figure in sorted(_figures(), key=lambda figure: figure.place)
}
"""Figures by id."""

CLAIMS: tuple[Claim, ...] = tuple(
    sorted(find_claims(), key=lambda claim: FIGURES[claim.figure].place)
)


def choose(ids: Sequence[str]) -> list[Figure]:
    """Return the figures with the given ids, or all, in the paper's order.

    Raises
    ------
    InputError
        Names the unknown ids and the known ones.
    """
    unknown = [one for one in ids if one not in FIGURES]
    if unknown:
        raise InputError(f"no such figure: {', '.join(unknown)}; there are {', '.join(FIGURES)}")
    return [figure for name, figure in FIGURES.items() if not ids or name in ids]
