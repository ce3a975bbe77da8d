"""Conformance of a scheme: power, finite numbers, repeatability, causality, no hidden truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from echobeam.scenario.model import GeometryName, Scenario
from echobeam.schemes.configure import ConfiguredScheme, configure
from echobeam.simulation.loop import SlotRecord, run_slots
from echobeam.simulation.movers import Ground, Kinematic, Mover
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import World, begin
from echobeam.values import NOBODY, Array, StateSpace, UavState

Numbers = npt.NDArray[np.float64] | npt.NDArray[np.complex128]

TRIALS = range(2)
SEED = 2024
OTHER_SEED = 2025

SPLIT = 1e-4
"""Relative change, by rounding, that other trials beside a trial may make."""

MOVED = 5.0
"""m along the road by which all objects are elsewhere: as much as the first measurement's error."""

ROUNDING = 1e-9
"""Relative change below which two values are the same."""

INSENSITIVE = 1e-3
"""Change that other noise makes, relative to the change that another truth makes, below which a
scheme has more than its measurements: whatever it makes of these, both move it about equally, after
some slots the noise a tenth or a hundredth as much."""


class ConformanceError(AssertionError):
    """A rule that a scheme breaks; the message says which, where and by how much."""


@dataclass(frozen=True, slots=True)
class Bent:
    """A mover whose objects are elsewhere, or others, or gone, after a slot.

    Attributes
    ----------
    mover
        The motion up to that slot.
    slot
        The last slot, counted from 1, in which everything is as before.
    state
        Whether the objects' positions and velocities change.
    identity
        ``"same"``, ``"others"`` (every column passes to a new object) or ``"gone"``.
    """

    mover: Mover
    slot: int
    state: bool = True
    identity: str = "same"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objects before and after."""
        return self.mover.names * 2

    def begin(self) -> Ground:
        """Return the objects in the first slot."""
        return self.mover.begin()

    def advance(self, ground: Ground, slot: int, uav: UavState, seed: int, trials: range) -> Ground:
        """Return the objects one slot later, bent once."""
        moved = self.mover.advance(ground, slot, uav, seed, trials)
        if slot + 1 < self.slot:
            return moved
        if slot + 1 == self.slot and self.state:
            moved = replace(moved, position=-1.5 * moved.position, velocity=1.5 * moved.velocity)
        if self.identity == "others":
            return replace(moved, identity=moved.identity + len(self.mover.names))
        if self.identity == "gone":
            nowhere = np.full_like(moved.position, np.nan)
            nobody = np.full_like(moved.identity, NOBODY)
            return Ground(nowhere, nowhere, nobody)
        return moved

    def standing(self, slot: int) -> Array:
        """Return the headings of objects at rest, as they were."""
        return self.mover.standing(slot)


_NONE = np.empty(0, dtype=np.int64)
_STILL = Kinematic(np.empty(0), np.empty(0), np.empty(0), 1.0, None, _NONE, _NONE)

BENDS = {
    "the truth": Bent(_STILL, 1),
    "the occupants": Bent(_STILL, 1, state=False, identity="others"),
    "the roster": Bent(_STILL, 1, state=False, identity="gone"),
}
"""Changes of nature, by their names in messages; mover and slot are filled in."""


def check_scheme(scheme: str | object, geometry: GeometryName = "road") -> None:
    """Examine a scheme on small scenarios with no, one and several objects.

    Its beams must be finite and within the power, whatever is known; the same seed must give the
    same run, and a trial the same whichever trials run beside it. No beam may depend on what
    happens after it: states, occupants and roster are bent after a slot, and no beam up to that
    slot may move. No track may be there before the first detection of its object. And no estimate
    and no beam may follow the truth without following the measurements, as it would if the scheme
    read the truth out of the variances that the reading ``radar.variance = "known"`` gives. An
    omniscient scheme is free of the last two rules.

    Parameters
    ----------
    scheme
        A name, with parameters or without, ``path/to/file.py:name``, a function
        ``(prior, view) -> beams`` or a whole scheme.
    geometry
        Objects on a road below a linear array, or on the ground below a planar one.

    Raises
    ------
    ConformanceError, SchemeError
        Name the rule that is broken.
    """
    for n_objects in (0, 1, 3):
        scenario = small_scenario(n_objects, geometry=geometry)
        found = configure(scenario, scheme)
        if not found.name or not isinstance(found.name, str):
            raise ConformanceError("a scheme needs a name: a text that is not empty")
        world = begin(scene_of(scenario), SEED, TRIALS)
        records = list(run_slots(world, found))
        _check_numbers(found, records)
        _check_same(found, records, list(run_slots(world, found)), "the same seed", len(records))
        _check_trials(found, world, records)
        for slot in (1, 2, scenario.frame.slots_per_frame, scenario.n_slots - 1):
            for label, bend in BENDS.items():
                mover = replace(bend, mover=world.scene.mover, slot=slot)
                bent = list(run_slots(bent_world(world, mover), found))
                _check_same(found, records, bent, f"{label} bent after slot {slot}", slot)
                if not found.scheme.omniscient:
                    _check_first_detections(found, bent)
        if n_objects and not found.scheme.omniscient:
            _check_measured(found, scenario)


def small_scenario(n_objects: int, geometry: GeometryName = "road") -> Scenario:
    """Return two short frames with a small array and some objects."""
    setting = _ground(n_objects) if geometry == "ground" else _road(n_objects)
    return Scenario.model_validate(
        {
            "name": f"conformance-{n_objects}",
            "geometry": geometry,
            "radio": {"power": 10.0},
            "frame": {"slots_per_frame": 4, "frames": 2},
            "filter": {"velocity_prior": 30.0},
            "coverage": {"ripple": 0.8, "resolution": 0.02},
            **setting,
        }
    )


def _road(n_objects: int) -> dict[str, object]:
    angles = np.linspace(0.8, 2.2, n_objects) if n_objects != 1 else np.array([1.1])
    return {
        "array": {"n_tx": 8},
        "uav": {"height": 100.0, "speed": 15.0},
        "objects": [{"angle": angle, "velocity": 10.0} for angle in angles],
    }


def _ground(n_objects: int) -> dict[str, object]:
    places = np.linspace(-40.0, 50.0, n_objects) if n_objects != 1 else np.array([45.0])
    return {
        "array": {"kind": "planar", "rows": 3, "columns": 4, "facing": "down"},
        "uav": {"position": [0.0, 0.0, 100.0], "velocity": [15.0, 0.0, 0.0]},
        "objects": [{"position": [x, 0.4 * x], "velocity": [10.0, 3.0]} for x in places],
    }


def bent_world(world: World, mover: Mover) -> World:
    """Return a world with the same past and the objects of another mover."""
    return replace(world, scene=replace(world.scene, mover=mover))


def _check_numbers(scheme: ConfiguredScheme, records: list[SlotRecord]) -> None:
    """Check finiteness and covariances; the loop itself refuses the worst."""
    for record in records:
        if not np.isfinite(record.rate).all() or (record.rate < 0).any():
            raise ConformanceError(f"{scheme.name}: a rate in slot {record.slot} is not a number")
        known = np.isfinite(record.estimated).all(axis=-1)
        eigenvalues = np.linalg.eigvalsh(record.estimated_cov[known])
        if (eigenvalues < -1e-9 * np.abs(eigenvalues).max(initial=1.0)).any():
            raise ConformanceError(
                f"{scheme.name}: a covariance in slot {record.slot} is not positive"
            )


def _check_same(
    scheme: ConfiguredScheme,
    ours: list[SlotRecord],
    theirs: list[SlotRecord],
    why: str,
    until: int,
) -> None:
    """Check that modes and beams up to a slot are the same, bit for bit."""
    for one, other in zip(ours[:until], theirs[:until], strict=True):
        if not np.array_equal(one.mode, other.mode):
            raise ConformanceError(
                f"{scheme.name}: with {why}, the mode of slot {one.slot} is different"
            )
        if not np.array_equal(one.beam, other.beam, equal_nan=True):
            raise ConformanceError(
                f"{scheme.name}: with {why}, the beams of slot {one.slot} are different"
            )


def _check_trials(scheme: ConfiguredScheme, world: World, records: list[SlotRecord]) -> None:
    """Check that a trial comes out as it does alone, and among other trials."""
    for trial, others in ((0, TRIALS[:1]), (1, range(1, 3))):
        again = list(run_slots(begin(world.scene, SEED, others), scheme))
        for one, other in zip(records, again, strict=True):
            same = one.mode[trial] == other.mode[0]
            for values in (one.beam, other.beam), (one.estimated, other.estimated):
                same &= _alike(values[0][trial], values[1][0])
            if not same:
                raise ConformanceError(
                    f"{scheme.name}: slot {one.slot} of a trial depends on the trials beside it; "
                    "results would depend on how the work is split"
                )


def _alike(one: Numbers, other: Numbers) -> bool:
    """Return whether two arrays are the same up to the rounding of sums and of solvers."""
    there = np.isfinite(one)
    if not np.array_equal(there, np.isfinite(other)):
        return False
    size = float(np.linalg.norm(one[there]))
    return float(np.linalg.norm(one[there] - other[there])) <= SPLIT * size


def _check_first_detections(scheme: ConfiguredScheme, records: list[SlotRecord]) -> None:
    """Check that no object has a prior before its first detection."""
    detected: set[tuple[int, int]] = set()
    for record in records:
        known = np.isfinite(record.predicted[..., 0])
        for trial, column in np.argwhere(known).tolist():
            who = int(record.identity[trial, column])
            if (trial, who) not in detected:
                raise ConformanceError(
                    f"{scheme.name}: has a prior of object {who} in slot {record.slot}, before the "
                    "first detection of it; an object that took another's column is a new one"
                )
        measured = np.isfinite(record.measured).any(axis=-1)
        detected |= {
            (trial, int(record.identity[trial, column]))
            for trial, column in np.argwhere(measured).tolist()
        }


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """A mover whose objects are `MOVED` further along the road, from the first slot on."""

    mover: Mover

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objects."""
        return self.mover.names

    def begin(self) -> Ground:
        """Return the objects in the first slot."""
        ground = self.mover.begin()
        return replace(ground, position=ground.position + np.array([MOVED, 0.0, 0.0]))

    def advance(self, ground: Ground, slot: int, uav: UavState, seed: int, trials: range) -> Ground:
        """Return the objects one slot later."""
        return self.mover.advance(ground, slot, uav, seed, trials)

    def standing(self, slot: int) -> Array:
        """Return the headings of objects at rest."""
        return self.mover.standing(slot)


def _check_measured(scheme: ConfiguredScheme, scenario: Scenario) -> None:
    """Check that what follows the truth follows the measurements too: estimates and beams."""
    scene = scene_of(scenario.replace({"radar.variance": "known"}))
    elsewhere = replace(scene, mover=Elsewhere(scene.mover))
    records, other_noise, other_truth = (
        list(run_slots(begin(where, seed, TRIALS), scheme))
        for where, seed in ((scene, SEED), (scene, OTHER_SEED), (elsewhere, SEED))
    )
    for one, noise, truth in zip(records, other_noise, other_truth, strict=True):
        for what, values in _followers(scene.geometry.space, one, noise, truth).items():
            by_noise, by_truth = _changes(*values)
            if by_noise < INSENSITIVE * by_truth:
                raise ConformanceError(
                    f"{scheme.name}: the {what} of slot {one.slot} follow the truth and not the "
                    "measurements; it reads the truth out of the variances"
                )


def _followers(space: StateSpace, *records: SlotRecord) -> dict[str, list[Numbers]]:
    """Return what depends on measurements, by name: every estimated component, and the beams."""
    found: dict[str, list[Numbers]] = {"beams": [record.beam for record in records]}
    for place, name in enumerate(space.names):
        found[f"estimates of {name}"] = [record.estimated[..., place] for record in records]
    return found


def _changes(value: Numbers, noise: Numbers, truth: Numbers) -> tuple[float, float]:
    """Return the root mean square changes that noise and truth make, where all are numbers."""
    there = np.isfinite(value) & np.isfinite(noise) & np.isfinite(truth)
    by_noise, by_truth = (
        float(np.linalg.norm(np.where(there, other - value, 0.0))) for other in (noise, truth)
    )
    scale = float(np.linalg.norm(np.where(there, value, 0.0)))
    return by_noise, by_truth if by_truth > ROUNDING * scale else 0.0
