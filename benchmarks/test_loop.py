"""What the loop costs without beam design: microseconds per trial, slot and object.

`make bench` prints it; correctness stands beside the time.
"""

import numpy as np
import pytest

import echobeam as eb
from echobeam.schemes.registry import find_scheme
from echobeam.simulation.blocks import run_block

TRIALS = 128


@pytest.mark.parametrize("name", ["paper-multi", "paper-long"])
def test_loop_without_beam_design(benchmark, name):
    scenario = eb.load_scenario(name)
    scheme = find_scheme("water-filling")
    block = benchmark(run_block, scenario, [scheme], 0, range(TRIALS))
    one = run_block(scenario, [scheme], 0, range(1))
    np.testing.assert_allclose(block.arrays["rate"][0, 0], one.arrays["rate"][0, 0], rtol=1e-9)
    work = TRIALS * scenario.n_slots * scenario.n_objects
    benchmark.extra_info["us_per_trial_slot_object"] = 1e6 * benchmark.stats["median"] / work
