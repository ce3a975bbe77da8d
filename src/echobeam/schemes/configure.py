"""Schemes with their parameters: from ``temporal:ripple=1`` to a scheme that can run.

A scheme's parameters are the keys of ``[filter]``, ``[coverage]`` and, without labels, ``[tracks]``
that its parts read, the parts themselves (``frame``, ``tracker``, ``beamer``), and the fields of
its own and of its parts.
What the text says goes before the scenario's ``[schemes.NAME]``, and that before its tables.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import BaseModel

from echobeam.faults import InputError
from echobeam.physics.array import LinearArray
from echobeam.physics.aspect import OnGround, OnRoad
from echobeam.physics.coordinates import Geometry
from echobeam.physics.detection import DetectionLaw, detection_law
from echobeam.physics.fluctuation import STEADY, Fluctuation, SwerlingOne
from echobeam.physics.planar import AntennaArray, PlanarArray
from echobeam.physics.plane import GroundGeometry, Vector, facing
from echobeam.physics.road import ROAD_GEOMETRY
from echobeam.physics.targets import TARGETS
from echobeam.physics.variance_law import VarianceLaw
from echobeam.scenario.checking import ScenarioError, override_table, read_value
from echobeam.scenario.dump import key_texts
from echobeam.scenario.geometry import ROAD_KEYS, check_cover
from echobeam.scenario.limits import MOST_FALSE
from echobeam.scenario.model import Scenario
from echobeam.scenario.quantities import ripple_value
from echobeam.scenario.tables import CoverageTable, FilterTable, TracksTable
from echobeam.schemes.base import Scheme, SchemeError, System
from echobeam.schemes.doors import as_scheme
from echobeam.schemes.parameters import (
    own_parameters,
    part_names,
    road_parameters,
    set_parameter,
    table_keys,
)
from echobeam.schemes.parts import SchemeOfParts, misfits
from echobeam.schemes.registry import find_part, find_scheme
from echobeam.schemes.unlabelled import Unlabelled

_TEXT = re.compile(r"(?P<base>.+?)(?::(?P<parameters>[A-Za-z_]\w*=.*))?", re.DOTALL)


@dataclass(frozen=True, slots=True)
class ConfiguredScheme:
    """A scheme, the name of this variant in results, and the system that it is given."""

    name: str
    scheme: Scheme
    system: System


def configure_all(
    scenario: Scenario, schemes: Sequence[str | object] | None
) -> list[ConfiguredScheme]:
    """Return schemes that can run, for names and doors of any size, each name once.

    Parameters
    ----------
    scenario
        Whose parameters hold where nothing else is said.
    schemes
        Names with or without parameters, ``path/to/file.py:name``, functions
        ``(prior, view) -> beams`` or whole schemes; those that the scenario names if None.

    Raises
    ------
    SchemeError
        If one cannot be found or configured, or two have one name.
    """
    if schemes is None:
        asked: Sequence[str | object] = scenario.schemes
    else:
        asked = [schemes] if isinstance(schemes, str) else schemes
    found: list[ConfiguredScheme] = []
    faults: list[InputError] = []
    for item in asked:
        try:
            found.append(configure(scenario, item))
        except InputError as error:
            faults.append(error)
    if faults:
        details = "".join(fault.details for fault in faults)
        raise SchemeError("\n".join(map(str, faults)), details) from faults[0]
    names = [one.name for one in found]
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise SchemeError(f"scheme {doubled[0]!r} is asked for twice; give each one once")
    if not names:
        raise SchemeError("no scheme is asked for; give at least one")
    return found


def configure(scenario: Scenario, asked: str | object) -> ConfiguredScheme:
    """Return one scheme that can run.

    Raises
    ------
    SchemeError
        If it cannot be found, has no such parameter, or a value is not accepted.
    """
    if not isinstance(asked, str):
        scheme = as_scheme(asked)
        return ConfiguredScheme(scheme.name, _for(scenario, scheme), system_of(scenario))
    base, text = split(asked)
    scheme = find_scheme(base)
    values = _given(scenario, asked)
    name = f"{scheme.name}:{text}" if text else scheme.name
    scheme, system = _with_parameters(scheme, values, scenario, f"scheme {asked}")
    return ConfiguredScheme(name, _for(scenario, scheme), system)


def _for(scenario: Scenario, scheme: Scheme) -> Scheme:
    """Return a scheme of parts as one that associates detections, where nobody labels them."""
    if isinstance(scheme, SchemeOfParts) and scenario.unlabelled:
        return Unlabelled(scheme)
    return scheme


def _given(scenario: Scenario, asked: str) -> dict[str, object]:
    """Return the parameters of a scheme's text: its own, then those of the scenario's tables.

    Raises
    ------
    SchemeError
        If the scenario's table of this very text says something else than the text.
    """
    base, text = split(asked)
    values, tables = _values(text, asked), scenario.scheme_parameters
    for key, value in tables.get(asked, {}).items():
        if key in values and values[key] != value:
            raise SchemeError(
                f"scheme {asked}: {key}: {value!r} in its table contradicts its name; "
                "give it in one of the two"
            )
    return {**tables.get(base, {}), **tables.get(asked, {}), **values}


def system_of(
    scenario: Scenario,
    filter: FilterTable | None = None,
    coverage: CoverageTable | None = None,
    tracks: TracksTable | None = None,
) -> System:
    """Return the equipment and task of a scenario's UAV, as a scheme is given them."""
    coverage = scenario.coverage if coverage is None else coverage
    return System(
        array=scenario.array,
        radio=scenario.radio,
        frame=scenario.frame,
        filter=scenario.filter if filter is None else filter,
        coverage=coverage,
        law=variance_law(scenario),
        ripple=ripple_value(coverage.ripple, scenario.array.n_tx),
        detection=detection_of(scenario),
        law_known=scenario.radar.model == "crb" and scenario.radar.variance == "predicted",
        tracks=scenario.tracks if tracks is None else tracks,
        altitude_std=scenario.uav.altitude_std,
        labelled=not scenario.unlabelled,
        geometry=geometry_of(scenario),
    )


def geometry_of(scenario: Scenario) -> Geometry:
    """Return the coordinates of a scenario's states and measurements."""
    if scenario.geometry == "road":
        return ROAD_GEOMETRY
    array = scenario.array
    if array.kind == "linear":
        along: Vector = (1.0, 0.0, 0.0) if array.axis == "horizontal" else (0.0, 0.0, -1.0)
        return GroundGeometry(along_rows=along, normal=None)
    return facing(_FACING.get(array.facing, array.facing), array.element)


_FACING: dict[Any, Any] = {"down": (0.0, 0.0, -1.0), "ahead": (1.0, 0.0, 0.0)}


def arrays_of(scenario: Scenario) -> tuple[AntennaArray, AntennaArray]:
    """Return the transmit and the receive array of a scenario.

    On the ground a linear array is a planar one of a single column.
    """
    array = scenario.array
    if scenario.geometry == "road":
        sizes = (array.n_tx, array.receivers)
        one, other = (LinearArray(n, array.spacing, array.axis) for n in sizes)
        return one, other
    shapes = ((array.n_tx, 1), (array.receivers, 1))
    if array.kind == "planar":
        assert array.rows is not None
        assert array.columns is not None
        shapes = ((array.rows, array.columns), array.receive_shape)
    first, second = (PlanarArray(*one, array.spacing, array.polarisations) for one in shapes)
    return first, second


def detection_of(scenario: Scenario) -> DetectionLaw:
    """Return the law of detections for a scenario's equipment.

    Raises
    ------
    ScenarioError
        If there would be more false detections than trackers can take.
    """
    radar = scenario.radar
    law = detection_law(
        arrays_of(scenario)[1],
        false_alarm=radar.false_alarm,
        clutter=radar.clutter,
        subcarriers=radar.subcarriers,
        bandwidth=radar.bandwidth,
        pulse_length=radar.pulse_length,
        carrier=scenario.radio.carrier,
        uav_speed=fastest(scenario),
        fluctuation=fluctuation_of(scenario),
    )
    if scenario.unlabelled and law.mean_false > MOST_FALSE:
        raise ScenarioError(
            f"radar.false_alarm: {radar.false_alarm:g} is not accepted; {law.mean_false:.3g} false "
            f"detections in a slot, in {law.cells:.3g} resolution cells (of radar.subcarriers, the "
            "Doppler shifts by radar.pulse_length and radio.carrier, and the antennas); expected "
            f"at most {MOST_FALSE:g}"
        )
    return law


def fastest(scenario: Scenario) -> float:
    """Return the largest speed of a scenario's UAV, m/s."""
    uav = scenario.uav
    if scenario.geometry == "road":
        return uav.speed
    if uav.waypoints is None:
        return float(np.linalg.norm(uav.velocity or (0.0, 0.0, 0.0)))
    steps = np.diff(np.array(uav.waypoints), axis=0)
    return float(np.max(np.linalg.norm(steps[:, 1:], axis=-1) / steps[:, 0], initial=0.0))


def fluctuation_of(scenario: Scenario) -> Fluctuation:
    """Return the law of the strength of a scenario's echoes."""
    radar = scenario.radar
    if radar.target in TARGETS:
        return TARGETS[radar.target].fluctuation
    swerling = "swerling1" in (radar.target, radar.fluctuation)
    return SwerlingOne() if swerling else STEADY


def system_for(scenario: Scenario, name: str) -> System:
    """Return the system that the scheme of a name in a result was given.

    A user's scheme, whose file the result does not name, is taken to read all keys; the scenario's
    table is that of a file's scheme of this name.
    """
    base, text = split(name)
    files = [key for key in scenario.scheme_parameters if split(key)[0].endswith(f".py:{base}")]
    asked = f"{split(files[0])[0]}:{text}".removesuffix(":") if files else name
    try:
        return configure(scenario, name).system
    except SchemeError:
        values = _given(scenario, asked)
        tables = (FilterTable, CoverageTable, TracksTable)
        known = {key: values[key] for key in values if any(key in t.model_fields for t in tables)}
        return _system(scenario, known, f"scheme {name}")


def variance_law(scenario: Scenario) -> VarianceLaw:
    """Return the law of the measurement variance for a scenario's equipment."""
    radar, (transmitter, receiver) = scenario.radar, arrays_of(scenario)
    target = TARGETS.get(radar.target)
    on_place = OnRoad if scenario.geometry == "road" else OnGround
    return VarianceLaw(
        transmitter=transmitter,
        receiver=receiver,
        rcs=complex(*radar.rcs),
        gain=radar.integrated,
        noise=radar.noise,
        bandwidth=radar.bandwidth,
        pulse_length=radar.pulse_length,
        crb=radar.crb,
        target=on_place(target) if target is not None and target.directional else None,
    )


def split(text: str) -> tuple[str, str]:
    """Return name and parameters of a scheme's text, ``temporal:ripple=1`` or a plain name."""
    match = _TEXT.fullmatch(text)
    return (match["base"], match["parameters"] or "") if match else (text, "")


def _values(text: str, asked: str) -> dict[str, object]:
    values: dict[str, object] = {}
    for item in filter(None, text.split(",")):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals or not value:
            raise SchemeError(f"scheme {asked}: {item!r} is not accepted; expected KEY=VALUE")
        if key in values:
            raise SchemeError(f"scheme {asked}: {key} is given twice")
        values[key] = read_value(value)
    return values


def _with_parameters(
    scheme: Scheme, values: Mapping[str, object], scenario: Scenario, label: str
) -> tuple[Scheme, System]:
    """Return a scheme of other parts and parameters, and the system that it is given."""
    for kind in part_names(scheme):
        if kind in values:
            scheme = replace(scheme, **{kind: find_part(kind, str(values[kind]))})  # type: ignore[type-var]
    road = _of_the_road(scheme) if scenario.geometry == "ground" else set()
    own = {key: value for key, value in own_parameters(scheme).items() if key not in road}
    read = table_keys(scheme, unlabelled=scenario.unlabelled)
    keys = [key for key in read if key not in own and key not in road]
    accepted = [*keys, *own, *part_names(scheme)]
    elsewhere = dict.fromkeys(table_keys(scheme, unlabelled=True), _UNLABELLED)
    elsewhere |= dict.fromkeys(road, _ROAD)
    faults = [_unknown(key, accepted, elsewhere) for key in values if key not in accepted]
    system = system_of(scenario)
    try:
        system = _system(scenario, {key: values[key] for key in values if key in keys}, label)
    except InputError as error:
        faults.append(str(error).removeprefix(f"{label}: "))
    for key in values:
        if key in own:
            try:
                scheme = set_parameter(scheme, key, values[key], label)
            except SchemeError as error:
                faults.append(str(error).removeprefix(f"{label}: "))
    if not faults and isinstance(scheme, SchemeOfParts):
        faults += misfits(scheme)
    if faults:
        raise SchemeError("\n".join(f"{label}: {fault}" for fault in faults))
    return scheme, system


def _system(scenario: Scenario, values: Mapping[str, object], label: str) -> System:
    """Return the system of a scenario with some keys of its filter and coverage replaced."""

    def of(table: type[BaseModel]) -> dict[str, object]:
        return {key: value for key, value in values.items() if key in table.model_fields}

    coverage = override_table(scenario.coverage, of(CoverageTable), label)
    check_cover(scenario.geometry, coverage)
    return system_of(
        scenario,
        override_table(scenario.filter, of(FilterTable), label),
        coverage,
        override_table(scenario.tracks, of(TracksTable), label),
    )


_UNLABELLED = 'radar.detections = "unlabelled"'
_ROAD = 'geometry = "road"'


def _of_the_road(scheme: Scheme) -> set[str]:
    """Return the parameters of a scheme that have no meaning on the ground."""
    return {*ROAD_KEYS["filter"], *road_parameters(scheme)}


def _unknown(key: str, accepted: Sequence[str], elsewhere: Mapping[str, str]) -> str:
    if key in elsewhere:
        return f"{key}: a parameter only of runs with {elsewhere[key]}"
    near = difflib.get_close_matches(key, accepted, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    there = f"accepted here: {', '.join(accepted)}" if accepted else "this scheme has no parameters"
    return f"{key}: unknown parameter; {hint}{there}"


def defaults(name: str) -> dict[str, str]:
    """Return the parameters of a scheme by name with their defaults, as they would be written."""
    scheme = find_scheme(name)
    tables = {**key_texts(FilterTable()), **key_texts(CoverageTable())}
    chosen = {key: tables[key] for key in table_keys(scheme) if key in tables}
    return chosen | {
        key: str(value) for key, value in own_parameters(scheme).items() if key not in chosen
    }
