"""What every scheme must keep: power, finite numbers, repeatability, causality, any K."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echobeam.scenario.model import Scenario
from echobeam.schemes.base import Scheme
from echobeam.schemes.doors import as_scheme
from echobeam.schemes.registry import find_scheme
from echobeam.simulation.blocks import world_of
from echobeam.simulation.loop import SlotRecord, run_slots
from echobeam.simulation.motion import plan_motion
from echobeam.simulation.world import World

TRIALS = range(2)
SEED = 2024


class ConformanceError(AssertionError):
    """A scheme breaks a rule; the message says which, where and by how much."""


def check_scheme(scheme: str | object) -> None:
    """Examine a scheme on small scenarios with no, one and several objects.

    Its beams must be finite and within the power, whatever is known; the same seed must give the
    same run; and no beam may depend on what happens after it (the truth is bent after a slot, and
    no beam up to that slot may move).

    Parameters
    ----------
    scheme
        A name, ``path/to/file.py:name``, a function ``(prior, view) -> beams`` or a whole scheme.

    Raises
    ------
    ConformanceError, SchemeError
        Name the rule that is broken.
    """
    found = find_scheme(scheme) if isinstance(scheme, str) else as_scheme(scheme)
    if not found.name or not isinstance(found.name, str):
        raise ConformanceError("a scheme needs a name: a text that is not empty")
    for n_objects in (0, 1, 3):
        scenario = small_scenario(n_objects)
        world = _world(scenario)
        records = _run(scenario, found, world)
        _check_beams(found, records, scenario)
        _check_same(found, records, _run(scenario, found, world), "the same seed", len(records))
        for slot in (1, 2, scenario.frame.slots_per_frame, scenario.n_slots - 1):
            bent = _run(scenario, found, bend(world, slot))
            _check_same(found, records, bent, f"the truth bent after slot {slot}", slot)


def small_scenario(n_objects: int) -> Scenario:
    """Return two short frames with a small array and some objects."""
    angles = np.linspace(0.8, 2.2, n_objects) if n_objects != 1 else np.array([1.1])
    return Scenario.model_validate(
        {
            "name": f"conformance-{n_objects}",
            "array": {"n_tx": 8, "n_rx": 8},
            "radio": {"power": 10.0},
            "uav": {"height": 100.0, "speed": 15.0},
            "objects": [{"angle": angle, "velocity": 10.0} for angle in angles],
            "frame": {"slots_per_frame": 4, "frames": 2},
            "filter": {"velocity_prior": 30.0},
            "coverage": {"ripple": 0.8, "resolution": 0.02},
        }
    )


def bend(world: World, slot: int) -> World:
    """Return a world in which everything is the same up to a slot (from 1) and different after."""
    truth = world.motion.truth.copy()
    truth[:, slot:, :, 0] = np.pi - truth[:, slot:, :, 0]
    truth[:, slot:, :, 1:] *= 1.5
    return replace(world, motion=replace(world.motion, truth=truth))


def _world(scenario: Scenario) -> World:
    return world_of(scenario, SEED, TRIALS, plan_motion(scenario, SEED, TRIALS))


def _run(scenario: Scenario, scheme: Scheme, world: World) -> list[SlotRecord]:
    return list(run_slots(scenario, scheme, world))


def _check_beams(scheme: Scheme, records: list[SlotRecord], scenario: Scenario) -> None:
    """Check finiteness, power and shapes; the loop itself refuses the worst."""
    for record in records:
        if record.phase not in ("omni", "directional", "pilot"):
            raise ConformanceError(
                f"{scheme.name}: phase {record.phase!r} in slot {record.slot}; expected 'omni', "
                "'directional' or 'pilot'"
            )
        if not np.isfinite(record.rate).all() or (record.rate < 0).any():
            raise ConformanceError(f"{scheme.name}: a rate in slot {record.slot} is not a number")
        known = np.isfinite(record.estimated).all(axis=-1)
        eigenvalues = np.linalg.eigvalsh(record.estimated_cov[known])
        if (eigenvalues < -1e-9 * np.abs(eigenvalues).max(initial=1.0)).any():
            raise ConformanceError(
                f"{scheme.name}: a covariance in slot {record.slot} is not positive"
            )
        if record.estimated.shape != (len(TRIALS), scenario.n_objects, 3):
            raise ConformanceError(
                f"{scheme.name}: states of shape {record.estimated.shape} in slot {record.slot}"
            )


def _check_same(
    scheme: Scheme, ours: list[SlotRecord], theirs: list[SlotRecord], why: str, until: int
) -> None:
    """Check that beams up to a slot are the same, bit for bit."""
    for one, other in zip(ours[:until], theirs[:until], strict=True):
        if not np.array_equal(one.beam, other.beam, equal_nan=True):
            raise ConformanceError(
                f"{scheme.name}: with {why}, the beams of slot {one.slot} are different"
            )
