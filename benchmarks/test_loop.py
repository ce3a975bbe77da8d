"""Cost of the loop without beam design: microseconds per trial, slot and object, and memory.

`make bench` prints it; correctness stands beside the time.
"""

import tracemalloc

import numpy as np
import pytest

import echobeam as eb
from echobeam.schemes.configure import configure_all
from echobeam.simulation.blocks import run_block
from echobeam.simulation.loop import run_slots
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin

TRIALS = 128


def prepared(name, **changes):
    scenario = eb.load_scenario(name, {key.replace("__", "."): v for key, v in changes.items()})
    return scenario, scene_of(scenario), configure_all(scenario, ["water-filling"])


@pytest.mark.parametrize("name", ["paper-multi", "paper-long"])
def test_loop_without_beam_design(benchmark, name):
    scenario, scene, schemes = prepared(name)
    block = benchmark(run_block, scene, schemes, 0, range(TRIALS))
    one = run_block(scene, schemes, 0, range(1))
    np.testing.assert_allclose(block.arrays["rate"][0, 0], one.arrays["rate"][0, 0], rtol=1e-9)
    work = TRIALS * scenario.n_slots * scenario.n_objects
    benchmark.extra_info["us_per_trial_slot_object"] = 1e6 * benchmark.stats["median"] / work


@pytest.mark.parametrize("frames", [5, 50])
def test_memory_of_the_loop_does_not_grow_with_slots(benchmark, frames):
    """Peak of 128 trials drained slot by slot: what stays is one slot's values."""
    _, scene, (scheme,) = prepared("paper-long", frame__frames=frames)

    def drain():
        tracemalloc.start()
        total = sum(
            record.rate.sum() for record in run_slots(begin(scene, 0, range(TRIALS)), scheme)
        )
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return total, peak

    total, peak = benchmark.pedantic(drain, rounds=1)
    assert np.isfinite(total)
    benchmark.extra_info["peak_MB"] = round(peak / 1e6, 2)


def test_loop_with_signals(benchmark):
    """The receiver's chain in the loop; correctness: no trial depends on its block."""
    scenario, scene, schemes = prepared("paper-signal")
    block = benchmark.pedantic(run_block, (scene, schemes, 0, range(32)), rounds=3)
    one = run_block(scene, schemes, 0, range(1))
    np.testing.assert_allclose(block.arrays["rate"][0, 0], one.arrays["rate"][0, 0], rtol=1e-9)
    work = 32 * scenario.n_slots * scenario.n_objects
    benchmark.extra_info["us_per_trial_slot_object"] = 1e6 * benchmark.stats["median"] / work


@pytest.mark.parametrize("slots", [3, 12])
def test_memory_with_signals_does_not_grow_with_slots(benchmark, slots):
    """Peak of 64 trials: the signals of so many samples as are processed at once."""
    _, scene, (scheme,) = prepared("paper-signal", frame__slots_per_frame=slots)

    def drain():
        tracemalloc.start()
        total = sum(record.rate.sum() for record in run_slots(begin(scene, 0, range(64)), scheme))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return total, peak

    total, peak = benchmark.pedantic(drain, rounds=1)
    assert np.isfinite(total)
    benchmark.extra_info["peak_MB"] = round(peak / 1e6, 1)
