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
    disturbance,
    globally_best,
    harvest,
    loudest,
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
from echobeam.beamforming.direct.shape import power_of
from echobeam.beamforming.direct.shapes import Covers, listen, set_out
from echobeam.beamforming.direct.sizes import PROBE_STEPS
from echobeam.values import Array, ComplexArray, IntArray

MOST_STEPS = 150

HELD = 12
"""Steps for which shares that were given are held, so that the shapes are those which suit them
and not those of a transition."""

AUDIBLE = 0.01
"""Interference over noise, at the start and with all the power, that is worth a closer look."""

OBJECTIVE, CONVERGED, PART, STEPS, DISTURBANCE, FIGURES = 0, 1, 2, 3, 4, 5


@dataclass(frozen=True, slots=True, eq=False)
class CompiledTrials:
    """T trials with K objects each.

    Attributes
    ----------
    phases, reach, ripple
        ``(T, K, G)``, ``(T, K)``, ``(T, K)``: see `Covers`.
    loss, threshold
        ``(T, K)``, see `Powers`.
    n_tx
        N.
    """

    phases: Array
    reach: IntArray
    ripple: Array
    loss: Array
    threshold: Array
    n_tx: int

    def taken(self, index: IntArray) -> CompiledTrials:
        """Return some of the trials."""
        return CompiledTrials(
            self.phases[index],
            self.reach[index],
            self.ripple[index],
            self.loss[index],
            self.threshold[index],
            self.n_tx,
        )

    def climb(
        self, chirp: float, warm: ComplexArray | None = None, share: Array | None = None
    ) -> Found:
        """Return the local optimum that one start leads to.

        Parameters
        ----------
        chirp
            Rate of the chirp of the start.
        warm
            ``(T K, N)`` beams to start from, NaN where there are none.
        share
            ``(T, K)``: shares of the surplus power to start from, held for the first steps.
        """
        beams = np.empty((*self.loss.shape, self.n_tx), dtype=complex)
        held = 0 if share is None else HELD
        _, figures = self._run((MOST_STEPS, held), chirp, warm, share, beams)
        return Found(
            beams=beams,
            objective=figures[:, OBJECTIVE].copy(),
            converged=figures[:, CONVERGED] > 0.0,
            factor=figures[:, PART].copy(),
            iterations=figures[:, STEPS].astype(np.int64),
            disturbance=figures[:, DISTURBANCE].copy(),
        )

    def probe(self, chirp: float, share: Array) -> tuple[Array, Array]:
        """Return ``(T, K)`` shares and ``(T,)`` sum rates, nats, after a few steps from some."""
        nothing = np.empty((0, 0, 0), dtype=complex)
        reached, figures = self._run((PROBE_STEPS, HELD), chirp, None, share, nothing)
        return reached, figures[:, OBJECTIVE].copy()

    def _run(
        self,
        steps: tuple[int, int],
        chirp: float,
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
        if warm is None:
            given = np.empty((0, 0, 0), dtype=complex)
        else:
            given = np.ascontiguousarray(warm.reshape(n_trials, n_objects, self.n_tx))
        figures = np.empty((n_trials, FIGURES))
        arrays = (self.phases, self.reach, self.ripple, self.loss, self.threshold)
        data = tuple(np.ascontiguousarray(array) for array in arrays)
        _ready()(*data, self.n_tx, chirp, given, share, *steps, beams, figures)
        return share, figures


@cache
def _ready() -> Callable[..., None]:
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
    phases, pair = np.empty((0, 1, 1)), np.empty((0, 1))
    reach, beams = np.empty((0, 1), dtype=np.int64), np.empty((0, 0, 0), dtype=complex)
    nobody = (phases, reach, pair, pair, pair, 2, 0.6, beams, pair, 1, 0, beams, pair)
    return compile_now(_runner(), nobody, progress)


@cache
def _runner() -> Callable[..., None]:
    """Return the function that is compiled when it is first called."""
    key = fingerprint()

    def run(
        phases: Array,
        reach: IntArray,
        ripple: Array,
        loss: Array,
        threshold: Array,
        n_tx: int,
        chirp: float,
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
            covers = Covers(phases[trial], reach[trial], ripple[trial])
            shapes = set_out(covers, n_tx, chirp, warm[trial] if warm.size else nobody)
            powers = uplink.start_powers(loss[trial], threshold[trial], share[trial])
            power, leak = np.empty(loss.shape[1]), scaled_identity(loss.shape[1], 0.0)
            listen(shapes, power, leak)
            heard = loudest(powers, power, leak)
            steps = descend(covers, shapes, powers, n_tx, most, held)
            line = figures[trial]
            line[STEPS] = min(steps, most)
            line[DISTURBANCE] = 0.0
            if beams.size:
                best = globally_best(shapes, powers)
                for beam in range(power.size):
                    power[beam] = min(power[beam], power_of(shapes.z[beam]))
                objective, good = harvest(covers, shapes, powers, beams[trial])
                line[OBJECTIVE] = objective
                line[CONVERGED] = 1.0 if steps <= most and good and best else 0.0
                line[PART] = powers.scalars[uplink.FACTOR]
                if heard > AUDIBLE:
                    line[DISTURBANCE] = disturbance(powers, power, objective)
            else:
                line[OBJECTIVE] = sum_rate(shapes, powers)

    return compiled_once(run)
