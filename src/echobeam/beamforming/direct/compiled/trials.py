"""Trials solved one after the other by compiled code: the counterpart of `direct.climb.Trials`."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from echobeam.beamforming.direct.climb import AUDIBLE, HELD, MOST_STEPS, PROBE_STEPS, Found
from echobeam.beamforming.direct.compiled import powers as uplink
from echobeam.beamforming.direct.compiled.arrays import scaled_identity
from echobeam.beamforming.direct.compiled.climb import (
    descend,
    disturbance,
    globally_best,
    harvest,
    loudest,
    sum_rate,
)
from echobeam.beamforming.direct.compiled.decorate import compiled_once, fingerprint
from echobeam.beamforming.direct.compiled.shape import power_of
from echobeam.beamforming.direct.compiled.shapes import Covers, listen, set_out
from echobeam.values import Array, ComplexArray, IntArray

PATIENCE = 2.0
"""s: if the code is not there by then, the user is told that it is being compiled."""

OBJECTIVE, CONVERGED, PART, STEPS, DISTURBANCE, FIGURES = 0, 1, 2, 3, 4, 5


@dataclass(frozen=True, slots=True, eq=False)
class CompiledTrials:
    """T trials with K objects each.

    Attributes
    ----------
    phases, reach, ripple
        ``(T, K, G)``, ``(T, K)``, ``(T, K)``: see `Covers`.
    loss, threshold
        ``(T, K)``, see `Uplink`.
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
        """Return what one start leads to, see `direct.climb.climb`."""
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
        """Return the share and the sum rate after a few steps, see `direct.climb.probe`."""
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
        _runner()(*data, self.n_tx, chirp, given, share, *steps, beams, figures)
        return share, figures


@cache
def _runner() -> Callable[..., None]:
    """Return the compiled function; the first call waits for the compiler and says so."""
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

    return _patient(compiled_once(run))


def _patient(run: Callable[..., None]) -> Callable[..., None]:
    """Return a function that tells the user if it has to compile for long before its first call.

    It is compiled on a batch of no trials, so that many trials are not taken for a slow compiler.
    """
    first = True

    def compile_like(arguments: tuple[Any, ...]) -> None:
        nobody = [value[:0] if isinstance(value, np.ndarray) else value for value in arguments]
        message = "compiling the beam solver; it is kept for later runs (about half a minute)"
        clock = threading.Timer(PATIENCE, logging.getLogger("echobeam").warning, [message])
        clock.daemon = True
        clock.start()
        try:
            run(*nobody)
        finally:
            clock.cancel()

    def called(*arguments: Any) -> None:
        nonlocal first
        if first:
            compile_like(arguments)
            first = False
        run(*arguments)

    return called
