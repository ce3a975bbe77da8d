"""echobeam: sensing-assisted predictive beamforming, from the echo to the rate, in one loop.

The names here are the public interface. They are imported when first used, so that importing the
package stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from echobeam.version import __version__

if TYPE_CHECKING:
    from echobeam import testing as testing
    from echobeam.beamforming.answer import BeamAnswer
    from echobeam.beamforming.design import design_beams
    from echobeam.beamforming.problem import BeamProblem, ProblemError
    from echobeam.commands.describe import describe
    from echobeam.commands.plot import plot
    from echobeam.commands.reproduce import reproduce
    from echobeam.commands.run import run
    from echobeam.commands.sense import sense
    from echobeam.commands.simulate import simulate
    from echobeam.commands.summary import summary
    from echobeam.commands.sweep import sweep
    from echobeam.commands.traffic import Traffic, traffic
    from echobeam.faults import InputError, RunError
    from echobeam.physics.array import ArrayError, LinearArray
    from echobeam.physics.planar import PlanarArray
    from echobeam.scenario.built_in import scenarios
    from echobeam.scenario.checking import ScenarioError
    from echobeam.scenario.load import load_scenario
    from echobeam.scenario.model import Scenario
    from echobeam.schemes.base import Decision, Scheme, SchemeError, System, View
    from echobeam.schemes.beamers import Aim, Beams
    from echobeam.schemes.doors import scheme
    from echobeam.schemes.parts import Beamer, Frame, SchemeOfParts, Tracker
    from echobeam.schemes.registry import schemes
    from echobeam.simulation.description import Description
    from echobeam.simulation.loop import SlotRecord
    from echobeam.simulation.run import slots
    from echobeam.simulation.sensing_check import SensingCheck
    from echobeam.values import (
        Detections,
        GaussianState,
        Mode,
        StateSpace,
        Status,
        Tracks,
        Transmission,
        UavState,
    )

_HOME = {
    "Aim": "schemes.beamers",
    "ArrayError": "physics.array",
    "BeamAnswer": "beamforming.answer",
    "BeamProblem": "beamforming.problem",
    "Beamer": "schemes.parts",
    "Beams": "schemes.beamers",
    "Decision": "schemes.base",
    "Description": "simulation.description",
    "Detections": "values",
    "Frame": "schemes.parts",
    "GaussianState": "values",
    "InputError": "faults",
    "LinearArray": "physics.array",
    "Mode": "values",
    "PlanarArray": "physics.planar",
    "ProblemError": "beamforming.problem",
    "RunError": "faults",
    "Scenario": "scenario.model",
    "ScenarioError": "scenario.checking",
    "Scheme": "schemes.base",
    "SchemeError": "schemes.base",
    "SchemeOfParts": "schemes.parts",
    "SensingCheck": "simulation.sensing_check",
    "SlotRecord": "simulation.loop",
    "StateSpace": "values",
    "Status": "values",
    "System": "schemes.base",
    "Tracker": "schemes.parts",
    "Tracks": "values",
    "Traffic": "commands.traffic",
    "Transmission": "values",
    "UavState": "values",
    "View": "schemes.base",
    "describe": "commands.describe",
    "design_beams": "beamforming.design",
    "load_scenario": "scenario.load",
    "plot": "commands.plot",
    "reproduce": "commands.reproduce",
    "run": "commands.run",
    "scenarios": "scenario.built_in",
    "scheme": "schemes.doors",
    "sense": "commands.sense",
    "simulate": "commands.simulate",
    "slots": "simulation.run",
    "summary": "commands.summary",
    "sweep": "commands.sweep",
    "traffic": "commands.traffic",
}

_ROOMS = ("schemes", "testing")
"""Packages that are public names as well: `schemes` is called for the list of schemes."""

__all__ = [
    "Aim",
    "ArrayError",
    "BeamAnswer",
    "BeamProblem",
    "Beamer",
    "Beams",
    "Decision",
    "Description",
    "Detections",
    "Frame",
    "GaussianState",
    "InputError",
    "LinearArray",
    "Mode",
    "PlanarArray",
    "ProblemError",
    "RunError",
    "Scenario",
    "ScenarioError",
    "Scheme",
    "SchemeError",
    "SchemeOfParts",
    "SensingCheck",
    "SlotRecord",
    "StateSpace",
    "Status",
    "System",
    "Tracker",
    "Tracks",
    "Traffic",
    "Transmission",
    "UavState",
    "View",
    "__version__",
    "describe",
    "design_beams",
    "load_scenario",
    "plot",
    "reproduce",
    "run",
    "scenarios",
    "scheme",
    "schemes",
    "sense",
    "simulate",
    "slots",
    "summary",
    "sweep",
    "testing",
    "traffic",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its home when it is first asked for."""
    if name in _ROOMS:
        return import_module(f"echobeam.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'echobeam' has no attribute {name!r}")
    value = getattr(import_module(f"echobeam.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
