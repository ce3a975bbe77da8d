"""Description of a scenario: link budget, scale of powers, and assumptions of the model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from echobeam.scenario.load import load_scenario
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import configure_all
from echobeam.simulation.assumption import Assumption
from echobeam.simulation.assumptions import MOST_SLOTS, assumptions, extremes
from echobeam.simulation.ground_budget import ground_budgets
from echobeam.simulation.link_budget import PowerScale, object_budgets, power_scale
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import World, begin


@dataclass(frozen=True, slots=True)
class Description:
    """Numbers that describe a scenario; SI units, radians, linear powers.

    Attributes
    ----------
    scenario
        Described scenario.
    slot
        Slot of the budgets, counted from 1: the first with an object in the scene.
    objects
        Budgets of the objects present in that slot: `ObjectBudget` above a road, `GroundBudget`
        with ``geometry = "ground"``.
    scale
        Watts and square metres that correspond to the scenario's powers.
    assumptions
        Assumptions of the model, and whether they hold in the scenario.
    """

    scenario: Scenario
    slot: int
    objects: tuple[Any, ...]
    scale: PowerScale
    assumptions: tuple[Assumption, ...]

    @property
    def warnings(self) -> tuple[Assumption, ...]:
        """Assumptions that do not hold."""
        return tuple(one for one in self.assumptions if one.holds is False)

    def __repr__(self) -> str:
        """Return a line with name, objects and warnings."""
        names = ", ".join(one.name for one in self.warnings) or "none"
        count = f"{len(self.objects)} object(s)"
        return f"<Description of {self.scenario.name}: {count}, warnings {names}>"


def describe(scenario: Scenario | str | Path) -> Description:
    """Describe a scenario without running it: link budget, powers in watts, assumptions.

    Parameters
    ----------
    scenario
        A scenario, a built-in scenario's name, or the path of a scenario file.

    Raises
    ------
    ScenarioError, SchemeError, TraceError
        If the scenario, one of its schemes or its trace cannot be used.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    configure_all(scenario, None)
    start = begin(scene_of(scenario.calm), 0, range(1))
    with np.errstate(all="ignore"):  # extreme settings give zero, inf or NaN
        first = _first_inhabited(start)
        on_ground, scale = scenario.geometry == "ground", power_scale(scenario)
        objects: tuple[Any, ...] = (ground_budgets if on_ground else object_budgets)(first)
        found = assumptions(scenario, objects, scale, extremes(start))
    return Description(scenario, first.slot + 1, objects, scale, found)


def _first_inhabited(start: World) -> World:
    """Return the world in the first slot with an object, or in the first slot if there is none."""
    world = start
    for _ in range(min(start.scene.scenario.n_slots, MOST_SLOTS) - 1):
        if world.present.any():
            return world
        world = world.advance()
    return world if world.present.any() else start
