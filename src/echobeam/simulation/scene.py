"""Scene of a run: all that its trials have in common. A trace is read when it is made."""

from __future__ import annotations

from dataclasses import dataclass

from echobeam.physics.coordinates import Geometry
from echobeam.physics.motion import Flight
from echobeam.physics.variance_law import VarianceLaw
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import geometry_of, variance_law
from echobeam.simulation.grid import check_unambiguous
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
    flight: Flight
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
        If the waveform folds the delay or the Doppler shift of an object present in the first slot.
    """
    flight = flight_of(scenario)
    mover, geometry = mover_of(scenario, flight), geometry_of(scenario)
    if scenario.radar.model == "signal":
        ground, uav = mover.begin(), flight.at(0)
        check_unambiguous(scenario, geometry.state(ground.position, ground.velocity, uav), uav)
    return Scene(scenario, flight, mover, variance_law(scenario), geometry)


def flight_of(scenario: Scenario) -> Flight:
    """Return the flight of a scenario's UAV."""
    uav = scenario.uav
    return Flight(uav.height, uav.speed, uav.heading, scenario.frame.slot, uav.floor)
