"""The typed scenario, its built-in presets, and the reading and writing of scenario files."""

from echobeam.scenario.dump import dump_scenario
from echobeam.scenario.load import (
    BUILT_IN,
    ScenarioError,
    load_scenario,
    preset_text,
    trace_path,
    validate,
    with_trace,
)
from echobeam.scenario.model import Scenario

__all__ = [
    "BUILT_IN",
    "Scenario",
    "ScenarioError",
    "dump_scenario",
    "load_scenario",
    "preset_text",
    "trace_path",
    "validate",
    "with_trace",
]
