"""The typed scenario, its built-in presets, and the reading and writing of scenario files.

`tables` and the `model` that holds them say what there is, `checking` what is wrong with what was
written; `load` reads and `dump` writes.
"""

from echobeam.scenario.built_in import BUILT_IN, preset_text
from echobeam.scenario.checking import ScenarioError
from echobeam.scenario.load import load_scenario, trace_path
from echobeam.scenario.model import Scenario

__all__ = ["BUILT_IN", "Scenario", "ScenarioError", "load_scenario", "preset_text", "trace_path"]
