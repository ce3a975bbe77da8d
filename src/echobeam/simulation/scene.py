"""Scene of a run: all that its trials have in common. A trace is read when it is made."""

from __future__ import annotations

from dataclasses import dataclass

from echobeam.physics.background import SURROUNDINGS
from echobeam.physics.coordinates import Geometry
from echobeam.physics.flight import FlightPath, StraightFlight, Waypoints
from echobeam.physics.motion import Flight
from echobeam.physics.variance_law import VarianceLaw
from echobeam.scenario.checking import ScenarioError
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import geometry_of, variance_law
from echobeam.simulation.grid import check_unambiguous
from echobeam.simulation.ground_movers import ground_mover
from echobeam.simulation.movers import Mover, mover_of


@dataclass(frozen=True, slots=True)
class Scene:
    """Scenario with its flight, its mover and its radar.

    Attributes
    ----------
    scenario
        The scenario.
    flight
        The UAV's.
    mover
        Motion of the objects.
    law
        Law of the measurement variance.
    geometry
        Coordinates of states and measurements.
    """

    scenario: Scenario
    flight: FlightPath
    mover: Mover
    law: VarianceLaw
    geometry: Geometry


def scene_of(scenario: Scenario) -> Scene:
    """Return the scene of a scenario; reads its trace, once for all trials.

    Raises
    ------
    TraceError
        If the trace cannot be used.
    ScenarioError
        If the waveform folds the delay or the Doppler shift of an object present in the first slot,
        or the background channel is not stated for the UAV's height.
    """
    geometry = geometry_of(scenario)
    if scenario.geometry == "ground":
        over_ground = ground_flight(scenario)
        moving = ground_mover(scenario, over_ground)
        _check_signal(scenario, geometry, moving, over_ground)
        return Scene(scenario, over_ground, moving, variance_law(scenario), geometry)
    along_road = flight_of(scenario)
    mover = mover_of(scenario, along_road)
    _check_signal(scenario, geometry, mover, along_road)
    return Scene(scenario, along_road, mover, variance_law(scenario), geometry)


def _check_signal(scenario: Scenario, geometry: Geometry, mover: Mover, flight: FlightPath) -> None:
    """Refuse objects of the first slot that the waveform of a signal folds."""
    if scenario.radar.model != "signal":
        return
    _check_background(scenario)
    ground, uav = mover.begin(), flight.at(0)
    state = geometry.exact(ground.position, ground.velocity, uav)
    check_unambiguous(scenario, geometry.ideal(state, uav, scenario.radio.carrier))


def _check_background(scenario: Scenario) -> None:
    """Refuse a height for which the standard does not state its background channel."""
    around = SURROUNDINGS.get(scenario.radar.background)
    height = scenario.uav.start(scenario.geometry)[2]
    if around is not None and not around.lowest < height <= around.highest:
        raise ScenarioError(
            f"{scenario.name}: radar.background: {scenario.radar.background!r} is stated for "
            f"heights above {around.lowest:g} and up to {around.highest:g} m; the UAV starts "
            f"{height:g} m high"
        )


def ground_flight(scenario: Scenario) -> FlightPath:
    """Return the flight of a scenario's UAV over the ground."""
    uav = scenario.uav
    if uav.waypoints is not None:
        return Waypoints(uav.waypoints, scenario.frame.slot)
    assert uav.position is not None
    return StraightFlight(uav.position, uav.velocity or (0.0, 0.0, 0.0), scenario.frame.slot)


def flight_of(scenario: Scenario) -> Flight:
    """Return the flight of a scenario's UAV above a road."""
    uav = scenario.uav
    return Flight(uav.height, uav.speed, uav.heading, scenario.frame.slot, uav.floor)
