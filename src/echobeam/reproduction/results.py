"""Results by name: sum rates, errors and stored arrays of every setup."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from echobeam.estimation.gaussian import wrap
from echobeam.physics.polar import POLAR
from echobeam.reproduction.setups import Variation, claimed
from echobeam.scenario.model import Scenario
from echobeam.simulation.statistics import Statistics
from echobeam.sweeps.points import Point
from echobeam.values import Array


@dataclass(frozen=True, slots=True)
class Outcome:
    """Results of one point.

    Attributes
    ----------
    point
        Point that was run.
    statistics
        Statistics of the point; ``sum_rate`` is (scheme, trial, slot).
    kept
        Arrays of the variables in the point's ``keep``, with the dimensions of a result file.
    asked
        Schemes that were accessed so far, on which a measure depends.
    """

    point: Point
    statistics: Statistics
    kept: dict[str, Array]
    asked: set[str] = field(default_factory=set, repr=False, compare=False)

    @property
    def scenario(self) -> Scenario:
        """Scenario that was run."""
        return self.point.scenario

    def sum_rate(self, scheme: str) -> Array:
        """Return ``(trial, slot)`` bit/s/Hz, summed over the objects."""
        rate: Array = self.statistics["sum_rate"][self._index(scheme)]
        return rate

    def of(self, variable: str, scheme: str) -> Array:
        """Return a stored variable of one scheme, ``(trial, slot, object, ...)``."""
        found: Array = self.kept[variable][self._index(scheme)]
        return found

    def error(self, scheme: str, component: str, variable: str = "estimated") -> Array:
        """Return ``(trial, slot, object)``: estimate minus truth of a state's component, SI."""
        index = POLAR.names.index(component)
        off = self.of(variable, scheme)[..., index] - self.kept["truth"][..., index]
        return wrap(off) if component == "angle" else np.asarray(off)

    def fallbacks(self, scheme: str) -> float:
        """Return the share of a scheme's directional slots whose beams were a fallback."""
        frame = self.scenario.frame
        slots = frame.frames * (frame.slots_per_frame - 1)
        return float(self.statistics["fallback"][self._index(scheme)].mean() / slots)

    def _index(self, scheme: str) -> int:
        self.asked.add(scheme)
        return self.point.schemes.index(scheme)


class Results:
    """Outcomes by name of the setup, and the settings ``KEY=VALUE`` of all of them."""

    def __init__(
        self, outcomes: Sequence[Outcome], trials: int, seed: int, settings: Sequence[str] = ()
    ) -> None:
        self.outcomes = {outcome.point.name: outcome for outcome in outcomes}
        self.trials = trials
        self.seed = seed
        self.settings = tuple(settings)

    def __getitem__(self, name: str) -> Outcome:
        """Return the outcome of a setup."""
        return self.outcomes[name]

    def under(self, variation: Variation, names: Collection[str]) -> Results:
        """Return the results with one reading of the named setups changed.

        Outcomes under the variation have the names of the default setups and schemes, so that the
        same measures apply; all others are unchanged. The record of accessed schemes is empty.
        """
        outcomes = []
        for name, own in self.outcomes.items():
            found, schemes = own, own.point.schemes
            if name in names:
                found, schemes = self[variation.named(name)], claimed(schemes)
            point = replace(found.point, name=name, schemes=schemes)
            outcomes.append(replace(found, point=point, asked=set()))
        return Results(outcomes, self.trials, self.seed, self.settings)
