"""What was run, by name: sum rates, errors and kept arrays of every setup."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echobeam.estimation.gaussian import wrap
from echobeam.scenario.model import Scenario
from echobeam.simulation.digest import Digest
from echobeam.sweeps.points import Point
from echobeam.values import STATE, Array


@dataclass(frozen=True, slots=True)
class Outcome:
    """One point's results.

    Attributes
    ----------
    point
        What was run.
    digest
        Its digest; ``sum_rate`` is (scheme, trial, slot).
    kept
        Arrays of the point's ``keep``, laid out as in a result file.
    """

    point: Point
    digest: Digest
    kept: dict[str, Array]

    @property
    def scenario(self) -> Scenario:
        """The scenario that was run."""
        return self.point.scenario

    def sum_rate(self, scheme: str) -> Array:
        """Return ``(trial, slot)`` bit/s/Hz, summed over the objects."""
        rate: Array = self.digest["sum_rate"][self._index(scheme)]
        return rate

    def of(self, variable: str, scheme: str) -> Array:
        """Return a kept variable of one scheme, ``(trial, slot, object, ...)``."""
        found: Array = self.kept[variable][self._index(scheme)]
        return found

    def error(self, scheme: str, component: str, variable: str = "estimated") -> Array:
        """Return ``(trial, slot, object)``: estimate minus truth of a state's component, SI."""
        index = STATE.index(component)
        off = self.of(variable, scheme)[..., index] - self.kept["truth"][..., index]
        return wrap(off) if component == "angle" else np.asarray(off)

    def _index(self, scheme: str) -> int:
        return self.point.schemes.index(scheme)


class Results:
    """Outcomes by the name of their setup."""

    def __init__(self, outcomes: Sequence[Outcome], trials: int, seed: int) -> None:
        self.outcomes = {outcome.point.name: outcome for outcome in outcomes}
        self.trials = trials
        self.seed = seed

    def __getitem__(self, name: str) -> Outcome:
        """Return the outcome of a setup."""
        return self.outcomes[name]
