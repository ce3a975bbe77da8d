"""The cases of the benchmark by name: recorded, generated, hard, the test point, growth in K."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from echobeam.benchmarking import asked, problems
from echobeam.benchmarking.problems import CaseProblems
from echobeam.faults import InputError

ANTENNAS = (8, 30, 64, 128)
OBJECTS = (1, 2, 4, 8)
SIGMAS = (0.1, 1, 3)
"""Degrees."""

GROWTH = (2, 4, 8, 16)
"""K at N = 64."""

HARD = ((30, 2), (30, 4), (64, 4))
"""N and K of the cases with objects close together."""

QUICK = ("paper-multi-first", "paper-multi-later", "n30-k2-s1", "test-point", "n64-k2-s1")
"""What is run if nothing is asked for."""


@dataclass(frozen=True, slots=True)
class Case:
    """A named set of problems.

    Attributes
    ----------
    name, words
        As on the command line, and what it is.
    make
        Returns the problems.
    """

    name: str
    words: str
    make: Callable[[], CaseProblems]


def _recorded() -> list[Case]:
    parts = (
        ("first", "first slots after an omnidirectional one, wide", asked.first_slots),
        ("later", "later slots of a frame", asked.later_slots),
    )
    return [
        Case(f"{scenario}-{part}", f"{scenario}, {words}", partial(make, scenario))
        for scenario in ("paper-multi", "paper-single")
        for part, words, make in parts
    ]


def _generated() -> list[Case]:
    return [
        Case(
            f"n{n_tx}-k{count}-s{sigma}",
            f"N = {n_tx}, K = {count} anywhere on the road, sigma {sigma} degrees, P_T = 1e4",
            partial(problems.on_the_road, n_tx, count, sigma),
        )
        for n_tx in ANTENNAS
        for count in OBJECTS
        for sigma in SIGMAS
    ]


def _hard() -> list[Case]:
    return [
        Case(
            f"hard-n{n_tx}-k{count}",
            f"N = {n_tx}, K = {count}, 3 to 6 degrees apart, sigma 1 degree, P_T = 1e4",
            partial(problems.close_together, n_tx, count, 1.0),
        )
        for n_tx, count in HARD
    ]


def _growth() -> list[Case]:
    return [
        Case(
            f"growth-k{count}",
            f"N = 64, K = {count} anywhere on the road, sigma 1 degree, P_T = 1e4",
            partial(problems.on_the_road, 64, count, 1.0),
        )
        for count in GROWTH
    ]


CASES: dict[str, Case] = {
    case.name: case
    for case in (
        *_recorded(),
        *_generated(),
        *_hard(),
        Case(
            "test-point",
            "N = 30, K = 2 at 75 and 135 degrees, +-3 degrees, B = 2, P_T = 1e4",
            problems.test_point,
        ),
        *_growth(),
    )
}
"""Every case by its name."""


def find_cases(names: Sequence[str]) -> list[Case]:
    """Return cases by their names, each once, in the order given.

    Raises
    ------
    InputError
        If there is no such case; the message names all there are.
    """
    for name in names:
        if name not in CASES:
            near = difflib.get_close_matches(name, CASES, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise InputError(f"unknown case {name!r}; {hint}there are: {', '.join(CASES)}")
    return [CASES[name] for name in dict.fromkeys(names)]
