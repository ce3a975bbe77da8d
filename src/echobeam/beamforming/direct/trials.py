"""Trials solved one after the other by compiled code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from echobeam.beamforming.direct import powers as uplink
from echobeam.beamforming.direct.arrays import scaled_identity
from echobeam.beamforming.direct.climb import (
    descend,
    finish_beams,
    globally_best,
    interference_loss,
    largest_interference,
    sum_rate,
)
from echobeam.beamforming.direct.compiling import (
    Compilation,
    Progress,
    compile_now,
    compiled_once,
    fingerprint,
)
from echobeam.beamforming.direct.found import Found
from echobeam.beamforming.direct.layout import Layout
from echobeam.beamforming.direct.shape import power_of
from echobeam.beamforming.direct.shapes import Covers, measure_leaks, start_shapes
from echobeam.physics.planar import AntennaArray
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

MOST_STEPS = 300
"""Steps of a climb. With half as many 14 of 2,000 random problems, under very wide covers, were
worse."""

HELD = 20
"""Steps for which shares that were given are held, so that the shapes are those which suit them
and not those of a transition."""

NOTICEABLE = 0.01
"""Interference over noise, at the start and with all the power, that is worth a closer look."""

OBJECTIVE, CONVERGED, KEPT, PROVED, PART, STEPS, INTERFERENCE_LOSS, FIGURES = 0, 1, 2, 3, 4, 5, 6, 7


@dataclass(frozen=True, slots=True, eq=False)
class CompiledTrials:
    """T trials with K objects each.

    Attributes
    ----------
    layout
        Their geometry.
    ripple
        ``(T, K)``: B_k / N.
    loss, threshold
        ``(T, K)``, see `Powers`.
    array
        The transmit array.
    """

    layout: Layout
    ripple: Array
    loss: Array
    threshold: Array
    array: AntennaArray

    @property
    def may_stay_unproved(self) -> bool:
        """True where a shape without a proof may be a best one: the array is no linear one."""
        return self.array.axes > 1

    def taken(self, index: IntArray) -> CompiledTrials:
        """Return some of the trials."""
        return CompiledTrials(
            self.layout.taken(index),
            self.ripple[index],
            self.loss[index],
            self.threshold[index],
            self.array,
        )

    def only(self, index: IntArray, objects: IntArray) -> CompiledTrials:
        """Return some of the trials with some of their objects, ``(J, k)``."""
        place = index[:, np.newaxis], objects
        return CompiledTrials(
            self.layout.only(index, objects),
            self.ripple[place],
            self.loss[place],
            self.threshold[place],
            self.array,
        )

    def climb(
        self, chirp: Array, warm: ComplexArray | None = None, share: Array | None = None
    ) -> Found:
        """Return the local optimum that one start leads to.

        Parameters
        ----------
        chirp
            ``(r, d)``: rates of the chirps of the start.
        warm
            ``(T, K, n)`` beams to start from, NaN where there are none.
        share
            ``(T, K)``: shares of the surplus power to start from, held for the first steps.
        """
        beams = np.empty((*self.loss.shape, self.array.n), dtype=complex)
        held = 0 if share is None else HELD
        _, figures = self._run((MOST_STEPS, held), chirp, warm, share, beams)
        proved: BoolArray = figures[:, PROVED] > 0.0
        return Found(
            beams=beams,
            objective=figures[:, OBJECTIVE].copy(),
            converged=(figures[:, CONVERGED] > 0.0) & (proved | self.may_stay_unproved),
            proved=proved,
            kept=figures[:, KEPT] > 0.0,
            factor=figures[:, PART].copy(),
            iterations=figures[:, STEPS].astype(np.int64),
            interference_loss=figures[:, INTERFERENCE_LOSS].copy(),
        )

    def probe(self, chirp: Array, share: Array, steps: int) -> tuple[Array, Array]:
        """Return ``(T, K)`` shares and ``(T,)`` sum rates, nats, after a few steps from some."""
        nothing = np.empty((0, 0, 0), dtype=complex)
        reached, figures = self._run((steps, HELD), chirp, None, share, nothing)
        return reached, figures[:, OBJECTIVE].copy()

    def _run(
        self,
        steps: tuple[int, int],
        chirp: Array,
        warm: ComplexArray | None,
        share: Array | None,
        beams: ComplexArray,
    ) -> tuple[Array, Array]:
        """Return shares ``(T, K)`` and ``(T, FIGURES)``, and fill the beams if there is room.

        ``steps`` are how many to take at most, and for how many of them the shares are held.
        """
        n_trials, n_objects = self.loss.shape
        if share is None:
            share = np.full((n_trials, n_objects), 1.0 / n_objects)
        else:
            share = np.array(np.broadcast_to(share, self.loss.shape))
        given = np.empty((0, 0, 0), dtype=complex) if warm is None else warm
        figures = np.empty((n_trials, FIGURES))
        at = self.layout
        geometry = (at.own, at.nodes, at.grid, at.count, at.near, at.first, at.bow)
        arrays = (*geometry, self.ripple, self.loss, self.threshold)
        # Writable and contiguous: another type of array would have to be compiled for.
        data = tuple(np.require(array, requirements=["C", "W"]) for array in arrays)
        sizes = (at.spare, self.array.elements, self.array.shape[1])
        given = np.ascontiguousarray(given)
        ready()(*data, *sizes, chirp, given, share, *steps, beams, figures)
        return share, figures


@cache
def ready() -> Callable[..., None]:
    """Return the compiled function; the first call waits for the compiler, which says so."""
    compile_solver()
    return _runner()


def compile_solver(progress: Progress = lambda done, total: None) -> Compilation:
    """Compile the solver where it is not on disk yet, on a batch of no trials.

    Parameters
    ----------
    progress
        Called with the number of functions compiled and their number in all.
    """
    pair, places = np.empty((0, 1)), np.empty((0, 1), dtype=np.int64)
    three, four = np.empty((0, 1, 1)), np.empty((0, 1, 1, 1))
    near, first = np.empty((0, 1, 1, 2), dtype=np.int64), np.empty((0, 1, 1), dtype=np.int64)
    beams = np.empty((0, 0, 0), dtype=complex)
    geometry = (three, four, four, places, near, first, four)
    nobody = (*geometry, pair, pair, pair, 0, 2, 2, pair, beams, pair, 1, 0, beams, pair)
    return compile_now(_runner(), nobody, progress)


@cache
def _runner() -> Callable[..., None]:
    """Return the function that is compiled when it is first called."""
    key = fingerprint()

    def run(
        own: Array,
        nodes: Array,
        grid: Array,
        count: IntArray,
        near: IntArray,
        first: IntArray,
        bow: Array,
        ripple: Array,
        loss: Array,
        threshold: Array,
        spare: int,
        n_tx: int,
        columns: int,
        chirp: Array,
        warm: ComplexArray,
        share: Array,
        most: int,
        held: int,
        beams: ComplexArray,
        figures: Array,
    ) -> None:
        if len(key) == 0:  # Only here so that the key is one of what the function closes over.
            return
        nobody = np.empty((0, 0), dtype=np.complex128)
        for trial in range(loss.shape[0]):
            covers = Covers(
                own[trial],
                nodes[trial],
                grid[trial],
                count[trial],
                near[min(trial, near.shape[0] - 1)],
                first[trial],
                bow[trial],
                spare,
                ripple[trial],
                n_tx,
                columns,
            )
            shapes = start_shapes(covers, chirp, warm[trial] if warm.size else nobody)
            powers = uplink.start_powers(loss[trial], threshold[trial], share[trial])
            power, leak = np.empty(loss.shape[1]), scaled_identity(loss.shape[1], 0.0)
            measure_leaks(shapes, power, leak)
            interference = largest_interference(powers, power, leak)
            steps = descend(covers, shapes, powers, most, held)
            line = figures[trial]
            line[STEPS] = min(steps, most)
            line[INTERFERENCE_LOSS] = 0.0
            if beams.size:
                best = globally_best(shapes, powers)
                for beam in range(power.size):
                    power[beam] = min(power[beam], power_of(shapes.z[beam]))
                objective, good, kept = finish_beams(covers, shapes, powers, beams[trial])
                line[OBJECTIVE] = objective
                line[CONVERGED] = 1.0 if steps <= most and good else 0.0
                line[KEPT] = 1.0 if kept else 0.0
                line[PROVED] = 1.0 if best else 0.0
                line[PART] = powers.scalars[uplink.FACTOR]
                if interference > NOTICEABLE:
                    line[INTERFERENCE_LOSS] = interference_loss(powers, power, objective)
            else:
                line[OBJECTIVE] = sum_rate(shapes, powers)

    return compiled_once(run)
