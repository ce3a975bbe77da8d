"""Varied keys of a grid as coordinates: the values as read by the scenarios, with units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from echobeam.scenario.model import Scenario
from echobeam.simulation.dataset import AnyArray
from echobeam.units import UNITS

_ALIKE = 1e-12  # unit conversion rounds: 70 cm is 0.7000000000000001 m


def read_setting(scenario: Scenario, key: str) -> tuple[object, str]:
    """Return the value of a scenario at a dotted key, and its SI unit (empty inside a list).

    A parameter of a scheme, ``schemes.NAME.KEY``, is returned as in the file, without a unit.
    """
    first, *names = key.split(".")
    if first == "schemes" and len(names) == 2:
        return scenario.scheme_parameters[names[0]][names[1]], ""
    value: Any = scenario
    unit = ""
    for part in key.split("."):
        if isinstance(value, tuple):
            value, unit = value[int(part)], ""
            continue
        extra = type(value).model_fields[part].json_schema_extra
        kind = extra.get("kind", "number") if isinstance(extra, dict) else "number"
        value, unit = getattr(value, part), next(iter(UNITS[str(kind)]), "1")
    return value, unit


def coordinate(
    scenarios: Sequence[Scenario], key: str, texts: Sequence[str]
) -> tuple[AnyArray, dict[str, str]]:
    """Return a key's values and attributes, one value for each of the scenarios.

    Whole numbers stay whole numbers, quantities are in SI units, and other values are the
    strings as given.
    """
    values, units = zip(*(read_setting(scenario, key) for scenario in scenarios), strict=True)
    attrs = {"long_name": f"the scenario's {key}"}
    kinds = {type(value) for value in values}
    if kinds == {int} or kinds == {float}:
        return np.array(values), attrs | ({"units": units[0]} if units[0] else {})
    return np.array(texts), attrs


def first_repeated(scenarios: Sequence[Scenario], keys: Sequence[str]) -> tuple[int, int] | None:
    """Return the first two scenarios with equal values at all given keys; None if all differ."""
    values = [[read_setting(scenario, key)[0] for key in keys] for scenario in scenarios]
    for later, value in enumerate(values):
        for earlier in range(later):
            if all(map(_same, values[earlier], value)):
                return earlier, later
    return None


def _same(one: object, two: object) -> bool:
    if isinstance(one, float) and isinstance(two, float):
        return math.isclose(one, two, rel_tol=_ALIKE)
    return one == two
