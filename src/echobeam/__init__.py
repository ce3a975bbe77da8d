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
    from echobeam.scenario.load import ScenarioError, load_scenario
    from echobeam.scenario.model import Scenario
    from echobeam.schemes.base import Scheme, SchemeError, View
    from echobeam.schemes.doors import scheme
    from echobeam.simulation.loop import SlotRecord
    from echobeam.simulation.run import simulate, slots
    from echobeam.values import GaussianState, Measurement

_HOME = {
    "BeamAnswer": "beamforming.answer",
    "BeamProblem": "beamforming.problem",
    "GaussianState": "values",
    "Measurement": "values",
    "ProblemError": "beamforming.problem",
    "Scenario": "scenario.model",
    "ScenarioError": "scenario.load",
    "Scheme": "schemes.base",
    "SchemeError": "schemes.base",
    "SlotRecord": "simulation.loop",
    "View": "schemes.base",
    "design_beams": "beamforming.design",
    "load_scenario": "scenario.load",
    "scheme": "schemes.doors",
    "simulate": "simulation.run",
    "slots": "simulation.run",
}

__all__ = [
    "BeamAnswer",
    "BeamProblem",
    "GaussianState",
    "Measurement",
    "ProblemError",
    "Scenario",
    "ScenarioError",
    "Scheme",
    "SchemeError",
    "SlotRecord",
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
