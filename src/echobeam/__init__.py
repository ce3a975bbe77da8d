"""echobeam: sensing-assisted predictive beamforming, from the echo to the rate, in one loop.

The names here are the public interface. They are imported when first used, so that importing the
package stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from echobeam.version import __version__

if TYPE_CHECKING:
    from echobeam.beamforming.answer import BeamAnswer
    from echobeam.beamforming.design import design_beams
    from echobeam.beamforming.problem import BeamProblem, ProblemError
    from echobeam.physics.array import ArrayError, LinearArray
    from echobeam.physics.planar import PlanarArray
    from echobeam.scenario.checking import ScenarioError
    from echobeam.scenario.load import load_scenario
    from echobeam.scenario.model import Scenario
    from echobeam.schemes.base import Decision, Scheme, SchemeError, View
    from echobeam.schemes.beamers import Aim, Beams
    from echobeam.schemes.doors import scheme
    from echobeam.schemes.parts import SchemeOfParts
    from echobeam.simulation.loop import SlotRecord
    from echobeam.simulation.run import simulate, slots
    from echobeam.values import (
        Detections,
        GaussianState,
        Mode,
        StateSpace,
        Tracks,
        Transmission,
        UavState,
    )

_HOME = {
    "Aim": "schemes.beamers",
    "ArrayError": "physics.array",
    "BeamAnswer": "beamforming.answer",
    "BeamProblem": "beamforming.problem",
    "Beams": "schemes.beamers",
    "Decision": "schemes.base",
    "Detections": "values",
    "GaussianState": "values",
    "LinearArray": "physics.array",
    "Mode": "values",
    "PlanarArray": "physics.planar",
    "ProblemError": "beamforming.problem",
    "Scenario": "scenario.model",
    "ScenarioError": "scenario.checking",
    "Scheme": "schemes.base",
    "SchemeError": "schemes.base",
    "SchemeOfParts": "schemes.parts",
    "SlotRecord": "simulation.loop",
    "StateSpace": "values",
    "Tracks": "values",
    "Transmission": "values",
    "UavState": "values",
    "View": "schemes.base",
    "design_beams": "beamforming.design",
    "load_scenario": "scenario.load",
    "scheme": "schemes.doors",
    "simulate": "simulation.run",
    "slots": "simulation.run",
}

__all__ = [
    "Aim",
    "ArrayError",
    "BeamAnswer",
    "BeamProblem",
    "Beams",
    "Decision",
    "Detections",
    "GaussianState",
    "LinearArray",
    "Mode",
    "PlanarArray",
    "ProblemError",
    "Scenario",
    "ScenarioError",
    "Scheme",
    "SchemeError",
    "SchemeOfParts",
    "SlotRecord",
    "StateSpace",
    "Tracks",
    "Transmission",
    "UavState",
    "View",
    "__version__",
    "design_beams",
    "load_scenario",
    "scheme",
    "simulate",
    "slots",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its home when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'echobeam' has no attribute {name!r}")
    value = getattr(import_module(f"echobeam.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
