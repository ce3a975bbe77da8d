"""From a start to the optimum: shapes and powers in turn, round by round of coverage points."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Protocol

import numpy as np

from echobeam.beamforming.direct import barrier, cuts, symmetric, uplink
from echobeam.beamforming.direct.barrier import LAST_BARRIER, Shapes
from echobeam.beamforming.direct.beams import BeamSet, other_objects
from echobeam.beamforming.direct.chirp import FIRST_BARRIER, make_feasible, start_shapes
from echobeam.beamforming.direct.uplink import Uplink
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

WIDE_NODES = 7
"""Nodes from which on a cover is wide, and compared with the full grid on the way."""

MOST_STEPS = 150
PROBE_STEPS = 20

HELD = 12
"""Steps for which shares that were given are held, so that the shapes are those which suit them
and not those of a transition."""

AUDIBLE = 0.01
"""Interference over noise, at the start and with all the power, that is worth a closer look."""

QUIET_STEPS = 8

DONE = 1e-7
"""KKT residual of shapes, relative to the power of a matched beam, at which they are done."""

DONE_POWERS = 1e-9
"""The same for the powers, relative to the sum rate."""

EVERY = 20
"""Every so many steps it is asked whether a trial still gains anything."""

STALLED, STALLED_POWERS = 1e-6, 1e-7
"""Relative gain of the sum rate in that time, and residual of the powers, at which it does not:
where the optimum is flat, steps along a curved boundary are short and residuals fall slowly."""

CAUGHT = 1e6
"""Shift of a shape's matrix at which its steps have become too short to lead anywhere."""

LIVE = 0.75
"""Finished trials leave the working set when no more than this part of it still works."""

CURVED = 3e-5
"""How far from positive semidefinite a shape's dual matrix may be, relative to its diagonal."""

UNFINISHED, UNPROVED = 0.1, 0.5
"""Parts of `Uplink.leeway` to which the beam of an object that is not served may miss the best one,
and the proof that there is no better one: the object could not become worth serving by that."""

UNKEPT = 5e-7
"""Excess of ripple, relative to what is allowed, up to which such a beam may stay: more cannot be
bought off where a cover leaves no direction to spare."""


class Climber(Protocol):
    """T trials with K objects each, and the way from a start to their optima."""

    @property
    def loss(self) -> Array:
        """``(T, K)``, see `Uplink`."""

    def taken(self, index: IntArray) -> Climber:
        """Return some of the trials."""

    def climb(
        self, chirp: float, warm: ComplexArray | None = None, share: Array | None = None
    ) -> Found:
        """Return what one start leads to, see `climb`."""

    def probe(self, chirp: float, share: Array) -> tuple[Array, Array]:
        """Return shares and sum rates after a few steps, see `probe`."""


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """T trials that take their steps together: beams trial by trial, losses and floors."""

    beams: BeamSet
    loss: Array
    threshold: Array

    def taken(self, index: IntArray) -> Trials:
        """Return some of the trials."""
        return Trials(
            self.beams.taken(_beams_of(index, self.loss.shape[1])),
            self.loss[index],
            self.threshold[index],
        )

    def climb(
        self, chirp: float, warm: ComplexArray | None = None, share: Array | None = None
    ) -> Found:
        """Return what one start leads to, see `climb`."""
        return climb(self, chirp, warm, share)

    def probe(self, chirp: float, share: Array) -> tuple[Array, Array]:
        """Return shares and sum rates after a few steps, see `probe`."""
        return probe(self, chirp, share)


@dataclass(slots=True)
class Found:
    """What a climb found: beams for unit power and the rest as in `DirectResult`.

    ``disturbance`` tells what the beams' consideration for each other costs of the sum rate,
    relative and roughly: ``(T,)``.
    """

    beams: ComplexArray
    objective: Array
    converged: BoolArray
    factor: Array
    iterations: IntArray
    disturbance: Array

    def put(self, index: IntArray, other: Found) -> None:
        """Take over another climb's trials, where it is better: converged, and higher."""
        lift = other.converged.astype(int) - self.converged[index]
        rise = other.factor - self.factor[index]
        rise = np.where(rise == 0.0, other.objective - self.objective[index], rise)
        better = (lift > 0) | ((lift == 0) & (rise > 0.0))
        for field in fields(self):
            getattr(self, field.name)[index[better]] = getattr(other, field.name)[better]


def climb(
    trials: Trials, chirp: float, warm: ComplexArray | None = None, share: Array | None = None
) -> Found:
    """Return what one start leads to.

    Parameters
    ----------
    trials
        T trials.
    chirp, warm
        As in `start_shapes`.
    share
        As in `start_uplink`.
    """
    shapes = start_shapes(trials.beams, chirp, warm)
    powers = uplink.start_uplink(trials.loss, trials.threshold, share)
    at_start, leak = _uplink_view(shapes, trials.loss.shape[1])
    held = 0 if share is None else HELD
    settled, steps = _descend(trials.beams, shapes, powers, MOST_STEPS, held)
    found = _harvest(trials, shapes, powers, settled, steps)
    heard = np.max(leak / (at_start[:, :, np.newaxis] * trials.loss[:, np.newaxis]), axis=(1, 2))
    which = np.flatnonzero(heard > AUDIBLE)
    if which.size:
        least = np.minimum(at_start, shapes.power.reshape(at_start.shape))[which]
        quiet = _quiet_rate(powers.taken(which), least)
        found.disturbance[which] = quiet / np.maximum(found.objective[which], 1e-300) - 1.0
    return found


def probe(trials: Trials, chirp: float, share: Array) -> tuple[Array, Array]:
    """Return the share ``(T, K)`` and the sum rate ``(T,)``, nats, after a few steps from a start.

    Parameters
    ----------
    trials, chirp, share
        As in `climb`.
    """
    shapes = start_shapes(trials.beams, chirp)
    powers = uplink.start_uplink(trials.loss, trials.threshold, share)
    _descend(trials.beams, shapes, powers, PROBE_STEPS, HELD)
    sinr, _ = uplink.downlink(powers, *_uplink_view(shapes, share.shape[1]))
    return powers.share, np.where(powers.factor < 1.0, -np.inf, np.sum(np.log1p(sinr), axis=1))


def _descend(
    beams: BeamSet, shapes: Shapes, powers: Uplink, most: int, held: int
) -> tuple[BoolArray, IntArray]:
    """Step until every trial is settled or out of steps; return which are, and the steps taken."""
    n_trials, n_objects = powers.loss.shape
    settled = np.zeros(n_trials, dtype=bool)
    steps = np.full(n_trials, most, dtype=np.int64)
    live = np.arange(n_trials)
    wide = beams.spare > WIDE_NODES
    value = np.zeros(n_trials)
    beams_now = replace(beams, points=beams.points.copy())
    work_powers = powers.taken(live)
    work = shapes.taken(np.arange(shapes.target.size))
    for count in range(1, most + 1):
        before = work.barrier
        barrier.step(work, _weights(work_powers.level), LAST_BARRIER)
        _free(work)
        uplink.step(work_powers, *_uplink_view(work, n_objects), hold=count <= held)
        ready = _ready(work, work_powers)
        if count % EVERY == 0:
            value, before_that = _value(work, work_powers), value
            ready |= _stalled(work, work_powers, value, before_that)
        look = np.repeat(ready, n_objects)
        if wide:
            look |= work.barrier < before
        ready = _look(beams_now, work, work_powers, np.flatnonzero(look), ready)
        # What a settled trial does from here on, while others still work, is not recorded.
        new = np.flatnonzero(ready & ~settled[live])
        settled[live[new]], steps[live[new]] = True, count
        if count == most:
            new = np.union1d(new, np.flatnonzero(~settled[live]))
        shapes.put(_beams_of(live[new], n_objects), work.taken(_beams_of(new, n_objects)))
        powers.put(live[new], work_powers.taken(new))
        left = np.flatnonzero(~settled[live])
        if not left.size:
            break
        if left.size <= LIVE * live.size:
            which = _beams_of(left, n_objects)
            beams_now, work = beams_now.taken(which), work.taken(which)
            work_powers, live, value = work_powers.taken(left), live[left], value[left]
    return settled, steps


def _quiet_rate(powers: Uplink, power: Array) -> Array:
    """Return the sum rate ``(T,)``, bit/s/Hz, if no beam heard the others."""
    silence = np.zeros((*power.shape, power.shape[1]))
    for _ in range(QUIET_STEPS):
        uplink.step(powers, power, silence)
    rate: Array = np.sum(np.log1p(powers.level / power), axis=1) / np.log(2.0)
    return rate


def _look(
    beams: BeamSet, shapes: Shapes, powers: Uplink, which: IntArray, ready: BoolArray
) -> BoolArray:
    """Compare some beams with the full grid; return the trials that are ready and keep it.

    Beams of the others get points imposed where they miss it.
    """
    if not which.size:
        return ready
    excess = cuts.relative_excess(beams.taken(which), shapes.taken(which))
    met = np.ones(shapes.target.size, dtype=bool)
    allowed = np.maximum(cuts.MISSED, np.minimum(_unfinished(powers)[which], UNKEPT))
    met[which] = np.max(excess, axis=0) < allowed
    settled: BoolArray = ready & np.all(met.reshape(ready.size, -1), axis=1)
    going = ~np.repeat(settled, powers.loss.shape[1])[which]
    which = which[going]
    if which.size:
        part, part_beams = shapes.taken(which), beams.taken(which)
        cuts.impose(part_beams, part, excess[:, going])
        beams.points[which] = part_beams.points
        shapes.put(which, part)
    return settled


def _ready(shapes: Shapes, powers: Uplink) -> BoolArray:
    unfinished = _unfinished(powers)
    last = unfinished * shapes.power / (2.0 * shapes.cover)
    ready = (shapes.barrier <= np.maximum(LAST_BARRIER, last)) & (shapes.ripple <= shapes.target)
    ready &= shapes.residual < np.maximum(DONE, unfinished)
    trial_ready: BoolArray = np.all(ready.reshape(powers.loss.shape), axis=1)
    trial_ready &= powers.residual < DONE_POWERS
    return trial_ready


def _free(shapes: Shapes) -> None:
    """Let shapes that are caught in a corner, where no step is short enough, start from there."""
    caught = np.flatnonzero(shapes.shift > CAUGHT)
    if caught.size:
        part = shapes.taken(caught)
        part.barrier[:], part.shift[:] = FIRST_BARRIER, 0.0
        make_feasible(part)
        shapes.put(caught, part)


def _stalled(shapes: Shapes, powers: Uplink, value: Array, before: Array) -> BoolArray:
    """Tell which trials gained next to nothing since their sum rate was last looked at."""
    stalled: BoolArray = np.abs(value - before) < STALLED * value
    stalled &= np.all((shapes.ripple <= shapes.target).reshape(powers.loss.shape), axis=1)
    stalled &= powers.residual < STALLED_POWERS
    return stalled


def _value(shapes: Shapes, powers: Uplink) -> Array:
    """Return the sum rate ``(T,)``, nats."""
    power, leak = _uplink_view(shapes, powers.loss.shape[1])
    heard = power + (leak @ powers.level[:, :, np.newaxis])[:, :, 0]
    value: Array = np.sum(np.log1p(powers.level / heard), axis=1)
    return value


def _unfinished(powers: Uplink) -> Array:
    """Return by what part of its power each beam may miss the best one, ``(S,)``."""
    return UNFINISHED * powers.leeway.reshape(-1)


def _weights(level: Array) -> Array:
    """Return ``(K - 1, S)``: for each beam the lambda of the other objects."""
    n_objects = level.shape[1]
    other = other_objects(n_objects)
    return np.ascontiguousarray(level[:, other].reshape(level.size, n_objects - 1).T)


def _uplink_view(shapes: Shapes, n_objects: int) -> tuple[Array, Array]:
    """Return powers ``(T, K)`` and leaks ``(T, K, K)`` of shapes, trial by trial."""
    power = shapes.power.reshape(-1, n_objects)
    leak = np.zeros((power.shape[0], n_objects, n_objects))
    heard = shapes.leak.T.reshape(len(power), n_objects, n_objects - 1)
    np.put_along_axis(leak, np.broadcast_to(other_objects(n_objects), heard.shape), heard, axis=2)
    return power, leak


def _beams_of(trials: IntArray, n_objects: int) -> IntArray:
    index: IntArray = (trials[:, np.newaxis] * n_objects + np.arange(n_objects)).reshape(-1)
    return index


def _harvest(
    trials: Trials, shapes: Shapes, powers: Uplink, settled: BoolArray, steps: IntArray
) -> Found:
    """Return beams that keep the grid and the power to rounding, and what they reach."""
    n_trials, n_objects = trials.loss.shape
    excess = cuts.relative_excess(trials.beams, shapes)
    weights, power = cuts.patched(trials.beams, shapes, excess)
    _, leak = _uplink_view(shapes, n_objects)
    power = power.reshape(n_trials, n_objects)
    for _ in range(3):
        uplink.step(powers, power, leak)
    sinr, received = uplink.downlink(powers, power, leak)
    good = np.all(np.isfinite(received) & (received >= 0.0), axis=1)
    amplitude = np.sqrt(np.where(good[:, np.newaxis], received, 0.0))
    beams = weights.reshape(n_trials, n_objects, -1) * amplitude[:, :, np.newaxis]
    converged = settled & good & _globally_best(shapes, powers)
    return Found(
        beams=beams,
        objective=np.where(good, np.sum(np.log1p(sinr), axis=1) / np.log(2.0), 0.0),
        converged=converged,
        factor=powers.factor,
        iterations=steps,
        disturbance=np.zeros(n_trials),
    )


def _globally_best(shapes: Shapes, powers: Uplink) -> BoolArray:
    """Tell for which trials the multipliers prove every shape optimal for its prices.

    The Lagrangian of a shape is the quadratic form of a matrix that has w in its kernel; where
    that matrix is positive semidefinite no other shape, of any rank, does better.
    """
    bend = np.concatenate([shapes.high - shapes.low, _weights(powers.level)])
    spread = 1.0 - shapes.ripple * np.sum(shapes.low + shapes.high, axis=0)
    form = barrier.curvature(shapes, bend, spread)
    diagonal = np.arange(form.shape[0])
    largest = 1.0 + np.max(np.abs(np.einsum("iis->is", form)), axis=0)
    leeway = powers.leeway.reshape(-1)
    form[diagonal, diagonal] += np.maximum(CURVED * largest, UNPROVED * leeway)
    upper, _ = symmetric.factor(form)
    proved = symmetric.positive_definite(upper).reshape(powers.loss.shape)
    best: BoolArray = np.all(proved, axis=1)
    return best
