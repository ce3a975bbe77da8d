"""Cost of a slot on unlabelled detections over the number of vehicles.

`make bench` prints milliseconds per trial and slot, of the association and of the whole slot;
correctness stands beside the time: the vehicles are tracked, and no beams are a fallback.
"""

import numpy as np
import pytest

import echobeam as eb
from echobeam.schemes.configure import configure_all
from echobeam.simulation.blocks import run_block
from echobeam.simulation.scene import scene_of
from echobeam.values import Status

FRAMES = 3


def scenario_of(vehicles):
    """Vehicles on 280 m of road, each a little faster than the one behind."""
    places = np.linspace(-140.0, 140.0, vehicles)
    objects = [
        {"angle": float(np.arctan2(100.0, x)), "velocity": 10.0 + 10.0 * number / vehicles}
        for number, x in enumerate(places)
    ]
    return eb.load_scenario("arrivals").replace(
        {"objects": objects, "radio.power": 2e4, "tracks.capacity": 48, "frame.frames": FRAMES}
    )


@pytest.mark.parametrize("scheme", ["omni", "water-filling", "temporal"])
@pytest.mark.parametrize("vehicles", [4, 8, 16, 32])
def test_slot_on_unlabelled_detections(benchmark, scheme, vehicles):
    scenario = scenario_of(vehicles)
    scene, schemes = scene_of(scenario), configure_all(scenario, [scheme])
    run_block(scene, schemes, 0, range(1))
    block = benchmark.pedantic(run_block, (scene, schemes, 0, range(2)), rounds=3)
    confirmed = (block.arrays["track_status"] >= Status.CONFIRMED).sum(axis=-1)
    assert (confirmed[0, :, -5:] >= 0.9 * vehicles).all()
    assert not block.arrays["fallback"].any()
    slots = 2 * scenario.n_slots
    benchmark.extra_info["ms_per_trial_slot"] = 1e3 * benchmark.stats["median"] / slots
